/* What breaks is refused, restarted and said; what breaks again and again is a fault that only a reset leaves. Damage is
 * done to the estimator's own memory, as nothing that comes in from outside should be able to do it. */
#include "app/estimator.h"
#include "rig.h"

static lever_config_t config;
static estimator_t estimator;
static rig_t rig;

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
    rig = rig_typical();
    lever_config_default(&config);
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
    }
}

static void test_restarts_from_the_measurement_and_the_first_guess(void)
{
    (void)run_damaged();
    lever_estimate_t estimate;
    estimator_estimate(&estimator, &estimate);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, rig.simulation.theta, (double)estimate.theta);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, rig.simulation.theta_dot, (double)estimate.theta_dot);
    TEST_ASSERT_EQUAL_FLOAT(config.settings.m_p, estimate.parameter[0]);
    TEST_ASSERT_EQUAL_FLOAT(config.settings.m_p * config.settings.m_p_sigma, estimate.parameter_sigma[0]);
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
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 3.2, (double)estimate.parameter[0]);
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
    estimator.dual.parameters.w[0] = 3.0f;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
    lever_estimate_t estimate;
    estimator_estimate(&estimator, &estimate);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, 10.0, (double)estimate.parameter[0]);
    TEST_ASSERT_TRUE((health().faults & (uint16_t)LEVER_FAULT_BOUND) != 0u);
    TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_recovers_from_damage_to_any_factor_or_estimate);
    RUN_TEST(test_restarts_from_the_measurement_and_the_first_guess);
    RUN_TEST(test_restart_without_a_measurement_begins_at_the_trim_and_at_rest);
    RUN_TEST(test_recovered_is_said_of_the_sample_of_the_restart_only);
    RUN_TEST(test_learns_again_after_a_restart);
    RUN_TEST(test_six_restarts_in_a_row_are_a_fault);
    RUN_TEST(test_restarts_now_and_then_are_no_fault);
    RUN_TEST(test_good_samples_do_not_leave_fault);
    RUN_TEST(test_a_long_gap_does_not_leave_fault);
    RUN_TEST(test_run_and_freeze_do_not_leave_fault);
    RUN_TEST(test_reset_leaves_fault);
    RUN_TEST(test_frozen_survives_a_restart);
    RUN_TEST(test_an_estimate_beyond_a_bound_is_held_there_and_said);
    return UNITY_END();
}
