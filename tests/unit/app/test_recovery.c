/* What breaks is refused, restarted and said; what breaks again and again is a fault that only a reset leaves. With
 * every model and estimator. Damage is done to the estimator's own memory, as nothing from outside should be able to do
 * it. */
#include "app/estimator.h"
#include "rig.h"

static lever_config_t config;
static estimator_t estimator;
static rig_t rig;
static double truth[LEVER_PARAMETERS];

static enum lever_mode run(uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = rig_sample(&rig);
        mode = estimator_update(&estimator, &sample, 0.0f);
    }
    return mode;
}

static bool has_fault(enum lever_fault fault)
{
    return (estimator.faults & (uint32_t)fault) != 0u;
}

static lever_estimate_t estimate(void)
{
    lever_estimate_t result;
    estimator_estimate(&estimator, &result);
    return result;
}

static void request(enum lever_request what)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)what;
    (void)estimator_command(&estimator, &command);
}

void setUp(void)
{
    config = rig_config(test_round);
    rig = rig_of(config.model, truth);
    estimator_init(&estimator, &config);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(2000u));
}

/* So many samples, each with the state's factor broken before it. */
static enum lever_mode run_damaged(uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_RUN;
    for (uint32_t k = 0u; k < count; k++) {
        estimator.cdkf.s_xx[0] = NAN;
        mode = run(1u);
    }
    return mode;
}

/* NaN in entries of the belief from `first` on is noticed within so many samples: with the state at once, otherwise
 * when a block of samples is learnt. Infinity may be held at a bound instead. */
static void assert_recovers(float *first, uint32_t count, uint32_t samples)
{
    for (uint32_t k = 0u; k < (2u * count); k++) {
        const bool infinite = ((k % 2u) == 1u);
        uint32_t said = 0u;
        setUp();
        first[k / 2u] = infinite ? INFINITY : NAN;
        for (uint32_t taken = 0u; taken < samples; taken++) {
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
            said += has_fault(LEVER_FAULT_RECOVERED) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE(infinite || (estimator.recoveries == 1u));
        TEST_ASSERT_TRUE(cdkf_is_valid(&estimator.cdkf));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(30u));
        TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_RECOVERED)); /* said of the sample of the restart only */
        TEST_ASSERT_EQUAL_UINT32(said, estimator.recoveries);
        rig_assert_finite(estimate());
    }
}

TEST_EACH(RIG_COMBINATIONS, recovers_from_damage_to_any_part_of_the_belief)
{
    cdkf_t *cdkf = &estimator.cdkf;
    assert_recovers(cdkf->x, (uint32_t)MODEL_STATES, 1u);
    assert_recovers(&cdkf->s_xx[2], 2u, 1u);
    assert_recovers(&cdkf->s_xx[0], 1u, 1u);
    assert_recovers(cdkf->w, (uint32_t)MODEL_PARAMETERS, 10u);
    assert_recovers(cdkf->walk, (uint32_t)MODEL_PARAMETERS, 10u);
    assert_recovers(&cdkf->growth, 1u, 10u);
    assert_recovers(cdkf->response, (uint32_t)MODEL_STATES, 10u);
    for (uint32_t i = 0u; i < (uint32_t)CDKF_ROWS; i++) { /* above the diagonal nothing is read */
        assert_recovers(&cdkf->s[i * 3u], (i < 3u) ? (i + 1u) : 3u, 10u);
    }
    assert_recovers(cdkf->pending.vector, (uint32_t)MODEL_PARAMETERS, 10u);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        assert_recovers(&cdkf->pending.matrix[i * 4u], 3u - i, 10u);
    }
    for (uint32_t point = 0u; point < (uint32_t)MODEL_POINTS; point++) {
        assert_recovers(cdkf->points[point].c, 3u, 10u);
    }
}

TEST_EACH(RIG_COMBINATIONS, restarts_from_the_measurement_and_the_first_guess)
{
    (void)run_damaged(1u);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, rig.simulation.theta, (double)estimate().theta);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, rig.simulation.theta_dot, (double)estimate().theta_dot);
    rig_assert_first_guess(&config, estimate());
}

TEST_EACH(RIG_COMBINATIONS, restart_without_a_measurement_begins_at_the_trim_and_at_rest)
{
    const lever_sample_t sample = rig_sample_blind(&rig);
    estimator.cdkf.s_xx[0] = NAN;
    (void)estimator_update(&estimator, &sample, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(1u, estimator.recoveries);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, rig.simulation.plant.trim, (double)estimate().theta);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, (double)estimate().theta_dot);
    TEST_ASSERT_TRUE(cdkf_is_valid(&estimator.cdkf));
}

/* What was not a number for a sample must not make it deaf for what comes later. */
TEST_EACH(RIG_COMBINATIONS, after_a_restart_it_learns_and_notices_a_sudden_grip)
{
    (void)run_damaged(1u);
    (void)run(40000u);
    TEST_ASSERT_DOUBLE_WITHIN(0.0625 * fabs(truth[0]), truth[0], (double)estimate().parameter[0]);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_CHANGE));
    rig_grip(&rig);
    for (uint32_t samples = 0u; !has_fault(LEVER_FAULT_CHANGE); samples++) {
        (void)run(1u);
        TEST_ASSERT_LESS_THAN_UINT32(2000u, samples);
    }
}

TEST_EACH(RIG_COMBINATIONS, six_restarts_in_a_row_are_a_fault_and_now_and_then_are_none)
{
    for (uint32_t k = 0u; k < 20u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_damaged(1u));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(5000u));
    }
    setUp();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_damaged(5u));
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run_damaged(1u));
}

TEST_EACH(RIG_COMBINATIONS, only_a_reset_leaves_fault)
{
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run_damaged(6u));
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(20000u));
    const lever_sample_t after_a_gap = rig_sample_after(&rig, 2000u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, estimator_update(&estimator, &after_a_gap, 0.0f));
    request(LEVER_REQUEST_FREEZE);
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(1u));
    request(LEVER_REQUEST_RUN);
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(1u));
    rig.time_us = 0u; /* nor a clock that starts anew */
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(1u));
    }
    request(LEVER_REQUEST_RESET);
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, estimator.mode);
    rig_assert_first_guess(&config, estimate());
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(310u));
    TEST_ASSERT_EQUAL_UINT32(6u, estimator.recoveries); /* counts go on */
}

TEST_EACH(RIG_COMBINATIONS, frozen_survives_a_restart)
{
    request(LEVER_REQUEST_FREEZE);
    (void)run(1u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run_damaged(1u));
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run(100u));
    TEST_ASSERT_EQUAL_UINT32(1u, estimator.recoveries);
}

TEST_EACH(RIG_COMBINATIONS, an_estimate_beyond_a_bound_is_held_there_and_said)
{
    const model_t *const models[] = {&model_lever, &model_linear_physical, &model_linear_black_box, &model_hand};
    const float greatest = models[config.model]->parameter[0].greatest;
    estimator.cdkf.w[0] = estimator.cdkf.scaling.greatest[0] + 1.0f;
    for (uint32_t samples = 0u; !has_fault(LEVER_FAULT_BOUND); samples++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
        TEST_ASSERT_LESS_THAN_UINT32(20u, samples); /* learn_period */
    }
    TEST_ASSERT_FLOAT_WITHIN(2.0e-6f * greatest, greatest, estimate().parameter[0]);
    TEST_ASSERT_EQUAL_UINT32(0u, estimator.recoveries);
}

/* An angle a million standard deviations off after an outage is refused, and does not make the average deaf for what comes later. */
TEST_EACH(RIG_COMBINATIONS, a_huge_innovation_after_an_outage_does_not_spoil_the_average)
{
    config.settings.noise_window = 0.0f; /* or the noise would be found out */
    config.settings.theta_noise = 1.0e-6f;
    config.settings.theta_dot_noise = 1.0e-5f;
    estimator_init(&estimator, &config);
    rig.simulation.theta_noise = 1.0e-6;
    rig.simulation.theta_dot_noise = 1.0e-5;
    (void)run(2000u);
    request(LEVER_REQUEST_FREEZE);
    lever_sample_t sample = rig_sample_blind(&rig);
    (void)estimator_update(&estimator, &sample, 0.0f);
    sample = rig_sample_blind(&rig);
    sample.theta += 2.0f;
    sample.theta_valid = true;
    (void)estimator_update(&estimator, &sample, 0.0f);
    TEST_ASSERT_TRUE(isfinite(estimator.averages.innovation) && has_fault(LEVER_FAULT_THETA));
    (void)run(16000u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_INNOVATION));
    rig.simulation.theta_noise *= 4.0;
    rig.simulation.theta_dot_noise *= 4.0;
    (void)run(3000u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_INNOVATION));
    TEST_ASSERT_EQUAL_UINT32(0u, estimator.recoveries);
}
