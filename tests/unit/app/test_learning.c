/* When the parameters learn, and when they must not: their own rate, frozen, without excitation, coasting. With every
 * model and estimator. */
#include "app/estimator.h"
#include "math/factor.h"
#include "rig.h"

enum { PARAMETERS = LEVER_PARAMETERS };

static lever_config_t config;
static estimator_t estimator;
static rig_t rig;
static double truth[PARAMETERS];

static void start(uint8_t adaptation)
{
    config.adaptation = adaptation;
    TEST_ASSERT_NULL(lever_config_check(&config));
    estimator_init(&estimator, &config);
    rig = rig_of(config.model, truth);
}

void setUp(void)
{
    config = rig_config(test_round);
    start((uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
}

static enum lever_mode run(uint32_t count, bool blind)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = blind ? rig_sample_blind(&rig) : rig_sample(&rig);
        mode = estimator_update(&estimator, &sample, 0.0f);
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

static void assert_same_parameters(const lever_estimate_t *before, const lever_estimate_t *after)
{
    TEST_ASSERT_EQUAL_MEMORY(before->parameter, after->parameter, sizeof before->parameter);
}

static void assert_less_certain(const lever_estimate_t *before, const lever_estimate_t *after)
{
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_TRUE(after->parameter_sigma[i] > before->parameter_sigma[i]);
    }
}

/* --- their own rate ----------------------------------------------------------------------------------------------- */

/* The state moves with every sample, the parameters with the last sample of each block. */
TEST_EACH(RIG_COMBINATIONS, parameters_learn_once_a_learn_period_and_move_at_that_sample)
{
    const float periods[] = {0.0f, 1.0e-3f, 2.0e-3f, 1.0e-2f, 0.1f};
    const uint32_t samples[] = {1u, 1u, 2u, 10u, 100u};
    for (uint32_t k = 0u; k < 5u; k++) {
        config.settings.learn_period = periods[k];
        start((uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
        (void)run(3000u, false);
        uint32_t since = 0u;
        uint32_t learnt = 0u;
        for (uint32_t sample = 0u; sample < 1000u; sample++) {
            const lever_estimate_t before = estimate();
            (void)run(1u, false);
            const lever_estimate_t after = estimate();
            TEST_ASSERT_TRUE(after.theta_dot != before.theta_dot);
            since++;
            if (memcmp(before.parameter, after.parameter, sizeof before.parameter) != 0) {
                TEST_ASSERT_TRUE((learnt == 0u) || (since == samples[k]));
                since = 0u;
                learnt++;
            }
        }
        TEST_ASSERT_EQUAL_UINT32(1000u / samples[k], learnt);
    }
}

/* --- frozen ------------------------------------------------------------------------------------------------------- */

TEST_EACH(RIG_COMBINATIONS, frozen_neither_learns_nor_walks_nor_forgets)
{
    for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
        start(adaptation);
        (void)run(2000u, false);
        request(LEVER_REQUEST_FREEZE);
        const lever_estimate_t before = estimate();
        TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run(2000u, false));
        const lever_estimate_t after = estimate();
        assert_same_parameters(&before, &after);
        TEST_ASSERT_EQUAL_MEMORY(before.parameter_sigma, after.parameter_sigma, sizeof before.parameter_sigma);
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)after.theta_sigma, rig.simulation.plant.theta, (double)after.theta);
        request(LEVER_REQUEST_RUN);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(19u, false)); /* a block begins when it is left */
        const lever_estimate_t left = estimate();
        assert_same_parameters(&before, &left);
        (void)run(1u, false);
        TEST_ASSERT_TRUE(estimate().parameter[0] != before.parameter[0]);
    }
}

/* --- without excitation ------------------------------------------------------------------------------------------- */

/* However wildly they walk, and whatever the adaptation: at the floor, no less certain than at the start. */
TEST_EACH(RIG_COMBINATIONS, without_excitation_nothing_winds_up)
{
    const bool is_signed = (config.model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX);
    const cdkf_t *cdkf = &estimator.cdkf;
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        *rig_parameter_setting(&config, i, "_walk") *= 10.0f;
    }
    for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
        start(adaptation);
        (void)run(5000u, false);
        rig_let_rest(&rig);
        (void)run(60000u, false);
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS;
            i++) { /* w of signed ones counts in sigmas of the first guess */
            const float sigma = *rig_parameter_setting(&config, i, "_sigma");
            const float walk = *rig_parameter_setting(&config, i, "_walk") / (is_signed ? sigma : 1.0f);
            TEST_ASSERT_FLOAT_WITHIN(1.0e-6f * walk * walk, walk * walk, cdkf->walk[i]);
            TEST_ASSERT_TRUE(factor_sigma(cdkf->s, (uint32_t)PARAMETERS, i) <= 1.00001f * (is_signed ? 1.0f : sigma));
        }
        TEST_ASSERT_TRUE(cdkf->growth == 0.0f);
        TEST_ASSERT_TRUE((estimator.faults & (uint32_t)LEVER_FAULT_EXCITATION) != 0u);
    }
}

/* What moves the estimate at rest is noise of the sensors, which the next innovation holds, too. */
TEST_EACH(RIG_COMBINATIONS, without_excitation_nothing_is_learnt)
{
    for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
        start(adaptation);
        (void)run(5000u, false);
        rig_let_rest(&rig);
        do {
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u, false));
        } while ((estimator.faults & (uint32_t)LEVER_FAULT_EXCITATION) == 0u);
        (void)run(20u, false); /* learn_period: what is pending is learnt yet */
        const lever_estimate_t before = estimate();
        (void)run(60000u, false);
        const lever_estimate_t after = estimate();
        assert_same_parameters(&before, &after);
        assert_less_certain(&before, &after);
    }
}

/* --- coasting ----------------------------------------------------------------------------------------------------- */

TEST_EACH(RIG_COMBINATIONS, coasting_holds_the_parameters_and_widens_everything)
{
    start((uint8_t)LEVER_ADAPTATION_FORGETTING);
    (void)run(10310u, false);
    const lever_estimate_t before = estimate();
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run(20u, true)); /* learn_period: what is pending is learnt yet */
    const lever_estimate_t learnt = estimate();
    TEST_ASSERT_TRUE(estimator.cdkf.growth == 0.0f); /* what cannot be learnt again is not forgotten */
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run(380u, true));
    const lever_estimate_t after = estimate();
    assert_same_parameters(&learnt, &after);
    assert_less_certain(&learnt, &after);
    TEST_ASSERT_TRUE(after.theta_sigma > 1.5f * before.theta_sigma);
    TEST_ASSERT_TRUE(after.theta_dot_sigma > 1.5f * before.theta_dot_sigma);
}

/* The state starts anew where it is measured. Until the levels have settled, 0.9 / trim_corner, nothing is learnt, as
 * at the start, and SETTLING says so. */
TEST_EACH(RIG_COMBINATIONS, after_an_outage_the_state_is_the_measurement_and_the_levels_settle_first)
{
    for (uint32_t k = 0u; k < 2u; k++) {
        (void)run((k == 0u) ? 301u : 5000u, false);
        (void)run((k == 0u) ? 0u : 1000u, true);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u, false));
        const lever_estimate_t before = estimate();
        const double theta = 3.0 * (double)config.settings.theta_noise;
        TEST_ASSERT_DOUBLE_WITHIN(theta, rig.simulation.plant.theta, (double)before.theta);
        const double theta_dot = 5.0 * (double)config.settings.theta_dot_noise;
        TEST_ASSERT_DOUBLE_WITHIN(theta_dot, rig.simulation.plant.theta_dot, (double)before.theta_dot);
        (void)run(880u, false);
        const lever_estimate_t settled = estimate();
        assert_same_parameters(&before, &settled);
        TEST_ASSERT_TRUE((estimator.faults & (uint32_t)LEVER_FAULT_SETTLING) != 0u);
        (void)run(50u, false); /* settled, and the end of a block */
        TEST_ASSERT_TRUE(estimate().parameter[0] != before.parameter[0]);
        TEST_ASSERT_TRUE((estimator.faults & (uint32_t)LEVER_FAULT_SETTLING) == 0u);
    }
}

/* --- what is known of them together ------------------------------------------------------------------------------- */
