/* Modes: init, align, run, coast, frozen, and what leads from one to the other (fault: test_recovery.c); gaps in
 * time. */
#include "app/instance.h"
#include "model/model.h"
#include "rig.h"

void setUp(void)
{
    lever_config_default(&config);
    start();
}

/* Through alignment and on for as many samples. */
static void run_for(uint32_t samples)
{
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(310u + samples));
}

/* --- init and align ----------------------------------------------------------------------------------------------- */

TEST_EACH(COMBINATIONS, init_then_align_for_align_time_at_the_first_guess_then_run)
{
    config = config_of(test_round);
    start();
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, health().mode);
    TEST_ASSERT_EQUAL_UINT32(0u, health().samples);
    assert_first_guess();
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run(300u)); /* 0.299 s after the first sample */
    assert_first_guess();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(2u));
    config.settings.align_time = 0.0f;
    start();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
}

TEST(init_lasts_until_a_sample_is_usable)
{
    const uint32_t missing = (uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_THETA_DOT |
                             (uint32_t)LEVER_FAULT_BASE | (uint32_t)LEVER_FAULT_TORQUE;
    for (uint32_t k = 0u; k < 2000u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.theta_valid = sample.theta_dot_valid = sample.tau_m_valid = sample.z_ddot_valid = false;
        TEST_ASSERT_EQUAL(LEVER_MODE_INIT, lever_update(lever, &sample));
    }
    TEST_ASSERT_EQUAL_UINT32(2000u, health().samples);
    TEST_ASSERT_EQUAL_HEX32(missing, health().faults & missing);
    assert_first_guess();
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run(1u)); /* align_time begins here */
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run(299u));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(2u));
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run_blind(10u));
}

TEST(trim_after_alignment_is_the_mean_of_valid_angles)
{
    const float angles[] = {0.2f, NAN, 0.4f};
    for (uint32_t k = 0u; k < 3u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.theta = angles[k];
        sample.theta_valid = (k != 1u);
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_FLOAT_WITHIN(1.0e-7f, 0.3f, estimate().trim);
}

TEST(alignment_waits_for_a_valid_theta_unless_only_the_rate_is_measured)
{
    (void)run(100u);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run_blind(1000u));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
    start();
    for (uint32_t k = 0u; k <= 301u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.theta_valid = false;
        TEST_ASSERT_EQUAL((k < 300u) ? LEVER_MODE_ALIGN : LEVER_MODE_RUN, lever_update(lever, &sample));
        TEST_ASSERT_TRUE((k > 300u) || (estimate().trim == config.settings.lever_preload_angle));
    }
}

/* --- coast -------------------------------------------------------------------------------------------------------- */

TEST(without_outputs_it_coasts_and_then_runs_again)
{
    run_for(0u);
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run_blind(1u));
    TEST_ASSERT_EQUAL_UINT8(0u, estimate().nis_size);
    TEST_ASSERT_TRUE(estimate().nis == 0.0f);
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, run_blind(299u));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
}

/* --- frozen ------------------------------------------------------------------------------------------------------- */

/* On a bound of the model, where nothing can correct it, this is no fault. */
TEST(frozen_before_the_first_sample_freezes_after_alignment_at_any_first_guess)
{
    for (uint32_t k = 0u; k < 3u; k++) {
        float guess[PARAMETERS];
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
            const model_parameter_t *p = &model_lever.parameter[i];
            guess[i] = (k == 0u) ? *parameter_setting(i, "") : ((k == 1u) ? p->least : p->greatest);
            *parameter_setting(i, "") = guess[i];
        }
        start();
        request(LEVER_REQUEST_FREEZE);
        TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run(400u));
        TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
        TEST_ASSERT_EQUAL_FLOAT(guess[0], estimate().parameter[0]);
    }
}

/* --- gaps --------------------------------------------------------------------------------------------------------- */

/* R29 */
TEST(a_gap_up_to_gap_limit_is_coasted_through_and_a_longer_one_aligns_anew)
{
    run_for(1000u);
    lever_sample_t sample = sample_after(500u);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(499u, health().lost);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_GAP));
    (void)run(1u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_GAP)); /* of the sample after it only */
    sample = sample_after(501u);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(999u, health().lost);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(301u));
}

/* R29 */
TEST(levels_settle_for_the_whole_of_their_time_after_a_gap)
{
    run_for(3000u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_SETTLING));
    lever_sample_t sample = sample_after(490u);
    (void)lever_update(lever, &sample);
    for (uint32_t k = 0u; k < 899u; k++) {
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_SETTLING));
        (void)run(1u);
    }
    (void)run(2u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_SETTLING));
}

/* R29 */
TEST(signals_that_are_back_together_were_out_once)
{
    run_for(3000u);
    for (uint32_t k = 0u; k < 30u; k++) {
        lever_sample_t sample = sample_blind();
        sample.z_ddot_valid = false;
        (void)lever_update(lever, &sample);
    }
    for (uint32_t k = 0u; k < 900u; k++) {
        (void)run(1u);
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_SETTLING));
    }
    (void)run(2u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_SETTLING));
}

/* R29 */
TEST(the_first_sample_after_alignment_says_that_levels_settle)
{
    run_for(3000u);
    lever_sample_t sample = sample_after(1000u);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, lever_update(lever, &sample));
    while (run(1u) == LEVER_MODE_ALIGN) {
        TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_SETTLING));
    }
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_SETTLING));
}

/* Angle and rate are compared anew after a gap: what the lever did meanwhile is no jump of the one alone. */
/* R33 R55 */
TEST(a_gap_is_no_difference_of_angle_and_rate)
{
    for (uint32_t trial = 0u; trial < 20u; trial++) {
        start();
        run_for(3000u + (37u * trial));
        lever_sample_t sample = sample_after(1000u);
        (void)lever_update(lever, &sample);
        for (uint32_t k = 0u; k < 1500u; k++) {
            (void)run(1u);
            TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_THETA) || has_fault(LEVER_FAULT_THETA_DOT));
        }
    }
}

/* While levels are aligned nothing is estimated that anything could be learnt from, and means begin anew. */
TEST(during_alignment_it_is_blind_and_afterwards_nothing_is_left_of_before)
{
    run_for(3000u);
    lever->estimator.learning.evidence.nis_slow = 5.0f;
    lever_sample_t sample = sample_after(1000u);
    (void)lever_update(lever, &sample);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, lever->estimator.learning.evidence.nis_slow);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run(100u));
    TEST_ASSERT_EQUAL(VERDICT_BLIND, lever->estimator.learning.verdict);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(250u));
    TEST_ASSERT_EQUAL(VERDICT_SETTLING, lever->estimator.learning.verdict);
}

/* What was found wrong before the levels are aligned anew is so meanwhile, too. */
/* R55 */
TEST(faults_of_sensors_show_during_alignment)
{
    run_for(3000u);
    for (uint32_t k = 0u; k < 1500u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.theta_dot = -sample.theta_dot;
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_THETA_DOT));
    lever_sample_t sample = sample_after(1000u);
    (void)lever_update(lever, &sample);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run(100u));
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_THETA_DOT));
}

/* R29 */
TEST(a_long_gap_keeps_the_parameters_and_widens_them_by_their_walk)
{
    config.settings.z_ddot_gain_sigma = 0.0f; /* of a standard deviation that does not grow */
    config.settings.z_ddot_delay_sigma = 0.0f;
    config.settings.tau_m_gain_sigma = 0.0f;
    config.settings.lever_friction_sigma = 0.0f;
    start();
    run_for(20000u);
    const lever_estimate_t before = estimate();
    const lever_sample_t sample = sample_after(5000u);
    (void)lever_update(lever, &sample);
    const lever_estimate_t after = estimate();
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        /* what was gathered before the gap is learnt yet */
        TEST_ASSERT_FLOAT_WITHIN(0.15f * before.parameter_sigma[i], before.parameter[i], after.parameter[i]);
        TEST_ASSERT_TRUE(after.parameter_sigma[i] > 1.2f * before.parameter_sigma[i]);
    }
}

TEST(a_sample_somewhat_late_or_much_too_early_is_taken_as_it_is)
{
    run_for(1000u);
    lever_sample_t sample = sample_after(1u);
    sample.time_us += 400u;
    (void)lever_update(lever, &sample);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_GAP));
    sample.time_us += 100u;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    TEST_ASSERT_EQUAL_UINT32(0u, health().lost + health().late);
    (void)run(100u);
    TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
}
