/* Samples that never came: gaps in time that are coasted through, and longer ones. */
#include "rig.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;

void setUp(void)
{
    rig = rig_typical();
    lever_config_default(&config);
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
}

/* Through alignment and on for as many samples. */
static void run_for(uint32_t samples)
{
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 310u + samples));
}

TEST(a_gap_up_to_gap_limit_is_coasted_through_and_a_longer_one_aligns_anew)
{
    run_for(1000u);
    lever_sample_t sample = rig_sample_after(&rig, 500u);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(499u, rig_health(lever).lost);
    TEST_ASSERT_TRUE((rig_health(lever).faults & (uint32_t)LEVER_FAULT_GAP) != 0u);
    (void)rig_run(&rig, lever, 1u);
    TEST_ASSERT_EQUAL_UINT32(
        0u, rig_health(lever).faults & (uint32_t)LEVER_FAULT_GAP); /* of the sample after it only */
    sample = rig_sample_after(&rig, 501u);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(999u, rig_health(lever).lost);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 301u));
}

TEST(a_long_gap_keeps_the_parameters_and_widens_them_by_their_walk)
{
    rig_trust_calibration(&config); /* a standard deviation that does not grow */
    lever = lever_init(&memory, &config);
    run_for(30000u);
    const lever_estimate_t before = rig_estimate(lever);
    const lever_sample_t sample = rig_sample_after(&rig, 5000u);
    (void)lever_update(lever, &sample);
    const lever_estimate_t after = rig_estimate(lever);
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        /* what was gathered before the gap is learnt yet */
        TEST_ASSERT_FLOAT_WITHIN(0.15f * before.parameter_sigma[i], before.parameter[i], after.parameter[i]);
        TEST_ASSERT_TRUE(after.parameter_sigma[i] > 1.2f * before.parameter_sigma[i]);
    }
}

TEST(jitter_of_less_than_half_a_period_is_no_gap)
{
    run_for(0u);
    lever_sample_t sample = rig_sample(&rig);
    sample.time_us += 400u;
    (void)lever_update(lever, &sample);
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).lost);
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).faults & (uint32_t)LEVER_FAULT_GAP);
}

/* A gap is predicted in a bounded number of steps, which therefore get long; averages are shorter than that. */
TEST(the_longest_gaps_that_the_settings_let_coast_need_no_restart)
{
    config.settings.gap_limit = 1.0f;                               /* the greatest that may be set */
    config.settings.trim_corner = 1.5f / config.settings.gap_limit; /* lever_config_check() allows no more */
    config.settings.excitation_time = 0.01f;
    config.settings.robbins_monro_time = 0.01f;
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    run_for(1000u);
    for (uint32_t k = 1u; k <= 20u; k++) {
        const lever_sample_t sample = rig_sample_after(&rig, 50u * k);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 200u));
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

TEST(a_sample_much_too_early_is_taken)
{
    run_for(1000u);
    lever_sample_t sample = rig_sample(&rig);
    (void)lever_update(lever, &sample);
    sample.time_us += 100u;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).lost + rig_health(lever).late);
    (void)rig_run(&rig, lever, 100u);
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
}
