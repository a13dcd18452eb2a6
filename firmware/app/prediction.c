#include "app/prediction.h"

#include "math/bounds.h"

#include <math.h>
#include <stddef.h>

#define MISSING 10.0f     /* process noise for a base acceleration or torque that is missing, in those that are set, */
#define WRONG 3.0f        /* and for a wrong one, so that it is noticed when it is right again */
#define UNSETTLED 4.0f    /* innovations while levels settle, in squares: as much larger as they may be */
#define STOP_RATE 0.002f  /* friction is at half of its limit [rad/s] */
#define RATE_MOST 1.0e4f  /* [rad/s] */
#define REST_RATE 6.0f    /* of the mean of the trim angle, which itself follows motion of 1 to 3 Hz in full [1/s] */
#define JUMP 0.03f        /* of the angle while it was refused, which the rate does not explain [rad] */
#define SUBSTEPS_MOST 12u /* predictions through a gap: bounds the time of one call */

/* Torque of one newton metre of Coulomb friction, smooth about standstill. Of a rate that is none it is none: what is
 * not a number would stay in the trim. */
static float friction(float rate)
{
    return (fabsf(rate) <= RATE_MOST) ? (rate / (fabsf(rate) + STOP_RATE)) : 0.0f;
}

/* What a unit of each considered error takes from the inputs (filter/cdkf.h): true = measured / (1 + gain error), true
 * = measured later by the delay, in sample periods. `stop`: friction of a newton metre at mid-step, high-passed like any
 * torque. The hand is driven by z_ddot + c_space z_dot, both wrong alike. */
static void considered_errors(const estimator_t *estimator, float z_ddot, float stop, float error[CDKF_CONSIDERED])
{
    const setup_t *setup = &estimator->setup;
    const float space = (setup->model_in_use == &model_hand) ? estimator->cdkf.p[2] : 0.0f;
    error[CDKF_BASE_GAIN] = -(z_ddot - (space * estimator->base_motion.seat_dot)); /* without a seat it is -z_dot */
    error[CDKF_BASE_DELAY] = (z_ddot - estimator->z_ddot) + (space * (setup->settings->sample_period * z_ddot));
    error[CDKF_TORQUE_GAIN] = -estimator->tau_m;
    error[CDKF_FRICTION] = -stop;
}

/* One step of the model, with the mean of the inputs at both ends. A base that cannot be used is unknown: then the
 * state has the process noise for it. `force`: of the hand, NULL where it is missing. */
static void predict(estimator_t *estimator, float z_ddot, float tau_m, const float *force, float period)
{
    trim_t *trim = &estimator->trim;
    cdkf_t *cdkf = &estimator->cdkf;
    learning_t *learning = &estimator->learning;
    const setup_t *setup = &estimator->setup;
    const lever_settings_t *s = setup->settings;
    const bool wrong = evidence_has(&learning->evidence, EVIDENCE_BASE);
    const bool unknown = (estimator->base_missing > 0.0f) || wrong;
    const bool driven = (estimator->torque_missing > 0.0f); /* by a torque that is not known */
    const bool steps = (cdkf->acting > (uint32_t)CDKF_STEP);
    const float rate = trim->origin[1] + cdkf->x[1];
    const float half_change =
        0.5f * (rate - estimator->last_rate); /* friction is that of mid-step, not a sample late */
    float input[] = {friction(rate + half_change), z_ddot, tau_m, 1.0f}; /* as in enum trim_signal */
    estimator->last_rate = rate;
    trim_inputs(trim, input, TRIM_FRICTION, steps ? 4u : 3u, period);
    const float stop = input[0];
    const float next_z_ddot = input[1];
    const float next_tau_m = input[2];
    float error[CDKF_CONSIDERED];
    cdkf_grip_t grip;
    trim_set_origin(trim);
    model_step_t step = {.period = period,
        .z_ddot = 0.5f * (estimator->z_ddot + next_z_ddot),
        .tau_m = (0.5f * (estimator->tau_m + next_tau_m)) - (s->lever_friction * stop),
        .origin = trim->origin[0],
        .trim = trim_angle(trim),
        .trim_sine = estimator->trim_sine_cosine.sine,
        .trim_cosine = estimator->trim_sine_cosine.cosine};
    if (setup->model_in_use->uses_base_motion) {
        base_motion_step(&estimator->base_motion, &setup->constants, &step);
    }
    const float alone = hands_predict(&learning->evidence.hands, &setup->constants, &step, cdkf->x);
    if (unknown) {
        step.z_ddot = 0.0f;
        step.seat_dot = 0.0f;
    }
    if (unknown || driven) {
        cdkf->disturbance = (wrong ? WRONG : MISSING) * s->theta_dot_process_noise;
    }
    considered_errors(estimator, next_z_ddot, stop, error);
    error[CDKF_STEP] = input[3]; /* not read without a step */
    if (steps) {
        cdkf->x[0] += period * (error[CDKF_STEP] * trim->begin_rate);
    }
    const bool gripped = grip_force_step(
        &learning->evidence.force, setup, trim, (unknown || driven) ? NULL : force, &step, alone, error, &grip);
    if (gripped) {
        grip.learn =
            !estimator->frozen && learning_informs(learning) && !evidence_has(&learning->evidence, EVIDENCE_REST);
    }
    cdkf_time_update(cdkf, setup->model_in_use, &setup->constants, &step, error, gripped ? &grip : NULL);
    estimator->z_ddot = next_z_ddot;
    estimator->tau_m = next_tau_m;
}

/* Subtracts the slow level from the outputs, and renews the trim angle. Returns true at the end of an outage. */
static bool subtract_trim(estimator_t *estimator, float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS], float period)
{
    const bool back = trim_outputs(&estimator->trim, y, valid, period);
    const float angle = trim_angle(&estimator->trim);
    estimator->trim_sine_cosine = sine_cosine(angle);
    estimator->rest_angle += lesser(period * REST_RATE, 1.0f) * (angle - estimator->rest_angle);
    return back;
}

/* Predicts through a gap in `substeps`, inputs in between on a straight line from the last ones, up to the last
 * step. */
static void cross_gap(
    estimator_t *estimator, const checked_t *sample, const inputs_t *last, float period, uint32_t substeps)
{
    static const bool missing[CDKF_OUTPUTS] = {false, false};
    const float part = 1.0f / (float)substeps;
    float unused[CDKF_OUTPUTS] = {0.0f, 0.0f};
    for (uint32_t i = 1u; i < substeps; i++) {
        const float share = part * (float)i;
        predict(estimator, last->z_ddot + (share * (sample->z_ddot - last->z_ddot)),
            last->tau_m + (share * (sample->tau_m - last->tau_m)), NULL, period);
        (void)subtract_trim(estimator, unused, missing, period);
    }
}

/* Counts for how long an input has been missing. Returns true at the end of an outage. */
static bool follow_input(float *missing, bool valid, float elapsed)
{
    const bool back = valid && (*missing > TRIM_OUTAGE);
    *missing = valid ? 0.0f : (*missing + elapsed);
    return back;
}

/* An angle that has jumped while the rate went on, and stays there, has another offset, and so has one that is back from
 * an outage elsewhere: its level takes it, which would pass on some of a jump for longer than levels settle. */
static void take_offset(estimator_t *estimator, const checked_t *sample)
{
    trim_t *trim = &estimator->trim;
    evidence_t *evidence = &estimator->learning.evidence;
    const bool back = trim_is_waiting(trim, 0u);
    const bool goes_on = (evidence->refused[0] > 0.0f) && sample->valid[1] && (evidence->refused[1] <= 0.0f);
    if (sample->valid[0] && (back || goes_on) && trim->deviations) {
        const float expected =
            back ? (trim->origin[0] + estimator->cdkf.x[0]) : (trim->last[0] + (trim->missing[0] * sample->y[1]));
        const float jump = sample->y[0] - expected;
        if (fabsf(jump) > JUMP) {
            trim_shift(trim, jump);
            evidence->offset += jump;
            evidence->faults |= LEVER_FAULT_THETA; /* until the end of the block, which judges what is left */
        }
    }
}

/* An output far from what is expected is not valid. */
static void refuse_spikes(estimator_t *estimator, checked_t *sample, float elapsed)
{
    const float least = (estimator->trim.unsettled > 0.0f) ? UNSETTLED : 1.0f;
    const float level = greater(estimator->learning.evidence.nis_slow, least);
    for (uint32_t i = 0u; i < (uint32_t)CDKF_OUTPUTS; i++) {
        const float y = sample->y[i] - estimator->trim.origin[i];
        const bool expected = sample->valid[i] && !trim_is_waiting(&estimator->trim, i);
        if (expected &&
            evidence_refuses_output(&estimator->learning.evidence, &estimator->cdkf, i, y, level, elapsed)) {
            sample->valid[i] = false;
            estimator->corrupt++;
            estimator->faults |= (i == 0u) ? (uint32_t)LEVER_FAULT_THETA : (uint32_t)LEVER_FAULT_THETA_DOT;
        }
    }
    if ((estimator->learning.evidence.refused[0] + estimator->trim.missing[0]) > 0.0f) {
        take_offset(estimator, sample);
    }
}

void prediction_advance(
    estimator_t *estimator, checked_t *sample, const inputs_t *last, float elapsed, uint32_t periods)
{
    float period = elapsed;
    if (periods > 1u) {
        const uint32_t substeps = lesser_count(periods, SUBSTEPS_MOST);
        period = elapsed / (float)substeps;
        cross_gap(estimator, sample, last, period, substeps);
    }
    const bool base_back = follow_input(&estimator->base_missing, sample->base, elapsed);
    const bool torque_back = follow_input(&estimator->torque_missing, sample->torque, elapsed);
    const bool input_back = base_back || torque_back;
    if (input_back) {
        trim_unsettle(&estimator->trim);
    }
    predict(estimator, sample->z_ddot, sample->tau_m, sample->gripped ? &sample->grip_force : NULL, period);
    refuse_spikes(estimator, sample, elapsed);
    evidence_add_outputs(&estimator->learning.evidence, estimator->trim.last, sample->y,
        sample->valid[0] && sample->valid[1], elapsed, estimator->setup.settings->sample_period);
    if (subtract_trim(estimator, sample->y, sample->valid, period)) {
        if (!input_back) { /* signals that are back together were out once */
            trim_unsettle(&estimator->trim);
        }
        estimator->learning.evidence.offset = 0.0f; /* the angle is what it is now */
    }
}
