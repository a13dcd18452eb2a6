/* Single samples: what is missing, invalid, implausible, late, twice; time that wraps; inputs between samples; health.
 * With every model and estimator. */
#include "rig.h"

static lever_memory_t memory;
static lever_memory_t other_memory;
static lever_t *lever;
static lever_t *other; /* for comparison */
static rig_t rig;
static double truth[LEVER_PARAMETERS];

static lever_t *make(lever_memory_t *in)
{
    static lever_config_t config;
    config = rig_config(test_round);
    lever_t *made = lever_init(in, &config);
    TEST_ASSERT_NOT_NULL(made);
    return made;
}

void setUp(void)
{
    rig = rig_of(rig_config(test_round).model, truth);
    lever = make(&memory);
    other = make(&other_memory);
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

/* --- what is missing ---------------------------------------------------------------------------------------------- */

TEST_EACH(RIG_COMBINATIONS, good_samples_have_no_fault)
{
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_EQUAL_UINT32(0u, faults());
    TEST_ASSERT_EQUAL_UINT32(3000u, rig_health(lever).samples);
    TEST_ASSERT_EQUAL_UINT8(2u, rig_estimate(lever).nis_size);
}

TEST_EACH(RIG_COMBINATIONS, without_one_output_it_runs_on_the_other)
{
    (void)rig_run(&rig, lever, 3000u);
    for (uint32_t missing = 0u; missing < 2u; missing++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.theta_valid = (missing != 0u);
        sample.theta_dot_valid = (missing != 1u);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
        TEST_ASSERT_EQUAL_UINT32((missing == 0u) ? LEVER_FAULT_THETA : LEVER_FAULT_THETA_DOT, faults());
        TEST_ASSERT_EQUAL_UINT8(1u, rig_estimate(lever).nis_size);
    }
}

/* Without dither nothing is asked of the motor. */
TEST_EACH(RIG_COMBINATIONS, torque_that_is_not_valid_counts_as_what_was_asked_of_the_motor)
{
    run_both(1000u);
    for (uint32_t k = 0u; k < 20u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.tau_m = 0.0f;
        (void)lever_update(other, &sample);
        sample.tau_m = NAN;
        sample.tau_m_valid = false;
        (void)lever_update(lever, &sample);
        rig_assert_same_estimates(lever, other);
        TEST_ASSERT_EQUAL_UINT32(LEVER_FAULT_TORQUE, faults() & ~(uint32_t)LEVER_FAULT_SETTLING);
    }
}

/* What it is does not matter; nothing is learnt, and the state is less certain. For more than 20 ms, the levels have to
 * settle again. */
TEST_EACH(RIG_COMBINATIONS, without_base_acceleration_nothing_is_learnt)
{
    for (uint32_t k = 0u; k < 2u; k++) {
        const uint32_t missing = (k == 0u) ? 20u : 300u;
        setUp();
        (void)rig_run(&rig, lever, 3000u);
        (void)rig_run(&rig, lever, 20u - (rig_health(lever).samples % 20u));
        lever_estimate_t learnt = rig_estimate(lever);
        const float sigma = learnt.theta_dot_sigma;
        for (uint32_t n = 0u; n < missing; n++) {
            lever_sample_t sample = rig_sample(&rig);
            sample.z_ddot = ((n % 2u) == 0u) ? NAN : 5.0f;
            sample.z_ddot_valid = false;
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
            TEST_ASSERT_TRUE((faults() & (uint32_t)LEVER_FAULT_BASE) != 0u);
            if (n == 20u) { /* what was pending is dropped or learnt by now */
                learnt = rig_estimate(lever);
            }
        }
        const lever_estimate_t after = rig_estimate(lever);
        TEST_ASSERT_TRUE(after.theta_dot_sigma > (1.02f * sigma));
        TEST_ASSERT_EQUAL((k == 1u),
            rig_run(&rig, lever, 1u) == LEVER_MODE_RUN && ((faults() & (uint32_t)LEVER_FAULT_SETTLING) != 0u));
        TEST_ASSERT_EQUAL_UINT32(0u, faults() & (uint32_t)LEVER_FAULT_BASE);
        if (k == 1u) {
            TEST_ASSERT_EQUAL_MEMORY(learnt.parameter, after.parameter, sizeof after.parameter);
            (void)rig_run(&rig, lever, 850u);
            TEST_ASSERT_EQUAL_MEMORY(learnt.parameter, rig_estimate(lever).parameter, sizeof after.parameter);
            (void)rig_run(&rig, lever, 400u);
            TEST_ASSERT_TRUE(learnt.parameter[0] != rig_estimate(lever).parameter[0]);
        }
    }
}

/* --- what is wrong ------------------------------------------------------------------------------------------------ */

/* A good sample with one value replaced. */
static lever_sample_t sample_with(uint32_t which, float value)
{
    lever_sample_t sample = rig_sample(&rig);
    float *const values[4] = {&sample.theta, &sample.theta_dot, &sample.tau_m, &sample.z_ddot};
    *values[which] = value;
    return sample;
}

TEST_EACH(RIG_COMBINATIONS, a_value_that_is_not_finite_is_corrupt_and_counts_as_invalid)
{
    const uint32_t fault[4] = {(uint32_t)LEVER_FAULT_THETA, (uint32_t)LEVER_FAULT_THETA_DOT,
        (uint32_t)LEVER_FAULT_TORQUE, (uint32_t)LEVER_FAULT_BASE};
    const float bad[3] = {NAN, INFINITY, -INFINITY};
    (void)rig_run(&rig, lever, 3000u);
    uint32_t corrupt = 0u;
    for (uint32_t which = 0u; which < 4u; which++) {
        for (uint32_t b = 0u; b < 3u; b++) {
            const lever_sample_t sample = sample_with(which, bad[b]);
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
            corrupt++;
            TEST_ASSERT_EQUAL_UINT32(corrupt, rig_health(lever).corrupt);
            TEST_ASSERT_EQUAL_UINT32(fault[which], faults());
        }
    }
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
}

TEST_EACH(RIG_COMBINATIONS, a_value_that_is_flagged_invalid_is_not_read)
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

TEST_EACH(RIG_COMBINATIONS, not_a_number_in_the_very_first_sample_does_no_harm)
{
    for (uint32_t which = 0u; which < 4u; which++) {
        setUp();
        const lever_sample_t sample = sample_with(which, NAN);
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, lever_update(lever, &sample));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 3000u));
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

TEST_EACH(RIG_COMBINATIONS, the_wildest_finite_values_need_no_restart)
{
    random_source_t source = {77u};
    (void)rig_run(&rig, lever, 400u);
    for (uint32_t k = 0u; k < 2000u; k++) {
        const float wild =
            (float)(pow(10.0, random_between(&source, -38.0, 38.0)) * random_between(&source, -1.0, 1.0));
        const lever_sample_t sample = sample_with(k % 4u, wild);
        (void)lever_update(lever, &sample);
        rig_assert_finite(rig_estimate(lever));
    }
    TEST_ASSERT_TRUE(rig_health(lever).mode != LEVER_MODE_FAULT);
}

/* --- time --------------------------------------------------------------------------------------------------------- */

enum { CLOCK = 4096 }; /* LEVER_FAULT_CLOCK: of a late sample it may be the only fault */

TEST_EACH(RIG_COMBINATIONS, a_sample_that_comes_twice_or_is_older_is_late_and_changes_nothing)
{
    const uint32_t older_us[] = {0u, 5000u, 1800000000u}; /* half a turn of the clock is 36 minutes */
    run_both(1500u);                                      /* settled */
    lever_sample_t sample = rig_sample(&rig);
    (void)lever_update(lever, &sample);
    (void)lever_update(other, &sample);
    sample.theta += 0.1f;
    for (uint32_t k = 0u; k < 3u; k++) {
        sample.time_us = rig.time_us - older_us[k];
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
        TEST_ASSERT_EQUAL_UINT32(k + 1u, rig_health(lever).late);
        TEST_ASSERT_EQUAL_UINT32(1501u, rig_health(lever).samples);
        TEST_ASSERT_EQUAL_UINT32(0u, faults() & ~(uint32_t)CLOCK);
    }
    rig_assert_same_estimates(lever, other);
    run_both(100u);
    rig_assert_same_estimates(lever, other);
    TEST_ASSERT_EQUAL_UINT32(0u, faults());
}

/* So many good samples whose clock lags behind by `lag_us`; the mode after the last. */
static enum lever_mode run_lagging(uint32_t count, uint32_t lag_us)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.time_us -= lag_us;
        mode = lever_update(lever, &sample);
    }
    return mode;
}

/* A sender that restarts its clock is late for gap_limit; then the estimator aligns anew, parameters kept, and runs. */
TEST_EACH(RIG_COMBINATIONS, a_clock_that_starts_anew_is_followed_after_gap_limit)
{
    const uint32_t lags_us[] = {10000000u, 2000000000u, 1000000u};
    for (uint32_t k = 0u; k < 3u; k++) {
        setUp();
        (void)rig_run(&rig, lever, 20000u);
        const lever_estimate_t before = rig_estimate(lever);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(500u, lags_us[k])); /* gap_limit 0.5 s */
        const lever_estimate_t late = rig_estimate(lever);
        TEST_ASSERT_EQUAL_MEMORY(&before, &late, sizeof before);
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run_lagging(2u, lags_us[k]));
        TEST_ASSERT_EQUAL_UINT32(rig.time_us - lags_us[k], rig_estimate(lever).time_us);
        TEST_ASSERT_EQUAL_MEMORY(before.parameter, rig_estimate(lever).parameter, sizeof before.parameter);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(301u, lags_us[k]));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(2000u, lags_us[k]));
        TEST_ASSERT_EQUAL_UINT32(0u, faults());
        TEST_ASSERT_EQUAL_UINT32(501u, rig_health(lever).late);
        rig_assert_within(4.0, truth, rig_estimate(lever));
    }
}

/* A clock that stands, or jumps to and fro, is never a new one; nor is one whose late samples a good one interrupts. */
TEST_EACH(RIG_COMBINATIONS, late_samples_that_do_not_advance_are_no_new_clock)
{
    (void)rig_run(&rig, lever, 1000u);
    const lever_sample_t standing = rig_sample(&rig);
    for (uint32_t k = 0u; k < 2000u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &standing));
    }
    TEST_ASSERT_EQUAL_UINT32(1999u, rig_health(lever).late);
    for (uint32_t k = 0u; k < 2000u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(1u, ((k % 2u) == 0u) ? 10000000u : 5000000u));
    }
    rig.time_us = standing.time_us;
    uint32_t old_clock_us = 0u;
    for (uint32_t k = 0u; k < 1200u; k++) {
        old_clock_us += 1000u;
        const uint32_t lag_us = (rig.time_us + 1000u) - old_clock_us;
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(1u, ((k % 300u) == 299u) ? 0u : lag_us));
    }
    TEST_ASSERT_EQUAL_UINT32(1005u, rig_health(lever).samples);
}

TEST_EACH(RIG_COMBINATIONS, time_may_wrap_at_2_to_the_32)
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

/* --- health ------------------------------------------------------------------------------------------------------- */

TEST_EACH(RIG_COMBINATIONS, excitation_is_the_rms_of_theta_dot)
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

TEST_EACH(RIG_COMBINATIONS, a_lever_at_rest_is_said_to_lack_excitation)
{
    rig_let_rest(&rig);
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_TRUE((faults() & (uint32_t)LEVER_FAULT_EXCITATION) != 0u);
    rig.simulation.base_rms = 0.98;
    (void)rig_run(&rig, lever, 3000u);
    TEST_ASSERT_EQUAL_UINT32(0u, faults() & (uint32_t)LEVER_FAULT_EXCITATION);
}

static void set_noise(double factor)
{
    rig.simulation.theta_noise = factor * 1.0e-3;
    rig.simulation.theta_dot_noise = factor * 1.0e-2;
}

/* Four times the noise that is set is found out when there is a noise window, and said when there is none. */
TEST_EACH(RIG_COMBINATIONS, innovations_larger_than_predicted_are_said)
{
    for (uint32_t k = 0u; k < 2u; k++) {
        static lever_config_t config;
        config = rig_config(test_round);
        config.settings.noise_window = (k == 0u) ? 1.0f : 0.0f;
        lever = lever_init(&memory, &config);
        rig = rig_of(config.model, truth);
        (void)rig_run(&rig, lever, 3000u);
        TEST_ASSERT_EQUAL_UINT32(0u, faults() & (uint32_t)LEVER_FAULT_INNOVATION);
        set_noise(4.0);
        (void)rig_run(&rig, lever, 10000u);
        TEST_ASSERT_EQUAL((k == 1u), (faults() & (uint32_t)LEVER_FAULT_INNOVATION) != 0u);
        set_noise(1.0);
        (void)rig_run(&rig, lever, 5000u);
        TEST_ASSERT_EQUAL_UINT32(0u, faults() & (uint32_t)LEVER_FAULT_INNOVATION);
    }
}
