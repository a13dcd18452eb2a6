/* What breaks is refused, restarted and said; what breaks again and again is a fault that only a reset leaves. With every
 * model and estimator. Damage is done to the estimator's own memory, as nothing that comes in from outside should be able to
 * do it. */
#include "app/estimator.h"
#include "rig.h"

static uint32_t combination;
static lever_config_t config;
static estimator_t estimator;
static rig_t rig;
static double truth[LEVER_PARAMETERS];

static enum lever_mode run(uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = rig_sample(&rig);
        mode = estimator_update(&estimator, &sample);
    }
    return mode;
}

static lever_health_t health(void)
{
    lever_health_t result;
    estimator_health(&estimator, &result);
    return result;
}

void setUp(void)
{
    config = rig_config(combination);
    rig = rig_of(config.model, truth);
    estimator_init(&estimator, &config);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(2000u));
}

void tearDown(void)
{
}

/* One sample with the state's factor broken before it. */
static enum lever_mode run_damaged(void)
{
    estimator.dual.state.s[0] = NAN;
    return run(1u);
}

static enum lever_mode run_into_fault(void)
{
    enum lever_mode mode = LEVER_MODE_RUN;
    for (uint32_t k = 0u; k < 6u; k++) {
        mode = run_damaged();
    }
    return mode;
}

static void assert_recovers(float *entry, float value)
{
    setUp();
    *entry = value;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
    TEST_ASSERT_EQUAL_UINT32(1u, health().recoveries);
    TEST_ASSERT_TRUE((health().faults & (uint16_t)LEVER_FAULT_RECOVERED) != 0u);
    TEST_ASSERT_TRUE(dual_is_valid(&estimator.dual));
}

static void test_recovers_from_damage_to_any_factor_or_estimate(void)
{
    dual_t *dual = &estimator.dual;
    for (uint32_t k = 0u; k < 4u; k++) {
        if (k != 1u) { /* above the diagonal: not read */
            assert_recovers(&dual->state.s[k], NAN);
            assert_recovers(&dual->state.s[k], INFINITY);
        }
    }
    for (uint32_t k = 0u; k < (uint32_t)(PARAMETER_FILTER_ROWS * MODEL_PARAMETERS); k++) {
        assert_recovers(&dual->parameters.s[k], NAN);
    }
    for (uint32_t k = 0u; k < 2u; k++) {
        assert_recovers(&dual->state.x[k], NAN);
        assert_recovers(&dual->state.x[k], INFINITY);
    }
    for (uint32_t k = 0u; k < (uint32_t)MODEL_PARAMETERS; k++) {
        assert_recovers(&dual->parameters.w[k], NAN);
        assert_recovers(&dual->parameters.walk[k], NAN);
    }
}

/* What is gathered, and the points of the parameters, show when they are used: when what the next block of samples says is
 * adopted. */
static void assert_recovers_within_two_blocks(float *entry)
{
    setUp();
    *entry = NAN;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(20u));
    TEST_ASSERT_EQUAL_UINT32(1u, health().recoveries);
    TEST_ASSERT_TRUE(dual_is_valid(&estimator.dual));
}

static void test_recovers_from_damage_to_what_is_gathered_and_to_the_points(void)
{
    parameter_filter_t *parameters = &estimator.dual.parameters;
    for (uint32_t k = 0u; k < (uint32_t)MODEL_PARAMETERS; k++) {
        assert_recovers_within_two_blocks(&parameters->gathered.score[k]);
    }
    for (uint32_t k = 0u; k < (uint32_t)INFORMATION_SIZE; k++) {
        assert_recovers_within_two_blocks(&parameters->gathered.upper[k]);
    }
    for (uint32_t point = 0u; point < (uint32_t)MODEL_PARAMETER_POINTS; point++) {
        for (uint32_t k = 0u; k < (uint32_t)MODEL_COEFFICIENTS; k++) {
            assert_recovers_within_two_blocks(&parameters->arm[point].coefficient[k]);
        }
    }
    assert_recovers_within_two_blocks(&parameters->growth);
}

static void test_restarts_from_the_measurement_and_the_first_guess(void)
{
    (void)run_damaged();
    lever_estimate_t estimate;
    estimator_estimate(&estimator, &estimate);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, rig.simulation.theta, (double)estimate.theta);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, rig.simulation.theta_dot, (double)estimate.theta_dot);
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        TEST_ASSERT_EQUAL_FLOAT(*rig_parameter_setting(&config, i, ""), estimate.parameter[i]);
        TEST_ASSERT_EQUAL_FLOAT(rig_first_sigma(&config, i), estimate.parameter_sigma[i]);
    }
}

static void test_restart_without_a_measurement_begins_at_the_trim_and_at_rest(void)
{
    lever_sample_t sample = rig_sample(&rig);
    sample.theta_valid = false;
    sample.theta_dot_valid = false;
    estimator.dual.state.s[0] = NAN;
    (void)estimator_update(&estimator, &sample);
    lever_estimate_t estimate;
    estimator_estimate(&estimator, &estimate);
    TEST_ASSERT_EQUAL_UINT32(1u, health().recoveries);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, rig.simulation.plant.trim, (double)estimate.theta);
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 0.0, (double)estimate.theta_dot);
    TEST_ASSERT_TRUE(dual_is_valid(&estimator.dual));
}

static void test_recovered_is_said_of_the_sample_of_the_restart_only(void)
{
    (void)run_damaged();
    (void)run(1u);
    TEST_ASSERT_EQUAL_UINT16(0u, health().faults & (uint16_t)LEVER_FAULT_RECOVERED);
    TEST_ASSERT_EQUAL_UINT32(1u, health().recoveries);
}

static void test_learns_again_after_a_restart(void)
{
    (void)run_damaged();
    (void)run(40000u);
    lever_estimate_t estimate;
    estimator_estimate(&estimator, &estimate);
    TEST_ASSERT_DOUBLE_WITHIN(0.0625 * fabs(truth[0]), truth[0], (double)estimate.parameter[0]);
}

/* What was not a number for a sample must not make it deaf for what comes later. */
static void test_notices_a_sudden_grip_after_a_restart(void)
{
    (void)run_damaged();
    (void)run(20000u);
    TEST_ASSERT_EQUAL_UINT16(0u, health().faults & (uint16_t)LEVER_FAULT_CHANGE);
    plant_t *plant = &rig.simulation.plant;
    plant->k_p *= 2.0;
    plant->linear.stiffness *= 2.0;
    uint32_t samples = 0u;
    while ((health().faults & (uint16_t)LEVER_FAULT_CHANGE) == 0u) {
        (void)run(1u);
        samples++;
        TEST_ASSERT_LESS_THAN_UINT32(2000u, samples);
    }
}

static void test_six_restarts_in_a_row_are_a_fault(void)
{
    for (uint32_t k = 0u; k < 5u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_damaged());
    }
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run_damaged());
}

static void test_restarts_now_and_then_are_no_fault(void)
{
    for (uint32_t k = 0u; k < 20u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_damaged());
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(5000u));
    }
}

static void test_good_samples_do_not_leave_fault(void)
{
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run_into_fault());
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(20000u));
}

static void test_a_long_gap_does_not_leave_fault(void)
{
    (void)run_into_fault();
    const lever_sample_t sample = rig_sample_after(&rig, 2000u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, estimator_update(&estimator, &sample));
}

static void test_run_and_freeze_do_not_leave_fault(void)
{
    lever_command_t command = rig_command();
    (void)run_into_fault();
    command.request = (uint8_t)LEVER_REQUEST_FREEZE;
    TEST_ASSERT_TRUE(estimator_command(&estimator, &command));
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(1u));
    command.request = (uint8_t)LEVER_REQUEST_RUN;
    TEST_ASSERT_TRUE(estimator_command(&estimator, &command));
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, run(1u));
}

static void test_reset_leaves_fault(void)
{
    lever_command_t command = rig_command();
    (void)run_into_fault();
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    TEST_ASSERT_TRUE(estimator_command(&estimator, &command));
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, health().mode);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(310u));
    TEST_ASSERT_EQUAL_UINT32(6u, health().recoveries); /* counts go on */
}

static void test_frozen_survives_a_restart(void)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)LEVER_REQUEST_FREEZE;
    TEST_ASSERT_TRUE(estimator_command(&estimator, &command));
    (void)run(1u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run_damaged());
    TEST_ASSERT_EQUAL_UINT32(1u, health().recoveries);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run(100u));
    TEST_ASSERT_EQUAL_UINT32(1u, health().recoveries);
}

static void test_an_estimate_beyond_a_bound_is_held_there_and_said(void)
{
    config.settings.learn_period = 0.0f; /* at the next sample it is learnt, and bounded */
    estimator_init(&estimator, &config);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(2000u));
    estimator.dual.parameters.w[0] = estimator.dual.parameters.greatest[0] + 1.0f;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
    lever_estimate_t estimate;
    estimator_estimate(&estimator, &estimate);
    const model_t *const models[] = {&model_lever, &model_linear_physical, &model_linear_black_box};
    const float greatest = models[config.model]->parameter[0].greatest;
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f * greatest, greatest, estimate.parameter[0]);
    TEST_ASSERT_TRUE((health().faults & (uint16_t)LEVER_FAULT_BOUND) != 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
}

int main(void)
{
    UNITY_BEGIN();
    for (combination = 0u; combination < (uint32_t)RIG_COMBINATIONS; combination++) {
        RIG_RUN_TEST(test_recovers_from_damage_to_any_factor_or_estimate, combination);
        RIG_RUN_TEST(test_recovers_from_damage_to_what_is_gathered_and_to_the_points, combination);
        RIG_RUN_TEST(test_restarts_from_the_measurement_and_the_first_guess, combination);
        RIG_RUN_TEST(test_restart_without_a_measurement_begins_at_the_trim_and_at_rest, combination);
        RIG_RUN_TEST(test_recovered_is_said_of_the_sample_of_the_restart_only, combination);
        RIG_RUN_TEST(test_learns_again_after_a_restart, combination);
        RIG_RUN_TEST(test_notices_a_sudden_grip_after_a_restart, combination);
        RIG_RUN_TEST(test_six_restarts_in_a_row_are_a_fault, combination);
        RIG_RUN_TEST(test_restarts_now_and_then_are_no_fault, combination);
        RIG_RUN_TEST(test_good_samples_do_not_leave_fault, combination);
        RIG_RUN_TEST(test_a_long_gap_does_not_leave_fault, combination);
        RIG_RUN_TEST(test_run_and_freeze_do_not_leave_fault, combination);
        RIG_RUN_TEST(test_reset_leaves_fault, combination);
        RIG_RUN_TEST(test_frozen_survives_a_restart, combination);
        RIG_RUN_TEST(test_an_estimate_beyond_a_bound_is_held_there_and_said, combination);
    }
    return UNITY_END();
}
