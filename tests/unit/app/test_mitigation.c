/* The mitigation of an instance: what it says on the bus and when, and whatever fails has it passive within 100 ms. */
#include "app/instance.h"
#include "frames.h"

void setUp(void)
{
    lever_config_default(&config);
    config.mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION;
    start_bus();
}

static lever_correction_t correction_of(const lever_t *instance)
{
    lever_correction_t correction;
    lever_correction(instance, &correction);
    return correction;
}

static lever_correction_t correction(void)
{
    return correction_of(lever);
}

/* The CORRECTION among the last `count` answers; NULL without one. */
static const message_correction_t *found_in(uint32_t count)
{
    static message_correction_t message;
    const message_correction_t *found = NULL;
    for (uint32_t f = 0u; f < count; f++) {
        if (message_correction_decode(&message, &frames[f])) {
            TEST_ASSERT_NULL(found);
            TEST_ASSERT_EQUAL_HEX8(
                e2e_crc(&frames[f].data[1], 7u, (uint8_t)(9u + e2e_counter(&frames[f]))), frames[f].data[0]);
            found = &message;
        }
    }
    return found;
}

static void choose(enum lever_mitigation mitigation)
{
    lever_command_t command = command_none();
    command.mitigation = (uint8_t)mitigation;
    const lever_frame_t frame = command_frame(&command);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
}

/* At sample k: as often as a COMMAND is repeated. */
static void keep_alive(uint32_t k)
{
    if ((k % 250u) == 0u) {
        dither((float)LEVER_KEEP);
    }
}

/* As many samples, kept alive. */
static void keep_delivering(uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        keep_alive(k);
        (void)deliver_many(1u);
    }
}

/* --- on the bus --------------------------------------------------------------------------------------------------- */

TEST(each_sample_is_answered_by_a_correction)
{
    keep_delivering(3000u);
    for (uint32_t k = 0u; k < 100u; k++) {
        const message_correction_t *message = found_in(answers());
        TEST_ASSERT_NOT_NULL(message);
        TEST_ASSERT_FLOAT_WITHIN(1.01e-5f, correction().angle, message->correction);
        TEST_ASSERT_FLOAT_WITHIN(2.51e-3f, correction().weight, message->weight);
        TEST_ASSERT_EQUAL_UINT8(LEVER_MITIGATION_CANCELLATION, message->mitigation);
        TEST_ASSERT_EQUAL_UINT16(time_us & 0xFFFFu, message->time_low);
        TEST_ASSERT_TRUE(message->valid);
    }
    TEST_ASSERT_EQUAL_FLOAT(1.0f, correction().weight);
}

TEST(without_mitigation_there_is_none)
{
    config.mitigation = (uint8_t)LEVER_MITIGATION_NONE;
    start_bus();
    for (uint32_t k = 0u; k < 2000u; k++) {
        TEST_ASSERT_NULL(found_in(answers()));
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, correction().angle);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, correction().weight);
}

/* The estimate does not know of it. */
TEST(a_correction_changes_no_estimate)
{
    static lever_memory_t other_memory;
    lever_config_t other_config = config;
    other_config.mitigation = (uint8_t)LEVER_MITIGATION_NONE;
    start();
    lever_t *other = lever_init(&other_memory, &other_config);
    for (uint32_t k = 0u; k < 3000u; k++) {
        const lever_sample_t sample = sample_after(1u);
        keep_alive(k);
        (void)lever_update(lever, &sample);
        (void)lever_update(other, &sample);
    }
    assert_same_estimates(lever, other);
    TEST_ASSERT_TRUE((correction().weight > 0.0f) && (correction_of(other).weight <= 0.0f));
}

TEST(a_command_chooses_it)
{
    keep_delivering(3000u);
    choose(LEVER_MITIGATION_NONE);
    const message_correction_t *message = found_in(answers());
    TEST_ASSERT_NOT_NULL(message);
    TEST_ASSERT_EQUAL_UINT8(LEVER_MITIGATION_NONE, message->mitigation);
    for (uint32_t k = 0u; (k < 100u) && (message != NULL); k++) {
        const float last = message->correction;
        message = found_in(answers());
        TEST_ASSERT_TRUE((message != NULL) || (fabsf(last) < 1.0e-5f));
    }
    TEST_ASSERT_NULL(message);
    choose(LEVER_MITIGATION_NOTCH);
    keep_delivering(2000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, correction().weight);
}

/* In COMMAND_ACK and IDENTITY. */
TEST(what_was_chosen_can_be_read_back)
{
    message_command_ack_t ack;
    message_identity_t identity = {.page = 0u};
    choose(LEVER_MITIGATION_NOTCH_AND_DAMPING);
    TEST_ASSERT_EQUAL_UINT32(1u, fetch());
    TEST_ASSERT_TRUE(message_command_ack_decode(&ack, &frames[0]));
    TEST_ASSERT_EQUAL_UINT8(LEVER_MITIGATION_NOTCH_AND_DAMPING, ack.mitigation);
    for (uint32_t k = 0u; (k < 10u) && (identity.page != (uint8_t)MESSAGE_PAGE_CHOICES); k++) {
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            (void)message_identity_decode(&identity, &frames[f]);
        }
    }
    TEST_ASSERT_EQUAL_UINT8(LEVER_MITIGATION_NOTCH_AND_DAMPING, identity.mitigation);
    lever_command_t command = command_none();
    command.mitigation = (uint8_t)LEVER_MITIGATION_COUNT;
    TEST_ASSERT_FALSE(lever_command(lever, &command));
    TEST_ASSERT_EQUAL_UINT8(LEVER_MITIGATION_NOTCH_AND_DAMPING, lever->bounce.chosen);
}

/* --- what ends it ------------------------------------------------------------------------------------------------- */

typedef enum cause { NO_SAMPLES, NO_BASE, NO_THETA, NO_RATE, NO_LEVER, CLOCK_STANDS, PLATFORM, RESET, CAUSES } cause_t;

/* A millisecond with it. */
static void pass(cause_t cause)
{
    if (cause == NO_SAMPLES) {
        lever_idle(lever, 1000u);
    } else {
        lever_sample_t sample = sample_after(1u);
        sample.z_ddot_valid = (cause != NO_BASE);
        sample.theta_valid = (cause != NO_THETA) && (cause != NO_LEVER);
        sample.theta_dot_valid = (cause != NO_RATE) && (cause != NO_LEVER);
        time_us -= (cause == CLOCK_STANDS) ? (uint32_t)PERIOD_US : 0u;
        sample.time_us = time_us;
        (void)lever_update(lever, &sample);
    }
}

TEST_EACH(CAUSES, whatever_fails_it_is_passive_within_100_ms_without_a_jump)
{
    const cause_t cause = (cause_t)test_round;
    const lever_platform_t broken = {.faults = (uint8_t)LEVER_PLATFORM_ROM};
    config.mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION_AND_DAMPING;
    config.settings.dither_fade = 0.1f;
    start();
    dither(0.0f);
    (void)run(900u);
    dither(0.0f);
    for (uint32_t k = 0u; (k < 1000u) && (fabsf(correction().angle) < 5.0e-3f); k++) {
        (void)run(1u);
    }
    TEST_ASSERT_TRUE((fabsf(correction().angle) >= 5.0e-3f) && health().gate_open);
    if (cause == PLATFORM) {
        lever_platform(lever, &broken);
    }
    if (cause == RESET) {
        request(LEVER_REQUEST_RESET);
    }
    float last = correction().angle;
    for (uint32_t k = 0u; k < 100u; k++) {
        pass(cause);
        TEST_ASSERT_FLOAT_WITHIN(3.5e-3f, last, correction().angle); /* 0.2 degrees */
        last = correction().angle;
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, correction().angle);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, correction().weight);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, health().torque);
}

/* The port calls it when none comes; each is fetched, down to 0, and then there is nothing to say. */
TEST(without_samples_the_corrections_go_on_down_to_zero)
{
    keep_delivering(3000u);
    uint32_t count = 0u;
    float last = 1.0f;
    for (uint32_t k = 0u; k < 40u; k++) {
        lever_idle(lever, 5000u);
        const message_correction_t *message = found_in(fetch());
        if (message != NULL) {
            count++;
            last = message->correction;
        }
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, last);
    TEST_ASSERT_UINT32_WITHIN(2u, 18u, count);
}

/* --- torque ------------------------------------------------------------------------------------------------------- */

/* Against the estimated rate, by the gain between the corners of its band; through the gate, with what else is asked. */
TEST(damping_is_asked_of_the_motor)
{
    config.mitigation = (uint8_t)LEVER_MITIGATION_DAMPING;
    config.settings.dither_fade = 0.1f;
    config.settings.damping_limit = 0.3f;
    start_bus();
    dither(0.0f);
    keep_delivering(900u);
    dither(0.1f);
    double product = 0.0;
    double square = 0.0;
    for (uint32_t k = 0u; k < 900u; k++) {
        message_motor_command_t message;
        (void)answers();
        TEST_ASSERT_TRUE(message_motor_command_decode(&message, &frames[0]));
        const float damping = message.torque - message.dither;
        TEST_ASSERT_TRUE(fabsf(damping) <= 0.302f);
        TEST_ASSERT_FLOAT_WITHIN(1.1e-3f, health().torque, message.torque);
        product += (double)damping * (double)estimate().theta_dot;
        square += (double)estimate().theta_dot * (double)estimate().theta_dot;
    }
    TEST_ASSERT_TRUE((product / square) < -0.5);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, correction().angle);
}

/* R39 */
TEST(damping_and_correction_end_with_the_commands)
{
    config.mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION_AND_DAMPING;
    start();
    dither(0.0f);
    (void)run(900u);
    TEST_ASSERT_TRUE(health().gate_open);
    TEST_ASSERT_TRUE(correction().weight > 0.5f);
    (void)run(200u);
    TEST_ASSERT_FALSE(health().gate_open);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, health().torque);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, correction().weight);
    TEST_ASSERT_FALSE(lever_is_acting(lever));
    keep_delivering(1000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, correction().weight);
}

/* Long before the estimator finds it stuck. */
TEST_EACH(2, a_sensor_that_says_the_same_closes_it)
{
    for (uint32_t k = 0u; k < 3000u; k++) {
        keep_alive(k);
        (void)run(1u);
    }
    const lever_sample_t stuck = sample_after(0u);
    for (uint32_t k = 1u; k <= 23u; k++) {
        TEST_ASSERT_TRUE(lever->bounce.mitigation.open);
        lever_sample_t sample = sample_after(1u);
        sample.theta = (test_round == 0u) ? stuck.theta : sample.theta;
        sample.z_ddot = (test_round == 1u) ? stuck.z_ddot : sample.z_ddot;
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_FALSE(lever->bounce.mitigation.open);
}

/* To the microsecond, or 1.25 sample periods. */
TEST(a_sample_serves_for_20_ms_or_longer_if_samples_are_slow)
{
    static const float period[] = {1.0e-3f, 0.016001f, 0.02f};
    static const uint32_t silence_us[] = {20000u, 20001u, 25000u};
    for (uint32_t i = 0u; i < 3u; i++) {
        config.settings.sample_period = period[i];
        start();
        for (uint32_t k = 0u; k < 100u; k++) {
            const lever_sample_t sample = sample_after((i == 0u) ? 4u : 16u);
            (void)lever_update(lever, &sample);
        }
        TEST_ASSERT_EQUAL_UINT32(silence_us[i] + 1u, lever->bounce.mitigation.sensed_left);
    }
}

TEST(each_fault_of_sensors_clock_or_hands_closes_it)
{
    static const uint32_t fault[] = {LEVER_FAULT_CLOCK, LEVER_FAULT_RECOVERED, 0u, 0u};
    keep_delivering(3000u);
    for (uint32_t i = 0u; i < 4u; i++) {
        lever->estimator.faults = fault[i];
        lever->estimator.learning.verdict = (uint8_t)((i == 2u) ? VERDICT_HANDS_OFF : VERDICT_LEARNING);
        bounce_mitigate(&lever->bounce, &lever->estimator, &lever->gate, &lever->to_gate);
        TEST_ASSERT_EQUAL(i == 3u, lever->bounce.mitigation.open);
    }
}

TEST(a_correction_acts_without_the_motor_until_it_has_faded)
{
    TEST_ASSERT_FALSE(lever_is_acting(lever));
    keep_delivering(3000u);
    TEST_ASSERT_FALSE(instance_is_driving(lever));
    TEST_ASSERT_TRUE(lever_is_acting(lever));
    choose(LEVER_MITIGATION_NONE);
    keep_delivering(200u);
    TEST_ASSERT_FALSE(lever_is_acting(lever));
}
