/* Noise estimated on line: on samples of a linear oscillator with known noise, the state filter told something else. */
#include "filter/noise.h"

#include "kalman.h"
#include "unity.h"

#include <string.h>

enum { SENSITIVITIES = MODEL_STATES * MODEL_PARAMETERS };

#define PERIOD 1.0e-3f
#define THETA_NOISE 1.0e-3
#define THETA_DOT_NOISE 1.0e-2
#define PROCESS_NOISE 0.05

/* Change of theta_dot of a damped oscillator of 4 Hz. */
static const double change_of[2] = {-0.63, -0.015};

static random_source_t source;
static state_filter_t filter;
static noise_estimator_t noise;
static noise_setting_t setting;
static double truth[2];
static double output_scale; /* of the true measurement noise */

void setUp(void)
{
    source.state = 83u;
    truth[0] = 0.0;
    truth[1] = 0.0;
    output_scale = 1.0;
}

void tearDown(void)
{
}

/* The filter is told noise that is so many times the true one. */
static void start(double output_factor, double process_factor)
{
    setting = (noise_setting_t){.window = 1.0f,
        .range = 10.0f,
        .output_noise = {(float)(output_factor * THETA_NOISE), (float)(output_factor * THETA_DOT_NOISE)},
        .process_noise = (float)(process_factor * PROCESS_NOISE)};
    filter = (state_filter_t){.s = {setting.output_noise[0], 0.0f, 0.0f, setting.output_noise[1]},
        .process_noise = {0.0f, setting.process_noise},
        .output_noise = {setting.output_noise[0], setting.output_noise[1]}};
    noise_begin(&noise);
}

static void predict(void)
{
    model_points_t points;
    model_response_t response = {.bend = {0.0f}};
    const double *a = change_of;
    state_filter_points(&filter, &points);
    response.mean = (float)((a[0] * (double)points.x[0]) + (a[1] * (double)points.x[1]));
    for (uint32_t j = (uint32_t)MODEL_PARAMETERS; j < (uint32_t)MODEL_PAIRS; j++) {
        const float *offset = points.offset[j];
        response.difference[j] = (float)(2.0 * ((a[0] * (double)offset[0]) + (a[1] * (double)offset[1])));
    }
    state_filter_predict(&filter, &response, PERIOD);
}

static void move(void)
{
    const double change = (change_of[0] * truth[0]) + (change_of[1] * truth[1]);
    truth[0] += (double)PERIOD * (truth[1] + (0.5 * change));
    truth[1] += change + (PROCESS_NOISE * sqrt((double)PERIOD) * random_normal(&source));
}

/* So many samples, outputs valid as flagged. Returns how often the noise was said to have been far too small. */
static uint32_t run(uint32_t samples, bool theta_valid, bool theta_dot_valid)
{
    uint32_t far_too_small = 0u;
    for (uint32_t k = 0u; k < samples; k++) {
        const spread_t alone = {.a = 1.0f, .d = 1.0f, .inverse = 1.0f}; /* no parameters */
        float sensitivity[SENSITIVITIES] = {0.0f};
        whitened_t whitened;
        predict();
        move();
        measurement_t measurement = {.valid = {theta_valid, theta_dot_valid}};
        measurement.y[0] = (float)(truth[0] + (output_scale * THETA_NOISE * random_normal(&source)));
        measurement.y[1] = (float)(truth[1] + (output_scale * THETA_DOT_NOISE * random_normal(&source)));
        state_filter_update(&filter, &measurement, sensitivity, &whitened);
        noise_gather(&noise, filter.output_noise, &measurement, &whitened, &alone);
        far_too_small += noise_step(&noise, &filter, &setting, PERIOD) ? 1u : 0u;
        TEST_ASSERT_TRUE(state_filter_is_valid(&filter));
    }
    return far_too_small;
}

static void assert_outputs_within(double relative)
{
    TEST_ASSERT_DOUBLE_WITHIN(relative * THETA_NOISE, THETA_NOISE, (double)filter.output_noise[0]);
    TEST_ASSERT_DOUBLE_WITHIN(relative * THETA_DOT_NOISE, THETA_DOT_NOISE, (double)filter.output_noise[1]);
}

static void assert_process_within_a_factor(double factor)
{
    TEST_ASSERT_TRUE((double)filter.process_noise[1] < factor * PROCESS_NOISE);
    TEST_ASSERT_TRUE((double)filter.process_noise[1] > PROCESS_NOISE / factor);
}

/* --- facts ----------------------------------------------------------------------------------------------------------- */

static void test_without_a_window_the_noise_stays_as_set(void)
{
    start(0.1, 10.0);
    setting.window = 0.0f;
    const state_filter_t before = filter;
    TEST_ASSERT_EQUAL_UINT32(0u, run(20000u, true, true));
    TEST_ASSERT_EQUAL_MEMORY(before.output_noise, filter.output_noise, sizeof before.output_noise);
    TEST_ASSERT_EQUAL_MEMORY(before.process_noise, filter.process_noise, sizeof before.process_noise);
}

static void test_within_a_window_nothing_changes(void)
{
    start(0.3, 3.0);
    const state_filter_t before = filter;
    (void)run(900u, true, true);
    TEST_ASSERT_EQUAL_MEMORY(before.output_noise, filter.output_noise, sizeof before.output_noise);
    TEST_ASSERT_EQUAL_MEMORY(before.process_noise, filter.process_noise, sizeof before.process_noise);
    (void)run(200u, true, true);
    TEST_ASSERT_TRUE(filter.output_noise[0] != before.output_noise[0]);
}

static void test_noise_that_is_right_stays_about_there(void)
{
    start(1.0, 1.0);
    for (uint32_t k = 0u; k < 20u; k++) {
        TEST_ASSERT_EQUAL_UINT32(0u, run(5000u, true, true));
        assert_outputs_within(0.1);
        assert_process_within_a_factor(1.7);
    }
}

static void test_noise_that_is_wrong_by_ten_either_way_is_found(void)
{
    const double factors[4][2] = {{10.0, 10.0}, {0.1, 0.1}, {0.1, 10.0}, {10.0, 0.1}};
    for (uint32_t k = 0u; k < 4u; k++) {
        setUp();
        start(factors[k][0], factors[k][1]);
        setting.range = 20.0f;
        (void)run(60000u, true, true);
        assert_outputs_within(0.2);
        assert_process_within_a_factor(2.0);
    }
}

static void test_only_outputs_with_far_too_little_noise_are_said(void)
{
    start(0.1, 1.0);
    TEST_ASSERT_GREATER_THAN_UINT32(0u, run(5000u, true, true));
    start(10.0, 1.0);
    TEST_ASSERT_EQUAL_UINT32(0u, run(60000u, true, true));
}

static void test_noise_that_rises_while_running_is_followed(void)
{
    start(1.0, 1.0);
    (void)run(10000u, true, true);
    output_scale = 4.0;
    (void)run(10000u, true, true);
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * 4.0 * THETA_NOISE, 4.0 * THETA_NOISE, (double)filter.output_noise[0]);
    output_scale = 1.0;
    (void)run(20000u, true, true);
    assert_outputs_within(0.2);
}

static void test_never_leaves_its_range(void)
{
    const double scales[] = {1.0e3, 1.0e-3};
    for (uint32_t k = 0u; k < 2u; k++) {
        setUp();
        start(1.0, 1.0);
        setting.range = 3.0f;
        output_scale = scales[k];
        for (uint32_t repeat = 0u; repeat < 20u; repeat++) {
            (void)run(1000u, true, true);
            for (uint32_t i = 0u; i < 2u; i++) {
                TEST_ASSERT_TRUE(filter.output_noise[i] <= 3.001f * setting.output_noise[i]);
                TEST_ASSERT_TRUE(filter.output_noise[i] >= setting.output_noise[i] / 3.001f);
            }
            TEST_ASSERT_TRUE(filter.process_noise[1] <= 3.001f * setting.process_noise);
            TEST_ASSERT_TRUE(filter.process_noise[1] >= setting.process_noise / 3.001f);
        }
        TEST_ASSERT_FLOAT_WITHIN(
            0.01f, (k == 0u) ? 3.0f : (1.0f / 3.0f), filter.output_noise[0] / setting.output_noise[0]);
    }
}

static void test_an_output_that_is_missing_keeps_its_noise(void)
{
    start(0.5, 1.0);
    (void)run(20000u, true, false);
    TEST_ASSERT_EQUAL_FLOAT(setting.output_noise[1], filter.output_noise[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * THETA_NOISE, THETA_NOISE, (double)filter.output_noise[0]);
    start(0.5, 1.0);
    (void)run(20000u, false, false);
    TEST_ASSERT_EQUAL_FLOAT(setting.output_noise[0], filter.output_noise[0]);
    TEST_ASSERT_EQUAL_FLOAT(setting.process_noise, filter.process_noise[1]);
}

static void test_a_window_that_is_begun_anew_forgets_what_was_in_it(void)
{
    start(1.0, 1.0);
    (void)run(10000u, true, true);
    output_scale = 100.0;
    (void)run(900u, true, true);
    output_scale = 1.0;
    (void)run(50u, true, true);
    noise_begin(&noise);
    TEST_ASSERT_EQUAL_UINT32(0u, run(3000u, true, true));
    assert_outputs_within(0.3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_a_window_the_noise_stays_as_set);
    RUN_TEST(test_within_a_window_nothing_changes);
    RUN_TEST(test_noise_that_is_right_stays_about_there);
    RUN_TEST(test_noise_that_is_wrong_by_ten_either_way_is_found);
    RUN_TEST(test_only_outputs_with_far_too_little_noise_are_said);
    RUN_TEST(test_noise_that_rises_while_running_is_followed);
    RUN_TEST(test_never_leaves_its_range);
    RUN_TEST(test_an_output_that_is_missing_keeps_its_noise);
    RUN_TEST(test_a_window_that_is_begun_anew_forgets_what_was_in_it);
    return UNITY_END();
}
