/* A checksum of program memory, made in slices while the program runs. */
#ifndef LEVER_PORT_EMBEDDED_ROM_TEST_H
#define LEVER_PORT_EMBEDDED_ROM_TEST_H

#include <stdbool.h>
#include <stdint.h>

/* Set `bytes`, `size` and `expected`; the rest begins as 0. */
typedef struct rom_test {
    const uint8_t *bytes;
    uint32_t size;
    uint32_t expected; /* CRC-32 of them */
    uint32_t at;       /* bytes of this pass that are done ... */
    uint32_t crc;      /* ... and the CRC of those */
    uint32_t passes;   /* ended; wraps */
    bool failed;       /* one of them, ever */
} rom_test_t;

/* Goes on by so many bytes, or to the end of the pass. About 11 instructions a byte. */
void rom_test_step(rom_test_t *test, uint32_t bytes);

#endif
