/* Self tests of the machine that go on while the loop runs, a slice at a time.
 *
 * ROM: the CRC of all of the image, against the build's. RAM: all of it that the image uses, stack included, by
 * ram_test.h; each word at least every second pass, since a march leaves out the stack that it stands on, which is
 * elsewhere in every other pass. Stack: the words at its end, which nothing should ever reach. */
#ifndef LEVER_PORT_STM32F4_PERIODIC_TEST_H
#define LEVER_PORT_STM32F4_PERIODIC_TEST_H

#include <stdint.h>

/* Marks the end of the stack, and makes one whole pass of the ROM test. What fails: of enum message_self_test. */
uint32_t periodic_test_start(void);

/* The next slice of each test, and what fails in it. About 1300 instructions, some 300 of them with interrupts off. */
uint32_t periodic_test_step(void);

#endif
