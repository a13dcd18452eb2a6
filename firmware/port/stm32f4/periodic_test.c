#include "port/stm32f4/periodic_test.h"

#include <stdbool.h>

#include "can/messages.h"
#include "port/embedded/ram_test.h"
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

extern volatile uint32_t image_ram[]; /* of image.ld, both: the stack is at the bottom of RAM */
extern volatile uint32_t image_ram_used_end[];

static rom_test_t rom;
static uint32_t ram_at; /* words of this pass that are done */
static uint32_t ram_passes;
static uint32_t failed;

static bool is_below_frames(const volatile uint32_t *slice, uintptr_t here)
{
    return ((uintptr_t)slice + (RAM_TEST_WORDS * sizeof *slice)) <= (here - (uintptr_t)FRAMES_BELOW);
}

/* A function of its own, so that its frame and that of the march are where it thinks. */
__attribute__((noinline)) static bool test_unless_in_use(volatile uint32_t *slice, uint32_t background)
{
    volatile uint32_t local = background;
    const uintptr_t here = (uintptr_t)&local;
    bool good = true;

    if (is_below_frames(slice, here) || ((uintptr_t)slice >= (here + (uintptr_t)FRAMES_ABOVE))) {
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

static void test_ram(void)
{
    volatile uint32_t *slice = &image_ram[ram_at];
    const uint32_t background = ram_test_background(ram_passes / 2u);
    const bool good =
        ((ram_passes % 2u) == 0u) ? test_unless_in_use(slice, background) : test_from_deeper(slice, background);

    failed |= good ? 0u : (uint32_t)MESSAGE_SELF_TEST_RAM;
    ram_at += (uint32_t)RAM_TEST_WORDS;
    if (&image_ram[ram_at] >= image_ram_used_end) {
        ram_at = 0u;
        ram_passes++;
    }
}

static void test_rom(uint32_t bytes)
{
    rom_test_step(&rom, bytes);
    failed |= rom.failed ? (uint32_t)MESSAGE_SELF_TEST_ROM : 0u;
}

static void test_stack(void)
{
    for (uint32_t i = 0u; i < (uint32_t)GUARD_WORDS; i++) {
        failed |= (image_ram[i] == GUARD) ? 0u : (uint32_t)MESSAGE_SELF_TEST_STACK;
    }
}

void periodic_test_start(void)
{
    for (uint32_t i = 0u; i < (uint32_t)GUARD_WORDS; i++) {
        image_ram[i] = GUARD;
    }
    rom = rom_test_of_image();
    test_rom(rom.size);
}

void periodic_test_step(void)
{
    test_stack();
    test_rom(ROM_SLICE_BYTES);
    test_ram();
}

uint32_t periodic_test_failed(void)
{
    return failed;
}
