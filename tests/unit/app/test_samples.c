/* Single samples: what is missing, invalid, implausible, late, twice; time that wraps; inputs between samples; health. With
 * every model and estimator. */
#include "rig.h"

static uint32_t combination;
static lever_memory_t memory;
static lever_memory_t other_memory;
static lever_t *lever;
static lever_t *other; /* for comparison */
static rig_t rig;
static double truth[LEVER_PARAMETERS];

static lever_t *make(lever_memory_t *in)
{
    static lever_config_t config;
    config = rig_config(combination);
    lever_t *made = lever_init(in, &config);
    TEST_ASSERT_NOT_NULL(made);
    return made;
}

void setUp(void)
{
    rig = rig_of(rig_config(combination).model, truth);
    lever = make(&memory);
    other = make(&other_memory);
}

void tearDown(void)
{
}

/* The same good samples into both. */
static void run_both(uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = rig_sample(&rig);
        (void)lever_update(lever, &sample);
        (void)lever_update(other, &sample);
    }
}

static uint32_t faults(void)
{
    return rig_health(lever).faults;
}

/* --- what is missing ----------------------------------------------------------------------------------------------- */

static void test_good_samples_have_no_fault(void)
{
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_EQUAL_UINT16(0u, faults());
    TEST_ASSERT_EQUAL_UINT32(3000u, rig_health(lever).samples);
    TEST_ASSERT_EQUAL_UINT8(2u, rig_estimate(lever).nis_size);
}

static void test_without_theta_it_runs_on_theta_dot(void)
{
    (void)rig_run(&rig, lever, 3000u);
    lever_sample_t sample = rig_sample(&rig);
    sample.theta_valid = false;
    sample.theta = NAN;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT16(LEVER_FAULT_THETA, faults());
    TEST_ASSERT_EQUAL_UINT8(1u, rig_estimate(lever).nis_size);
}

static void test_without_theta_dot_it_runs_on_theta(void)
{
    (void)rig_run(&rig, lever, 3000u);
    lever_sample_t sample = rig_sample(&rig);
    sample.theta_dot_valid = false;
    sample.theta_dot = NAN;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT16(LEVER_FAULT_THETA_DOT, faults());
    TEST_ASSERT_EQUAL_UINT8(1u, rig_estimate(lever).nis_size);
}

static void test_with_one_output_alone_it_still_learns(void)
{
    for (uint32_t k = 0u; k < 60000u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.theta_dot_valid = (k < 400u);
        (void)lever_update(lever, &sample);
        sample.theta_valid = (k < 400u);
        sample.theta_dot_valid = true;
        (void)lever_update(other, &sample);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * fabs(truth[2]), truth[2], (double)rig_estimate(lever).parameter[2]);
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * fabs(truth[2]), truth[2], (double)rig_estimate(other).parameter[2]);
}

static void test_torque_that_is_not_valid_counts_as_none(void)
{
    run_both(1000u);
    for (uint32_t k = 0u; k < 10u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.tau_m = 0.0f;
        (void)lever_update(other, &sample);
        sample.tau_m = 3.0f;
        sample.tau_m_valid = false;
        (void)lever_update(lever, &sample);
        rig_assert_same_estimates(lever, other);
        TEST_ASSERT_EQUAL_UINT16(LEVER_FAULT_TORQUE, faults());
    }
}

static void test_base_acceleration_that_is_not_valid_is_held(void)
{
    run_both(1000u);
    const float held = (float)rig.simulation.z_ddot;
    for (uint32_t k = 0u; k < 10u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.z_ddot = held;
        (void)lever_update(other, &sample);
        sample.z_ddot = 30.0f;
        sample.z_ddot_valid = false;
        (void)lever_update(lever, &sample);
        rig_assert_same_estimates(lever, other);
        TEST_ASSERT_EQUAL_UINT16(LEVER_FAULT_BASE, faults());
    }
}

/* Blind samples that differ in their inputs by 4: over the step to them, half of that acts. */
static void test_inputs_between_two_samples_are_the_mean_of_both(void)
{
    run_both(10000u);
    lever_sample_t sample = rig_sample(&rig);
    sample.theta_valid = false;
    sample.theta_dot_valid = false;
    sample.z_ddot = 1.0f;
    sample.tau_m = -1.0f;
    (void)lever_update(lever, &sample);
    sample.z_ddot = 5.0f;
    sample.tau_m = 3.0f;
    (void)lever_update(other, &sample);
    const plant_t *plant = &rig.simulation.plant;
    const double pushed = plant_acceleration(plant, plant->theta, 0.0, 2.0, 2.0);
    const double wanted = 1.0e-3 * (pushed - plant_acceleration(plant, plant->theta, 0.0, 0.0, 0.0));
    const double found = (double)rig_estimate(other).theta_dot - (double)rig_estimate(lever).theta_dot;
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * fabs(wanted), wanted, found);
}

/* --- what is wrong ------------------------------------------------------------------------------------------------- */

/* A good sample with one value replaced. */
static lever_sample_t sample_with(uint32_t which, float value)
{
    lever_sample_t sample = rig_sample(&rig);
    float *const values[4] = {&sample.theta, &sample.theta_dot, &sample.tau_m, &sample.z_ddot};
    *values[which] = value;
    return sample;
}

static void test_a_value_that_is_not_finite_is_corrupt_and_counts_as_invalid(void)
{
    const uint16_t fault[4] = {(uint16_t)LEVER_FAULT_THETA, (uint16_t)LEVER_FAULT_THETA_DOT,
        (uint16_t)LEVER_FAULT_TORQUE, (uint16_t)LEVER_FAULT_BASE};
    const float bad[3] = {NAN, INFINITY, -INFINITY};
    (void)rig_run(&rig, lever, 3000u);
    uint32_t corrupt = 0u;
    for (uint32_t which = 0u; which < 4u; which++) {
        for (uint32_t b = 0u; b < 3u; b++) {
            const lever_sample_t sample = sample_with(which, bad[b]);
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
            corrupt++;
            TEST_ASSERT_EQUAL_UINT32(corrupt, rig_health(lever).corrupt);
            TEST_ASSERT_EQUAL_UINT16(fault[which], faults());
        }
    }
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
}

static void test_a_value_that_is_flagged_invalid_is_not_read(void)
{
    (void)rig_run(&rig, lever, 400u);
    lever_sample_t sample = rig_sample(&rig);
    sample.theta = NAN;
    sample.theta_dot = NAN;
    sample.tau_m = NAN;
    sample.z_ddot = NAN;
    sample.theta_valid = false;
    sample.theta_dot_valid = false;
    sample.tau_m_valid = false;
    sample.z_ddot_valid = false;
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).corrupt);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 1u));
}

static void test_not_a_number_in_the_very_first_sample_does_no_harm(void)
{
    for (uint32_t which = 0u; which < 4u; which++) {
        setUp();
        const lever_sample_t sample = sample_with(which, NAN);
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, lever_update(lever, &sample));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 3000u));
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

static void test_the_wildest_finite_values_need_no_restart(void)
{
    random_source_t source = {77u};
    (void)rig_run(&rig, lever, 400u);
    for (uint32_t k = 0u; k < 2000u; k++) {
        const float wild =
            (float)(pow(10.0, random_between(&source, -38.0, 38.0)) * random_between(&source, -1.0, 1.0));
        const lever_sample_t sample = sample_with(k % 4u, wild);
        (void)lever_update(lever, &sample);
        const lever_estimate_t estimate = rig_estimate(lever);
        TEST_ASSERT_TRUE(isfinite(estimate.theta) && isfinite(estimate.theta_dot) && isfinite(estimate.nis));
        TEST_ASSERT_TRUE(isfinite(estimate.parameter[0]) && isfinite(estimate.natural_frequency_sigma));
    }
    TEST_ASSERT_TRUE(rig_health(lever).mode != LEVER_MODE_FAULT);
}

/* --- time ---------------------------------------------------------------------------------------------------------- */

static void test_a_sample_that_comes_twice_is_late_and_changes_nothing(void)
{
    run_both(500u);
    lever_sample_t sample = rig_sample(&rig);
    (void)lever_update(lever, &sample);
    (void)lever_update(other, &sample);
    sample.theta += 0.1f;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(1u, rig_health(lever).late);
    TEST_ASSERT_EQUAL_UINT32(501u, rig_health(lever).samples);
    rig_assert_same_estimates(lever, other);
    run_both(100u);
    rig_assert_same_estimates(lever, other);
}

static void test_an_older_sample_is_late_and_changes_nothing(void)
{
    run_both(500u);
    lever_sample_t sample = rig_sample(&rig);
    (void)lever_update(lever, &sample);
    (void)lever_update(other, &sample);
    sample.time_us -= 5000u;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    sample.time_us -= 1800000000u; /* half an hour: half a turn of the clock is 36 minutes */
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(2u, rig_health(lever).late);
    rig_assert_same_estimates(lever, other);
    run_both(100u);
    rig_assert_same_estimates(lever, other);
}

static void test_time_may_wrap_at_2_to_the_32(void)
{
    const uint32_t shift = UINT32_MAX - 400000u; /* wraps 0.4 s after the start, running */
    for (uint32_t k = 0u; k < 2000u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        (void)lever_update(lever, &sample);
        sample.time_us += shift;
        (void)lever_update(other, &sample);
    }
    lever_estimate_t wrapped = rig_estimate(other);
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_EQUAL_UINT32(estimate.time_us + shift, wrapped.time_us);
    wrapped.time_us = estimate.time_us;
    TEST_ASSERT_EQUAL_MEMORY(&estimate, &wrapped, sizeof estimate);
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(other).lost + rig_health(other).late);
}

/* --- health -------------------------------------------------------------------------------------------------------- */

static void test_excitation_is_the_rms_of_theta_dot(void)
{
    double square = 0.0;
    (void)rig_run(&rig, lever, 5000u);
    for (uint32_t k = 0u; k < 4000u; k++) {
        (void)rig_run(&rig, lever, 1u);
        square += rig.simulation.plant.theta_dot * rig.simulation.plant.theta_dot;
    }
    const double wanted = sqrt(square / 4000.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.3 * wanted, wanted, (double)rig_health(lever).excitation);
}

static void test_a_lever_at_rest_is_said_to_lack_excitation(void)
{
    rig.simulation.base_rms = 0.0;
    rig.simulation.torque_rms = 0.0;
    rig.simulation.process_noise = 0.0;
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_TRUE((faults() & (uint16_t)LEVER_FAULT_EXCITATION) != 0u);
    rig.simulation.base_rms = 0.98;
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_EQUAL_UINT16(0u, faults() & (uint16_t)LEVER_FAULT_EXCITATION);
}

static void test_innovations_larger_than_set_are_not_those_larger_than_predicted(void)
{
    (void)rig_run(&rig, lever, 3000u);
    rig.simulation.theta_noise = 4.0e-3; /* four times what the settings say, which the estimator finds out */
    rig.simulation.theta_dot_noise = 4.0e-2;
    (void)rig_run(&rig, lever, 10000u);
    TEST_ASSERT_EQUAL_UINT16(0u, faults() & (uint16_t)LEVER_FAULT_INNOVATION);
}

static void test_innovations_larger_than_predicted_are_said(void)
{
    static lever_config_t config;
    config = rig_config(combination);
    config.settings.noise_window = 0.0f; /* or the estimator would find out */
    lever = lever_init(&memory, &config);
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_EQUAL_UINT16(0u, faults() & (uint16_t)LEVER_FAULT_INNOVATION);
    rig.simulation.theta_noise = 4.0e-3; /* four times what the settings say */
    rig.simulation.theta_dot_noise = 4.0e-2;
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_TRUE((faults() & (uint16_t)LEVER_FAULT_INNOVATION) != 0u);
    rig.simulation.theta_noise = 1.0e-3;
    rig.simulation.theta_dot_noise = 1.0e-2;
    (void)rig_run(&rig, lever, 5000u);
    TEST_ASSERT_EQUAL_UINT16(0u, faults() & (uint16_t)LEVER_FAULT_INNOVATION);
}

int main(void)
{
    UNITY_BEGIN();
    for (combination = 0u; combination < (uint32_t)RIG_COMBINATIONS; combination++) {
        RIG_RUN_TEST(test_good_samples_have_no_fault, combination);
        RIG_RUN_TEST(test_without_theta_it_runs_on_theta_dot, combination);
        RIG_RUN_TEST(test_without_theta_dot_it_runs_on_theta, combination);
        RIG_RUN_TEST(test_with_one_output_alone_it_still_learns, combination);
        RIG_RUN_TEST(test_torque_that_is_not_valid_counts_as_none, combination);
        RIG_RUN_TEST(test_base_acceleration_that_is_not_valid_is_held, combination);
        RIG_RUN_TEST(test_inputs_between_two_samples_are_the_mean_of_both, combination);
        RIG_RUN_TEST(test_a_value_that_is_not_finite_is_corrupt_and_counts_as_invalid, combination);
        RIG_RUN_TEST(test_a_value_that_is_flagged_invalid_is_not_read, combination);
        RIG_RUN_TEST(test_not_a_number_in_the_very_first_sample_does_no_harm, combination);
        RIG_RUN_TEST(test_the_wildest_finite_values_need_no_restart, combination);
        RIG_RUN_TEST(test_a_sample_that_comes_twice_is_late_and_changes_nothing, combination);
        RIG_RUN_TEST(test_an_older_sample_is_late_and_changes_nothing, combination);
        RIG_RUN_TEST(test_time_may_wrap_at_2_to_the_32, combination);
        RIG_RUN_TEST(test_excitation_is_the_rms_of_theta_dot, combination);
        RIG_RUN_TEST(test_a_lever_at_rest_is_said_to_lack_excitation, combination);
        RIG_RUN_TEST(test_innovations_larger_than_predicted_are_said, combination);
        RIG_RUN_TEST(test_innovations_larger_than_set_are_not_those_larger_than_predicted, combination);
    }
    return UNITY_END();
}
