#include "app/estimator.h"
#include "app/alignment.h"
#include "app/prediction.h"
#include "math/bounds.h"
#include "math/share.h"

#include <math.h>
#include <string.h>

#define RESTARTS_FORGOTTEN 0.1f   /* part of them each second [1/s] */
#define RESTARTS_TOLERATED 5.0f   /* not yet forgotten */
#define INNOVATION_TOLERATED 3.0f /* mean of nis / nis_size; expected 1 */
#define INNOVATION_MOST 1.0e6f    /* a single value is not averaged beyond this, so that the mean recovers */
#define MOTION_TIME 0.1f          /* [s] */
#define NOISE_LIKE_MOTION 0.2f    /* of the noise of theta_dot, in squares: what a mean of products may be by chance */
#define RATE_OF_ANGLE 2.0f        /* presumed rate over angle, in corners of the trim */
#define CLOCK_LEAST 0.25f         /* of a sample_period: a clock that advances by less as good as stands */
#define OTHER_MOST 1.0e4f         /* plausible samples but of theta [rad/s], [N m], [m/s^2] */
#define HALF_TURN_OF_TIME 0x80000000u

static float squared(float x)
{
    return x * x;
}

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
    start_filter(estimator);
    (void)memset(&estimator->averages, 0, sizeof estimator->averages);
    (void)memset(&estimator->trim, 0, sizeof estimator->trim);
    estimator->trim_sine_cosine = sine_cosine(0.0f);
    estimator->mode = LEVER_MODE_INIT;
    estimator->frozen = false;
    estimator->last_z_ddot = 0.0f;
    estimator->raw_z_ddot = 0.0f;
    estimator->base_missing = 0.0f;
    estimator->last_tau_m = 0.0f;
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

/* The true base acceleration of a sensor with gain and delay, the delay by extrapolation. */
static float compensated(estimator_t *estimator, float z_ddot, float elapsed)
{
    const lever_settings_t *s = estimator->setup.settings;
    const bool late = (s->z_ddot_delay > 0.0f) && (elapsed > 0.0f);
    const float ahead = late ? (s->z_ddot_delay * ((z_ddot - estimator->raw_z_ddot) / elapsed)) : 0.0f;
    estimator->raw_z_ddot = z_ddot;
    return seat_step(&estimator->seat, (z_ddot + ahead) * estimator->setup.base_scale, elapsed);
}

/* An input that is plausible, but for some samples far from where it was. Not after it was missing, as `fault` of the
 * last sample says: then there is no change from sample to sample. */
static bool has_jumped(
    estimator_t *estimator, enum monitor_input input, enum lever_fault fault, float change, float elapsed)
{
    monitor_t *monitor = &estimator->learning.monitor;
    bool jumped = false;
    if (((estimator->faults & (uint32_t)fault) == 0u) || (monitor->jump[input].refused > 0.0f)) {
        jumped = monitor_is_jump(monitor, input, change, elapsed);
        estimator->corrupt += jumped ? 1u : 0u;
    }
    return jumped;
}

/* Notes in the faults what is missing, `elapsed` seconds after the last sample. */
static void check(
    estimator_t *estimator, const lever_sample_t *sample, float own_torque, float elapsed, checked_t *checked)
{
    monitor_t *monitor = &estimator->learning.monitor;
    const bool theta = is_usable(estimator, sample->theta, sample->theta_valid, MODEL_THETA_MOST);
    const bool theta_dot = is_usable(estimator, sample->theta_dot, sample->theta_dot_valid, OTHER_MOST);
    const bool successive = (elapsed > 0.0f) && (elapsed < (1.5f * estimator->setup.settings->sample_period));
    const bool measured = is_usable(estimator, sample->tau_m, sample->tau_m_valid, OTHER_MOST);
    const float tau_m = sample->tau_m * estimator->setup.torque_scale;
    const bool torque_jumped =
        measured && successive &&
        has_jumped(estimator, MONITOR_TORQUE, LEVER_FAULT_TORQUE, tau_m - estimator->last_tau_m, elapsed);
    const bool torque = measured && !torque_jumped;
    const bool base = is_usable(estimator, sample->z_ddot, sample->z_ddot_valid, OTHER_MOST);
    checked->y[0] = sample->theta;
    checked->y[1] = sample->theta_dot;
    checked->valid[0] = theta && monitor_is_alive(monitor, MONITOR_THETA, sample->theta);
    checked->valid[1] = theta_dot && monitor_is_alive(monitor, MONITOR_THETA_DOT, sample->theta_dot);
    checked->base = base && monitor_is_alive(monitor, MONITOR_Z_DDOT, sample->z_ddot);
    checked->gripped = is_usable(estimator, sample->grip_force, sample->grip_force_valid, OTHER_MOST);
    checked->grip_force = sample->grip_force;
    const bool jumped =
        checked->base && successive &&
        has_jumped(estimator, MONITOR_BASE, LEVER_FAULT_BASE, sample->z_ddot - estimator->raw_z_ddot, elapsed);
    checked->tau_m = torque_jumped ? estimator->last_tau_m : own_torque;
    checked->tau_m = torque ? tau_m : checked->tau_m;
    if (torque && monitor_takes_torque(estimator->samples)) {
        monitor_add_torque(monitor, own_torque, checked->tau_m);
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
    note(estimator, !torque || monitor->torque_wrong, LEVER_FAULT_TORQUE);
    note(estimator, !checked->base || jumped || monitor->base_wrong, LEVER_FAULT_BASE);
    note(estimator, estimator->communication_fault, LEVER_FAULT_COMMUNICATION);
    estimator->communication_fault = false;
}

/* --- measurement update ------------------------------------------------------------------------------------------ */

/* Refuses an estimate that breaks an invariant: the filter starts again from the measurement and the first guess. */
static bool restart_if_invalid(estimator_t *estimator, const checked_t *sample, bool learnt)
{
    const cdkf_t *cdkf = &estimator->cdkf;
    const bool valid = learnt ? cdkf_is_valid(cdkf) : cdkf_state_is_valid(cdkf);
    if (!valid) {
        start_filter(estimator);
        alignment_start_state(estimator, sample->y, sample->valid);
        estimator->averages.innovation = 1.0f;
        estimator->nis = 0.0f;
        estimator->recoveries++;
        estimator->averages.restarts += 1.0f;
    }
    return !valid;
}

/* The measured motion exceeds excitation_least and what the noise of the sensor may look like. */
static bool is_excited(const estimator_t *estimator)
{
    const averages_t *averages = &estimator->averages;
    const float least = squared(estimator->setup.settings->excitation_least) +
                        (NOISE_LIKE_MOTION * squared(estimator->cdkf.output_noise[1]));
    return (averages->excitation_square >= least) && (averages->motion_square >= (0.25f * least));
}

/* The mean square of the rate, as the product of successive samples: unlike motion, the noise of a sensor differs from
 * sample to sample. The prediction is no evidence of motion: the base drives it on a lever that is locked. Where only
 * theta is measured, a motion well above the trim's corner is presumed. `share` is that of a sample in the mean. */
static void average_motion(estimator_t *estimator, const checked_t *sample, float elapsed, float share)
{
    averages_t *averages = &estimator->averages;
    const uint32_t i = sample->valid[1] ? 1u : 0u;
    if (sample->valid[i]) {
        float now = sample->y[i];
        if (i == 0u) {
            const float angle = now - (estimator->setup.constants.trim ? 0.0f : trim_angle(&estimator->trim));
            now = (RATE_OF_ANGLE * estimator->trim.corner) * angle;
        }
        const float square = now * averages->last[i];
        averages->last[i] = now;
        if (elapsed < TRIM_OUTAGE) {
            const float excitation = averages->excitation_square;
            averages->excitation_square = greater(excitation + (share * (square - excitation)), 0.0f);
            averages->motion_square +=
                lesser(elapsed * (1.0f / MOTION_TIME), 1.0f) * (square - averages->motion_square);
        }
    }
}

/* The levels have settled, and the base acceleration is known. */
static bool is_settled(const estimator_t *estimator)
{
    return (estimator->trim.unsettled < (0.5f * estimator->setup.settings->sample_period)) &&
           (estimator->base_missing <= 0.0f);
}

bool estimator_may_learn(const estimator_t *estimator)
{
    return !estimator->frozen && is_settled(estimator) && is_excited(estimator);
}

static void average(estimator_t *estimator, const checked_t *sample, float elapsed)
{
    const float time = estimator->setup.settings->excitation_time;
    averages_t *averages = &estimator->averages;
    const float share = share_of(elapsed, time);
    average_motion(estimator, sample, elapsed, share);
    if (averages->restarts > 0.0f) {
        averages->restarts -= averages->restarts * (elapsed * RESTARTS_FORGOTTEN);
    }
    if (estimator->nis_size != 0u) {
        const float ratio = (estimator->nis_size == 2u) ? (0.5f * estimator->nis) : estimator->nis;
        const float bounded = lesser(ratio, INNOVATION_MOST);
        monitor_add(&estimator->learning.monitor, ratio, elapsed);
        if (estimator->trim.unsettled <= 0.0f) { /* innovations are those of the filter, not of the levels */
            averages->innovation += share * (bounded - averages->innovation);
        }
    }
}

static enum lever_mode mode_of(const estimator_t *estimator, bool measured)
{
    enum lever_mode mode = measured ? LEVER_MODE_RUN : LEVER_MODE_COAST;
    if (estimator->frozen) {
        mode = LEVER_MODE_FROZEN;
    }
    if (estimator->averages.restarts > RESTARTS_TOLERATED) {
        mode = LEVER_MODE_FAULT;
    }
    return mode;
}

/* Measurement update of the filter; returns what may be learnt from the sample. */
static lesson_t update_filter(estimator_t *estimator, const checked_t *sample)
{
    const bool measured = sample->valid[0] || sample->valid[1];
    const lesson_t lesson = {
        .walks = !estimator->frozen, .measured = measured && is_settled(estimator), .excited = is_excited(estimator)};
    innovation_t innovation[CDKF_OUTPUTS];
    cdkf_measurement_update(&estimator->cdkf, sample->y, sample->valid, lesson.measured, innovation);
    if (lesson.excited && lesson.measured) {
        noise_estimation_add(&estimator->learning.noise, innovation, sample->valid);
        whiteness_add(&estimator->learning.whiteness, innovation[sample->valid[1] ? 1u : 0u].value);
    }
    estimator->nis = (squared(innovation[0].value) * innovation[0].inverse_variance) +
                     (squared(innovation[1].value) * innovation[1].inverse_variance);
    estimator->nis_size = (uint8_t)((sample->valid[0] ? 1u : 0u) + (sample->valid[1] ? 1u : 0u));
    return lesson;
}

static void correct(estimator_t *estimator, const checked_t *sample, float elapsed)
{
    const learning_t *learning = &estimator->learning;
    const lesson_t lesson = update_filter(estimator, sample);
    const bool learnt = learning_step(&estimator->learning, &estimator->setup, &estimator->cdkf, &lesson, elapsed);
    if (estimator->learning.moved) {
        estimator->learning.moved = false;
        alignment_begin_grip(estimator, sample);
    }
    note(estimator, (estimator->trim.unsettled > 0.0f), LEVER_FAULT_SETTLING);
    const bool restarted = restart_if_invalid(estimator, sample, learnt);
    average(estimator, sample, elapsed);
    note(estimator, !lesson.excited, LEVER_FAULT_EXCITATION);
    note(estimator, learning->bounded, LEVER_FAULT_BOUND);
    note(estimator, learning->changed > 0.0f, LEVER_FAULT_CHANGE);
    note(estimator, estimator->averages.innovation > INNOVATION_TOLERATED, LEVER_FAULT_INNOVATION);
    note(estimator, learning->whiteness.coloured, LEVER_FAULT_MISMATCH);
    note(estimator, learning->calibration.wrong || learning->force.wrong, LEVER_FAULT_CALIBRATION);
    note(estimator, learning->hands.off, LEVER_FAULT_HANDS_OFF);
    note(estimator, restarted, LEVER_FAULT_RECOVERED);
    estimator->mode = mode_of(estimator, sample->valid[0] || sample->valid[1]);
}

/* --- samples ----------------------------------------------------------------------------------------------------- */

/* Number of sample periods in `elapsed`, at least one. */
static uint32_t periods_in(const estimator_t *estimator, float elapsed)
{
    const float period = estimator->setup.settings->sample_period;
    uint32_t periods = 1u;
    if (elapsed > (1.5f * period)) {
        const float rounded = (elapsed / period) + 0.5f;
        periods = (uint32_t)rounded;
    }
    return periods;
}

/* Sensors are judged while nothing is estimated yet. The first block of RUN begins with its first sample. */
static void watch_alignment(estimator_t *estimator, float elapsed)
{
    static const lesson_t none = {.walks = false, .measured = false, .excited = true};
    (void)learning_step(&estimator->learning, &estimator->setup, &estimator->cdkf, &none, elapsed);
}

/* A sample `elapsed` seconds after the last one. */
static void step(estimator_t *estimator, checked_t *sample, const inputs_t *last, float elapsed)
{
    const uint32_t periods = periods_in(estimator, elapsed);
    estimator->trim.unsettled -= elapsed; /* before this sample may set it */
    note(estimator, elapsed < (CLOCK_LEAST * estimator->setup.settings->sample_period), LEVER_FAULT_CLOCK);
    if (periods > 1u) {
        estimator->lost += periods - 1u;
        note(estimator, true, LEVER_FAULT_GAP);
    }
    if (estimator->mode == LEVER_MODE_FAULT) {
        /* only a reset leaves it */
    } else if (elapsed > estimator->setup.settings->gap_limit) {
        learning_skip(&estimator->learning, &estimator->setup, &estimator->cdkf, elapsed);
        alignment_begin(estimator, sample);
    } else if (estimator->mode == LEVER_MODE_ALIGN) {
        watch_alignment(estimator, elapsed);
        alignment_step(estimator, sample, elapsed);
    } else {
        prediction_advance(estimator, sample, last, elapsed, periods);
        correct(estimator, sample, elapsed);
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

enum lever_mode estimator_update(estimator_t *estimator, const lever_sample_t *sample, float own_torque)
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
        check(estimator, sample, own_torque, elapsed, &checked);
        estimator->late_series_us = 0u;
        if (started && !new_clock) {
            step(estimator, &checked, &last, elapsed);
        } else {
            alignment_begin(estimator, &checked);
        }
    }
    return estimator->mode;
}
