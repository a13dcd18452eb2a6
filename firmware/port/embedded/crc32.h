/* CRC-32 of ISO/IEC 8802-3 (Ethernet; zlib's crc32): polynomial 0x04C11DB7 reflected, init and xor 0xFFFFFFFF; of
 * "123456789" it is 0xCBF43926. About 11 instructions a byte on a Cortex-M4. */
#ifndef LEVER_PORT_EMBEDDED_CRC32_H
#define LEVER_PORT_EMBEDDED_CRC32_H

#include <stdint.h>

/* The CRC of what `crc` is the CRC of (0: of nothing), followed by `count` bytes. */
uint32_t crc32_update(uint32_t crc, const void *bytes, uint32_t count);

#endif
