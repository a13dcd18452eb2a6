/* When the parameters learn, and when they must not: their own rate, frozen, without excitation, coasting. With every model
 * and estimator. */
#include "app/estimator.h"
#include "math/factor.h"
#include "rig.h"

enum { PARAMETERS = LEVER_PARAMETERS };

static uint32_t combination;
static lever_config_t config;
static estimator_t estimator;
static rig_t rig;
static double truth[PARAMETERS];

static void start(void)
{
    TEST_ASSERT_NULL(lever_config_check(&config));
    estimator_init(&estimator, &config);
    rig = rig_of(config.model, truth);
}

void setUp(void)
{
    config = rig_config(combination);
    start();
}

void tearDown(void)
{
}

static enum lever_mode run(uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = rig_sample(&rig);
        mode = estimator_update(&estimator, &sample);
    }
    return mode;
}

static enum lever_mode run_blind(uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.theta_valid = false;
        sample.theta_dot_valid = false;
        mode = estimator_update(&estimator, &sample);
    }
    return mode;
}

static void request(enum lever_request what)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)what;
    TEST_ASSERT_TRUE(estimator_command(&estimator, &command));
}

static lever_estimate_t estimate(void)
{
    lever_estimate_t result;
    estimator_estimate(&estimator, &result);
    return result;
}

/* --- their own rate -------------------------------------------------------------------------------------------------- */

/* The state moves with every sample, the parameters with every `samples`th. */
static void assert_learns_every(uint32_t samples)
{
    uint32_t since = 0u;
    uint32_t learnt = 0u;
    start();
    (void)run(3000u);
    for (uint32_t k = 0u; k < 1000u; k++) {
        const lever_estimate_t before = estimate();
        (void)run(1u);
        const lever_estimate_t after = estimate();
        TEST_ASSERT_TRUE(after.theta_dot != before.theta_dot);
        since++;
        if (memcmp(before.parameter, after.parameter, sizeof before.parameter) != 0) {
            TEST_ASSERT_TRUE((learnt == 0u) || (since == samples));
            since = 0u;
            learnt++;
        }
    }
    TEST_ASSERT_EQUAL_UINT32(1000u / samples, learnt);
}

static void test_parameters_learn_once_a_learn_period(void)
{
    const uint32_t samples[] = {1u, 2u, 10u, 100u};
    for (uint32_t k = 0u; k < 4u; k++) {
        config.settings.learn_period = 1.0e-3f * (float)samples[k];
        assert_learns_every(samples[k]);
    }
}

static void test_a_learn_period_shorter_than_a_sample_learns_from_every_sample(void)
{
    config.settings.learn_period = 0.0f;
    assert_learns_every(1u);
}

/* Less often is not less; it only takes effect later, so that the walk of that time is not yet made up for. */
static void test_what_is_learnt_hardly_depends_on_the_learn_period(void)
{
    const float periods[] = {4.0e-3f, 2.0e-2f};
    config.adaptation = (uint8_t)LEVER_ADAPTATION_FIXED;
    config.settings.change_threshold = 0.0f;
    config.settings.learn_period = 0.0f;
    start();
    (void)run(20000u);
    const lever_estimate_t wanted = estimate();
    for (uint32_t k = 0u; k < 2u; k++) {
        config.settings.learn_period = periods[k];
        start();
        (void)run(20000u);
        const lever_estimate_t found = estimate();
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
            TEST_ASSERT_FLOAT_WITHIN(0.1f * wanted.parameter_sigma[i], wanted.parameter[i], found.parameter[i]);
            TEST_ASSERT_FLOAT_WITHIN(
                0.03f * wanted.parameter_sigma[i], wanted.parameter_sigma[i], found.parameter_sigma[i]);
        }
    }
}

/* --- frozen ---------------------------------------------------------------------------------------------------------- */

static void test_frozen_neither_learns_nor_walks_nor_forgets(void)
{
    for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
        config.adaptation = adaptation;
        start();
        (void)run(2000u);
        request(LEVER_REQUEST_FREEZE);
        const lever_estimate_t before = estimate();
        TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run(2000u));
        const lever_estimate_t after = estimate();
        TEST_ASSERT_EQUAL_MEMORY(before.parameter, after.parameter, sizeof before.parameter);
        TEST_ASSERT_EQUAL_MEMORY(before.parameter_sigma, after.parameter_sigma, sizeof before.parameter_sigma);
        TEST_ASSERT_EQUAL_MEMORY(
            before.parameter_correlation, after.parameter_correlation, sizeof before.parameter_correlation);
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)after.theta_sigma, rig.simulation.plant.theta, (double)after.theta);
    }
}

/* --- without excitation ---------------------------------------------------------------------------------------------- */

static void let_it_rest(void)
{
    rig.simulation.base_rms = 0.0;
    rig.simulation.torque_rms = 0.0;
    rig.simulation.process_noise = 0.0;
}

/* However wildly they walk, and whatever the adaptation: at the floor, no less certain than at the start. */
static void test_without_excitation_nothing_winds_up(void)
{
    const bool is_signed = (config.model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX);
    const parameter_filter_t *parameters = &estimator.dual.parameters;
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        *rig_parameter_setting(&config, i, "_walk") *= 10.0f;
    }
    for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
        config.adaptation = adaptation;
        start();
        (void)run(5000u);
        let_it_rest();
        (void)run(60000u);
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS;
            i++) { /* of w: signed ones count in sigmas of the first guess */
            const float sigma = *rig_parameter_setting(&config, i, "_sigma");
            const float walk = *rig_parameter_setting(&config, i, "_walk") / (is_signed ? sigma : 1.0f);
            const float cap = is_signed ? 1.0f : sigma;
            TEST_ASSERT_FLOAT_WITHIN(1.0e-6f * walk * walk, walk * walk, parameters->walk[i]);
            TEST_ASSERT_TRUE(factor_sigma(parameters->s, (uint32_t)PARAMETERS, i) <= 1.00001f * cap);
        }
        TEST_ASSERT_TRUE(parameters->growth == 0.0f);
        TEST_ASSERT_TRUE((estimator.faults & (uint16_t)LEVER_FAULT_EXCITATION) != 0u);
    }
}

/* What moves the estimate at rest is noise of the sensors, which the next innovation holds, too. */
static void test_without_excitation_nothing_is_learnt(void)
{
    for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
        config.adaptation = adaptation;
        start();
        (void)run(5000u);
        let_it_rest();
        do {
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
        } while ((estimator.faults & (uint16_t)LEVER_FAULT_EXCITATION) == 0u);
        (void)run(20u); /* two learn_periods: what was gathered last is learnt yet */
        const lever_estimate_t before = estimate();
        (void)run(60000u);
        const lever_estimate_t after = estimate();
        TEST_ASSERT_EQUAL_MEMORY(before.parameter, after.parameter, sizeof before.parameter);
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
            TEST_ASSERT_TRUE(after.parameter_sigma[i] > before.parameter_sigma[i]);
        }
    }
}

/* Excitation is presumed until it has been measured, so a little is. */
static void test_at_rest_from_the_start_the_first_guess_stays_within_two_sigma(void)
{
    let_it_rest();
    (void)run(60000u);
    const lever_estimate_t after = estimate();
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        const float guess = *rig_parameter_setting(&config, i, "");
        TEST_ASSERT_FLOAT_WITHIN(2.0f * after.parameter_sigma[i], guess, after.parameter[i]);
    }
}

/* --- coasting -------------------------------------------------------------------------------------------------------- */

static void test_coasting_holds_the_parameters_and_widens_everything(void)
{
    (void)run(10310u);
    const lever_estimate_t before = estimate();
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run_blind(10u)); /* learn_period: what was gathered last is learnt yet */
    const lever_estimate_t learnt = estimate();
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run_blind(390u));
    const lever_estimate_t after = estimate();
    TEST_ASSERT_EQUAL_MEMORY(learnt.parameter, after.parameter, sizeof learnt.parameter);
    TEST_ASSERT_TRUE(after.theta_sigma > 1.5f * before.theta_sigma);
    TEST_ASSERT_TRUE(after.theta_dot_sigma > 1.5f * before.theta_dot_sigma);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_TRUE(after.parameter_sigma[i] > learnt.parameter_sigma[i]);
    }
}

static void test_after_a_minute_of_coasting_it_learns_on(void)
{
    for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
        config.adaptation = adaptation;
        start();
        (void)run(20000u);
        TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run_blind(60000u));
        for (uint32_t k = 0u; k < 10u; k++) {
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1000u));
            const lever_estimate_t after = estimate();
            for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
                const double sigma = (double)after.parameter_sigma[i];
                TEST_ASSERT_DOUBLE_WITHIN(4.0 * sigma, truth[i], (double)after.parameter[i]);
            }
        }
        TEST_ASSERT_EQUAL_UINT32(0u, estimator.recoveries);
    }
}

/* --- what is known of them together ----------------------------------------------------------------------------------- */

/* Without a known force only ratios to the mass show: of models with a mass, all errors then go together. */
static void test_correlations_say_that_a_common_scale_is_not_known(void)
{
    const bool has_mass = (config.model != (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX);
    (void)run(20000u);
    const lever_estimate_t with = estimate();
    start();
    rig.simulation.torque_rms = 0.0;
    (void)run(20000u);
    const lever_estimate_t without = estimate();
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_TRUE(fabsf(with.parameter_correlation[i]) <= 1.0f);
        TEST_ASSERT_TRUE(fabsf(without.parameter_correlation[i]) <= 1.0f);
        TEST_ASSERT_TRUE(!has_mass || (without.parameter_correlation[i] > 0.9f));
        TEST_ASSERT_TRUE(!has_mass || (with.parameter_correlation[i] < without.parameter_correlation[i]));
    }
}

int main(void)
{
    UNITY_BEGIN();
    for (combination = 0u; combination < (uint32_t)RIG_COMBINATIONS; combination++) {
        RIG_RUN_TEST(test_parameters_learn_once_a_learn_period, combination);
        RIG_RUN_TEST(test_a_learn_period_shorter_than_a_sample_learns_from_every_sample, combination);
        RIG_RUN_TEST(test_what_is_learnt_hardly_depends_on_the_learn_period, combination);
        RIG_RUN_TEST(test_frozen_neither_learns_nor_walks_nor_forgets, combination);
        RIG_RUN_TEST(test_without_excitation_nothing_winds_up, combination);
        RIG_RUN_TEST(test_without_excitation_nothing_is_learnt, combination);
        RIG_RUN_TEST(test_at_rest_from_the_start_the_first_guess_stays_within_two_sigma, combination);
        RIG_RUN_TEST(test_coasting_holds_the_parameters_and_widens_everything, combination);
        RIG_RUN_TEST(test_after_a_minute_of_coasting_it_learns_on, combination);
        RIG_RUN_TEST(test_correlations_say_that_a_common_scale_is_not_known, combination);
    }
    return UNITY_END();
}
