#include "port/stm32f4/periodic_test.h"

#include <stdbool.h>

#include "can/messages.h"
#include "port/embedded/ram_test.h"
#include "port/stm32f4/image.h"
#include "port/stm32f4/processor.h"
#include "port/stm32f4/rom.h"

enum {
    ROM_SLICE_BYTES = 64,
    GUARD_WORDS = 8,
    /* Around a local of the function that calls the march: the frames of both are within. */
    FRAMES_BELOW = 256,
    FRAMES_ABOVE = 64,
    DEEPER_BYTES = 384 /* more than both */
};

#define GUARD 0x57AC6A2Du

static rom_test_t rom;
/* Volatile, so that what has been written is read again: the test may be the first to be broken. */
static volatile uint32_t ram_at; /* words of this pass that are done */
static volatile uint32_t ram_passes;

/* A function of its own, so that its frame and that of the march are where it thinks. */
__attribute__((noinline)) static bool test_unless_in_use(volatile uint32_t *slice, uint32_t background)
{
    volatile uint32_t local = background;
    /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    const uintptr_t here = (uintptr_t)&local;
    bool good = true;

    const uintptr_t begin = (uintptr_t)slice; /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    const uintptr_t end = begin + (RAM_TEST_WORDS * sizeof *slice);
    if ((end <= (here - (uintptr_t)FRAMES_BELOW)) || (begin >= (here + (uintptr_t)FRAMES_ABOVE))) {
        interrupts_off();
        good = ram_test_slice(slice, local);
        interrupts_on();
    }
    return good;
}

__attribute__((noinline)) static bool test_from_deeper(volatile uint32_t *slice, uint32_t background)
{
    volatile uint8_t room[DEEPER_BYTES];

    room[0] = 0u;
    const bool good = test_unless_in_use(slice, background);
    return good && (room[0] == 0u); /* the room is needed until here */
}

static uint32_t words_in_use(void)
{
    const uintptr_t begin = (uintptr_t)image_ram;        /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    const uintptr_t end = (uintptr_t)image_ram_used_end; /* cppcheck-suppress misra-c2012-11.4 ; D8 */

    return (uint32_t)((end - begin) / sizeof image_ram[0]);
}

static uint32_t test_ram(void)
{
    const uint32_t at = ram_at;
    const uint32_t pass = ram_passes;
    const bool is_last = (at + (uint32_t)RAM_TEST_WORDS) >= words_in_use();
    const uint32_t next = is_last ? 0u : (at + (uint32_t)RAM_TEST_WORDS);
    const uint32_t next_pass = is_last ? (pass + 1u) : pass;
    const uint32_t background = ram_test_background(pass / 2u);
    bool good = false;

    if ((pass % 2u) == 0u) {
        good = test_unless_in_use(&image_ram[at], background);
    } else {
        good = test_from_deeper(&image_ram[at], background);
    }
    ram_at = next;
    ram_passes = next_pass;
    good = (ram_at == next) && good;
    good = (ram_passes == next_pass) && good;
    return good ? 0u : (uint32_t)MESSAGE_SELF_TEST_RAM;
}

static uint32_t test_rom(uint32_t bytes)
{
    rom_test_step(&rom, bytes);
    return rom.failed ? (uint32_t)MESSAGE_SELF_TEST_ROM : 0u;
}

static uint32_t test_stack(void)
{
    uint32_t wrong = 0u;

    for (uint32_t i = 0u; i < (uint32_t)GUARD_WORDS; i++) {
        wrong |= image_ram[i] ^ GUARD;
    }
    return (wrong == 0u) ? 0u : (uint32_t)MESSAGE_SELF_TEST_STACK;
}

uint32_t periodic_test_start(void)
{
    for (uint32_t i = 0u; i < (uint32_t)GUARD_WORDS; i++) {
        image_ram[i] = GUARD;
    }
    rom = rom_test_of_image();
    return test_rom(rom.size);
}

uint32_t periodic_test_step(void)
{
    return test_stack() | test_rom(ROM_SLICE_BYTES) | test_ram();
}
