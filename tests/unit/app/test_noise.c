/* Measurement and process noise, found out on line: whatever the settings say, and within the bounds that they set.
 * With every model and estimator. */
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
        (void)estimator_update(&estimator, &sample, 0.0f);
    }
}

/* The simulation's inputs and dynamics are not quite those of the filter, so process noise is never quite its own. */
static void test_noise_is_found_out_whatever_is_set(void)
{
    const double factors[3] = {1.0, 3.0, 1.0 / 3.0};
    for (uint32_t k = 0u; k < 9u; k++) {
        const cdkf_t *cdkf = &estimator.cdkf;
        setUp();
        start(factors[k % 3u], factors[k / 3u]);
        run(30000u);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, (double)cdkf->output_noise[0] / rig.simulation.theta_noise);
        TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0, (double)cdkf->output_noise[1] / rig.simulation.theta_dot_noise);
        TEST_ASSERT_DOUBLE_WITHIN(0.4, 1.0, (double)cdkf->process_noise[1] / rig.simulation.process_noise);
        TEST_ASSERT_EQUAL_UINT32(0u, estimator.recoveries);
    }
}

static void assert_as_set(void)
{
    TEST_ASSERT_TRUE(estimator.cdkf.output_noise[0] == config.settings.theta_noise);
    TEST_ASSERT_TRUE(estimator.cdkf.output_noise[1] == config.settings.theta_dot_noise);
    TEST_ASSERT_TRUE(estimator.cdkf.process_noise[1] == config.settings.theta_dot_process_noise);
}

static void test_without_a_window_and_after_a_reset_noise_is_as_set(void)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    start(3.0, 3.0);
    run(10000u);
    TEST_ASSERT_TRUE(estimator_command(&estimator, &command));
    assert_as_set();
    config.settings.noise_window = 0.0f;
    start(3.0, 0.5);
    run(10000u);
    assert_as_set();
}

static void test_noise_stays_within_its_range(void)
{
    const cdkf_t *cdkf = &estimator.cdkf;
    config.settings.noise_range = 2.0f;
    start(10.0, 1.0);
    run(20000u);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.5f, cdkf->output_noise[0] / config.settings.theta_noise);
    TEST_ASSERT_FLOAT_WITHIN(0.75f, 1.25f, cdkf->process_noise[1] / config.settings.theta_dot_process_noise);
}

/* A rate sensor that is gone tells nothing of its noise. */
static void test_the_noise_of_a_missing_output_stays(void)
{
    start(1.0, 1.0);
    run(3000u);
    const float before = estimator.cdkf.output_noise[1];
    for (uint32_t k = 0u; k < 10000u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.theta_dot_valid = false;
        (void)estimator_update(&estimator, &sample, 0.0f);
    }
    TEST_ASSERT_FLOAT_WITHIN(0.15f * before, before, estimator.cdkf.output_noise[1]);
}

/* Parameters that were learnt with noise that was far too small are opened again, not believed; with the right noise
 * never. */
static void test_noise_far_too_small_does_not_leave_false_certainty(void)
{
    for (uint32_t k = 0u; k < 2u; k++) {
        uint32_t opened = 0u;
        setUp();
        start((k == 0u) ? 0.1 : 1.0, (k == 0u) ? 0.1 : 1.0);
        for (uint32_t sample = 0u; sample < 20000u; sample++) {
            const float trust = estimator.cdkf.trust;
            run(1u);
            opened += (estimator.cdkf.trust < trust) ? 1u : 0u;
        }
        TEST_ASSERT_EQUAL(k == 0u, opened > 0u);
        lever_estimate_t estimate;
        estimator_estimate(&estimator, &estimate);
        rig_assert_within(4.0, truth, estimate);
    }
}

int main(void)
{
    UNITY_BEGIN();
    for (combination = 0u; combination < (uint32_t)RIG_COMBINATIONS; combination++) {
        RIG_RUN_TEST(test_noise_is_found_out_whatever_is_set, combination);
        RIG_RUN_TEST(test_without_a_window_and_after_a_reset_noise_is_as_set, combination);
        RIG_RUN_TEST(test_noise_stays_within_its_range, combination);
        RIG_RUN_TEST(test_the_noise_of_a_missing_output_stays, combination);
        RIG_RUN_TEST(test_noise_far_too_small_does_not_leave_false_certainty, combination);
    }
    return UNITY_END();
}
