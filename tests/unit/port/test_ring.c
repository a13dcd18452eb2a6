/* The ring buffer against its contract: whole records or none, in order, over the wrap of the indices too. */
#include <string.h>

#include "port/embedded/ring.h"
#include "test.h"

enum { SIZE = 16 };

static volatile uint8_t bytes[SIZE];
static ring_t ring;

void setUp(void)
{
    ring = (ring_t){.bytes = bytes, .size = SIZE};
}

TEST(empty_gives_nothing)
{
    uint8_t byte = 0x5A;

    TEST_ASSERT_EQUAL_UINT32(0u, ring_used(&ring));
    TEST_ASSERT_FALSE(ring_get(&ring, &byte, 1u));
    TEST_ASSERT_EQUAL_HEX8(0x5A, byte);
}

TEST(takes_exactly_its_size)
{
    const uint8_t record[SIZE + 1] = {1, 2, 3};

    TEST_ASSERT_FALSE(ring_put(&ring, record, SIZE + 1u));
    TEST_ASSERT_EQUAL_UINT32(0u, ring_used(&ring));
    TEST_ASSERT_TRUE(ring_put(&ring, record, SIZE));
    TEST_ASSERT_FALSE(ring_put(&ring, record, 1u));
    TEST_ASSERT_EQUAL_UINT32(SIZE, ring_used(&ring));
}

TEST(a_record_that_has_not_all_come_stays)
{
    const uint8_t record[3] = {7, 8, 9};
    uint8_t got[4] = {0};

    TEST_ASSERT_TRUE(ring_put(&ring, record, 3u));
    TEST_ASSERT_FALSE(ring_get(&ring, got, 4u));
    TEST_ASSERT_TRUE(ring_get(&ring, got, 3u));
    TEST_ASSERT_EQUAL_UINT8_ARRAY(record, got, 3);
}

/* From any start of the indices, with records that wrap at every place of the buffer, and over the wrap at 2^32. */
TEST(keeps_order_over_every_wrap)
{
    ring.put = UINT32_MAX - 100u;
    ring.got = ring.put;
    uint8_t next_in = 0u;
    uint8_t next_out = 0u;
    for (uint32_t turn = 0u; turn < 500u; turn++) {
        uint8_t record[5];
        const uint32_t length = 1u + (turn % 5u);
        for (uint32_t i = 0u; i < length; i++) {
            record[i] = next_in++;
        }
        TEST_ASSERT_TRUE(ring_put(&ring, record, length));
        if ((turn % 3u) != 0u) {
            continue; /* let two more gather */
        }
        while (ring_get(&ring, record, 1u)) {
            TEST_ASSERT_EQUAL_HEX8(next_out, record[0]);
            next_out++;
        }
    }
    TEST_ASSERT_EQUAL_UINT32((uint8_t)(next_in - next_out), ring_used(&ring));
}

TEST(clear_empties)
{
    const uint8_t record[5] = {1, 2, 3, 4, 5};
    uint8_t byte = 0u;

    TEST_ASSERT_TRUE(ring_put(&ring, record, 5u));
    ring_clear(&ring);
    TEST_ASSERT_FALSE(ring_get(&ring, &byte, 1u));
    TEST_ASSERT_TRUE(ring_put(&ring, record, 5u));
    TEST_ASSERT_TRUE(ring_get(&ring, &byte, 1u));
    TEST_ASSERT_EQUAL_HEX8(1, byte);
}
