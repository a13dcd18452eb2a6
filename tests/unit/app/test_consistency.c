/* Are the standard deviations honest? Many pilots, many seeds, with default settings: the error over its claimed
 * standard deviation must have an rms of about 1, from the first second on, and the innovations be as large as
 * predicted. With every model and estimator, on a plant that is what the model takes it for. */
#include "rig.h"

enum { RUNS = 40, PARAMETERS = LEVER_PARAMETERS };

static uint32_t combination;
static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;
static double truth[PARAMETERS];

void setUp(void)
{
    config = rig_config(combination);
}

void tearDown(void)
{
}

/* A pilot from the filter's own prior, or from within it. */
static void draw_pilot(random_source_t *source)
{
    const double spread[PARAMETERS] = {0.3, 0.4, 0.4};
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        const double guess = (double)*rig_parameter_setting(&config, i, "");
        const double normal = random_normal(source);
        truth[i] = (config.model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX)
                       ? (guess + (0.7 * (double)rig_first_sigma(&config, i) * normal))
                       : (guess * exp(spread[i] * normal));
    }
}

/* Run `run` of many, the base already moving when the first sample comes. */
static void start(uint32_t run)
{
    random_source_t pilot = {1000u + (31u * run)};
    double unused[PARAMETERS];
    rig = rig_of(config.model, unused);
    rig.simulation.source.state = 977u * (run + 1u);
    rig.simulation.time = 0.731 * (double)run;
    draw_pilot(&pilot);
    plant_t *plant = &rig.simulation.plant;
    if (config.model == (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL) {
        *plant = plant_physical(truth[0], truth[1], truth[2]);
    } else if (config.model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX) {
        *plant = plant_black_box(truth[0], truth[1], truth[2]);
    } else if (config.model == (uint8_t)LEVER_MODEL_HAND) {
        *plant = plant_hand(truth[0], truth[1], truth[2]);
    } else {
        plant->m_p = truth[0];
        plant->c_p = truth[1];
        plant->k_p = truth[2];
    }
    plant->follows_trim = (config.preload == (uint8_t)LEVER_PRELOAD_TRIM);
    plant->arm_preload_angle = (double)config.settings.arm_preload_angle;
    for (uint32_t k = 0u; k < 2000u; k++) {
        simulation_advance(&rig.simulation, 1.0e-3);
    }
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
}

/* Sum over the parameters of (error / standard deviation)^2, of their logarithms where they are positive. */
static double squared_error_in_sigmas(void)
{
    const lever_estimate_t estimate = rig_estimate(lever);
    double sum = 0.0;
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        const double found = (double)estimate.parameter[i];
        const double sigma = (double)estimate.parameter_sigma[i];
        const double error = (config.model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX)
                                 ? ((found - truth[i]) / sigma)
                                 : (log(found / truth[i]) * found / sigma);
        sum += error * error;
    }
    return sum;
}

/* Rms error in standard deviations at 0.5, 1, 2, 5 and 10 s must be below 1.4 (1 expected; too small is no harm). */
static void assert_honest(void)
{
    const uint32_t samples[5] = {500u, 500u, 1000u, 3000u, 5000u};
    double sum[5] = {0.0};
    for (uint32_t run = 0u; run < RUNS; run++) {
        start(run);
        for (uint32_t t = 0u; t < 5u; t++) {
            (void)rig_run(&rig, lever, samples[t]);
            sum[t] += squared_error_in_sigmas();
        }
    }
    for (uint32_t t = 0u; t < 5u; t++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.4, 0.0, sqrt(sum[t] / (double)(RUNS * PARAMETERS)));
    }
}

static void test_standard_deviations_are_honest_with_either_preload_and_a_fixed_walk(void)
{
    assert_honest();
    if (config.model != (uint8_t)LEVER_MODEL_HAND) { /* it would need the base's velocity at the start */
        config.preload = (uint8_t)LEVER_PRELOAD_FIXED;
        config.settings.arm_preload_angle = 0.4f;
        assert_honest();
    }
    config = rig_config(combination);
    config.adaptation = (uint8_t)LEVER_ADAPTATION_FIXED;
    assert_honest();
}

static void test_standard_deviations_are_honest_at_five_hundred_samples_a_second(void)
{
    config.settings.sample_period = 2.0e-3f;
    double sum = 0.0;
    for (uint32_t run = 0u; run < RUNS; run++) {
        start(run);
        for (uint32_t k = 0u; k < 2500u; k++) {
            const lever_sample_t sample = rig_sample_after(&rig, 2u);
            (void)lever_update(lever, &sample);
        }
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).lost);
        sum += squared_error_in_sigmas();
    }
    TEST_ASSERT_DOUBLE_WITHIN(1.4, 0.0, sqrt(sum / (double)(RUNS * PARAMETERS)));
}

static void test_innovations_are_as_large_as_predicted_and_the_state_as_uncertain_as_said(void)
{
    double nis = 0.0;
    double sum[2] = {0.0, 0.0};
    start(0u);
    (void)rig_run(&rig, lever, 5000u);
    for (uint32_t k = 0u; k < 50000u; k++) {
        (void)rig_run(&rig, lever, 1u);
        const plant_t *plant = &rig.simulation.plant;
        const lever_estimate_t estimate = rig_estimate(lever);
        const double theta = ((double)estimate.theta - plant->theta) / (double)estimate.theta_sigma;
        const double rate = ((double)estimate.theta_dot - plant->theta_dot) / (double)estimate.theta_dot_sigma;
        sum[0] += theta * theta;
        sum[1] += rate * rate;
        nis += (double)estimate.nis;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2.0, nis / 50000.0);
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 0.0, sqrt(sum[0] / 50000.0)); /* that of the trim level is not in theta's */
    TEST_ASSERT_DOUBLE_WITHIN(1.2, 0.0, sqrt(sum[1] / 50000.0));
}

/* Natural frequency and damping ratio with their own standard deviations, over pilots. */
static void test_dynamics_and_their_sigma_are_honest(void)
{
    double sum[2] = {0.0, 0.0};
    for (uint32_t run = 0u; run < RUNS; run++) {
        start(run);
        (void)rig_run(&rig, lever, 8000u);
        const lever_estimate_t estimate = rig_estimate(lever);
        const double frequency = ((double)estimate.natural_frequency - plant_natural_frequency(&rig.simulation.plant)) /
                                 (double)estimate.natural_frequency_sigma;
        const double ratio = ((double)estimate.damping_ratio - plant_damping_ratio(&rig.simulation.plant)) /
                             (double)estimate.damping_ratio_sigma;
        sum[0] += frequency * frequency;
        sum[1] += ratio * ratio;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1.4, 0.0, sqrt(sum[0] / (double)RUNS));
    TEST_ASSERT_DOUBLE_WITHIN(1.4, 0.0, sqrt(sum[1] / (double)RUNS));
}

int main(void)
{
    UNITY_BEGIN();
    for (combination = 0u; combination < (uint32_t)RIG_COMBINATIONS; combination++) {
        RIG_RUN_TEST(test_standard_deviations_are_honest_with_either_preload_and_a_fixed_walk, combination);
        RIG_RUN_TEST(test_standard_deviations_are_honest_at_five_hundred_samples_a_second, combination);
        RIG_RUN_TEST(test_innovations_are_as_large_as_predicted_and_the_state_as_uncertain_as_said, combination);
        RIG_RUN_TEST(test_dynamics_and_their_sigma_are_honest, combination);
    }
    return UNITY_END();
}
