/* The tests of program memory and RAM in slices, on memory that is sound; with faults: tests/target/bxcan. */
#include <string.h>

#include "port/embedded/crc32.h"
#include "port/embedded/ram_test.h"
#include "port/embedded/rom_test.h"
#include "test.h"

enum { SIZE = 100 };

static uint8_t rom_bytes[SIZE];

static rom_test_t rom_of(uint32_t expected)
{
    const rom_test_t test = {.bytes = rom_bytes, .size = SIZE, .expected = expected};

    return test;
}

void setUp(void)
{
    for (uint32_t i = 0u; i < (uint32_t)SIZE; i++) {
        rom_bytes[i] = (uint8_t)(7u * i);
    }
}

/* The last slice is shorter; zlib's crc32 of these bytes is known from Python. */
TEST(a_pass_ends_with_the_last_byte_and_the_next_begins)
{
    rom_test_t test = rom_of(0x821D3E85u);

    for (int pass = 1; pass <= 3; pass++) {
        for (int slice = 0; slice < 4; slice++) {
            rom_test_step(&test, 32u);
        }
        TEST_ASSERT_EQUAL_UINT32((uint32_t)pass, test.passes);
        TEST_ASSERT_FALSE(test.failed);
    }
}

TEST(a_flipped_bit_fails_at_the_end_of_its_pass_and_for_ever)
{
    rom_test_t test = rom_of(crc32_update(0u, rom_bytes, SIZE));

    rom_test_step(&test, SIZE);
    rom_bytes[SIZE - 1] ^= 1u;
    rom_test_step(&test, SIZE - 1u);
    TEST_ASSERT_FALSE(test.failed);
    rom_test_step(&test, 1u);
    TEST_ASSERT_TRUE(test.failed);
    rom_bytes[SIZE - 1] ^= 1u;
    rom_test_step(&test, 2u * SIZE);
    TEST_ASSERT_EQUAL_UINT32(3u, test.passes);
    TEST_ASSERT_TRUE(test.failed);
}

TEST(sound_ram_passes_with_every_background_and_keeps_its_contents)
{
    uint32_t words[RAM_TEST_WORDS + 2];
    uint32_t before[RAM_TEST_WORDS + 2];

    for (uint32_t i = 0u; i < (uint32_t)RAM_TEST_WORDS + 2u; i++) {
        words[i] = 0x9E3779B9u * (i + 1u);
    }
    (void)memcpy(before, words, sizeof before);
    for (uint32_t number = 0u; number < (uint32_t)RAM_TEST_BACKGROUNDS; number++) {
        TEST_ASSERT_TRUE(ram_test_slice(&words[1], ram_test_background(number)));
        TEST_ASSERT_EQUAL_UINT32_ARRAY(before, words, RAM_TEST_WORDS + 2);
    }
}
