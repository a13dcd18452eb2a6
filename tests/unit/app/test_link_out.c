/* Frames to send: which, in what order, how often, protected how, and that they say what the estimate says. */
#include "frames.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static sender_t sender;
static lever_frame_t frames[FRAMES_MOST];

static void start(void)
{
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    sender = sender_typical();
}

void setUp(void)
{
    lever_config_default(&config);
    start();
}

void tearDown(void)
{
}

static void dither(float rms)
{
    lever_command_t command = rig_command();
    command.dither_rms = rms;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

/* The next sample; its answers in frames[]. */
static uint32_t answers(void)
{
    (void)sender_deliver(&sender, lever);
    return fetch_all(lever, frames);
}

/* Answers to a sample that are all divided messages, too: in a publish_period of no time, all are due at once. */
static uint32_t full_answers(void)
{
    uint32_t count = answers();
    while (count < 5u) {
        count = answers();
    }
    return count;
}

static void publish_always(void)
{
    config.settings.publish_period = 1.0e-4f;
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

/* --- which, and in what order -------------------------------------------------------------------------------------- */

static void test_nothing_is_sent_before_the_first_sample(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, fetch_all(lever, frames));
}

/* Part k of seven, of which two are not messages, at the first sample after k sevenths of the period. */
static void test_a_set_of_divided_messages_is_spread_over_a_publish_period(void)
{
    const struct {
        uint32_t sample;
        uint32_t id;
    } wanted[] = {{0u, 0x214u}, {3u, 0x212u}, {6u, 0x211u}, {18u, 0x213u}};
    for (uint32_t k = 0u; k < 200u; k++) {
        uint32_t next[2] = {0x210u, 0u};
        uint32_t count = 1u;
        for (uint32_t m = 0u; m < 4u; m++) {
            if (wanted[m].sample == (k % 20u)) {
                next[0] = wanted[m].id;
                next[1] = 0x210u;
                count = 2u;
            }
        }
        assert_ids(next, count, answers());
    }
}

static void test_when_all_are_due_state_estimate_comes_last(void)
{
    const uint32_t wanted[] = {0x211u, 0x212u, 0x213u, 0x214u, 0x210u};
    publish_always();
    (void)answers();
    assert_ids(wanted, 5u, answers());
}

static void test_the_motor_comes_first_while_dither_is_on(void)
{
    const uint32_t wanted[] = {0x215u, 0x214u, 0x210u};
    const uint32_t others[] = {0x215u, 0x210u};
    dither(0.3f);
    assert_ids(wanted, 3u, answers());
    assert_ids(others, 2u, answers());
}

static void test_the_last_motor_command_of_a_fade_is_zero_and_then_there_is_none(void)
{
    message_motor_command_t command = {.torque = 1.0f};
    dither(0.3f);
    (void)sender_run(&sender, lever, 2000u);
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

static void test_dither_that_ends_at_once_is_told_so_once(void)
{
    message_motor_command_t command;
    config.settings.dither_fade = 0.0f;
    start();
    dither(0.3f);
    (void)sender_run(&sender, lever, 1000u);
    dither(0.0f);
    (void)answers();
    TEST_ASSERT_TRUE(message_motor_command_decode(&command, &frames[0]));
    TEST_ASSERT_TRUE(command.torque == 0.0f);
    (void)answers();
    TEST_ASSERT_FALSE(message_motor_command_decode(&command, &frames[0]));
}

static void test_a_sample_that_is_late_by_time_is_answered_too(void)
{
    (void)sender_run(&sender, lever, 100u);
    sender.rig.time_us -= 2000u;
    const uint32_t count = answers();
    TEST_ASSERT_EQUAL_UINT32(1u, rig_health(lever).late);
    TEST_ASSERT_EQUAL_HEX32(0x210u, frames[count - 1u].id);
}

static void test_frames_not_fetched_are_replaced_and_do_not_pile_up(void)
{
    for (uint32_t k = 0u; k < 50u; k++) {
        (void)sender_deliver(&sender, lever);
    }
    const uint32_t count = fetch_all(lever, frames);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(5u, count);
    message_state_estimate_t message;
    TEST_ASSERT_TRUE(message_state_estimate_decode(&message, &frames[count - 1u]));
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-5, (double)rig_estimate(lever).theta, (double)message.theta);
}

/* --- how often ----------------------------------------------------------------------------------------------------- */

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

static void test_divided_messages_come_every_publish_period(void)
{
    TEST_ASSERT_EQUAL_UINT32(50u, publications_in(1000u));
    config.settings.publish_period = 0.1f;
    start();
    TEST_ASSERT_EQUAL_UINT32(10u, publications_in(1000u));
}

static void test_a_publish_period_shorter_than_a_sample_publishes_every_sample(void)
{
    publish_always();
    TEST_ASSERT_EQUAL_UINT32(99u, publications_in(100u)); /* the first sample begins a set, the second ends it */
}

static void test_publication_goes_on_when_time_wraps(void)
{
    sender.rig.time_us = UINT32_MAX - 500000u;
    TEST_ASSERT_EQUAL_UINT32(50u, publications_in(1000u));
}

/* --- protection ---------------------------------------------------------------------------------------------------- */

static uint32_t index_of(uint32_t id, const uint32_t ids[6])
{
    uint32_t index = 0u;
    while (ids[index] != id) {
        index++;
        TEST_ASSERT_LESS_THAN_UINT32(6u, index);
    }
    return index;
}

static void test_every_message_has_its_own_gapless_counter_and_a_right_crc(void)
{
    const uint32_t ids[6] = {0x210u, 0x211u, 0x212u, 0x213u, 0x214u, 0x215u};
    const uint8_t data_ids[6] = {49u, 65u, 81u, 97u, 113u, 129u}; /* E2EDataIdBase of the DBC */
    uint32_t received[6] = {0u};
    dither(0.3f);
    for (uint32_t k = 0u; k < 1000u; k++) {
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            const uint32_t m = index_of(frames[f].id, ids);
            const uint8_t counter = (uint8_t)(received[m] & 15u);
            TEST_ASSERT_EQUAL_UINT8(counter, e2e_counter(&frames[f]));
            TEST_ASSERT_EQUAL_HEX8(
                e2e_crc(&frames[f].data[1], 7u, (uint8_t)(data_ids[m] + counter)), frames[f].data[0]);
            received[m]++;
        }
    }
    TEST_ASSERT_EQUAL_UINT32(1000u, received[0]);
    TEST_ASSERT_EQUAL_UINT32(50u, received[4]);
    TEST_ASSERT_EQUAL_UINT32(1000u, received[5]);
}

/* --- content: within half a count of what the façade says ----------------------------------------------------------- */

static void test_state_estimate_says_what_the_estimate_says(void)
{
    message_state_estimate_t message;
    (void)sender_run(&sender, lever, 2000u);
    const uint32_t count = answers();
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_TRUE(message_state_estimate_decode(&message, &frames[count - 1u]));
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-5, (double)estimate.theta, (double)message.theta);
    TEST_ASSERT_DOUBLE_WITHIN(2.6e-4, (double)estimate.theta_dot, (double)message.theta_dot);
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-4, (double)estimate.nis, (double)message.nis);
    TEST_ASSERT_EQUAL_UINT8(LEVER_MODEL_LEVER, message.model);
}

static void test_parameters_and_sigma_say_what_the_estimate_says(void)
{
    const double half[3] = {5.1e-4, 5.1e-3, 5.1e-2};
    const double half_sigma[3] = {5.1e-5, 1.1e-3, 2.6e-2};
    message_pilot_parameters_t parameters;
    message_pilot_sigma_t sigma;
    publish_always();
    (void)sender_run(&sender, lever, 2000u);
    (void)full_answers();
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_TRUE(message_pilot_parameters_decode(&parameters, &frames[0]));
    TEST_ASSERT_TRUE(message_pilot_sigma_decode(&sigma, &frames[1]));
    for (uint32_t i = 0u; i < 3u; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(half[i], (double)estimate.parameter[i], (double)parameters.parameter[i]);
        TEST_ASSERT_DOUBLE_WITHIN(half_sigma[i], (double)estimate.parameter_sigma[i], (double)sigma.sigma[i]);
    }
}

static void test_dynamics_say_what_the_estimate_says(void)
{
    message_pilot_dynamics_t message;
    publish_always();
    (void)sender_run(&sender, lever, 2000u);
    (void)full_answers();
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_TRUE(message_pilot_dynamics_decode(&message, &frames[2]));
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-4, (double)estimate.natural_frequency, (double)message.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(
        1.1e-3, (double)estimate.natural_frequency_sigma, (double)message.natural_frequency_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(1.1e-4, (double)estimate.damping_ratio, (double)message.damping_ratio);
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-4, (double)estimate.damping_ratio_sigma, (double)message.damping_ratio_sigma);
}

static void test_health_says_mode_faults_counts_and_excitation(void)
{
    message_health_t message;
    publish_always();
    (void)sender_run(&sender, lever, 1000u);
    sender_next(&sender); /* lost */
    sender_next(&sender); /* its lever sample is damaged */
    sender.lever.data[3] ^= 1u;
    (void)lever_on_frame(lever, &sender.lever);
    (void)lever_on_frame(lever, &sender.base);
    (void)lever_step(lever);
    (void)lever_on_frame(lever, &sender.base); /* repeated */
    (void)fetch_all(lever, frames);
    (void)full_answers();
    TEST_ASSERT_TRUE(message_health_decode(&message, &frames[3]));
    const lever_health_t health = rig_health(lever);
    TEST_ASSERT_EQUAL_UINT8(LEVER_MODE_RUN, message.mode);
    TEST_ASSERT_EQUAL_UINT16(health.faults, message.faults);
    TEST_ASSERT_EQUAL_UINT8(2u, message.lost);
    TEST_ASSERT_EQUAL_UINT8(1u, message.corrupt);
    TEST_ASSERT_EQUAL_UINT8(1u, message.late);
    TEST_ASSERT_DOUBLE_WITHIN(2.6e-3, (double)health.excitation, (double)message.excitation);
}

static void test_motor_command_says_the_dither_of_health(void)
{
    message_motor_command_t message;
    dither(0.4f);
    (void)sender_run(&sender, lever, 2000u);
    (void)answers();
    TEST_ASSERT_TRUE(message_motor_command_decode(&message, &frames[0]));
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-4, (double)rig_health(lever).dither, (double)message.torque);
    TEST_ASSERT_TRUE(message.dither == message.torque);
    TEST_ASSERT_TRUE(message.torque != 0.0f);
}

/* --- what the port reports ------------------------------------------------------------------------------------------ */

static void test_platform_health_is_sent_from_the_first_report_on(void)
{
    const uint32_t wanted[] = {0x211u, 0x212u, 0x213u, 0x214u, 0x216u, 0x210u};
    publish_always();
    const lever_platform_t report = {
        .faults = (uint8_t)((uint8_t)LEVER_PLATFORM_CLOCK | (uint8_t)LEVER_PLATFORM_BUS_OFF),
        .transmit_errors = 255u,
        .receive_errors = 96u,
        .bus_offs = 3u,
        .overruns = 258u,
        .dropped = 1021u};
    message_platform_health_t message;
    lever_platform(lever, &report);
    (void)answers();
    assert_ids(wanted, 6u, answers());
    TEST_ASSERT_TRUE(message_platform_health_decode(&message, &frames[4]));
    TEST_ASSERT_EQUAL_UINT8(report.faults, message.faults);
    TEST_ASSERT_EQUAL_UINT8(255u, message.transmit_errors);
    TEST_ASSERT_EQUAL_UINT8(96u, message.receive_errors);
    TEST_ASSERT_EQUAL_UINT8(3u, message.bus_offs);
    TEST_ASSERT_EQUAL_UINT8(2u, message.overruns);
    TEST_ASSERT_EQUAL_UINT8(253u, message.dropped);
}

static void test_a_fault_of_the_platform_is_one_of_health_as_long_as_it_is_reported(void)
{
    lever_platform_t report = {.faults = (uint8_t)LEVER_PLATFORM_WATCHDOG};
    lever_platform(lever, &report);
    (void)sender_run(&sender, lever, 10u);
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_PLATFORM, rig_health(lever).faults);
    report.faults = 0u;
    lever_platform(lever, &report);
    (void)sender_run(&sender, lever, 1u);
    TEST_ASSERT_BITS_LOW(LEVER_FAULT_PLATFORM, rig_health(lever).faults);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_sent_before_the_first_sample);
    RUN_TEST(test_a_set_of_divided_messages_is_spread_over_a_publish_period);
    RUN_TEST(test_when_all_are_due_state_estimate_comes_last);
    RUN_TEST(test_the_motor_comes_first_while_dither_is_on);
    RUN_TEST(test_the_last_motor_command_of_a_fade_is_zero_and_then_there_is_none);
    RUN_TEST(test_dither_that_ends_at_once_is_told_so_once);
    RUN_TEST(test_a_sample_that_is_late_by_time_is_answered_too);
    RUN_TEST(test_frames_not_fetched_are_replaced_and_do_not_pile_up);
    RUN_TEST(test_divided_messages_come_every_publish_period);
    RUN_TEST(test_a_publish_period_shorter_than_a_sample_publishes_every_sample);
    RUN_TEST(test_publication_goes_on_when_time_wraps);
    RUN_TEST(test_every_message_has_its_own_gapless_counter_and_a_right_crc);
    RUN_TEST(test_state_estimate_says_what_the_estimate_says);
    RUN_TEST(test_parameters_and_sigma_say_what_the_estimate_says);
    RUN_TEST(test_dynamics_say_what_the_estimate_says);
    RUN_TEST(test_health_says_mode_faults_counts_and_excitation);
    RUN_TEST(test_motor_command_says_the_dither_of_health);
    RUN_TEST(test_platform_health_is_sent_from_the_first_report_on);
    RUN_TEST(test_a_fault_of_the_platform_is_one_of_health_as_long_as_it_is_reported);
    return UNITY_END();
}
