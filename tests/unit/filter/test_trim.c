/* The high-pass against the second-order Butterworth filter in double, and the trim: which signals pass it, and what it
 * does when an output is missing. */
#include "filter/trim.h"

#include "../math/dense.h"
#include "unity.h"

#define CORNER 1.0f    /* [Hz] */
#define PERIOD 1.0e-3f /* [s] */
#define TURN 6.283185307179586

static high_pass_t filter;
static high_pass_corner_t corner;
static trim_t trim;

void setUp(void)
{
    corner = high_pass_corner(CORNER);
    filter = (high_pass_t){.level = 0.35f};
    trim_start(&trim, 0.35f, CORNER, true);
}

void tearDown(void)
{
}

/* --- high-pass ---------------------------------------------------------------------------------------------------- */

static double step_with(float value)
{
    return (double)high_pass_step(&filter, value, &corner, PERIOD);
}

static void test_a_constant_has_no_deviation_and_a_value_is_compared_with_the_level_before_it(void)
{
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_TRUE(step_with(0.35f) == 0.0);
    }
    TEST_ASSERT_TRUE(step_with(0.45f) == (double)(0.45f - 0.35f));
}

/* The step response of s^2 / (s^2 + sqrt(2) w s + w^2) is exp(-a t) (cos a t - sin a t) with a = w / sqrt(2). */
static void test_a_step_is_forgotten_as_by_a_butterworth_high_pass(void)
{
    const double a = TURN * (double)CORNER / sqrt(2.0);
    for (uint32_t k = 0u; k < 3000u; k++) {
        const double t = (double)PERIOD * (double)k;
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 0.1 * exp(-a * t) * (cos(a * t) - sin(a * t)), step_with(0.45f));
    }
}

static void test_a_ramp_is_followed_without_lag(void)
{
    double deviation = 1.0;
    for (uint32_t k = 0u; k < 5000u; k++) {
        deviation = step_with(0.35f + (0.1f * PERIOD * (float)k));
    }
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-4, 0.0, deviation);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 0.1f, filter.slope);
}

static void test_gain_over_frequency_is_that_of_a_butterworth_high_pass(void)
{
    const double frequency[] = {0.1, 0.5, 1.0, 2.0, 4.0, 10.0};
    for (uint32_t f = 0u; f < 6u; f++) {
        const double ratio = frequency[f] / (double)CORNER;
        double real = 0.0;
        double imaginary = 0.0;
        filter = (high_pass_t){.level = 0.0f};
        for (uint32_t k = 0u; k < 40000u; k++) {
            const double angle = TURN * frequency[f] * (double)PERIOD * (double)k;
            const double deviation = step_with((float)sin(angle));
            real += (k < 20000u) ? 0.0 : (deviation * sin(angle) / 10000.0);
            imaginary += (k < 20000u) ? 0.0 : (deviation * cos(angle) / 10000.0);
        }
        const double wanted = ratio * ratio / sqrt(1.0 + (ratio * ratio * ratio * ratio));
        TEST_ASSERT_DOUBLE_WITHIN(0.01, wanted, hypot(real, imaginary));
    }
}

/* --- trim --------------------------------------------------------------------------------------------------------- */

/* Outputs and inputs of a linear system obey it after the same high-pass, too: all four must pass the same. */
static void test_every_signal_passes_the_same_high_pass(void)
{
    const float x[MODEL_STATES] = {0.0f, 0.0f};
    const bool valid[MODEL_STATES] = {true, true};
    filter = (high_pass_t){.level = 0.0f};
    for (uint32_t k = 0u; k < 3000u; k++) {
        const float signal = (float)sin(TURN * 2.3 * (double)PERIOD * (double)k) + 0.5f;
        const float wanted = high_pass_step(&filter, signal, &corner, PERIOD);
        float y[MODEL_STATES] = {0.35f + signal, signal}; /* the level of theta starts at the trim angle */
        TEST_ASSERT_TRUE(trim_input(&trim, 0u, signal, PERIOD) == wanted);
        TEST_ASSERT_TRUE(trim_input(&trim, 1u, signal, PERIOD) == wanted);
        TEST_ASSERT_FALSE(trim_outputs(&trim, x, y, valid, PERIOD));
        TEST_ASSERT_TRUE(y[1] == wanted);
        TEST_ASSERT_FLOAT_WITHIN(2.0e-6f, wanted, y[0]);
    }
    trim_set_origin(&trim);
    TEST_ASSERT_TRUE((trim.origin[0] == trim.output[0].level) && (trim.origin[1] == trim.output[1].level));
}

static void test_in_preload_fixed_signals_stay_and_only_the_trim_angle_follows(void)
{
    const float x[MODEL_STATES] = {0.0f, 0.0f};
    const bool valid[MODEL_STATES] = {true, true};
    trim_start(&trim, 0.35f, CORNER, false);
    TEST_ASSERT_TRUE(trim.unsettled == 0.0f);
    for (uint32_t k = 0u; k < 5000u; k++) {
        float y[MODEL_STATES] = {0.5f, 0.25f};
        (void)trim_outputs(&trim, x, y, valid, PERIOD);
        TEST_ASSERT_TRUE((y[0] == 0.5f) && (y[1] == 0.25f) && (trim_input(&trim, 0u, 3.0f, PERIOD) == 3.0f));
    }
    trim_set_origin(&trim);
    TEST_ASSERT_TRUE((trim.origin[0] == 0.0f) && (trim.origin[1] == 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 0.5f, trim.output[0].level);
}

static void test_nothing_can_be_learnt_for_one_over_the_corner(void)
{
    trim_start(&trim, 0.35f, 0.5f, true);
    TEST_ASSERT_EQUAL_FLOAT(2.0f, trim.unsettled);
    trim.unsettled = -1.0f;
    trim_unsettle(&trim);
    TEST_ASSERT_EQUAL_FLOAT(2.0f, trim.unsettled);
}

/* --- outages ------------------------------------------------------------------------------------------------------ */

/* So many samples with only theta_dot valid (1), only theta (0), or neither (2); the last answer of trim_outputs(). */
static bool run_without(uint32_t missing, uint32_t samples, float x0)
{
    bool back = false;
    for (uint32_t k = 0u; k < samples; k++) {
        const float x[MODEL_STATES] = {x0, 0.0f};
        const bool valid[MODEL_STATES] = {missing == 0u, missing == 1u};
        float y[MODEL_STATES] = {0.35f, 0.0f};
        back = trim_outputs(&trim, x, y, valid, PERIOD);
    }
    return back;
}

static void test_a_missing_level_follows_the_prediction_for_20_ms_and_then_waits(void)
{
    high_pass_t expected = trim.output[0];
    for (uint32_t k = 0u; k < 20u; k++) {
        (void)run_without(1u, 1u, 0.1f);
        (void)high_pass_step(&expected, 0.35f + 0.1f, &corner, PERIOD);
        TEST_ASSERT_TRUE((trim.output[0].level == expected.level) && !trim_is_waiting(&trim, 0u));
    }
    (void)run_without(1u, 1u, 0.1f);
    const float level = trim.output[0].level;
    TEST_ASSERT_TRUE(trim_is_waiting(&trim, 0u) && !trim_is_waiting(&trim, 1u));
    (void)run_without(1u, 1000u, 0.1f);
    TEST_ASSERT_TRUE((trim.output[0].level == level) && (trim.output[0].slope == 0.0f));
}

static void test_the_end_of_an_outage_is_said_once_and_a_short_one_is_none(void)
{
    (void)run_without(2u, 20u, 0.0f);
    TEST_ASSERT_FALSE(run_without(0u, 1u, 0.0f));
    (void)run_without(2u, 30u, 0.0f);
    TEST_ASSERT_TRUE(trim_is_waiting(&trim, 0u) && trim_is_waiting(&trim, 1u));
    TEST_ASSERT_TRUE(run_without(0u, 1u, 0.0f));
    TEST_ASSERT_FALSE(run_without(0u, 1u, 0.0f));
    TEST_ASSERT_TRUE(run_without(1u, 1u, 0.0f)); /* the other comes back later */
}

static void test_a_prediction_that_is_none_does_not_reach_the_level(void)
{
    const float wild[] = {NAN, INFINITY, -INFINITY, 1.0e30f};
    for (uint32_t k = 0u; k < 4u; k++) {
        setUp();
        (void)run_without(1u, 5u, wild[k]);
        TEST_ASSERT_TRUE(trim.output[0].level == 0.35f);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_constant_has_no_deviation_and_a_value_is_compared_with_the_level_before_it);
    RUN_TEST(test_a_step_is_forgotten_as_by_a_butterworth_high_pass);
    RUN_TEST(test_a_ramp_is_followed_without_lag);
    RUN_TEST(test_gain_over_frequency_is_that_of_a_butterworth_high_pass);
    RUN_TEST(test_every_signal_passes_the_same_high_pass);
    RUN_TEST(test_in_preload_fixed_signals_stay_and_only_the_trim_angle_follows);
    RUN_TEST(test_nothing_can_be_learnt_for_one_over_the_corner);
    RUN_TEST(test_a_missing_level_follows_the_prediction_for_20_ms_and_then_waits);
    RUN_TEST(test_the_end_of_an_outage_is_said_once_and_a_short_one_is_none);
    RUN_TEST(test_a_prediction_that_is_none_does_not_reach_the_level);
    return UNITY_END();
}
