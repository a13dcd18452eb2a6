/* A test of RAM while it is in use: a march over a slice, whose contents are kept and put back.
 *
 * March C- (van de Goor): {up w0; up r0 w1; up r1 w0; down r0 w1; down r1 w0; r0}, on words. It finds cells that are
 * stuck, that cannot change one way, or that change or follow another word of the same slice; with all of
 * ram_test_background(), also another bit of the same word. It does not find what couples two slices, nor address lines
 * above a slice. */
#ifndef LEVER_PORT_EMBEDDED_RAM_TEST_H
#define LEVER_PORT_EMBEDDED_RAM_TEST_H

#include <stdbool.h>
#include <stdint.h>

enum { RAM_TEST_WORDS = 8, RAM_TEST_BACKGROUNDS = 6 };

/* What takes the place of the march's zeros: backgrounds 0 to 5 tell each pair of bits of a word apart. */
uint32_t ram_test_background(uint32_t number);

/* Whether RAM_TEST_WORDS words from `slice` on are as they should be. With interrupts off, and not where its own stack
 * is: some 100 bytes from that of the caller on. About 500 instructions. */
bool ram_test_slice(volatile uint32_t *slice, uint32_t background);

#endif
