/* E2E Profile 2: CRC against its check value and a bitwise CRC, frames against published vectors, and the receiver
 * against sequences worked out by hand from AUTOSAR FO PRS E2EProtocol (checking of Profile 2). */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "can/e2e.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static const lever_frame_t blank = {0x110u, 8u, {0u}};
enum { BASE = 1 };

/* --- CRC --------------------------------------------------------------------------------------------------------- */

static uint8_t bitwise_crc(const uint8_t *data, size_t length)
{
    uint32_t crc = 0xFFu;
    for (size_t i = 0u; i < length; i++) {
        crc ^= data[i];
        for (int bit = 0; bit < 8; bit++) {
            crc = ((crc & 0x80u) != 0u) ? (((crc << 1u) ^ 0x2Fu) & 0xFFu) : ((crc << 1u) & 0xFFu);
        }
    }
    return (uint8_t)(crc ^ 0xFFu);
}

static void test_crc_check_value(void)
{
    static const uint8_t digits[8] = {'1', '2', '3', '4', '5', '6', '7', '8'};
    TEST_ASSERT_EQUAL_HEX8(0xDFu, e2e_crc(digits, sizeof digits, (uint8_t)'9'));
}

static void test_crc_is_the_bitwise_crc(void)
{
    for (uint32_t first = 0u; first < 256u; first++) {
        for (uint32_t last = 0u; last < 256u; last++) {
            const uint8_t data[2] = {(uint8_t)first, (uint8_t)last};
            TEST_ASSERT_EQUAL_HEX8(bitwise_crc(data, 2u), e2e_crc(data, 1u, data[1]));
        }
    }
}

/* --- frames ------------------------------------------------------------------------------------------------------ */

static void test_published_vectors(void)
{
    lever_frame_t frame = blank;
    e2e_protect(&frame, BASE, 0u);
    TEST_ASSERT_EQUAL_HEX8(0x0Eu, frame.data[0]);
    TEST_ASSERT_EQUAL_HEX8(0x00u, frame.data[1]);
    e2e_protect(&frame, BASE, 1u);
    TEST_ASSERT_EQUAL_HEX8(0x1Bu, frame.data[0]);
    TEST_ASSERT_EQUAL_HEX8(0x01u, frame.data[1]);
}

static void test_protect_leaves_the_rest(void)
{
    lever_frame_t frame = {0x212u, 8u, {0xAAu, 0x5Fu, 1u, 2u, 3u, 4u, 5u, 0xFFu}};
    e2e_protect(&frame, 81u, 0x3Cu);
    static const uint8_t rest[7] = {0x5Cu, 1u, 2u, 3u, 4u, 5u, 0xFFu};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(rest, &frame.data[1], 7);
    TEST_ASSERT_EQUAL_HEX32(0x212u, frame.id);
    TEST_ASSERT_EQUAL_UINT8(8u, frame.length);
    TEST_ASSERT_EQUAL_UINT8(12u, e2e_counter(&frame));
}

/* Status of a single frame at a fresh receiver. */
static e2e_status_t check_alone(const lever_frame_t *frame, uint8_t base)
{
    e2e_receiver_t receiver;
    e2e_receiver_init(&receiver, base, (e2e_tolerance_t){1u, 15u, 0u});
    return e2e_check(&receiver, frame);
}

static void test_every_burst_of_up_to_eight_bits_is_found(void)
{
    lever_frame_t frame = {0x110u, 8u, {0u, 0x70u, 0x12u, 0x34u, 0x56u, 0x78u, 0x9Au, 0xBCu}};
    e2e_protect(&frame, BASE, 9u);
    TEST_ASSERT_EQUAL_INT(E2E_INITIAL, check_alone(&frame, BASE));
    for (uint32_t start = 0u; start < 64u; start++) {
        for (uint32_t pattern = 1u; pattern < 256u; pattern += 2u) {
            lever_frame_t corrupt = frame;
            bool counter_hit = false;
            for (uint32_t bit = start; (bit < (start + 8u)) && (bit < 64u); bit++) {
                /* On the wire the most significant bit of a byte goes first. */
                uint8_t hit = (uint8_t)(((pattern >> (bit - start)) & 1u) << (7u - (bit % 8u)));
                corrupt.data[bit / 8u] ^= hit;
                counter_hit = counter_hit || (((bit / 8u) == 1u) && ((hit & 0x0Fu) != 0u));
            }
            /* A hit counter changes the data ID as well, so that the CRC's guarantee holds for the other bursts. */
            if (!counter_hit) {
                TEST_ASSERT_EQUAL_INT(E2E_CRC_ERROR, check_alone(&corrupt, BASE));
            }
        }
    }
}

static void test_every_single_bit_is_found(void)
{
    lever_frame_t frame = {0x110u, 8u, {0u, 0x70u, 0x12u, 0x34u, 0x56u, 0x78u, 0x9Au, 0xBCu}};
    for (uint8_t counter = 0u; counter < 16u; counter++) {
        e2e_protect(&frame, BASE, counter);
        for (uint32_t bit = 0u; bit < 64u; bit++) {
            lever_frame_t corrupt = frame;
            corrupt.data[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
            TEST_ASSERT_EQUAL_INT(E2E_CRC_ERROR, check_alone(&corrupt, BASE));
        }
    }
}

static void test_frame_of_another_message_is_found(void)
{
    for (uint8_t counter = 0u; counter < 16u; counter++) {
        lever_frame_t frame = blank;
        e2e_protect(&frame, 17u, counter);
        TEST_ASSERT_EQUAL_INT(E2E_INITIAL, check_alone(&frame, 17u));
        TEST_ASSERT_EQUAL_INT(E2E_CRC_ERROR, check_alone(&frame, BASE));
    }
}

static void test_wrong_length_is_found(void)
{
    for (uint32_t length = 0u; length < 256u; length++) {
        lever_frame_t frame = blank;
        e2e_protect(&frame, BASE, 0u);
        frame.length = (uint8_t)length;
        TEST_ASSERT_EQUAL_INT((length == 8u) ? E2E_INITIAL : E2E_CRC_ERROR, check_alone(&frame, BASE));
    }
}

/* --- the receiver ------------------------------------------------------------------------------------------------ */

enum { NONE = 16, CORRUPT = 17 }; /* instead of a counter: a cycle without a frame, a frame with a wrong CRC */

typedef struct step {
    uint8_t counter;
    uint8_t status;
    uint8_t lost;
} step_t;

static void run(e2e_tolerance_t tolerance, const step_t *steps, size_t count, unsigned int line)
{
    e2e_receiver_t receiver;
    e2e_receiver_init(&receiver, BASE, tolerance);
    for (size_t i = 0u; i < count; i++) {
        lever_frame_t frame = blank;
        e2e_protect(&frame, BASE, steps[i].counter);
        if (steps[i].counter == (uint8_t)CORRUPT) {
            frame.data[5] ^= 0x10u;
        }
        e2e_status_t status = e2e_check(&receiver, (steps[i].counter == (uint8_t)NONE) ? NULL : &frame);
        UNITY_TEST_ASSERT_EQUAL_INT(steps[i].status, status, line, "status");
        UNITY_TEST_ASSERT_EQUAL_INT(steps[i].lost, receiver.lost, line, "lost");
    }
}

/* The given steps, each {counter, status, lost}, at a fresh receiver. */
#define RUN(max_delta, max_no_new, sync, ...)                                                                          \
    do {                                                                                                               \
        static const step_t steps[] = {__VA_ARGS__};                                                                   \
        run((e2e_tolerance_t){(max_delta), (max_no_new), (sync)}, steps, sizeof steps / sizeof steps[0], __LINE__);    \
    } while (false)

static void test_order_over_the_wrap(void)
{
    e2e_receiver_t receiver;
    e2e_receiver_init(&receiver, BASE, (e2e_tolerance_t){0u, 0u, 0u});
    for (uint32_t i = 14u; i < 64u; i++) {
        lever_frame_t frame = blank;
        e2e_protect(&frame, BASE, (uint8_t)i);
        TEST_ASSERT_EQUAL_INT((i == 14u) ? E2E_INITIAL : E2E_OK, e2e_check(&receiver, &frame));
        TEST_ASSERT_EQUAL_UINT8(0u, receiver.lost);
    }
}

static void test_waits_for_the_first_correct_frame(void)
{
    RUN(1u, 15u, 0u, {NONE, E2E_NO_NEW_DATA, 0u}, {CORRUPT, E2E_CRC_ERROR, 0u}, {7u, E2E_INITIAL, 0u},
        {8u, E2E_OK, 0u});
}

static void test_repetition(void)
{
    RUN(1u, 15u, 0u, {3u, E2E_INITIAL, 0u}, {3u, E2E_REPEATED, 0u}, {3u, E2E_REPEATED, 0u}, {4u, E2E_OK, 0u});
}

static void test_loss_up_to_the_tolerance(void)
{
    /* The standard's own example: counter 1 and MaxDeltaCounterInit 1 accept 2 and 3, but not 4. */
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {2u, E2E_OK, 0u});
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {3u, E2E_SOME_LOST, 1u}, {4u, E2E_OK, 0u});
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {4u, E2E_WRONG_SEQUENCE, 0u});
    RUN(0u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {3u, E2E_WRONG_SEQUENCE, 0u});
    RUN(14u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {0u, E2E_SOME_LOST, 14u}, {15u, E2E_SOME_LOST, 14u});
    RUN(15u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {0u, E2E_SOME_LOST, 14u}, {0u, E2E_REPEATED, 0u});
}

static void test_silence_and_corruption_widen_the_tolerance(void)
{
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {4u, E2E_SOME_LOST, 2u},
        {7u, E2E_WRONG_SEQUENCE, 0u});
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {5u, E2E_WRONG_SEQUENCE, 0u});
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {CORRUPT, E2E_CRC_ERROR, 0u}, {4u, E2E_SOME_LOST, 2u});
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {1u, E2E_REPEATED, 0u}, {4u, E2E_SOME_LOST, 2u});
}

static void test_tolerance_stops_at_fifteen(void)
{
    e2e_receiver_t receiver;
    e2e_receiver_init(&receiver, BASE, (e2e_tolerance_t){1u, 15u, 0u});
    lever_frame_t frame = blank;
    e2e_protect(&frame, BASE, 1u);
    TEST_ASSERT_EQUAL_INT(E2E_INITIAL, e2e_check(&receiver, &frame));
    for (uint32_t i = 0u; i < 1000u; i++) {
        TEST_ASSERT_EQUAL_INT(E2E_NO_NEW_DATA, e2e_check(&receiver, NULL));
    }
    e2e_protect(&frame, BASE, 0u);
    TEST_ASSERT_EQUAL_INT(E2E_SOME_LOST, e2e_check(&receiver, &frame));
    TEST_ASSERT_EQUAL_UINT8(14u, receiver.lost);
}

static void test_wrong_sequence_synchronises(void)
{
    RUN(1u, 15u, 2u, {1u, E2E_INITIAL, 0u}, {9u, E2E_WRONG_SEQUENCE, 0u}, {10u, E2E_SYNC, 0u}, {12u, E2E_SYNC, 1u},
        {13u, E2E_OK, 0u});
    RUN(1u, 15u, 2u, {1u, E2E_INITIAL, 0u}, {9u, E2E_WRONG_SEQUENCE, 0u}, {10u, E2E_SYNC, 0u},
        {5u, E2E_WRONG_SEQUENCE, 0u}, {6u, E2E_SYNC, 0u}, {7u, E2E_SYNC, 0u}, {8u, E2E_OK, 0u});
    RUN(1u, 15u, 1u, {5u, E2E_INITIAL, 0u}, {4u, E2E_WRONG_SEQUENCE, 0u}, {5u, E2E_SYNC, 0u}, {6u, E2E_OK, 0u});
}

static void test_wrong_sequence_without_synchronisation_keeps_the_last_counter(void)
{
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {9u, E2E_WRONG_SEQUENCE, 0u}, {10u, E2E_WRONG_SEQUENCE, 0u},
        {2u, E2E_OK, 0u});
    RUN(1u, 15u, 0u, {1u, E2E_INITIAL, 0u}, {5u, E2E_WRONG_SEQUENCE, 0u}, {NONE, E2E_NO_NEW_DATA, 0u},
        {5u, E2E_SOME_LOST, 3u});
}

static void test_long_silence_synchronises(void)
{
    RUN(1u, 2u, 1u, {1u, E2E_INITIAL, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {2u, E2E_OK, 0u});
    RUN(1u, 2u, 1u, {1u, E2E_INITIAL, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {NONE, E2E_NO_NEW_DATA, 0u},
        {1u, E2E_REPEATED, 0u}, {2u, E2E_SYNC, 0u}, {3u, E2E_SYNC, 0u}, {4u, E2E_OK, 0u});
    /* The silence before an accepted frame is not held against the next one. */
    RUN(1u, 1u, 1u, {1u, E2E_INITIAL, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {2u, E2E_OK, 0u}, {NONE, E2E_NO_NEW_DATA, 0u},
        {3u, E2E_OK, 0u});
    /* Nor is the silence before a wrong sequence. */
    RUN(1u, 0u, 1u, {1u, E2E_INITIAL, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {NONE, E2E_NO_NEW_DATA, 0u},
        {12u, E2E_WRONG_SEQUENCE, 0u}, {13u, E2E_SYNC, 0u}, {14u, E2E_OK, 0u});
    /* Silence before the first frame is: the standard does not clear it there. */
    RUN(1u, 1u, 0u, {NONE, E2E_NO_NEW_DATA, 0u}, {NONE, E2E_NO_NEW_DATA, 0u}, {4u, E2E_INITIAL, 0u}, {5u, E2E_SYNC, 0u},
        {6u, E2E_OK, 0u});
}

static void test_what_is_usable(void)
{
    TEST_ASSERT_TRUE(e2e_is_usable(E2E_OK));
    TEST_ASSERT_TRUE(e2e_is_usable(E2E_SOME_LOST));
    TEST_ASSERT_TRUE(e2e_is_usable(E2E_INITIAL));
    TEST_ASSERT_FALSE(e2e_is_usable(E2E_NO_NEW_DATA));
    TEST_ASSERT_FALSE(e2e_is_usable(E2E_CRC_ERROR));
    TEST_ASSERT_FALSE(e2e_is_usable(E2E_SYNC));
    TEST_ASSERT_FALSE(e2e_is_usable(E2E_REPEATED));
    TEST_ASSERT_FALSE(e2e_is_usable(E2E_WRONG_SEQUENCE));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_crc_check_value);
    RUN_TEST(test_crc_is_the_bitwise_crc);
    RUN_TEST(test_published_vectors);
    RUN_TEST(test_protect_leaves_the_rest);
    RUN_TEST(test_every_burst_of_up_to_eight_bits_is_found);
    RUN_TEST(test_every_single_bit_is_found);
    RUN_TEST(test_frame_of_another_message_is_found);
    RUN_TEST(test_wrong_length_is_found);
    RUN_TEST(test_order_over_the_wrap);
    RUN_TEST(test_waits_for_the_first_correct_frame);
    RUN_TEST(test_repetition);
    RUN_TEST(test_loss_up_to_the_tolerance);
    RUN_TEST(test_silence_and_corruption_widen_the_tolerance);
    RUN_TEST(test_tolerance_stops_at_fifteen);
    RUN_TEST(test_wrong_sequence_synchronises);
    RUN_TEST(test_wrong_sequence_without_synchronisation_keeps_the_last_counter);
    RUN_TEST(test_long_silence_synchronises);
    RUN_TEST(test_what_is_usable);
    return UNITY_END();
}
