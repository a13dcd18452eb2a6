/* The tracker that parts a signal into level and deviation, against the second-order Butterworth high-pass in double. */
#include "filter/detrend.h"

#include "../math/dense.h"
#include "unity.h"

#define CORNER 1.0f    /* [Hz] */
#define PERIOD 1.0e-3f /* [s] */
#define TURN 6.283185307179586

static detrend_t detrend;
static detrend_corner_t corner;

void setUp(void)
{
    detrend_start(&detrend, 0.35f);
    corner = detrend_corner(CORNER);
}

void tearDown(void)
{
}

static void test_a_constant_has_no_deviation(void)
{
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_TRUE(detrend_step(&detrend, 0.35f, &corner, PERIOD) == 0.0f);
    }
    TEST_ASSERT_TRUE(detrend.level == 0.35f);
}

static void test_deviation_is_from_the_level_before_the_value(void)
{
    const float level = detrend.level;
    TEST_ASSERT_TRUE(detrend_step(&detrend, 0.45f, &corner, PERIOD) == 0.45f - level);
}

/* The step response of s^2 / (s^2 + sqrt(2) w s + w^2) is exp(-a t) (cos a t - sin a t) with a = w / sqrt(2). */
static void test_a_step_is_forgotten_like_by_a_butterworth_high_pass(void)
{
    const double a = TURN * (double)CORNER / sqrt(2.0);
    for (uint32_t k = 0u; k < 3000u; k++) {
        const double t = (double)PERIOD * (double)k;
        const double found = (double)detrend_step(&detrend, 0.45f, &corner, PERIOD);
        TEST_ASSERT_DOUBLE_WITHIN(0.1 * 0.01, 0.1 * exp(-a * t) * (cos(a * t) - sin(a * t)), found);
    }
}

static void test_a_ramp_is_followed_without_lag(void)
{
    double deviation = 1.0;
    for (uint32_t k = 0u; k < 5000u; k++) {
        const float value = 0.35f + (0.1f * PERIOD * (float)k);
        deviation = (double)detrend_step(&detrend, value, &corner, PERIOD);
    }
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-4, 0.0, deviation);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 0.1, (double)detrend.slope);
}

/* Amplitude of the deviation of a sine of amplitude 1 after it has settled. */
static double gain_at(double frequency)
{
    double real = 0.0;
    double imaginary = 0.0;
    detrend_start(&detrend, 0.0f);
    for (uint32_t k = 0u; k < 40000u; k++) {
        const double angle = TURN * frequency * (double)PERIOD * (double)k;
        const double deviation = (double)detrend_step(&detrend, (float)sin(angle), &corner, PERIOD);
        if (k >= 20000u) {
            real += deviation * sin(angle) / 10000.0;
            imaginary += deviation * cos(angle) / 10000.0;
        }
    }
    return sqrt((real * real) + (imaginary * imaginary));
}

static void test_gain_over_frequency_is_that_of_a_butterworth_high_pass(void)
{
    const double frequency[] = {0.1, 0.5, 1.0, 2.0, 4.0, 10.0};
    for (uint32_t k = 0u; k < 6u; k++) {
        const double ratio = frequency[k] / (double)CORNER;
        const double wanted = ratio * ratio / sqrt(1.0 + (ratio * ratio * ratio * ratio));
        TEST_ASSERT_DOUBLE_WITHIN(0.01, wanted, gain_at(frequency[k]));
    }
}

/* High-passing and differentiating commute: that is what makes deviations obey the same equation of motion. */
static void test_deviation_of_the_rate_is_the_rate_of_the_deviation(void)
{
    detrend_t rate;
    double last = 0.0;
    detrend_start(&detrend, 0.0f);
    detrend_start(&rate, 0.0f);
    for (uint32_t k = 0u; k < 4000u; k++) {
        const double angle = TURN * 3.0 * (double)PERIOD * (double)k;
        const double deviation = (double)detrend_step(&detrend, (float)(1.0 - cos(angle)), &corner, PERIOD);
        const double middle = TURN * 3.0 * sin(angle - (0.5 * TURN * 3.0 * (double)PERIOD));
        const double rate_deviation = (double)detrend_step(&rate, (float)((k == 0u) ? 0.0 : middle), &corner, PERIOD);
        if (k > 0u) {
            TEST_ASSERT_DOUBLE_WITHIN(0.02 * TURN * 3.0, (deviation - last) / (double)PERIOD, rate_deviation);
        }
        last = deviation;
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_constant_has_no_deviation);
    RUN_TEST(test_deviation_is_from_the_level_before_the_value);
    RUN_TEST(test_a_step_is_forgotten_like_by_a_butterworth_high_pass);
    RUN_TEST(test_a_ramp_is_followed_without_lag);
    RUN_TEST(test_gain_over_frequency_is_that_of_a_butterworth_high_pass);
    RUN_TEST(test_deviation_of_the_rate_is_the_rate_of_the_deviation);
    return UNITY_END();
}
