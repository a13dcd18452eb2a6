/* A section against the second-order Butterworth filter, the trim against the sixth-order one: which signals pass it,
 * and what it does when an output is missing. */
#include "filter/trim.h"

#include "../math/dense.h"
#include "unity.h"

#include <complex.h>

#define CORNER 1.0f    /* [Hz] */
#define PERIOD 1.0e-3f /* [s] */
#define TURN 6.283185307179586
#define J ((double complex)I)

static high_pass_t filter;
static high_pass_corner_t corner;
static trim_t trim;

void setUp(void)
{
    corner = high_pass_corner(CORNER, HIGH_PASS_BUTTERWORTH);
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

/* Value k of each signal into the trim; the deviations of theta, theta_dot, z_ddot, tau_m. */
static void pass_all(float signal, float deviation[4])
{
    const float x[MODEL_STATES] = {0.0f, 0.0f};
    const bool valid[MODEL_STATES] = {true, true};
    float y[MODEL_STATES] = {0.35f + signal, signal}; /* the level of theta starts at the trim angle */
    TEST_ASSERT_FALSE(trim_outputs(&trim, x, y, valid, PERIOD));
    deviation[0] = y[0];
    deviation[1] = y[1];
    deviation[2] = trim_input(&trim, 0u, signal, PERIOD);
    deviation[3] = trim_input(&trim, 1u, signal, PERIOD);
}

/* H(s) = 1 / B6(w / s) with the Butterworth polynomial of order six, as tables print it (Weinberg 1962). */
static double complex butterworth(double ratio)
{
    static const double b[7] = {1.0, 3.8637033, 7.4641016, 9.1416202, 7.4641016, 3.8637033, 1.0};
    const double complex s = 1.0 / (J * ratio);
    double complex sum = 0.0;
    for (uint32_t k = 0u; k < 7u; k++) {
        sum = (sum * s) + b[k];
    }
    return 1.0 / sum;
}

/* Gain and phase, of theta with the rounding of an angle of 0.35 rad. */
static void test_every_signal_passes_a_sixth_order_butterworth_high_pass(void)
{
    const double frequency[] = {0.3, 0.5, 1.0, 3.0};
    for (uint32_t f = 0u; f < 4u; f++) {
        double complex found[4] = {0.0, 0.0, 0.0, 0.0};
        const double complex wanted = butterworth(frequency[f] / (double)CORNER);
        setUp();
        for (uint32_t k = 0u; k < 40000u; k++) { /* whole turns in 20 s */
            float deviation[4];
            const double angle = TURN * frequency[f] * (double)PERIOD * (double)k;
            pass_all((float)sin(angle), deviation);
            for (uint32_t i = 0u; (k >= 20000u) && (i < 4u); i++) {
                found[i] += (double)deviation[i] * J * cexp(-J * angle) / 10000.0;
            }
        }
        for (uint32_t i = 0u; i < 4u; i++) {
            TEST_ASSERT_DOUBLE_WITHIN((0.02 * cabs(wanted)) + 1.0e-6, 0.0, cabs(found[i] - wanted));
        }
    }
}

/* Outputs and inputs of a linear system obey it after the same high-pass, too: all four must pass the same. */
static void test_every_signal_passes_the_same_high_pass(void)
{
    for (uint32_t k = 0u; k < 3000u; k++) {
        float deviation[4];
        pass_all((float)sin(TURN * 2.3 * (double)PERIOD * (double)k) + 0.5f, deviation);
        TEST_ASSERT_TRUE((deviation[1] == deviation[2]) && (deviation[1] == deviation[3]));
        TEST_ASSERT_FLOAT_WITHIN(5.0e-6f, deviation[1], deviation[0]);
    }
    trim_set_origin(&trim);
    TEST_ASSERT_TRUE(trim.origin[0] == trim_angle(&trim));
    TEST_ASSERT_FLOAT_WITHIN(5.0e-6f, 0.35f + trim.origin[1], trim.origin[0]);
}

/* The slow part and the deviation make up the signal: the trim angle follows a ramp without lag. */
static void test_the_trim_angle_follows_a_ramp_without_lag(void)
{
    float deviation[4];
    for (uint32_t k = 0u; k < 8000u; k++) {
        pass_all(0.1f * PERIOD * (float)k, deviation);
    }
    TEST_ASSERT_FLOAT_WITHIN(2.0e-4f, 0.0f, deviation[0]);
    TEST_ASSERT_FLOAT_WITHIN(3.0e-4f, 0.35f + 0.8f, trim_angle(&trim));
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
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 0.5f, trim_angle(&trim));
}

static void test_nothing_can_be_learnt_for_nine_tenths_of_the_corners_period(void)
{
    trim_start(&trim, 0.35f, 0.5f, true);
    TEST_ASSERT_EQUAL_FLOAT(1.8f, trim.unsettled);
    trim.unsettled = -1.0f;
    trim_unsettle(&trim);
    TEST_ASSERT_EQUAL_FLOAT(1.8f, trim.unsettled);
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

/* To a level that misses its output, the prediction is the output. */
static void test_a_missing_level_follows_the_prediction_for_20_ms_and_then_waits(void)
{
    trim_t expected = trim;
    for (uint32_t k = 0u; k < 20u; k++) {
        const float x[MODEL_STATES] = {0.0f, 0.0f};
        const bool valid[MODEL_STATES] = {true, true};
        float y[MODEL_STATES] = {0.35f + 0.1f, 0.0f};
        (void)run_without(1u, 1u, 0.1f);
        (void)trim_outputs(&expected, x, y, valid, PERIOD);
        TEST_ASSERT_EQUAL_MEMORY(&expected.output[0], &trim.output[0], sizeof trim.output[0]);
        TEST_ASSERT_FALSE(trim_is_waiting(&trim, 0u));
    }
    (void)run_without(1u, 1u, 0.1f);
    const float level = trim_angle(&trim);
    TEST_ASSERT_TRUE(trim_is_waiting(&trim, 0u) && !trim_is_waiting(&trim, 1u));
    (void)run_without(1u, 1000u, 0.1f);
    TEST_ASSERT_TRUE(trim_angle(&trim) == level);
    for (uint32_t k = 0u; k < (uint32_t)TRIM_SECTIONS; k++) {
        TEST_ASSERT_TRUE(trim.output[0].section[k].slope == 0.0f);
    }
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
        TEST_ASSERT_TRUE(trim_angle(&trim) == 0.35f);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_constant_has_no_deviation_and_a_value_is_compared_with_the_level_before_it);
    RUN_TEST(test_a_step_is_forgotten_as_by_a_butterworth_high_pass);
    RUN_TEST(test_a_ramp_is_followed_without_lag);
    RUN_TEST(test_gain_over_frequency_is_that_of_a_butterworth_high_pass);
    RUN_TEST(test_every_signal_passes_a_sixth_order_butterworth_high_pass);
    RUN_TEST(test_every_signal_passes_the_same_high_pass);
    RUN_TEST(test_the_trim_angle_follows_a_ramp_without_lag);
    RUN_TEST(test_in_preload_fixed_signals_stay_and_only_the_trim_angle_follows);
    RUN_TEST(test_nothing_can_be_learnt_for_nine_tenths_of_the_corners_period);
    RUN_TEST(test_a_missing_level_follows_the_prediction_for_20_ms_and_then_waits);
    RUN_TEST(test_the_end_of_an_outage_is_said_once_and_a_short_one_is_none);
    RUN_TEST(test_a_prediction_that_is_none_does_not_reach_the_level);
    return UNITY_END();
}
