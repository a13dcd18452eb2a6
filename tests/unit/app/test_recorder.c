/* Snapshots on the bus: whole, in time, spread evenly, and what they say of themselves. */
#include "app/instance.h"
#include "frames.h"

enum { FRAMES = 2 + ((LEVER_STATE_BYTES + 5) / 6), PERIOD = 500000 };

static lever_recorder_t recorder;
static uint8_t expected[LEVER_STATE_BYTES]; /* when the last one began */
static uint32_t expected_us;
static uint8_t received[6 * FRAMES];
static uint32_t parts; /* of the last one */
static uint32_t whole; /* how many were whole */
static uint8_t next_counter;

void setUp(void)
{
    lever_config_default(&config);
    start_bus();
    (void)memset(&recorder, 0xA5, sizeof recorder);
    lever_recorder_init(&recorder, PERIOD);
    parts = 0u;
    whole = 0u;
    next_counter = 0u;
}

/* CRC-32 by its definition. */
static uint32_t crc_of(const uint8_t *bytes, uint32_t count)
{
    uint32_t crc = 0xFFFFFFFFu;
    for (uint32_t i = 0u; i < count; i++) {
        crc ^= bytes[i];
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            crc = ((crc & 1u) != 0u) ? ((crc >> 1u) ^ 0xEDB88320u) : (crc >> 1u);
        }
    }
    return ~crc;
}

static void take(const lever_frame_t *frame)
{
    message_snapshot_t message;
    e2e_receiver_t receiver;
    e2e_receiver_init(&receiver, (uint8_t)MESSAGE_SNAPSHOT_DATA_ID, (e2e_tolerance_t){0u, 0u, 0u});
    TEST_ASSERT_EQUAL(E2E_INITIAL, e2e_check(&receiver, frame));
    TEST_ASSERT_EQUAL_UINT8(next_counter, e2e_counter(frame));
    next_counter = (uint8_t)((next_counter + 1u) & 15u);
    TEST_ASSERT_TRUE(message_snapshot_decode(&message, frame));
    if (parts == 0u) {
        TEST_ASSERT_EQUAL_UINT8(MESSAGE_PART_BEGIN, message.part);
        TEST_ASSERT_EQUAL_UINT32(expected_us, message.time_us);
        TEST_ASSERT_EQUAL_UINT16(lever_state_layout(), message.layout);
    } else if (parts < (uint32_t)(FRAMES - 1)) {
        TEST_ASSERT_EQUAL_UINT8(MESSAGE_PART_DATA, message.part);
        for (uint32_t i = 0u; i < 6u; i++) {
            const uint64_t data = message.data_low | ((uint64_t)message.data_high << 32u);
            received[(6u * (parts - 1u)) + i] = (uint8_t)((data >> (8u * i)) & 0xFFu);
        }
    } else {
        TEST_ASSERT_EQUAL_UINT8(MESSAGE_PART_END, message.part);
        TEST_ASSERT_EQUAL_UINT16(LEVER_STATE_BYTES, message.length);
        TEST_ASSERT_EQUAL_UINT32(crc_of(expected, LEVER_STATE_BYTES), message.digest);
        TEST_ASSERT_EQUAL_MEMORY(expected, received, sizeof expected);
        whole++;
    }
    parts = (parts + 1u) % (uint32_t)FRAMES;
}

/* A sample, and up to `room` frames of the snapshot; their number. */
static uint32_t record(uint32_t room)
{
    lever_frame_t frame;
    uint32_t count = 0u;
    (void)deliver();
    (void)fetch();
    lever_recorder_step(&recorder, lever);
    if ((recorder.sent == 0u) && (recorder.taken_us == time_us)) {
        lever_state_save(lever, expected);
        expected_us = time_us;
    }
    while ((count < room) && lever_recorder_next_frame(&recorder, &frame)) {
        take(&frame);
        count++;
    }
    return count;
}

/* R53 */
TEST(each_period_the_state_is_sent_whole_and_evenly)
{
    uint32_t total = 0u;
    for (uint32_t k = 0u; k < 2600u; k++) {
        const uint32_t count = record(1000u);
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(2u, count);
        total += count;
    }
    TEST_ASSERT_EQUAL_UINT32(5u, whole);
    TEST_ASSERT_UINT32_WITHIN(FRAMES, 5u * (uint32_t)FRAMES, total);
    TEST_ASSERT_EQUAL_UINT32(2500u + 1u, expected_us / 1000u); /* of the sixth */
}

TEST(a_bus_without_room_makes_it_later_not_less)
{
    for (uint32_t k = 0u; k < 1600u; k++) {
        (void)record((k % 4u) == 0u ? 1u : 0u);
    }
    TEST_ASSERT_EQUAL_UINT32(1u, whole);
    TEST_ASSERT_EQUAL_UINT32(1000u * ((4u * (uint32_t)(FRAMES - 1)) + 2u), expected_us); /* after the last frame */
}

/* Without a sample, again and again with the same one, or with one from before, nothing new begins. */
TEST(time_is_that_of_the_samples)
{
    lever_frame_t frame;
    lever_recorder_step(&recorder, lever);
    TEST_ASSERT_FALSE(lever_recorder_next_frame(&recorder, &frame));
    (void)record(1000u);
    TEST_ASSERT_EQUAL_UINT32(1u, parts);
    for (uint32_t k = 0u; k < 1000u; k++) {
        lever_recorder_step(&recorder, lever);
        TEST_ASSERT_FALSE(lever_recorder_next_frame(&recorder, &frame));
    }
    time_us -= 3000u;
    TEST_ASSERT_EQUAL_UINT32(0u, record(1000u));
    TEST_ASSERT_EQUAL_UINT32(1u, parts);
}

/* Half a turn of the clock is no time. */
TEST(when_a_snapshot_was_late_the_next_begins_with_a_sample)
{
    lever_frame_t frame;
    (void)record(1000u);
    recorder.elapsed_us = recorder.period_us;
    while (lever_recorder_next_frame(&recorder, &frame)) {
    }
    const uint16_t sent = recorder.sent;
    lever_recorder_step(&recorder, lever);
    TEST_ASSERT_EQUAL_UINT16(sent, recorder.sent);
    recorder.elapsed_us = recorder.period_us - 1u;
    lever->link.time_us += 0x80000000u;
    lever_recorder_step(&recorder, lever);
    TEST_ASSERT_EQUAL_UINT16(sent, recorder.sent);
    lever->link.time_us++;
    lever_recorder_step(&recorder, lever);
    TEST_ASSERT_EQUAL_UINT16(0u, recorder.sent);
}

TEST(a_period_that_is_too_short_is_as_short_as_can_be)
{
    lever_recorder_init(&recorder, 0u);
    TEST_ASSERT_EQUAL_UINT32(1u, record(1000u));
    TEST_ASSERT_EQUAL_UINT32(FRAMES - 1, record(1000u)); /* a millisecond later */
    TEST_ASSERT_EQUAL_UINT32(1u, whole);
}

TEST(a_part_that_is_not_known_is_refused_both_ways)
{
    const message_snapshot_t unknown = {.part = (uint8_t)MESSAGE_PART_COUNT};
    message_snapshot_t message = {.part = (uint8_t)MESSAGE_PART_END, .digest = 5u};
    lever_frame_t frame = {.id = 1u};
    TEST_ASSERT_FALSE(message_snapshot_encode(&frame, &unknown));
    TEST_ASSERT_EQUAL_UINT32(1u, frame.id);
    TEST_ASSERT_TRUE(message_snapshot_encode(&frame, &message));
    lever_frame_t other = frame;
    other.data[1] = (uint8_t)(unknown.part << 4u);
    TEST_ASSERT_FALSE(message_snapshot_decode(&message, &other));
    other = frame;
    other.id++;
    TEST_ASSERT_FALSE(message_snapshot_decode(&message, &other));
    TEST_ASSERT_EQUAL_UINT32(5u, message.digest);
}
