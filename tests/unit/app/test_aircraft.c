/* An aircraft beside the estimator: which one is taken, what the bus says of it, and what carries its margin. */
#include "app/instance.h"
#include "app/link.h"
#include "frames.h"

#include <math.h>

enum { POINTS = 14 };

/* Heave of a light aircraft: an acceleration that lags with frequency. */
static lever_aircraft_t aircraft_of(void)
{
    lever_aircraft_t aircraft = {.count = POINTS, .gain_sigma = 0.1f, .phase_sigma = 0.1f, .warning = 6.0f};
    aircraft.alarm = 3.0f;
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        const float frequency = 1.5f + (0.5f * (float)i);
        const float lag = frequency / 3.0f;
        aircraft.frequency[i] = frequency;
        aircraft.real[i] = 20.0f / (1.0f + (lag * lag));
        aircraft.imaginary[i] = -20.0f * lag / (1.0f + (lag * lag));
    }
    return aircraft;
}

static lever_aircraft_t aircraft;

void setUp(void)
{
    lever_config_default(&config);
    aircraft = aircraft_of();
    start_bus();
}

static lever_stability_t stability(void)
{
    lever_stability_t result;
    lever_stability(lever, &result);
    return result;
}

TEST(an_aircraft_is_taken_or_refused_as_a_whole)
{
    float *const wrong[] = {&aircraft.gain_sigma, &aircraft.phase_sigma, &aircraft.alarm, &aircraft.warning,
        &aircraft.frequency[POINTS - 1], &aircraft.real[POINTS - 1], &aircraft.imaginary[POINTS - 1]};
    static const float sigmas[] = {-0.1f, 1.1f};
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    for (uint32_t i = 0u; i < (sizeof wrong / sizeof wrong[0]); i++) {
        const float right = *wrong[i];
        *wrong[i] = NAN;
        TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
        *wrong[i] = INFINITY;
        TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
        for (uint32_t k = 0u; (i < 2u) && (k < 2u); k++) {
            *wrong[i] = sigmas[k];
            TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
        }
        *wrong[i] = right;
        TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    }
    aircraft.alarm = -INFINITY;
    TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
    aircraft = aircraft_of();
    aircraft.warning = aircraft.alarm - 0.1f;
    TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
    aircraft = aircraft_of();
    aircraft.frequency[3] = aircraft.frequency[2];
    TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
    aircraft = aircraft_of();
    aircraft.count = 2u;
    TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
    aircraft.count = (uint8_t)LEVER_AIRCRAFT_POINTS + 1u;
    TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
    TEST_ASSERT_TRUE(lever_aircraft(lever, NULL));
}

/* Modes of the cabin between accelerometer and seat. */
TEST(so_are_the_modes_of_a_cabin_that_bends)
{
    lever_seat_mode_t *mode = &aircraft.seat[1];
    float *const wrong[] = {&aircraft.seat_direct, &mode->damping, &mode->stiffness, &mode->by_rate, &mode->by_place};
    aircraft.seat_modes = 2u;
    aircraft.seat[0] = (lever_seat_mode_t){.by_place = -400.0f, .damping = 2.0f, .stiffness = 1400.0f};
    *mode = aircraft.seat[0];
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    for (uint32_t i = 0u; i < (sizeof wrong / sizeof wrong[0]); i++) {
        const float right = *wrong[i];
        *wrong[i] = NAN;
        TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
        *wrong[i] = INFINITY;
        TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
        *wrong[i] = 0.0f;
        TEST_ASSERT_EQUAL((i == 0u) || (i > 2u), lever_aircraft(lever, &aircraft));
        *wrong[i] = right;
    }
    aircraft.seat_modes = (uint8_t)LEVER_SEAT_MODES + 1u;
    TEST_ASSERT_FALSE(lever_aircraft(lever, &aircraft));
}

/* At rest in the accelerometer the seat stands; the estimator takes its acceleration. */
TEST(the_estimator_takes_the_acceleration_at_the_seat)
{
    aircraft.seat_modes = 1u;
    aircraft.seat_direct = 2.0f;
    aircraft.seat[0] = (lever_seat_mode_t){.by_place = 700.0f, .damping = 2.0f, .stiffness = 1400.0f};
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    lever_sample_t sample = {.theta = 0.3f, .theta_valid = true, .z_ddot = 0.4f, .z_ddot_valid = true};
    (void)lever_update(lever, &sample);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 2.5f * 0.4f, lever->estimator.last_z_ddot);
    TEST_ASSERT_TRUE(lever_aircraft(lever, NULL));
    sample.time_us += 1000u;
    (void)lever_update(lever, &sample);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.4f, lever->estimator.last_z_ddot);
}

/* The last STABILITY among the answers to so many samples; how many there were. */
static uint32_t stabilities(uint32_t samples, message_stability_t *message)
{
    uint32_t found = 0u;
    for (uint32_t k = 0u; k < samples; k++) {
        const uint32_t count = answers();
        for (uint32_t i = 0u; i < count; i++) {
            found += message_stability_decode(message, &frames[i]) ? 1u : 0u;
        }
    }
    return found;
}

/* R42 */
TEST(the_bus_says_how_stable_the_loop_is_once_a_publish_period)
{
    message_stability_t message;
    TEST_ASSERT_EQUAL_UINT32(0u, stabilities(2000u, &message)); /* what is said of it then has been learnt */
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    TEST_ASSERT_EQUAL_UINT32(50u, stabilities(1000u, &message));
    TEST_ASSERT_TRUE(message.valid);
    TEST_ASSERT_EQUAL_UINT8(stability().state, message.bounce);
    TEST_ASSERT_FLOAT_WITHIN(0.5f, stability().gain_margin, message.gain_margin);
    bounce_t *bounce = &lever->bounce;
    const bounce_t before = *bounce;
    float *const sigma[] = {&bounce->margin.gain_sigma, &bounce->margin.modulus_sigma};
    for (uint32_t i = 0u; i < 2u; i++) {
        lever_frame_t frame;
        *sigma[i] = NAN;
        TEST_ASSERT_TRUE(link_encode(lever, OUTPUT_STABILITY, &frame) && message_stability_decode(&message, &frame));
        TEST_ASSERT_FALSE(message.valid);
        *bounce = before;
    }
}

/* Not more often than each 40 ms, whatever the publish period. */
TEST_EACH(2, a_margin_is_worked_out_once_a_publish_period)
{
    uint32_t count = 0u;
    config.settings.publish_period = (test_round == 0u) ? 5.0e-3f : 0.1f;
    start_bus();
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    for (uint32_t k = 0u; k < 1000u; k++) {
        const uint32_t before_us = lever->bounce.time_us;
        (void)run(1u);
        count += (lever->bounce.time_us != before_us) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT32((test_round == 0u) ? 25u : 10u, count);
}

TEST(an_estimate_that_waits_for_samples_or_was_never_one_says_nothing_of_stability)
{
    message_stability_t message;
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    TEST_ASSERT_GREATER_THAN_UINT32(0u, stabilities(100u, &message));
    TEST_ASSERT_FALSE(message.valid);
    (void)deliver_many(4000u);
    TEST_ASSERT_NOT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, stability().state);
    (void)run_blind(100u);
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, stability().state);
}

/* R44 */
TEST(frozen_parameters_carry_a_margin_and_a_base_that_is_missing_does_not)
{
    lever_command_t command = command_none();
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    (void)deliver_many(4000u);
    command.request = (uint8_t)LEVER_REQUEST_FREEZE;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)run(100u);
    TEST_ASSERT_NOT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, stability().state);
    for (uint32_t k = 0u; k < 100u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.z_ddot_valid = false;
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, stability().state);
}

TEST(what_is_said_is_the_margin_and_another_aircraft_begins_without_one)
{
    bounce_t *bounce = &lever->bounce;
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    (void)deliver_many(1000u);
    bounce->margin = (margin_t){.gain = 1.0f,
        .gain_sigma = 2.0f,
        .modulus = 3.0f,
        .modulus_sigma = 4.0f,
        .frequency = 5.0f,
        .frequency_sigma = 6.0f};
    bounce->state = (uint8_t)LEVER_BOUNCE_WARNING;
    const lever_stability_t said = stability();
    TEST_ASSERT_TRUE((said.gain_margin == 1.0f) && (said.gain_margin_sigma == 2.0f) && (said.modulus == 3.0f));
    TEST_ASSERT_TRUE((said.modulus_sigma == 4.0f) && (said.frequency == 5.0f) && (said.frequency_sigma == 6.0f));
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, stability().state);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, stability().gain_margin);
    (void)run(1u);
    TEST_ASSERT_TRUE(stability().gain_margin != 0.0f);
}

/* A clock that stands, silence and a reset make an old margin unknown, though an alarm stays; the next samples, known. */
/* R44 */
TEST_EACH(6, a_margin_that_is_not_of_now_is_said_to_be_unknown)
{
    const bool alarm = (test_round >= 3u);
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    (void)run(4000u);
    TEST_ASSERT_TRUE(stability().valid && (stability().state == (uint8_t)LEVER_BOUNCE_CLEAR));
    if (alarm) {
        lever->bounce.state = (uint8_t)LEVER_BOUNCE_ALARM;
    }
    const lever_sample_t standing = sample_after(0u);
    if ((test_round % 3u) == 0u) {
        (void)lever_update(lever, &standing);
    } else if ((test_round % 3u) == 1u) {
        lever_idle(lever, 20001u);
        TEST_ASSERT_EQUAL_UINT8(LEVER_MODE_RUN, health().mode);
    } else {
        request(LEVER_REQUEST_RESET);
    }
    TEST_ASSERT_FALSE(stability().valid);
    TEST_ASSERT_EQUAL_UINT8(alarm ? LEVER_BOUNCE_ALARM : LEVER_BOUNCE_UNKNOWN, stability().state);
    (void)run(((test_round % 3u) == 2u) ? 4000u : 1u);
    TEST_ASSERT_TRUE(stability().valid);
}

/* R44 */
TEST(each_fault_of_sensors_or_model_takes_the_margin_away)
{
    static const uint32_t fault[] = {LEVER_FAULT_THETA, LEVER_FAULT_BASE, LEVER_FAULT_CLOCK, LEVER_FAULT_BOUND,
        LEVER_FAULT_RECOVERED, LEVER_FAULT_MISMATCH, 0u, 0u};
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    (void)deliver_many(4000u);
    for (uint32_t i = 0u; i < 8u; i++) {
        lever->estimator.faults = fault[i];
        lever->estimator.learning.verdict = (uint8_t)((i == 6u) ? VERDICT_HANDS_OFF : VERDICT_LEARNING);
        lever->bounce.time_us -= 1000000u;
        bounce_watch(&lever->bounce, &lever->estimator, lever->link.publish_us);
        TEST_ASSERT_EQUAL(i < 7u, stability().state == (uint8_t)LEVER_BOUNCE_UNKNOWN);
    }
}
