#include "app/estimator.h"
#include "app/alignment.h"
#include "app/prediction.h"
#include "math/bounds.h"
#include "math/elapsed.h"
#include "math/share.h"

#include <math.h>
#include <string.h>

#define RESTARTS_FORGOTTEN 0.1f /* part of them each second [1/s] */
#define RESTARTS_TOLERATED 5.0f /* not yet forgotten */
#define RATE_OF_ANGLE 2.0f      /* presumed rate over angle where theta_dot is not measured, in corners of the trim */
#define CLOCK_MIN 0.25f         /* of a sample_period: a clock that advances by less is treated as stopped */
#define OTHER_MAX 1.0e4f        /* plausibility limit of every signal except theta [rad/s], [N m], [m/s^2] */

static void note(estimator_t *estimator, bool present, enum lever_fault fault)
{
    if (present) {
        estimator->faults |= (uint32_t)fault;
    }
}

/* --- life ------------------------------------------------------------------------------------------------------ */

static void start_filter(estimator_t *estimator)
{
    static const float origin[MODEL_STATES] = {0.0f, 0.0f};
    const setup_t *setup = &estimator->setup;
    const lever_settings_t *s = setup->settings;
    cdkf_t *cdkf = &estimator->cdkf;
    const prior_t prior = setup_prior(setup); /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    cdkf_init(cdkf, setup->model_in_use, &setup->constants, &prior);
    cdkf->process_noise[0] = s->theta_process_noise;
    cdkf->process_noise[1] = s->theta_dot_process_noise;
    cdkf->output_noise[0] = s->theta_noise;
    cdkf->output_noise[1] = s->theta_dot_noise;
    cdkf->considered_sigma[CDKF_BASE_GAIN] = s->z_ddot_gain_sigma;
    cdkf->considered_sigma[CDKF_BASE_DELAY] = s->z_ddot_delay_sigma / s->sample_period;
    cdkf->considered_sigma[CDKF_TORQUE_GAIN] = s->tau_m_gain_sigma;
    cdkf->considered_sigma[CDKF_FRICTION] = s->lever_friction_sigma;
    cdkf_start_state(cdkf, origin, cdkf->output_noise);
    learning_start(&estimator->learning, setup, cdkf);
}

void estimator_start_over(estimator_t *estimator)
{
    setup_choose(&estimator->setup);
    delay_line_start(&estimator->line);
    start_filter(estimator);
    estimator->restarts = 0.0f;
    (void)memset(&estimator->trim, 0, sizeof estimator->trim);
    estimator->trim_sine_cosine = sine_cosine(0.0f);
    estimator->rest_angle = 0.0f;
    estimator->mode = LEVER_MODE_INIT;
    estimator->frozen = false;
    estimator->last_z_ddot = 0.0f;
    estimator->raw_z_ddot = 0.0f;
    estimator->base_missing = 0.0f;
    estimator->torque_missing = 0.0f;
    estimator->last_tau_m = 0.0f;
    estimator->last_rate = 0.0f;
    estimator->nis = 0.0f;
    estimator->nis_size = 0u;
    estimator->faults = 0u;
}

void estimator_init(estimator_t *estimator, const lever_config_t *config)
{
    setup_t *setup = &estimator->setup;
    setup->settings = &config->settings;
    setup->model = config->model;
    setup->preload = config->preload;
    setup->estimator = config->estimator;
    setup->adaptation = config->adaptation;
    estimator_start_over(estimator);
}

/* --- checks of a sample ------------------------------------------------------------------------------------------ */

/* A flagged value that is plausible; NaN is not. */
static bool is_usable(estimator_t *estimator, float value, bool valid, float most)
{
    const bool usable = valid && (fabsf(value) <= most);
    if (usable != valid) {
        estimator->corrupt++;
    }
    return usable;
}

/* The true base acceleration of a sensor with gain and delay: of the time to which the other signals are delayed, which
 * lies between this sample and the last. */
static float compensated(estimator_t *estimator, float z_ddot, float elapsed)
{
    const setup_t *setup = &estimator->setup;
    const float back = lesser(setup->delay_rest * setup->settings->sample_period, elapsed);
    const float behind = (back > 0.0f) ? (back * ((z_ddot - estimator->raw_z_ddot) / elapsed)) : 0.0f;
    estimator->raw_z_ddot = z_ddot;
    return seat_step(&estimator->seat, (z_ddot - behind) * setup->base_scale, elapsed);
}

/* An input that is plausible, but for some samples far from where it was. Not after it was missing, as `fault` of the
 * last sample says: then there is no change from sample to sample. */
static bool has_jumped(estimator_t *estimator, enum input input, enum lever_fault fault, float change, float elapsed)
{
    input_gate_t *gate = &estimator->learning.evidence.input[input];
    bool jumped = false;
    if (((estimator->faults & (uint32_t)fault) == 0u) || (gate->refused > 0.0f)) {
        jumped = input_gate_step(gate, change, elapsed);
        estimator->corrupt += jumped ? 1u : 0u;
    }
    return jumped;
}

/* Notes in the faults what is missing, `elapsed` seconds after the last sample. */
static void check(
    estimator_t *estimator, const lever_sample_t *sample, float commanded_torque, float elapsed, checked_t *checked)
{
    evidence_t *evidence = &estimator->learning.evidence;
    const bool theta = is_usable(estimator, sample->theta, sample->theta_valid, MODEL_THETA_MOST);
    const bool theta_dot = is_usable(estimator, sample->theta_dot, sample->theta_dot_valid, OTHER_MAX);
    const bool successive = (elapsed > 0.0f) && is_successive(elapsed, estimator->setup.settings->sample_period);
    const bool measured = is_usable(estimator, sample->tau_m, sample->tau_m_valid, OTHER_MAX);
    const float tau_m = sample->tau_m * estimator->setup.torque_scale;
    const bool torque_jumped =
        measured && successive &&
        has_jumped(estimator, INPUT_TORQUE, LEVER_FAULT_TORQUE, tau_m - estimator->last_tau_m, elapsed);
    const bool torque = measured && !torque_jumped;
    const bool base = is_usable(estimator, sample->z_ddot, sample->z_ddot_valid, OTHER_MAX);
    checked->y[0] = sample->theta;
    checked->y[1] = sample->theta_dot;
    checked->valid[0] = theta && evidence_sees(evidence, SIGNAL_THETA, sample->theta);
    checked->valid[1] = theta_dot && evidence_sees(evidence, SIGNAL_THETA_DOT, sample->theta_dot);
    if (checked->valid[1]) {
        sticking_add(&evidence->sticking, sample->theta_dot, elapsed);
    }
    checked->base = base && evidence_sees(evidence, SIGNAL_BASE, sample->z_ddot);
    checked->gripped = is_usable(estimator, sample->grip_force, sample->grip_force_valid, OTHER_MAX);
    checked->grip_force = sample->grip_force;
    const bool jumped =
        checked->base && successive &&
        has_jumped(estimator, INPUT_BASE, LEVER_FAULT_BASE, sample->z_ddot - estimator->raw_z_ddot, elapsed);
    evidence_follow_command(evidence, commanded_torque, elapsed);
    const bool unknown = !torque && evidence_has_other_torque(evidence);
    const float presumed = (torque_jumped || unknown) ? estimator->last_tau_m : commanded_torque;
    checked->tau_m = torque ? tau_m : presumed;
    checked->torque = !unknown || torque_jumped;
    if (torque && ((estimator->samples % (uint32_t)EVIDENCE_TORQUE_EVERY) == 0u)) {
        evidence_add_torque(evidence, checked->tau_m);
    }
    checked->z_ddot =
        (checked->base && !jumped) ? compensated(estimator, sample->z_ddot, elapsed) : estimator->last_z_ddot;
    estimator->last_z_ddot = checked->z_ddot;
    estimator->last_tau_m = checked->tau_m;
    estimator->time_us = sample->time_us;
    estimator->samples++;

    estimator->faults = 0u;
    note(estimator, !checked->valid[0], LEVER_FAULT_THETA);
    note(estimator, !checked->valid[1], LEVER_FAULT_THETA_DOT);
    note(estimator, !torque, LEVER_FAULT_TORQUE);
    note(estimator, !checked->base || jumped, LEVER_FAULT_BASE);
    note(estimator, estimator->communication_fault, LEVER_FAULT_COMMUNICATION);
    estimator->communication_fault = false;
}

/* --- measurement update ------------------------------------------------------------------------------------------ */

/* Refuses an estimate that breaks an invariant: the filter starts again from the measurement and the first guess. */
static void restart_if_invalid(estimator_t *estimator, const checked_t *sample, bool learnt)
{
    const cdkf_t *cdkf = &estimator->cdkf;
    const bool valid = learnt ? cdkf_is_valid(cdkf) : cdkf_state_is_valid(cdkf);
    if (!valid) {
        start_filter(estimator);
        alignment_start_state(estimator, sample->y, sample->valid);
        estimator->nis = 0.0f;
        estimator->recoveries++;
        estimator->restarts += 1.0f;
        note(estimator, true, LEVER_FAULT_RECOVERED);
    }
}

/* Where only theta is measured, a motion well above the trim's corner is presumed. */
static void add_motion(estimator_t *estimator, const checked_t *sample, float elapsed)
{
    const uint32_t i = sample->valid[1] ? 1u : 0u;
    if (sample->valid[i]) {
        float rate = sample->y[i];
        if (i == 0u) {
            const float angle = rate - (estimator->setup.constants.trim ? 0.0f : trim_angle(&estimator->trim));
            rate = (RATE_OF_ANGLE * estimator->trim.corner) * angle;
        }
        evidence_add_motion(&estimator->learning.evidence, i, rate, elapsed, estimator->setup.settings->sample_period);
    }
}

static enum lever_mode mode_of(const estimator_t *estimator, bool measured)
{
    enum lever_mode mode = measured ? LEVER_MODE_RUN : LEVER_MODE_COAST;
    if (estimator->frozen) {
        mode = LEVER_MODE_FROZEN;
    }
    if (estimator->restarts > RESTARTS_TOLERATED) {
        mode = LEVER_MODE_FAULT;
    }
    return mode;
}

/* The states of the evidence, as of a sample. Returns whether it was measured. */
static bool note_states(estimator_t *estimator, const checked_t *sample)
{
    evidence_t *evidence = &estimator->learning.evidence;
    const lever_settings_t *s = estimator->setup.settings;
    const bool measured = sample->valid[0] || sample->valid[1];
    evidence_note(evidence, EVIDENCE_MISSING,
        !measured || (estimator->base_missing > 0.0f) || (estimator->torque_missing > 0.0f));
    evidence_note(evidence, EVIDENCE_UNSETTLED, estimator->trim.unsettled >= (0.5f * s->sample_period));
    return measured;
}

/* Measurement update of the filter; what the innovations say of noise. */
static void update_filter(estimator_t *estimator, const checked_t *sample, float elapsed)
{
    learning_t *learning = &estimator->learning;
    evidence_t *evidence = &learning->evidence;
    const bool informs = learning_informs(learning);
    innovation_t innovation[CDKF_OUTPUTS];
    cdkf_measurement_update(&estimator->cdkf, sample->y, sample->valid, informs, innovation);
    if (informs && !evidence_has(evidence, EVIDENCE_REST)) {
        noise_estimation_add(&learning->noise, innovation, sample->valid);
        if (verdict_rows[learning->verdict].adapt) {
            const innovation_t *seen = &innovation[sample->valid[1] ? 1u : 0u];
            whiteness_add(&evidence->whiteness, seen->value * sqrtf(seen->inverse_variance), elapsed);
        }
    }
    estimator->nis = ((innovation[0].value * innovation[0].value) * innovation[0].inverse_variance) +
                     ((innovation[1].value * innovation[1].value) * innovation[1].inverse_variance);
    estimator->nis_size = (uint8_t)((sample->valid[0] ? 1u : 0u) + (sample->valid[1] ? 1u : 0u));
    if (estimator->nis_size != 0u) {
        const float ratio = (estimator->nis_size == 2u) ? (0.5f * estimator->nis) : estimator->nis;
        evidence_add_nis(evidence, ratio);
    }
}

static void correct(estimator_t *estimator, const checked_t *sample, float elapsed)
{
    learning_t *learning = &estimator->learning;
    const bool measured = note_states(estimator, sample);
    update_filter(estimator, sample, elapsed);
    add_motion(estimator, sample, elapsed);
    const bool learnt = learning_step(learning, &estimator->setup, &estimator->cdkf, estimator->frozen, elapsed);
    if (learning->levels) {
        learning->levels = false;
        alignment_begin_grip(estimator, sample);
    }
    restart_if_invalid(estimator, sample, learnt);
    if (estimator->restarts > 0.0f) {
        estimator->restarts -= estimator->restarts * lesser(elapsed * RESTARTS_FORGOTTEN, 1.0f);
    }
    estimator->mode = mode_of(estimator, measured);
}

/* --- samples ----------------------------------------------------------------------------------------------------- */

/* Number of sample periods in `elapsed`, at least one. */
static uint32_t periods_in(const estimator_t *estimator, float elapsed)
{
    const float period = estimator->setup.settings->sample_period;
    uint32_t periods = 1u;
    if (!is_successive(elapsed, period)) {
        const float rounded = (elapsed / period) + 0.5f;
        periods = (uint32_t)rounded;
    }
    return periods;
}

/* Sensors are judged while nothing is estimated yet. The first block of RUN begins with its first sample. */
static void watch_alignment(estimator_t *estimator, float elapsed)
{
    evidence_note(&estimator->learning.evidence, EVIDENCE_MISSING, true);
    (void)learning_step(&estimator->learning, &estimator->setup, &estimator->cdkf, true, elapsed);
}

/* The filter, or what comes before it, takes a sample. */
static void advance(estimator_t *estimator, checked_t *sample, const inputs_t *last, float elapsed, uint32_t periods)
{
    if (elapsed > estimator->setup.settings->gap_limit) {
        learning_skip(&estimator->learning, &estimator->setup, &estimator->cdkf, elapsed);
        alignment_begin(estimator, sample);
    } else if (estimator->mode == LEVER_MODE_ALIGN) {
        watch_alignment(estimator, elapsed);
        alignment_step(estimator, sample, elapsed);
    } else {
        prediction_advance(estimator, sample, last, elapsed, periods);
        correct(estimator, sample, elapsed);
    }
    note(estimator, (estimator->mode != LEVER_MODE_ALIGN) && (estimator->trim.unsettled > 0.0f), LEVER_FAULT_SETTLING);
    estimator->faults |= estimator->learning.evidence.faults;
}

/* A sample `elapsed` seconds after the last one. */
static void step(estimator_t *estimator, checked_t *sample, const inputs_t *last, float elapsed)
{
    const float period = estimator->setup.settings->sample_period;
    const uint32_t periods = periods_in(estimator, elapsed);
    evidence_add_time(&estimator->learning.evidence, elapsed, period);
    estimator->trim.unsettled -= elapsed; /* before this sample may set it */
    note(estimator, elapsed < (CLOCK_MIN * period), LEVER_FAULT_CLOCK);
    if (periods > 1u) {
        estimator->lost += periods - 1u;
        evidence_add_lost(&estimator->learning.evidence, period, periods - 1u);
        note(estimator, true, LEVER_FAULT_GAP);
    }
    if (estimator->mode != LEVER_MODE_FAULT) { /* only a reset leaves it */
        advance(estimator, sample, last, elapsed, periods);
    }
}

/* Counts a sample that is not newer than the last. Returns true when such samples have advanced for gap_limit: then
 * they are not late, but their sender has started its clock anew. */
static bool is_new_clock(estimator_t *estimator, uint32_t time_us)
{
    const uint32_t advanced_us = time_us - estimator->late_time_us;
    const float limit_us = estimator->setup.settings->gap_limit * 1.0e6f;
    const bool goes_on = (estimator->late_series_us != 0u) && (advanced_us != 0u) && ((float)advanced_us <= limit_us);
    estimator->late++;
    estimator->late_time_us = time_us;
    estimator->late_series_us = goes_on ? (estimator->late_series_us + advanced_us) : 1u;
    return (float)estimator->late_series_us > limit_us;
}

enum lever_mode estimator_update(estimator_t *estimator, const lever_sample_t *sample, float commanded_torque)
{
    const inputs_t last = {estimator->last_z_ddot, estimator->last_tau_m};
    const uint32_t elapsed_us = sample->time_us - estimator->time_us;
    const bool started = (estimator->mode != LEVER_MODE_INIT);
    const bool late = started && ((elapsed_us == 0u) || (elapsed_us >= HALF_TURN_OF_TIME));
    const bool new_clock = late && is_new_clock(estimator, sample->time_us) && (estimator->mode != LEVER_MODE_FAULT);
    if (late && !new_clock) {
        estimator->faults = LEVER_FAULT_CLOCK; /* the sample is ignored */
    } else {
        const float elapsed = (started && !new_clock) ? ((float)elapsed_us * 1.0e-6f) : 0.0f;
        checked_t checked;
        lever_sample_t met = *sample;
        float commanded = commanded_torque;
        delay_line_pass(
            &estimator->line, estimator->setup.delay_samples, periods_in(estimator, elapsed), &met, &commanded);
        check(estimator, &met, commanded, elapsed, &checked);
        estimator->late_series_us = 0u;
        if (started && !new_clock) {
            step(estimator, &checked, &last, elapsed);
        } else {
            alignment_begin(estimator, &checked);
        }
    }
    return estimator->mode;
}
