/* Frames to send: which, in what order, how often, protected how. */
#include "answers.h"

void setUp(void)
{
    lever_config_default(&config);
    start();
}

static void assert_ids(const uint32_t *wanted, uint32_t count, uint32_t found)
{
    TEST_ASSERT_EQUAL_UINT32(count, found);
    for (uint32_t k = 0u; k < count; k++) {
        TEST_ASSERT_EQUAL_HEX32(wanted[k], frames[k].id);
        TEST_ASSERT_EQUAL_UINT8(8u, frames[k].length);
    }
}

/* --- which, and in what order ------------------------------------------------------------------------------------- */

TEST(nothing_is_sent_before_the_first_sample)
{
    TEST_ASSERT_EQUAL_UINT32(0u, fetch_all(lever, frames));
}

/* Part k of seven, of which PLATFORM_HEALTH is not sent without a report, at the first sample after k sevenths of the
 * period; the pages of IDENTITY each second. */
TEST(a_set_of_divided_messages_is_spread_over_a_publish_period)
{
    const struct {
        uint32_t sample;
        uint32_t id;
    } wanted[] = {{0u, 0x214u}, {3u, 0x211u}, {6u, 0x212u}, {9u, 0x213u}, {12u, 0x21Au}, {15u, 0x219u}};
    for (uint32_t k = 0u; k < 2100u; k++) {
        uint32_t next[3] = {0u};
        uint32_t count = 0u;
        for (uint32_t m = 0u; m < 6u; m++) {
            if (wanted[m].sample == (k % 20u)) {
                next[count++] = wanted[m].id;
            }
        }
        if ((k % 1000u) < 3u) {
            next[count++] = 0x217u;
        }
        next[count++] = 0x210u;
        assert_ids(next, count, answers());
    }
}

TEST(when_all_are_due_state_estimate_comes_last)
{
    const uint32_t wanted[] = {0x215u, 0x218u, 0x211u, 0x212u, 0x213u, 0x21Au, 0x214u, 0x219u, 0x216u, 0x217u, 0x210u};
    const lever_platform_t report = {.faults = 0u};
    publish_always();
    lever_platform(lever, &report);
    (void)sender_run(&sender, lever, 400u);
    lever_command_t command = rig_command();
    command.dither_rms = 0.3f;
    const lever_frame_t frame = sender_command(&sender, &command);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    assert_ids(wanted, 11u, answers());
}

TEST(the_motor_comes_first_while_dither_is_on)
{
    const uint32_t wanted[] = {0x215u, 0x210u};
    (void)sender_run(&sender, lever, 421u);
    dither(0.3f);
    (void)answers();
    assert_ids(wanted, 2u, answers());
}

TEST(the_last_motor_command_of_a_fade_is_zero_and_then_there_is_none)
{
    message_motor_command_t command = {.torque = 1.0f};
    (void)sender_run(&sender, lever, 400u);
    dither(0.3f);
    (void)sender_run(&sender, lever, 900u);
    dither(0.0f);
    uint32_t sent = 0u;
    for (uint32_t k = 0u; k < 2000u; k++) {
        (void)answers();
        if (frames[0].id == 0x215u) {
            TEST_ASSERT_TRUE(message_motor_command_decode(&command, &frames[0]));
            sent++;
        }
    }
    TEST_ASSERT_UINT32_WITHIN(2u, 1000u, sent);
    TEST_ASSERT_TRUE(command.torque == 0.0f);
}

TEST(dither_that_ends_at_once_is_told_so_once)
{
    message_motor_command_t command;
    config.settings.dither_fade = 0.0f;
    config.settings.torque_slew = 1.0e5f;
    start();
    (void)sender_run(&sender, lever, 400u);
    dither(0.3f);
    (void)sender_run(&sender, lever, 900u);
    dither(0.0f);
    (void)answers();
    TEST_ASSERT_TRUE(message_motor_command_decode(&command, &frames[0]));
    TEST_ASSERT_TRUE(command.torque == 0.0f);
    (void)answers();
    TEST_ASSERT_FALSE(message_motor_command_decode(&command, &frames[0]));
}

TEST(a_sample_that_is_late_by_time_is_answered_too)
{
    (void)sender_run(&sender, lever, 100u);
    sender.rig.time_us -= 2000u;
    const uint32_t count = answers();
    TEST_ASSERT_EQUAL_UINT32(1u, rig_health(lever).late);
    TEST_ASSERT_EQUAL_HEX32(0x210u, frames[count - 1u].id);
}

TEST(frames_not_fetched_are_replaced_and_do_not_pile_up)
{
    for (uint32_t k = 0u; k < 50u; k++) {
        (void)sender_deliver(&sender, lever);
    }
    const uint32_t count = fetch_all(lever, frames);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(8u, count);
    message_state_estimate_t message;
    TEST_ASSERT_TRUE(message_state_estimate_decode(&message, &frames[count - 1u]));
    TEST_ASSERT_DOUBLE_WITHIN(1.1e-4, (double)rig_estimate(lever).theta, (double)message.theta);
}

/* --- how often ---------------------------------------------------------------------------------------------------- */

static uint32_t publications_in(uint32_t samples)
{
    uint32_t count = 0u;
    for (uint32_t k = 0u; k < samples; k++) {
        const uint32_t found = answers();
        for (uint32_t f = 0u; f < found; f++) {
            count += (frames[f].id == 0x213u) ? 1u : 0u;
        }
    }
    return count;
}

TEST(divided_messages_come_every_publish_period)
{
    TEST_ASSERT_EQUAL_UINT32(50u, publications_in(1000u));
    config.settings.publish_period = 0.1f;
    start();
    TEST_ASSERT_EQUAL_UINT32(10u, publications_in(1000u));
}

TEST(a_publish_period_shorter_than_a_sample_publishes_every_sample)
{
    publish_always();
    TEST_ASSERT_EQUAL_UINT32(99u, publications_in(100u)); /* the first sample begins a set, the second ends it */
}

/* Once there was no HEALTH at all then. */
TEST(publication_goes_on_while_the_sample_clock_stands)
{
    (void)sender_run(&sender, lever, 400u);
    const uint32_t now = sender.rig.time_us;
    uint32_t found = 0u;
    for (uint32_t k = 0u; k < 1000u; k++) {
        message_health_t health;
        sender.rig.time_us = now - (uint32_t)RIG_PERIOD_US; /* of which rig_sample() makes `now` */
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            if (message_health_decode(&health, &frames[f])) {
                TEST_ASSERT_BITS_HIGH(LEVER_FAULT_CLOCK, health.faults);
                found++;
            }
        }
    }
    TEST_ASSERT_EQUAL_UINT32(50u, found);
}

TEST(publication_goes_on_when_time_wraps)
{
    sender.rig.time_us = UINT32_MAX - 500000u;
    TEST_ASSERT_EQUAL_UINT32(50u, publications_in(1000u));
}

/* --- protection --------------------------------------------------------------------------------------------------- */

TEST(every_message_has_its_own_gapless_counter_and_a_right_crc)
{
    const uint8_t data_ids[11] = {
        49u, 65u, 81u, 97u, 113u, 129u, 145u, 161u, 177u, 193u, 209u}; /* E2EDataIdBase of the DBC */
    uint32_t received[11] = {0u};
    const lever_platform_t report = {.faults = 0u};
    lever_platform(lever, &report);
    for (uint32_t k = 0u; k < 1000u; k++) {
        lever_command_t command = rig_command();
        command.dither_rms = 0.3f;
        const lever_frame_t frame = sender_command(&sender, &command);
        (void)lever_on_frame(lever, &frame);
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            const uint32_t m = frames[f].id - 0x210u;
            TEST_ASSERT_LESS_THAN_UINT32(11u, m);
            const uint8_t counter = (uint8_t)(received[m] & 15u);
            TEST_ASSERT_EQUAL_UINT8(counter, e2e_counter(&frames[f]));
            TEST_ASSERT_EQUAL_HEX8(
                e2e_crc(&frames[f].data[1], 7u, (uint8_t)(data_ids[m] + counter)), frames[f].data[0]);
            received[m]++;
        }
    }
    const uint32_t expected[11] = {1000u, 50u, 50u, 50u, 50u, 700u, 50u, 3u, 1000u, 50u, 50u};
    TEST_ASSERT_EQUAL_UINT32_ARRAY(expected, received, 11);
}
