/* When the parameters learn, and when they must not: their own rate, frozen, without excitation, with hands off. */
#include "app/alignment.h"
#include "app/instance.h"
#include "rig.h"

static void start_with(uint32_t combination, uint8_t adaptation)
{
    config = config_of(combination);
    config.adaptation = adaptation;
    start();
}

/* The state moves with every sample, the parameters with the last sample of each block. */
TEST_EACH(LEVER_ESTIMATOR_COUNT, parameters_learn_once_a_learn_period_and_move_at_that_sample)
{
    const float periods[] = {0.0f, 1.0e-3f, 2.0e-3f, 0.1f};
    const uint32_t samples[] = {1u, 1u, 2u, 100u};
    config = config_of(test_round * (uint32_t)LEVER_MODEL_COUNT);
    for (uint32_t k = 0u; k < 4u; k++) {
        config.settings.learn_period = periods[k];
        start();
        (void)run(2000u);
        uint32_t since = 0u;
        uint32_t learnt = 0u;
        for (uint32_t sample = 0u; sample < 400u; sample++) {
            const lever_estimate_t before = estimate();
            (void)run(1u);
            const lever_estimate_t after = estimate();
            TEST_ASSERT_TRUE(after.theta_dot != before.theta_dot);
            since++;
            if (memcmp(before.parameter, after.parameter, sizeof before.parameter) != 0) {
                TEST_ASSERT_TRUE((learnt == 0u) || (since == samples[k]));
                since = 0u;
                learnt++;
            }
        }
        TEST_ASSERT_EQUAL_UINT32(400u / samples[k], learnt);
    }
}

/* R5 */
TEST_EACH(COMBINATIONS, frozen_neither_learns_nor_walks_nor_forgets)
{
    start_with(test_round, (uint8_t)(test_round % (uint32_t)LEVER_ADAPTATION_COUNT));
    (void)run(2000u);
    request(LEVER_REQUEST_FREEZE);
    const lever_estimate_t before = estimate();
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, run(1000u));
    const lever_estimate_t after = estimate();
    assert_same_parameters(&before, &after);
    TEST_ASSERT_EQUAL_MEMORY(before.parameter_sigma, after.parameter_sigma, sizeof before.parameter_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)after.theta_sigma, simulation.theta, (double)after.theta);
    request(LEVER_REQUEST_RUN);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(19u)); /* a block begins when it is left */
    const lever_estimate_t left = estimate();
    assert_same_parameters(&before, &left);
    (void)run(1u);
    TEST_ASSERT_TRUE(estimate().parameter[0] != before.parameter[0]);
}

/* However wildly they walk, and whatever the adaptation: at the floor of the walk, no less certain than at the
 * start. */
/* R5 */
TEST_EACH(COMBINATIONS, without_excitation_nothing_is_learnt_and_nothing_winds_up)
{
    config = config_of(test_round);
    config.adaptation = (uint8_t)((test_round + 1u) % (uint32_t)LEVER_ADAPTATION_COUNT);
    config.settings.z_ddot_gain_sigma = 0.0f; /* considered errors are not capped */
    config.settings.z_ddot_delay_sigma = 0.0f;
    config.settings.tau_m_gain_sigma = 0.0f;
    config.settings.lever_friction_sigma = 0.0f;
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        *parameter_setting(i, "_walk") *= 10.0f;
    }
    start();
    const cdkf_t *cdkf = &lever->estimator.cdkf;
    (void)run(2000u);
    let_rest();
    simulation.base_rms = 1.0e-4; /* an acceleration that stands still is none */
    while (!has_fault(LEVER_FAULT_EXCITATION)) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
    }
    (void)run(20u); /* learn_period: what is pending is learnt yet */
    const lever_estimate_t before = estimate();
    (void)run(4000u);
    const lever_estimate_t after = estimate();
    assert_same_parameters(&before, &after);
    const bool is_signed = (config.model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) { /* w of signed ones counts in sigmas of the first guess */
        const float unit = is_signed ? *parameter_setting(i, "_sigma") : 1.0f;
        const float walk = *parameter_setting(i, "_walk") / unit;
        const float guess = is_signed ? 1.0f : after.parameter[i];
        TEST_ASSERT_FLOAT_WITHIN(1.0e-6f * walk * walk, walk * walk, cdkf->walk[i]);
        TEST_ASSERT_TRUE(after.parameter_sigma[i] >= before.parameter_sigma[i]);
        TEST_ASSERT_TRUE(after.parameter_sigma[i] <= (1.0001f * guess * *parameter_setting(i, "_sigma")));
    }
    TEST_ASSERT_TRUE(cdkf->growth == 0.0f);
    simulation.base_rms = 0.98;
    (void)run(800u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_EXCITATION));
}

/* --- what the model cannot explain -------------------------------------------------------------------------------- */

/* Torque of 1 N m rms on the lever that nobody measures, with a correlation time of 0.3 s: no arm of this order does
 * that. */
/* R8 */
TEST(unknown_torque_is_a_mismatch_and_ordinary_flight_is_none)
{
    random_source_t source = {41u};
    for (uint32_t k = 0u; k < 2u; k++) {
        uint32_t mismatch = 0u;
        double unknown = 0.0;
        start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
        for (uint32_t ms = 0u; ms < 20000u; ms++) {
            unknown += (-unknown * 1.0e-3 / 0.3) + (sqrt(2.0e-3 / 0.3) * random_normal(&source));
            simulation.theta_dot += (k == 1u) ? (simulation.plant.torque * unknown * 1.0e-3) : 0.0;
            const lever_sample_t sample = sample_after(1u);
            (void)lever_update(lever, &sample);
            mismatch += ((ms >= 10000u) && has_fault(LEVER_FAULT_MISMATCH)) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE((k == 0u) ? (mismatch == 0u) : (mismatch > 3000u));
    }
}

/* Seen within a second, both ways; and what the lever does alone is not learnt of the arm. A grip is a change. */
/* R7 */
TEST(hands_off_is_flagged_and_not_learnt_and_a_new_grip_is_a_change)
{
    start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    (void)run(10000u);
    const lever_estimate_t before = estimate();
    TEST_ASSERT_EQUAL_UINT32(0u, health().faults);
    simulation.plant = plant_of_lever(0.0, 0.0, 0.0);
    (void)run(1000u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_HANDS_OFF));
    const lever_estimate_t alone = estimate();
    (void)run(500u);
    const lever_estimate_t still = estimate();
    assert_same_parameters(&alone, &still);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_FLOAT_WITHIN(3.0f * before.parameter_sigma[i], before.parameter[i], alone.parameter[i]);
    }
    simulation.plant = plant_of_lever(3.2, 60.0, 2100.0);
    (void)run(1000u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_HANDS_OFF));
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_CHANGE));
    TEST_ASSERT_TRUE(lever->estimator.learning.kept[1].trust < 1.0f); /* what was known of another grip is gone */
    (void)run(4000u);                                                 /* said for three seconds */
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_CHANGE));
}

/* Twice as stiff and damped, at once. */
/* R6 */
TEST_EACH(3, a_sudden_grip_is_reported_for_three_seconds_unless_the_threshold_is_0_or_nothing_moves)
{
    config = config_of(0u);
    config.settings.change_threshold *= (test_round == 1u) ? 0.0f : 1.0f;
    start();
    (void)run(10000u);
    if (test_round == 2u) {
        let_rest();
        (void)run(5000u);
    }
    const lever_estimate_t before = estimate();
    uint32_t reported = 0u;
    bool opened = false;
    simulation.plant = plant_of_lever(3.2, 120.0, 4200.0);
    for (uint32_t ms = 0u; ms < 5000u; ms++) {
        (void)run(1u);
        reported += has_fault(LEVER_FAULT_CHANGE) ? 1u : 0u;
        opened =
            opened || (has_fault(LEVER_FAULT_CHANGE) && (estimate().parameter_sigma[2] > before.parameter_sigma[2]));
    }
    TEST_ASSERT_UINT32_WITHIN(100u, (test_round == 0u) ? 3000u : 0u, reported);
    TEST_ASSERT_EQUAL(test_round == 0u, opened);
}

/* By one output alone, and with a trunk on its seat. */
TEST_EACH(3, a_new_grip_is_followed_with_what_is_measured)
{
    config = config_of(0u);
    config.settings.seat_frequency = (test_round == 2u) ? 4.5f : 0.0f;
    start();
    (void)run(10000u);
    simulation.plant = plant_of_lever(0.0, 0.0, 0.0);
    (void)run(1000u);
    simulation.plant = plant_of_lever(3.2, 60.0, 2100.0);
    for (uint32_t k = 0u; k < 4000u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.theta_valid = (test_round != 0u);
        sample.theta_dot_valid = (test_round != 1u);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
    }
    const lever_estimate_t after = estimate();
    if (test_round != 2u) { /* what is simulated sits firmly */
        TEST_ASSERT_FLOAT_WITHIN(4.0f * after.natural_frequency_sigma, 3.637f, after.natural_frequency);
    }
}

/* Soon after one change another is followed. */
/* R6 */
TEST(a_change_soon_after_another_is_followed)
{
    start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    const evidence_t *evidence = &lever->estimator.learning.evidence;
    (void)run(10000u);
    simulation.plant = plant_of_lever(3.2, 120.0, 4200.0);
    (void)run(2000u);
    TEST_ASSERT_TRUE((evidence->since_change > 0.5f) && (evidence->since_change < 2.0f));
    simulation.plant = plant_of_lever(2.0, 30.0, 1000.0);
    (void)run(1000u);
    TEST_ASSERT_TRUE(evidence->since_change < 1.0f);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_CHANGE));
}

/* The lever rests at another angle after a grip; only where the trim is followed is that to be learnt anew. A trunk on
 * its seat goes on moving; where there is none, the base's velocity until now is part of the step. */
TEST_EACH(4, a_new_grip_moves_the_level_of_a_trim_that_is_followed)
{
    config = config_of((test_round == 3u) ? (uint32_t)LEVER_MODEL_HAND : 0u);
    config.preload = (uint8_t)((test_round == 0u) ? LEVER_PRELOAD_FIXED : LEVER_PRELOAD_TRIM);
    config.settings.seat_frequency = (test_round == 2u) ? 4.5f : 0.0f;
    config.settings.learn_period = 0.0f;
    start();
    estimator_t *estimator = &lever->estimator;
    (void)run(5000u);
    evidence_begin_change(&estimator->learning.evidence, true, false);
    estimator->learning.verdict = (uint8_t)VERDICT_REGRIP;
    estimator->learning.evidence.since_change = 0.0375f;
    estimator->learning.evidence.opened = true;
    for (uint32_t k = 0u; (k < 20u) && (estimator->cdkf.acting <= (uint32_t)CDKF_STEP); k++) {
        (void)run(1u);
    }
    TEST_ASSERT_EQUAL(test_round != 0u, estimator->cdkf.acting > (uint32_t)CDKF_STEP);
    TEST_ASSERT_EQUAL(test_round == 2u, fabsf(estimator->base_motion.seat_dot) > 1.0e-6f);
    TEST_ASSERT_TRUE(estimator->learning.evidence.since_change > 0.038f);
    const level_t force = estimator->trim.input[TRIM_GRIP_FORCE];
    estimator->learning.evidence.since_change = 3.0f;
    (void)run(1u); /* no change is reported, so the step is over */
    TEST_ASSERT_EQUAL_UINT32(CDKF_CALIBRATION, estimator->cdkf.acting);
    TEST_ASSERT_EQUAL_MEMORY(&force, &estimator->trim.input[TRIM_GRIP_FORCE], sizeof force); /* there is none */
    TEST_ASSERT_EQUAL_FLOAT((test_round == 0u) ? 0.0f : 100.0f, estimator->cdkf.considered_sigma[CDKF_STEP]);
}

/* From where they are: deviations from the levels, of outputs that are valid; of others the prediction. */
TEST_EACH(4, levels_begin_anew_where_the_lever_is)
{
    start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    (void)run(2000u);
    estimator_t *estimator = &lever->estimator;
    checked_t sample = {.y = {0.1f, 0.2f}, .valid = {(test_round & 1u) != 0u, (test_round & 2u) != 0u}};
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        estimator->cdkf.x[i] = 0.3f + (0.1f * (float)i);
        estimator->trim.origin[i] = 0.4f;
    }
    estimator->cdkf.considered[CDKF_STEP].x[0] = 1.0f;
    estimator->cdkf.considered[CDKF_STEP].w[0] = 1.0f;
    estimator->trim.last[0] = 0.25f;
    estimator->setup.constants.seat_stiffness = (test_round == 0u) ? 0.5f : 0.0f;
    estimator->base_motion.seat_dot = 1.0f;
    alignment_begin_grip(estimator, &sample);
    TEST_ASSERT_EQUAL_FLOAT((test_round == 0u) ? 1.0f : 0.0f, estimator->base_motion.seat_dot);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        const float deviation = sample.valid[i] ? sample.y[i] : (0.3f + (0.1f * (float)i));
        TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.4f + deviation, estimator->trim.origin[i]);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, estimator->cdkf.x[i]);
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, estimator->cdkf.considered[CDKF_STEP].x[0]);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, estimator->cdkf.considered[CDKF_STEP].w[0]);
    TEST_ASSERT_EQUAL_FLOAT(0.25f, estimator->trim.last[0]);
}

/* What the errors have done to the state stays, by way of the parameters as well. */
TEST(parameters_that_are_opened_have_nothing_in_common_with_errors_of_sensors)
{
    start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    (void)run(5000u);
    cdkf_t *cdkf = &lever->estimator.cdkf;
    const considered_t before = cdkf->considered[CDKF_BASE_GAIN];
    float by_parameters = 0.0f;
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        by_parameters += cdkf->s[((uint32_t)PARAMETERS * PARAMETERS) + i] * before.w[i];
    }
    TEST_ASSERT_TRUE((by_parameters != 0.0f) && (before.w[0] != 0.0f));
    cdkf_open(cdkf);
    const considered_t after = cdkf->considered[CDKF_BASE_GAIN];
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f * fabsf(before.x[0]), before.x[0] + by_parameters, after.x[0]);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_EQUAL_FLOAT(0.0f, after.w[i]);
    }
}

/* Its sign is wrong: it is said within a second, nothing is learnt of it, and once it is right it is trusted again. */
/* R32 */
TEST(a_base_acceleration_of_the_wrong_sign_is_found_and_teaches_nothing)
{
    start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    (void)run(10000u);
    const lever_estimate_t before = estimate();
    uint32_t found = 0u;
    for (uint32_t k = 0u; k < 3000u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.z_ddot = -sample.z_ddot;
        (void)lever_update(lever, &sample);
        found += has_fault(LEVER_FAULT_BASE) ? 1u : 0u;
    }
    TEST_ASSERT_TRUE(found > 2000u);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_FLOAT_WITHIN(3.0f * before.parameter_sigma[i], before.parameter[i], estimate().parameter[i]);
    }
    (void)run(3000u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_BASE));
}

/* Each block is a sample, so that what is set before it is what it finds. */
static learning_t *start_learning(uint32_t samples)
{
    config = config_of(0u);
    config.settings.learn_period = 0.0f;
    start();
    (void)run(samples);
    return &lever->estimator.learning;
}

/* R5 */
TEST(what_was_under_way_ends_when_it_is_frozen)
{
    learning_t *learning = start_learning(400u);
    evidence_begin_change(&learning->evidence, true, false);
    learning->verdict = (uint8_t)VERDICT_REGRIP;
    learning->evidence.opened = true;
    lever->estimator.cdkf.acting = (uint32_t)CDKF_CONSIDERED;
    request(LEVER_REQUEST_FREEZE);
    (void)run(20u);
    TEST_ASSERT_TRUE(learning->evidence.since_change > 100.0f);
    TEST_ASSERT_EQUAL_UINT32(CDKF_CALIBRATION, lever->estimator.cdkf.acting);
}

/* The little that was learnt of an arm before an outage moves the estimate, and is not certain. */
/* R29 */
TEST_EACH(2, an_arm_that_is_not_known_is_opened_while_levels_settle)
{
    const bool known = (test_round == 1u);
    learning_t *learning = start_learning(3000u);
    const lever_estimate_t before = estimate();
    lever->estimator.trim.unsettled = 0.1f;
    learning->kept[0].trust = 0.9f;
    learning->kept[1].trust = known ? 1.0f : 0.9f;
    (void)run(2u);
    const lever_estimate_t after = estimate();
    TEST_ASSERT_EQUAL(VERDICT_SETTLING, learning->verdict);
    TEST_ASSERT_EQUAL(known, lever->estimator.cdkf.trust > 0.0f);
    TEST_ASSERT_EQUAL(known, learning->kept[0].trust > 0.0f);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        const float opened = after.parameter[i] * *parameter_setting(i, "_sigma");
        TEST_ASSERT_FLOAT_WITHIN(1.0e-5f * before.parameter[i], before.parameter[i], after.parameter[i]);
        TEST_ASSERT_FLOAT_WITHIN(
            1.0e-2f * opened, known ? before.parameter_sigma[i] : opened, after.parameter_sigma[i]);
    }
}

/* The change is taken back, too: its step would otherwise count for 3 s, and then no more, with nothing learnt. */
/* R55 */
TEST(the_step_of_a_change_ends_when_the_parameters_are_taken_back)
{
    learning_t *learning = start_learning(400u);
    lever->estimator.cdkf.acting = (uint32_t)CDKF_CONSIDERED;
    learning->evidence.since_change = 1.0f;
    (void)run(2u);
    TEST_ASSERT_EQUAL_UINT32(CDKF_CONSIDERED, lever->estimator.cdkf.acting);
    learning->evidence.torque = (agreement_t){1.0f, 1.0f, -1.0f}; /* a motor that does the reverse */
    (void)run(1u);
    TEST_ASSERT_EQUAL(VERDICT_MOTOR_WRONG, learning->verdict);
    TEST_ASSERT_EQUAL_UINT32(CDKF_CALIBRATION, lever->estimator.cdkf.acting);
}

/* --- noise -------------------------------------------------------------------------------------------------------- */

/* Rough air that begins in flight is no change of the pilot: the noise is estimated anew within a second. */
/* R58 */
TEST(rough_air_that_begins_in_flight_is_noise_and_no_change)
{
    random_source_t source = {77u};
    start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    (void)run(10000u);
    const float truth = estimate().natural_frequency;
    uint32_t change = 0u;
    uint32_t innovation = 0u;
    for (uint32_t ms = 0u; ms < 8000u; ms++) {
        simulation.theta_dot += 0.5 * sqrt(1.0e-3) * random_normal(&source);
        (void)run(1u);
        change += has_fault(LEVER_FAULT_CHANGE) ? 1u : 0u;
        innovation += has_fault(LEVER_FAULT_INNOVATION) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT32(0u, change);
    TEST_ASSERT_TRUE((innovation > 100u) && (innovation < 3000u));
    TEST_ASSERT_TRUE(lever->estimator.cdkf.process_noise[1] > (4.0f * config.settings.theta_dot_process_noise));
    TEST_ASSERT_FLOAT_WITHIN(3.0f * estimate().natural_frequency_sigma, truth, estimate().natural_frequency);
}

/* Sums that begin anew with the noise say nothing, and no verdict of the old ones stays where nothing is learnt. */
TEST(with_other_noise_calibration_is_judged_anew)
{
    random_source_t source = {77u};
    start_with(0u, (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    (void)run(10000u);
    evidence_t *evidence = &lever->estimator.learning.evidence;
    const float *vector = &evidence->calibration.score[CDKF_BASE_GAIN].vector;
    evidence->calibration.score[CDKF_BASE_GAIN].vector = 1.0e9f;
    for (uint32_t ms = 0u; (ms < 8000u) && (*vector > 1.0e6f); ms++) {
        simulation.theta_dot += 0.5 * sqrt(1.0e-3) * random_normal(&source);
        (void)run(1u);
        TEST_ASSERT_TRUE((ms < 100u) || (*vector < 1.0e6f) || evidence_has(evidence, EVIDENCE_CALIBRATION));
    }
    TEST_ASSERT_TRUE(*vector < 1.0e6f);
    TEST_ASSERT_FALSE(evidence_has(evidence, EVIDENCE_CALIBRATION));
}

/* --- frozen ------------------------------------------------------------------------------------------------------- */

enum wrong { BASE_STUCK, BASE_SIGN, THETA_STUCK, TORQUE_SIGN, WRONGS };

/* `count` samples of a lever whose motor does what is asked of it, or the contrary. */
static void fly_wrong(uint32_t count, enum wrong wrong, lever_sample_t *last)
{
    for (uint32_t k = 0u; k < count; k++) {
        if ((k % 500u) == 0u) {
            dither(0.1f);
        }
        lever_sample_t sample = sample_after(1u);
        const float asked = health().torque;
        sample.tau_m = (wrong == TORQUE_SIGN) ? -asked : asked;
        simulation.tau_m = (double)sample.tau_m;
        sample.theta = (wrong == THETA_STUCK) ? last->theta : sample.theta;
        sample.z_ddot = (wrong == BASE_STUCK) ? last->z_ddot : sample.z_ddot;
        sample.z_ddot *= (wrong == BASE_SIGN) ? -1.0f : 1.0f;
        if (wrong == WRONGS) {
            *last = sample;
        }
        (void)lever_update(lever, &sample);
    }
}

/* Flagged while frozen as quickly as ever, and no longer when it is right again. The parameters stay as they are. */
/* R55 */
TEST_EACH(WRONGS, a_sensor_that_fails_while_frozen_is_found_and_believed_again_when_it_is_right)
{
    static const enum lever_fault fault[WRONGS] = {
        LEVER_FAULT_BASE, LEVER_FAULT_BASE, LEVER_FAULT_THETA, LEVER_FAULT_TORQUE};
    lever_sample_t last;
    config = config_of(0u);
    start();
    simulation.torque_rms = 0.0;
    fly_wrong(8000u, WRONGS, &last);
    request(LEVER_REQUEST_FREEZE);
    fly_wrong(3000u, WRONGS, &last);
    const lever_estimate_t before = estimate();
    TEST_ASSERT_FALSE(has_fault(fault[test_round]));
    fly_wrong(2000u, (enum wrong)test_round, &last);
    TEST_ASSERT_TRUE(has_fault(fault[test_round]));
    fly_wrong(3000u, WRONGS, &last);
    TEST_ASSERT_FALSE(has_fault(fault[test_round]));
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, health().mode);
    const lever_estimate_t after = estimate();
    assert_same_parameters(&before, &after);
}

/* R55 */
TEST(a_sample_without_base_while_frozen_disturbs_the_state_for_a_while_only)
{
    config = config_of(0u);
    start();
    (void)run(4000u);
    request(LEVER_REQUEST_FREEZE);
    (void)run(1000u);
    lever_sample_t sample = sample_after(1u);
    sample.z_ddot_valid = false;
    (void)lever_update(lever, &sample);
    TEST_ASSERT_TRUE(lever->estimator.cdkf.disturbance > 0.0f);
    (void)run(4000u);
    TEST_ASSERT_TRUE(lever->estimator.cdkf.disturbance < (1.0e-3f * config.settings.theta_dot_process_noise));
}

/* --- standing still ----------------------------------------------------------------------------------------------- */

/* A lever that is locked from power-on in a cabin that vibrates; freed, it is learnt. */
/* R56 */
TEST(a_lever_that_stands_still_teaches_nothing_until_it_moves)
{
    config = config_of(0u);
    start();
    const lever_estimate_t before = estimate();
    for (uint32_t k = 0u; k < 20000u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.theta = (float)(SIMULATION_TRIM + (simulation.theta_noise * random_normal(&simulation.source)));
        sample.theta_dot = (float)(simulation.theta_dot_noise * random_normal(&simulation.source));
        sample.theta_dot_valid = ((k < 10000u) || ((k % 2u) == 0u));
        (void)lever_update(lever, &sample);
        TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_BOUND));
    }
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_EXCITATION));
    const lever_estimate_t after = estimate();
    assert_same_parameters(&before, &after);
    (void)run(2000u);
    TEST_ASSERT_TRUE(!has_fault(LEVER_FAULT_EXCITATION) && (estimate().parameter[2] != before.parameter[2]));
}

/* R56 */
TEST(after_a_long_gap_the_lever_has_to_be_seen_to_move_anew)
{
    config = config_of(0u);
    start();
    (void)run(3000u);
    const motion_t *motion = &lever->estimator.learning.evidence.motion;
    TEST_ASSERT_TRUE((motion->slow > 0.0f) && (motion->fast > 0.0f));
    const lever_sample_t sample = sample_after(1000u);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, lever_update(lever, &sample));
    TEST_ASSERT_TRUE((motion->slow == 0.0f) && (motion->fast == 0.0f));
}

/* R9 */
TEST(a_parameter_that_rests_on_a_bound_is_reported_while_nothing_is_learnt)
{
    config = config_of(0u);
    config.settings.c_p = model_lever.parameter[1].greatest;
    start();
    let_rest();
    simulation.base_rms = 1.0e-4;
    (void)run(2000u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_BOUND) && has_fault(LEVER_FAULT_EXCITATION));
    request(LEVER_REQUEST_FREEZE);
    (void)run(100u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_BOUND));
}
