/* What breaks is refused, restarted and said; what breaks again and again is a fault that only a reset leaves.
 * Damage is done to the estimator's own memory, as nothing from outside should be able to do it. */
#include "app/instance.h"
#include "rig.h"

static cdkf_t *cdkf;
static lever_memory_t whole; /* as it was when it ran */
static simulation_t then;

static void start_running(uint32_t combination)
{
    config = config_of(combination);
    start();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(2000u));
    cdkf = &lever->estimator.cdkf;
    whole = memory;
    then = simulation;
}

void setUp(void)
{
    start_running(0u);
}

/* So many samples, each with the state's factor broken before it. */
static enum lever_mode run_damaged(uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_RUN;
    for (uint32_t k = 0u; k < count; k++) {
        cdkf->s_xx[0] = NAN;
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
        memory = whole;
        simulation = then;
        time_us = health().samples * (uint32_t)PERIOD_US;
        first[k / 2u] = infinite ? INFINITY : NAN;
        for (uint32_t taken = 0u; taken < samples; taken++) {
            TEST_ASSERT_NOT_EQUAL(LEVER_MODE_FAULT, run(1u));
            said += has_fault(LEVER_FAULT_RECOVERED) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE(infinite || (health().recoveries == 1u));
        TEST_ASSERT_TRUE(cdkf_is_valid(cdkf));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(30u));
        TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_RECOVERED)); /* said of the sample of the restart only */
        TEST_ASSERT_EQUAL_UINT32(said, health().recoveries);
        assert_finite(estimate());
    }
}

/* R13 */
TEST_EACH(LEVER_ESTIMATOR_COUNT, recovers_from_damage_to_any_part_of_the_belief)
{
    start_running(test_round * (uint32_t)LEVER_MODEL_COUNT);
    assert_recovers(cdkf->x, (uint32_t)MODEL_STATES, 1u);
    assert_recovers(&cdkf->s_xx[2], 2u, 1u);
    assert_recovers(&cdkf->s_xx[0], 1u, 1u);
    assert_recovers(cdkf->w, (uint32_t)MODEL_PARAMETERS, 20u);
    assert_recovers(cdkf->walk, (uint32_t)MODEL_PARAMETERS, 20u);
    assert_recovers(&cdkf->growth, 1u, 20u);
    assert_recovers(cdkf->response, (uint32_t)MODEL_STATES, 20u);
    for (uint32_t i = 0u; i < (uint32_t)CDKF_ROWS; i++) { /* above the diagonal nothing is read */
        assert_recovers(&cdkf->s[i * 3u], (i < 3u) ? (i + 1u) : 3u, 20u);
    }
    assert_recovers(cdkf->pending.vector, (uint32_t)MODEL_PARAMETERS, 20u);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        assert_recovers(&cdkf->pending.matrix[i * 4u], 3u - i, 20u);
    }
    for (uint32_t point = 0u; point < (uint32_t)MODEL_POINTS; point++) {
        assert_recovers(cdkf->points[point].c, 3u, 20u);
    }
}

TEST_EACH(COMBINATIONS, restarts_from_the_measurement_and_the_first_guess_or_without_one_at_the_trim_and_at_rest)
{
    start_running(test_round);
    (void)run_damaged(1u);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, simulation.measured_theta, (double)estimate().theta);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, simulation.measured_theta_dot, (double)estimate().theta_dot);
    assert_first_guess();
    cdkf->s_xx[0] = NAN;
    (void)run_blind(1u);
    TEST_ASSERT_EQUAL_UINT32(2u, health().recoveries);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, SIMULATION_TRIM, (double)estimate().theta);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 0.0, (double)estimate().theta_dot);
    TEST_ASSERT_TRUE(cdkf_is_valid(cdkf));
}

/* R13 */
TEST(six_restarts_in_a_row_are_a_fault_and_now_and_then_are_none)
{
    for (uint32_t k = 0u; k < 7u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_damaged(1u));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(3000u));
    }
    setUp();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_damaged(5u));
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run_damaged(1u));
}

/* A tenth of them each second; innovations from before a restart say nothing of the filter after it. */
TEST(restarts_are_forgotten_and_innovations_begin_anew)
{
    evidence_t *evidence = &lever->estimator.learning.evidence;
    evidence->nis_slow = 50.0f;
    (void)run_damaged(1u);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, estimate().nis);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 1.0f, evidence->nis_slow);
    lever->estimator.restarts = 0.8f;
    (void)run(1000u);
    TEST_ASSERT_FLOAT_WITHIN(0.001f, 0.8f * 0.9048f, lever->estimator.restarts);
}

/* R13 */
TEST(only_a_reset_leaves_fault)
{
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run_damaged(6u));
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(2000u));
    const lever_sample_t after_a_gap = sample_after(2000u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, lever_update(lever, &after_a_gap));
    for (uint8_t what = 0u; what < (uint8_t)LEVER_REQUEST_RESET; what++) {
        lever_command_t command = command_none();
        command.request = what;
        (void)lever_command(lever, &command);
        TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(1u));
    }
    time_us = 0u; /* nor a clock that starts anew */
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(1u));
    }
    request(LEVER_REQUEST_RESET);
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, health().mode);
    assert_first_guess();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(310u));
    TEST_ASSERT_EQUAL_UINT32(6u, health().recoveries); /* counts go on */
}

TEST(frozen_survives_a_restart)
{
    request(LEVER_REQUEST_FREEZE);
    (void)run(1u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run_damaged(1u));
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run(100u));
    TEST_ASSERT_EQUAL_UINT32(1u, health().recoveries);
}

/* R9 */
TEST_EACH(COMBINATIONS, an_estimate_beyond_a_bound_is_held_there_and_said)
{
    const model_t *const models[] = {&model_lever, &model_linear_physical, &model_linear_black_box, &model_hand};
    start_running(test_round);
    const float greatest = models[config.model]->parameter[0].greatest;
    cdkf->w[0] = cdkf->scaling.greatest[0] + 1.0f;
    for (uint32_t samples = 0u; !has_fault(LEVER_FAULT_BOUND); samples++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
        TEST_ASSERT_LESS_THAN_UINT32(20u, samples); /* learn_period */
    }
    TEST_ASSERT_FLOAT_WITHIN(2.0e-6f * greatest, greatest, estimate().parameter[0]);
    TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
}

/* An angle a million standard deviations off after an outage is refused, and does not make the average deaf for what
 * comes later: more noise than is set, with no window to find it in. */
TEST(a_huge_innovation_after_an_outage_does_not_spoil_the_average)
{
    config.settings.noise_window = 0.0f;
    start();
    (void)run(2000u);
    request(LEVER_REQUEST_FREEZE);
    (void)run_blind(1u);
    lever_sample_t sample = sample_blind();
    sample.theta += 20.0f;
    sample.theta_valid = true;
    (void)lever_update(lever, &sample);
    TEST_ASSERT_TRUE(isfinite(lever->estimator.learning.evidence.nis_slow) && has_fault(LEVER_FAULT_THETA));
    (void)run(16000u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_INNOVATION));
    simulation.theta_noise *= 4.0;
    simulation.theta_dot_noise *= 4.0;
    (void)run(3000u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_INNOVATION));
    TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
}

/* The level of friction, which would keep what is not a number. */
TEST(a_rate_that_is_none_has_no_friction)
{
    static const float rates[] = {1.0e4f, 1.2e4f, NAN};
    level_t *level = &lever->estimator.trim.input[TRIM_FRICTION];
    const level_t nothing = {.section = {{0.0f, 0.0f}}};
    for (uint32_t i = 0u; i < 3u; i++) {
        setUp();
        *level = nothing;
        lever->estimator.trim.origin[1] = 0.0f;
        cdkf->x[1] = rates[i];
        lever->estimator.last_rate = rates[i];
        (void)run(1u);
        TEST_ASSERT_EQUAL(i == 0u, level->section[0].level > 0.0f);
        TEST_ASSERT_FALSE(isnan(level->section[0].level));
    }
}
