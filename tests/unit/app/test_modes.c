/* Modes: init, align, run, coast, frozen, and what leads from one to the other (fault: test_recovery.c). */
#include "model/model.h"
#include "rig.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;

static void start(void)
{
    rig = rig_typical();
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
}

void setUp(void)
{
    lever_config_default(&config);
    start();
}

/* Through alignment and on for as many samples. */
static void run_for(uint32_t samples)
{
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 310u + samples));
}

/* --- init and align ----------------------------------------------------------------------------------------------- */

TEST(init_then_align_for_align_time_at_the_first_guess_then_run)
{
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, rig_health(lever).mode);
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).samples);
    rig_assert_first_guess(&config, rig_estimate(lever));
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, rig_run(&rig, lever, 300u)); /* 0.299 s after the first sample */
    rig_assert_first_guess(&config, rig_estimate(lever));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 2u));
    config.settings.align_time = 0.0f;
    start();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 1u));
}

TEST(trim_after_alignment_is_the_mean_angle)
{
    double sum = 0.0;
    for (uint32_t k = 0u; k < 300u; k++) {
        const lever_sample_t sample = rig_sample(&rig);
        sum += (double)sample.theta;
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, sum / 300.0, (double)rig_estimate(lever).trim);
}

TEST(alignment_waits_for_a_valid_theta)
{
    (void)rig_run(&rig, lever, 100u);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, rig_run_blind(&rig, lever, 1000u));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 1u));
}

TEST(alignment_leaves_samples_without_theta_out_of_the_mean)
{
    lever_sample_t sample = rig_sample(&rig);
    sample.theta = 0.2f;
    (void)lever_update(lever, &sample);
    sample.time_us += 1000u;
    sample.theta = NAN;
    sample.theta_valid = false;
    (void)lever_update(lever, &sample);
    sample.time_us += 1000u;
    sample.theta = 0.4f;
    sample.theta_valid = true;
    (void)lever_update(lever, &sample);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, 0.3, (double)rig_estimate(lever).trim);
}

TEST(a_rate_that_was_never_measured_is_unknown)
{
    for (uint32_t k = 0u; k < 302u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.theta_dot_valid = false;
        (void)lever_update(lever, &sample);
        const lever_estimate_t estimate = rig_estimate(lever);
        TEST_ASSERT_DOUBLE_WITHIN(
            4.0 * (double)estimate.theta_dot_sigma, rig.simulation.plant.theta_dot, (double)estimate.theta_dot);
    }
}

/* --- coast -------------------------------------------------------------------------------------------------------- */

TEST(without_theta_and_theta_dot_it_coasts_and_then_runs_again)
{
    run_for(0u);
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, rig_run_blind(&rig, lever, 1u));
    TEST_ASSERT_EQUAL_UINT8(0u, rig_estimate(lever).nis_size);
    TEST_ASSERT_TRUE(rig_estimate(lever).nis == 0.0f);
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, rig_run_blind(&rig, lever, 299u));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 1u));
}

/* --- frozen ------------------------------------------------------------------------------------------------------- */

TEST(run_leaves_frozen_and_learns_on)
{
    run_for(1000u);
    rig_request(lever, LEVER_REQUEST_FREEZE);
    (void)rig_run(&rig, lever, 1000u);
    const lever_estimate_t before = rig_estimate(lever);
    rig_request(lever, LEVER_REQUEST_RUN);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 1000u));
    TEST_ASSERT_TRUE(rig_estimate(lever).parameter[2] != before.parameter[2]);
}

TEST(frozen_before_the_first_sample_freezes_after_alignment)
{
    rig_request(lever, LEVER_REQUEST_FREEZE);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, rig_run(&rig, lever, 400u));
    TEST_ASSERT_EQUAL_FLOAT(config.settings.k_p, rig_estimate(lever).parameter[2]);
}

/* Frozen from the start at a first guess on a bound of the model, where nothing can correct it. */
static void assert_can_be_frozen_at(float m_p, float c_p, float k_p)
{
    config.settings.m_p = m_p;
    config.settings.c_p = c_p;
    config.settings.k_p = k_p;
    start();
    rig_request(lever, LEVER_REQUEST_FREEZE);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, rig_run(&rig, lever, 400u));
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    TEST_ASSERT_EQUAL_FLOAT(m_p, rig_estimate(lever).parameter[0]);
}

TEST(frozen_at_the_least_or_greatest_first_guess_is_no_fault)
{
    const model_parameter_t *p = model_lever.parameter;
    assert_can_be_frozen_at(p[0].least, p[1].least, p[2].least);
    assert_can_be_frozen_at(p[0].greatest, p[1].greatest, p[2].greatest);
}
