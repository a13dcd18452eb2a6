/* candump's text from anybody: damaged in every way, in memory that ends where the text does. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bulk.h"
#include "test.h"

static const char *const lines[] = {
    "(1436509052.249713) vcan0 044#2A366C2BBA\n",
    "(1436509052.449847) vcan0 0F6#7ADFE07BD2000102 R\n",
    "(0.000001) can1 12345678#0011223344556677 T\r\n",
    "(1.5) can1 123#R4\n",
    "(12345678901.123456789) x 123##1AABBCC\n",
    "(2.0) vcan0 20000080#0000000000000000\n",
    "(2.0) vcan0 123#1122334455667788_B\n",
    "\n",
};

static uint32_t state = 12345u;

/* xorshift32 (G. Marsaglia, 2003), so that every machine damages alike. */
static uint32_t random_below(uint32_t limit)
{
    state ^= state << 13u;
    state ^= state >> 17u;
    state ^= state << 5u;
    return state % limit;
}

/* A copy in memory of exactly its size, in which the sanitizer sees a step too far. */
static char *exact(const char *text, size_t size)
{
    char *copy = malloc((size > 0u) ? size : 1u);
    TEST_ASSERT_NOT_NULL(copy);
    (void)memcpy(copy, text, size);
    return copy;
}

static uint64_t parse(const char *text, size_t size, bulk_frame_t *frames, uint64_t room, bulk_parsed_t *parsed)
{
    static bulk_buses_t buses;
    (void)memset(&buses, 0, sizeof buses);
    char *copy = exact(text, size);
    const uint64_t count = bulk_parse(copy, size, &buses, frames, room, parsed);
    free(copy);
    for (uint64_t i = 0u; i < count; i++) {
        TEST_ASSERT_LESS_THAN_UINT32(buses.count, frames[i].bus);
        TEST_ASSERT_LESS_OR_EQUAL_UINT8(8u, frames[i].length);
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(0x1FFFFFFFu, frames[i].id);
    }
    return count;
}

static size_t some_text(char *text)
{
    size_t size = 0u;
    const uint32_t count = 1u + random_below(6u);
    for (uint32_t i = 0u; i < count; i++) {
        const char *line = lines[random_below(sizeof lines / sizeof lines[0])];
        (void)memcpy(&text[size], line, strlen(line));
        size += strlen(line);
    }
    return size;
}

TEST(any_damage_is_a_frame_or_a_damaged_line)
{
    char text[512];
    bulk_frame_t frames[512];
    for (int round = 0; round < 20000; round++) {
        size_t size = some_text(text);
        for (uint32_t hits = random_below(4u); hits > 0u; hits--) {
            text[random_below((uint32_t)size)] = (char)random_below(256u);
        }
        size -= random_below((uint32_t)size);
        bulk_parsed_t parsed;
        const uint64_t count = parse(text, size, frames, 512u, &parsed);
        TEST_ASSERT_EQUAL_UINT64(parsed.lines, count + parsed.damaged);
        TEST_ASSERT_TRUE(parsed.used <= size);
        TEST_ASSERT_NULL(memchr(&text[parsed.used], '\n', size - parsed.used));
    }
}

TEST(more_buses_than_there_is_room_for_are_damage)
{
    static bulk_buses_t buses;
    bulk_frame_t frame;
    bulk_parsed_t parsed;
    char line[96];
    for (int i = 0; i < (BULK_BUSES + 3); i++) {
        const int size = snprintf(line, sizeof line, "(1.0) bus%d 123#00\n", i);
        TEST_ASSERT_EQUAL_UINT64(
            (i < BULK_BUSES) ? 1u : 0u, bulk_parse(line, (uint64_t)size, &buses, &frame, 1u, &parsed));
    }
    TEST_ASSERT_EQUAL_UINT32(BULK_BUSES, buses.count);
    const int size = snprintf(line, sizeof line, "(1.0) bus7 123#00\n");
    TEST_ASSERT_EQUAL_UINT64(1u, bulk_parse(line, (uint64_t)size, &buses, &frame, 1u, &parsed));
    TEST_ASSERT_EQUAL_UINT16(7u, frame.bus);
}
