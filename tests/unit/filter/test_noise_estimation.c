/* Noise estimated on line: on samples of a linear oscillator with known noise, when the filter is told
 * something else. */
#include "filter/noise_estimation.h"

#include "pair.h"

#define THETA_NOISE 1.0e-3
#define THETA_DOT_NOISE 1.0e-2
#define PROCESS_NOISE 0.05

static random_source_t source;
static cdkf_t cdkf;
static noise_estimation_t noise;
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

/* The filter, whose parameters make no difference, is told noise that is so many times the true one. */
static void start(double output_factor, double process_factor)
{
    const float origin[2] = {0.0f, 0.0f};
    setting = (noise_setting_t){.window = 1.0f,
        .range = 10.0f,
        .output_noise = {(float)(output_factor * THETA_NOISE), (float)(output_factor * THETA_DOT_NOISE)},
        .process_noise = (float)(process_factor * PROCESS_NOISE)};
    cdkf_init(&cdkf, &pair_model, NULL, &pair_prior);
    cdkf.process_noise[1] = setting.process_noise;
    cdkf.output_noise[0] = setting.output_noise[0];
    cdkf.output_noise[1] = setting.output_noise[1];
    cdkf_start_state(&cdkf, origin, cdkf.output_noise);
    noise_estimation_begin(&noise);
}

/* So many samples, outputs valid as flagged. Returns how often the noise was said to have been far too small. */
static uint32_t run(uint32_t samples, bool theta_valid, bool theta_dot_valid)
{
    const model_step_t step = {.period = PAIR_PERIOD};
    const bool valid[2] = {theta_valid, theta_dot_valid};
    uint32_t far_too_small = 0u;
    double slope[PAIR_Z];
    pair_slopes(&step, slope);
    for (uint32_t k = 0u; k < samples; k++) {
        innovation_t innovation[CDKF_OUTPUTS];
        const double change = (slope[3] * truth[0]) + (slope[4] * truth[1]);
        truth[0] += (double)PAIR_PERIOD * (truth[1] + (0.5 * change));
        truth[1] += change + (PROCESS_NOISE * sqrt((double)PAIR_PERIOD) * random_normal(&source));
        const float y[2] = {(float)(truth[0] + (output_scale * THETA_NOISE * random_normal(&source))),
            (float)(truth[1] + (output_scale * THETA_DOT_NOISE * random_normal(&source)))};
        cdkf_time_update(&cdkf, &pair_model, NULL, &step, pair_no_error, NULL);
        cdkf_measurement_update(&cdkf, y, valid, false, innovation);
        noise_estimation_add(&noise, innovation, valid);
        far_too_small += noise_estimation_step(&noise, &cdkf, &setting, PAIR_PERIOD) ? 1u : 0u;
        TEST_ASSERT_TRUE(cdkf_is_valid(&cdkf));
    }
    return far_too_small;
}

/* Outputs' noise within a part of `scale` times the true one, process noise within a factor. */
static void assert_found(double scale, double relative, double factor)
{
    TEST_ASSERT_DOUBLE_WITHIN(relative, 1.0, (double)cdkf.output_noise[0] / (scale * THETA_NOISE));
    TEST_ASSERT_DOUBLE_WITHIN(relative, 1.0, (double)cdkf.output_noise[1] / (scale * THETA_DOT_NOISE));
    TEST_ASSERT_DOUBLE_WITHIN(log(factor), 0.0, log((double)cdkf.process_noise[1] / PROCESS_NOISE));
}

static void assert_as_set(void)
{
    TEST_ASSERT_TRUE(cdkf.output_noise[0] == setting.output_noise[0]);
    TEST_ASSERT_TRUE(cdkf.output_noise[1] == setting.output_noise[1]);
    TEST_ASSERT_TRUE(cdkf.process_noise[1] == setting.process_noise);
}

static void test_without_a_window_and_within_one_the_noise_stays_as_set(void)
{
    start(0.3, 3.0);
    setting.window = 0.0f;
    TEST_ASSERT_EQUAL_UINT32(0u, run(20000u, true, true));
    assert_as_set();
    start(0.3, 3.0);
    (void)run(990u, true, true);
    assert_as_set();
    (void)run(20u, true, true);
    TEST_ASSERT_TRUE(cdkf.output_noise[0] != setting.output_noise[0]);
}

/* A window by hand: of both outputs, innovation and response to past corrections; output 0 has the variance 4, of which
 * half is noise, output 1 the variance 1, of which half is noise. */
typedef struct window {
    float value[2];
    float response; /* of output 0: gain = 1 + value / response */
    float before;   /* noise of both outputs, in what is set */
    float noise[2]; /* after it, likewise */
    float process;  /* likewise */
    bool too_small;
} window_t;

/* Outputs, enough gain: 4 times too large counts at once; 1.2 times by its noise's part, a half, and a fifth of that.
 * The process noise goes with the geometric mean of the factors 4 and 1.1, and the gain of 0.9.
 * Too little gain, 1.25: innovations 2 and 1.2 times too large leave R, half of what it was raised by (in logarithms)
 * is taken back, and the process noise goes with the square of 1.25.
 * Innovations half as large as expected lower R whatever the gain. */
static void test_a_window_changes_the_noise_by_the_stated_formulas(void)
{
    static const window_t windows[] = {{{8.0f, 1.2f}, -80.0f, 1.0f, {4.0f, 1.02f}, 1.8879f, true},
        {{4.0f, 1.2f}, 16.0f, 1.0f, {1.0f, 1.0f}, 1.5625f, true},
        {{4.0f, 1.2f}, 16.0f, 4.0f, {2.0f, 2.0f}, 1.5625f, true},
        {{1.0f, 0.5f}, 5.0f, 1.0f, {0.95f, 0.95f}, 1.088f, false}};
    const bool valid[CDKF_OUTPUTS] = {true, true};
    for (uint32_t k = 0u; k < 4u; k++) {
        const window_t *window = &windows[k];
        const innovation_t innovation[CDKF_OUTPUTS] = {{.value = window->value[0],
                                                           .inverse_variance = 0.25f,
                                                           .noise_variance = 2.0f,
                                                           .response = window->response},
            {.value = window->value[1], .inverse_variance = 1.0f, .noise_variance = 0.5f}};
        start(1.0, 1.0);
        for (uint32_t i = 0u; i < 2u; i++) {
            cdkf.output_noise[i] = window->before * setting.output_noise[i];
        }
        for (uint32_t n = 0u; n < 200u; n++) {
            noise_estimation_add(&noise, innovation, valid);
        }
        TEST_ASSERT_EQUAL(window->too_small, noise_estimation_step(&noise, &cdkf, &setting, 1.0f));
        for (uint32_t i = 0u; i < 2u; i++) {
            TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, window->noise[i], cdkf.output_noise[i] / setting.output_noise[i]);
        }
        TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, window->process, cdkf.process_noise[1] / setting.process_noise);
    }
}

/* Starved of gain by process noise ten times too small, measurement noise must not take the blame. */
static void test_process_noise_far_too_small_is_found_and_measurement_noise_stays(void)
{
    start(1.0, 0.1);
    setting.range = 20.0f;
    TEST_ASSERT_TRUE(run(3000u, true, true) > 0u);
    for (uint32_t k = 0u; k < 20u; k++) {
        (void)run(1000u, true, true);
        assert_found(1.0, 0.2, 2.0);
    }
}

static void test_noise_that_is_right_stays_about_there(void)
{
    uint32_t far_too_small = 0u;
    start(1.0, 1.0);
    for (uint32_t k = 0u; k < 40u; k++) {
        far_too_small += run(5000u, true, true);
        assert_found(1.0, 0.1, 1.9);
    }
    TEST_ASSERT_TRUE(far_too_small <= 6u); /* of 200 windows: a second teaches little of the gain */
}

static void test_measurement_and_process_noise_wrong_by_ten_either_way_are_found(void)
{
    const double factors[4][2] = {{10.0, 10.0}, {0.1, 0.1}, {0.1, 10.0}, {10.0, 0.1}};
    for (uint32_t k = 0u; k < 4u; k++) {
        setUp();
        start(factors[k][0], factors[k][1]);
        setting.range = 20.0f;
        const uint32_t far_too_small = run(60000u, true, true);
        TEST_ASSERT_TRUE((far_too_small > 0u) || ((factors[k][0] > 1.0) && (factors[k][1] > 1.0)));
        assert_found(1.0, 0.2, 2.0);
    }
}

static void test_noise_that_rises_while_running_is_followed(void)
{
    start(1.0, 1.0);
    (void)run(10000u, true, true);
    output_scale = 4.0;
    (void)run(10000u, true, true);
    assert_found(4.0, 0.2, 4.0);
    output_scale = 1.0;
    (void)run(20000u, true, true);
    assert_found(1.0, 0.2, 2.0);
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
            const float ratios[3] = {cdkf.output_noise[0] / setting.output_noise[0],
                cdkf.output_noise[1] / setting.output_noise[1], cdkf.process_noise[1] / setting.process_noise};
            for (uint32_t i = 0u; i < 3u; i++) {
                TEST_ASSERT_TRUE((ratios[i] <= 3.001f) && (ratios[i] >= (1.0f / 3.001f)));
            }
        }
        const float end = (k == 0u) ? 3.0f : (1.0f / 3.0f);
        TEST_ASSERT_FLOAT_WITHIN(0.01f, end, cdkf.output_noise[0] / setting.output_noise[0]);
    }
}

static void test_an_output_that_is_missing_keeps_its_noise(void)
{
    start(0.5, 1.0);
    (void)run(20000u, true, false);
    TEST_ASSERT_TRUE(cdkf.output_noise[1] == setting.output_noise[1]);
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * THETA_NOISE, THETA_NOISE, (double)cdkf.output_noise[0]);
    start(0.5, 1.0);
    (void)run(20000u, false, false);
    assert_as_set();
}

static void test_a_window_that_is_begun_anew_forgets_what_was_in_it(void)
{
    start(1.0, 1.0);
    (void)run(10000u, true, true);
    output_scale = 100.0;
    (void)run(900u, true, true);
    output_scale = 1.0;
    (void)run(50u, true, true);
    noise_estimation_begin(&noise);
    (void)run(3000u, true, true);
    assert_found(1.0, 0.3, 4.0); /* the state has that noise yet */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_a_window_and_within_one_the_noise_stays_as_set);
    RUN_TEST(test_a_window_changes_the_noise_by_the_stated_formulas);
    RUN_TEST(test_process_noise_far_too_small_is_found_and_measurement_noise_stays);
    RUN_TEST(test_noise_that_is_right_stays_about_there);
    RUN_TEST(test_measurement_and_process_noise_wrong_by_ten_either_way_are_found);
    RUN_TEST(test_noise_that_rises_while_running_is_followed);
    RUN_TEST(test_never_leaves_its_range);
    RUN_TEST(test_an_output_that_is_missing_keeps_its_noise);
    RUN_TEST(test_a_window_that_is_begun_anew_forgets_what_was_in_it);
    return UNITY_END();
}
