/* Standard deviations against errors: many pilots, many seeds, with default settings. The error over its claimed standard
 * deviation must have an rms of about 1, from the first second on, and the innovations be as large as predicted. With
 * every model and estimator, on a plant that is what the model takes it for. */
#include "rig.h"

enum { RUNS = 20, PARAMETERS = LEVER_PARAMETERS };

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;
static double truth[PARAMETERS];

void setUp(void)
{
    config = rig_config(test_round);
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
    plant->follows_trim = true;
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

/* Rms error in standard deviations at 0.5, 1, 2 and 5 s must be below 1.4 (1 expected; too small is no harm). */
TEST_EACH(RIG_COMBINATIONS, standard_deviations_have_the_size_of_the_errors)
{
    const uint32_t samples[4] = {500u, 500u, 1000u, 3000u};
    double sum[4] = {0.0};
    for (uint32_t run = 0u; run < RUNS; run++) {
        start(run);
        for (uint32_t t = 0u; t < 4u; t++) {
            (void)rig_run(&rig, lever, samples[t]);
            sum[t] += squared_error_in_sigmas();
        }
    }
    for (uint32_t t = 0u; t < 4u; t++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.4, 0.0, sqrt(sum[t] / (double)(RUNS * PARAMETERS)));
    }
}

TEST_EACH(RIG_COMBINATIONS, innovations_are_as_large_as_predicted_and_the_state_as_uncertain_as_said)
{
    double nis = 0.0;
    double sum[2] = {0.0, 0.0};
    start(0u);
    (void)rig_run(&rig, lever, 5000u);
    for (uint32_t k = 0u; k < 10000u; k++) {
        (void)rig_run(&rig, lever, 1u);
        const plant_t *plant = &rig.simulation.plant;
        const lever_estimate_t estimate = rig_estimate(lever);
        const double theta = ((double)estimate.theta - plant->theta) / (double)estimate.theta_sigma;
        const double rate = ((double)estimate.theta_dot - plant->theta_dot) / (double)estimate.theta_dot_sigma;
        sum[0] += theta * theta;
        sum[1] += rate * rate;
        nis += (double)estimate.nis;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2.0, nis / 10000.0);
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 0.0, sqrt(sum[0] / 10000.0)); /* that of the trim level is not in theta's */
    TEST_ASSERT_DOUBLE_WITHIN(1.2, 0.0, sqrt(sum[1] / 10000.0));
}
