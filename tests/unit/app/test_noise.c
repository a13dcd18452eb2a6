/* Measurement and process noise, found out on line: whatever the settings say, and within the bounds that they set. With every
 * model and estimator. */
#include "app/estimator.h"
#include "rig.h"

static uint32_t combination;
static lever_config_t config;
static estimator_t estimator;
static rig_t rig;
static double truth[LEVER_PARAMETERS];

void setUp(void)
{
    config = rig_config(combination);
    rig = rig_of(config.model, truth);
}

void tearDown(void)
{
}

/* The simulation's noise, as wrong in the settings as the factors say. */
static void start(double output, double process)
{
    config.settings.theta_noise = (float)(output * rig.simulation.theta_noise);
    config.settings.theta_dot_noise = (float)(output * rig.simulation.theta_dot_noise);
    config.settings.theta_dot_process_noise = (float)(process * rig.simulation.process_noise);
    TEST_ASSERT_NULL(lever_config_check(&config));
    estimator_init(&estimator, &config);
}

static void run(uint32_t samples)
{
    for (uint32_t k = 0u; k < samples; k++) {
        const lever_sample_t sample = rig_sample(&rig);
        (void)estimator_update(&estimator, &sample);
    }
}

static const double wrong[][2] = {{1.0, 1.0}, {3.0, 1.0}, {1.0 / 3.0, 1.0}, {1.0, 3.0}, {1.0, 1.0 / 3.0}, {3.0, 3.0},
    {1.0 / 3.0, 1.0 / 3.0}, {3.0, 1.0 / 3.0}, {1.0 / 3.0, 3.0}};
enum { WRONG = sizeof wrong / sizeof wrong[0] };

/* The simulation's inputs and its dynamics are not quite those of the filter, so process noise is never quite its own. */
static void test_noise_is_found_out_whatever_is_set(void)
{
    for (uint32_t k = 0u; k < (uint32_t)WRONG; k++) {
        setUp();
        start(wrong[k][0], wrong[k][1]);
        run(30000u);
        const state_filter_t *state = &estimator.dual.state;
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, (double)state->output_noise[0] / rig.simulation.theta_noise);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, (double)state->output_noise[1] / rig.simulation.theta_dot_noise);
        TEST_ASSERT_DOUBLE_WITHIN(0.4, 1.0, (double)state->process_noise[1] / rig.simulation.process_noise);
        TEST_ASSERT_EQUAL_UINT32(0u, estimator.recoveries);
    }
}

static void test_without_a_window_noise_stays_as_set(void)
{
    config.settings.noise_window = 0.0f;
    start(3.0, 0.5);
    run(10000u);
    TEST_ASSERT_TRUE(estimator.dual.state.output_noise[0] == config.settings.theta_noise);
    TEST_ASSERT_TRUE(estimator.dual.state.output_noise[1] == config.settings.theta_dot_noise);
    TEST_ASSERT_TRUE(estimator.dual.state.process_noise[1] == config.settings.theta_dot_process_noise);
}

static void test_noise_stays_within_its_range(void)
{
    config.settings.noise_range = 2.0f;
    start(10.0, 1.0);
    run(20000u);
    TEST_ASSERT_FLOAT_WITHIN(
        0.01f * config.settings.theta_noise, 0.5f * config.settings.theta_noise, estimator.dual.state.output_noise[0]);
    TEST_ASSERT_TRUE(estimator.dual.state.process_noise[1] <= 2.0f * config.settings.theta_dot_process_noise);
    TEST_ASSERT_TRUE(estimator.dual.state.process_noise[1] >= 0.5f * config.settings.theta_dot_process_noise);
}

/* A rate sensor that is gone tells nothing of its noise. */
static void test_the_noise_of_a_missing_output_stays(void)
{
    start(1.0, 1.0);
    run(3000u);
    const float before = estimator.dual.state.output_noise[1];
    for (uint32_t k = 0u; k < 10000u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.theta_dot_valid = false;
        (void)estimator_update(&estimator, &sample);
    }
    TEST_ASSERT_FLOAT_WITHIN(0.15f * before, before, estimator.dual.state.output_noise[1]);
}

static void test_a_reset_brings_back_what_is_set(void)
{
    start(3.0, 3.0);
    run(10000u);
    lever_command_t command = rig_command();
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    TEST_ASSERT_TRUE(estimator_command(&estimator, &command));
    TEST_ASSERT_TRUE(estimator.dual.state.output_noise[1] == config.settings.theta_dot_noise);
    TEST_ASSERT_TRUE(estimator.dual.state.process_noise[1] == config.settings.theta_dot_process_noise);
}

/* Parameters that were learnt with noise that was far too small are opened again, not believed. */
static void test_noise_far_too_small_does_not_leave_false_certainty(void)
{
    start(0.1, 0.1);
    run(20000u);
    lever_estimate_t estimate;
    estimator_estimate(&estimator, &estimate);
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        const double sigma = (double)estimate.parameter_sigma[i];
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * sigma, truth[i], (double)estimate.parameter[i]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    for (combination = 0u; combination < (uint32_t)RIG_COMBINATIONS; combination++) {
        RIG_RUN_TEST(test_noise_is_found_out_whatever_is_set, combination);
        RIG_RUN_TEST(test_without_a_window_noise_stays_as_set, combination);
        RIG_RUN_TEST(test_noise_stays_within_its_range, combination);
        RIG_RUN_TEST(test_the_noise_of_a_missing_output_stays, combination);
        RIG_RUN_TEST(test_a_reset_brings_back_what_is_set, combination);
        RIG_RUN_TEST(test_noise_far_too_small_does_not_leave_false_certainty, combination);
    }
    return UNITY_END();
}
