/* Noise estimated on line: windows by hand, and the limits of what they change. */
#include "filter/noise_estimation.h"

#include "test.h"

static cdkf_t cdkf;
static noise_estimation_t noise;
static noise_setting_t setting;
static bool valid[CDKF_OUTPUTS];

void setUp(void)
{
    setting =
        (noise_setting_t){.window = 1.0f, .range = 10.0f, .output_noise = {1.0e-3f, 1.0e-2f}, .process_noise = 0.05f};
    cdkf = (cdkf_t){.output_noise = {1.0e-3f, 1.0e-2f}, .process_noise = {0.0f, 0.05f}};
    valid[0] = true;
    valid[1] = true;
    noise_estimation_begin(&noise);
}

static void add(const innovation_t innovation[CDKF_OUTPUTS], uint32_t samples)
{
    for (uint32_t n = 0u; n < samples; n++) {
        noise_estimation_add(&noise, innovation, valid);
    }
}

/* A window of innovations of both outputs that are so many times as large as expected, half of it noise. */
static void window_of(float excess)
{
    const innovation_t innovation[CDKF_OUTPUTS] = {
        {.value = excess, .inverse_variance = 1.0f, .noise_variance = 0.5f, .response = 0.0f},
        {.value = excess, .inverse_variance = 1.0f, .noise_variance = 0.5f, .response = 0.0f}};
    add(innovation, 200u);
    (void)noise_estimation_step(&noise, &cdkf, &setting, 1.0f);
}

static void assert_as_set(uint32_t output)
{
    TEST_ASSERT_TRUE(cdkf.output_noise[output] == setting.output_noise[output]);
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
 * Innovations half as large as expected lower R whatever the gain.
 * A factor of 2 of one output is far too small by itself. Limits belong to what is nearer: innovations exactly 3 times
 * too large count by their noise's part (2), exactly as expected leave R to the gain; a gain of exactly 1.15, or by
 * exactly three standard deviations of the regression, is not too little. */
TEST(a_window_changes_the_noise_by_the_stated_formulas)
{
    static const window_t windows[] = {{{8.0f, 1.2f}, -80.0f, 1.0f, {4.0f, 1.02f}, 1.8879f, true},
        {{4.0f, 1.2f}, 16.0f, 1.0f, {1.0f, 1.0f}, 1.5625f, true},
        {{4.0f, 1.2f}, 16.0f, 4.0f, {2.0f, 2.0f}, 1.5625f, true},
        {{1.0f, 0.5f}, 5.0f, 1.0f, {0.95f, 0.95f}, 1.088f, false},
        {{1.0f, 0.5f}, 0.1f, 1.0f, {0.95f, 0.95f}, 10.0f, true},
        {{6.0f, 1.2f}, -80.0f, 1.0f, {2.0f, 1.02f}, 1.0744f, true},
        {{2.0f, 1.2f}, 8.0f, 4.0f, {2.0f, 2.0f}, 1.5625f, true},
        {{3.0f, 1.0f}, 20.0f, 1.0f, {1.05f, 1.0f}, 1.0571f, false},
        {{0.5f, 0.5f}, 2.0f, 1.0f, {0.625f, 0.95f}, 0.97117f, false}};
    for (uint32_t k = 0u; k < (sizeof windows / sizeof windows[0]); k++) {
        const window_t *window = &windows[k];
        const innovation_t innovation[CDKF_OUTPUTS] = {{.value = window->value[0],
                                                           .inverse_variance = 0.25f,
                                                           .noise_variance = 2.0f,
                                                           .response = window->response},
            {.value = window->value[1], .inverse_variance = 1.0f, .noise_variance = 0.5f}};
        setUp();
        for (uint32_t i = 0u; i < 2u; i++) {
            cdkf.output_noise[i] = window->before * setting.output_noise[i];
        }
        add(innovation, 144u);
        TEST_ASSERT_EQUAL(window->too_small, noise_estimation_step(&noise, &cdkf, &setting, 1.0f));
        for (uint32_t i = 0u; i < 2u; i++) {
            TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, window->noise[i], cdkf.output_noise[i] / setting.output_noise[i]);
        }
        TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, window->process, cdkf.process_noise[1] / setting.process_noise);
    }
}

TEST(never_leaves_its_range)
{
    const float excess[] = {1.0e3f, 1.0e-3f};
    setting.range = 3.0f;
    for (uint32_t k = 0u; k < 2u; k++) {
        const float end = (k == 0u) ? 3.0f : (1.0f / 3.0f);
        for (uint32_t repeat = 0u; repeat < 20u; repeat++) {
            window_of(excess[k]);
        }
        TEST_ASSERT_EQUAL_FLOAT(end * setting.output_noise[0], cdkf.output_noise[0]);
        TEST_ASSERT_EQUAL_FLOAT(end * setting.output_noise[1], cdkf.output_noise[1]);
        TEST_ASSERT_EQUAL_FLOAT(end * setting.process_noise, cdkf.process_noise[1]);
    }
}

/* Fewer than twenty samples of an output say nothing of it. */
TEST(an_output_that_is_missing_keeps_its_noise)
{
    const innovation_t innovation[CDKF_OUTPUTS] = {{.value = 2.0f, .inverse_variance = 1.0f, .noise_variance = 0.5f},
        {.value = 2.0f, .inverse_variance = 1.0f, .noise_variance = 0.5f}};
    add(innovation, 19u);
    valid[1] = false;
    add(innovation, 1u);
    (void)noise_estimation_step(&noise, &cdkf, &setting, 1.0f);
    TEST_ASSERT_TRUE(cdkf.output_noise[0] != setting.output_noise[0]);
    assert_as_set(1u);
}
