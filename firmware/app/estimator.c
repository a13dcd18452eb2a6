#include "app/estimator.h"

#include "math/trigonometry.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define RESTART_MEMORY 10.0f      /* [s] */
#define RESTARTS_TOLERATED 5.0f   /* within that */
#define INNOVATION_TOLERATED 3.0f /* mean of nis / nis_size; 1 is expected */
#define SUBSTEPS_MOST 16u         /* predictions through a gap: bounds the time of one call */
#define THETA_MOST 25.0f          /* plausible samples [rad], [rad/s], [N m], [m/s^2] */
#define OTHER_MOST 1.0e4f
#define TURN 6.28318531f
#define HALF_TURN_OF_TIME 0x80000000u

static const model_t *const models[LEVER_MODEL_COUNT] = {&model_lever, &model_linear_physical, &model_linear_black_box};

static const model_t *model_of(const estimator_t *estimator)
{
    return models[estimator->setup.model];
}

static float squared(float x)
{
    return x * x;
}

/* --- life ------------------------------------------------------------------------------------------------------ */

static void init_constants(model_constants_t *constants, const setup_t *setup)
{
    const lever_settings_t *s = setup->settings;
    constants->length = s->lever_length;
    constants->length_squared = squared(s->lever_length);
    constants->mass_moment = s->lever_mass_position * s->lever_mass;
    constants->inertia =
        (squared(s->lever_mass_position) * s->lever_mass * squared(s->lever_length)) + s->lever_inertia;
    constants->damping = s->lever_damping;
    constants->stiffness = s->lever_stiffness;
    constants->arm_preload_sine = sine_cosine(s->arm_preload_angle).sine;
    constants->lever_preload_angle = s->lever_preload_angle;
    constants->trim = (setup->preload == (uint8_t)LEVER_PRELOAD_TRIM);
}

static void init_dual(estimator_t *estimator)
{
    (void)memset(&estimator->dual, 0, sizeof estimator->dual);
    const lever_settings_t *s = estimator->setup.settings;
    const prior_t prior = prior_of(&estimator->setup); /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    parameter_filter_init(&estimator->dual.parameters, model_of(estimator), &estimator->constants, &prior);

    state_filter_t *state = &estimator->dual.state;
    state->process_noise[0] = s->theta_process_noise;
    state->process_noise[1] = s->theta_dot_process_noise;
    state->output_noise[0] = s->theta_noise;
    state->output_noise[1] = s->theta_dot_noise;
    state->s[0] = s->theta_noise;
    state->s[3] = s->theta_dot_noise;
    noise_begin(&estimator->dual.noise);
}

/* Back to before the first sample; dither and counts go on. */
static void start_over(estimator_t *estimator)
{
    init_constants(&estimator->constants, &estimator->setup);
    init_dual(estimator);
    learning_start(&estimator->learning, &estimator->setup, &estimator->dual);
    (void)memset(&estimator->followed, 0, sizeof estimator->followed);
    estimator->mode = LEVER_MODE_INIT;
    estimator->frozen = false;
    estimator->last_z_ddot = 0.0f;
    estimator->last_tau_m = 0.0f;
    (void)memset(&estimator->levels, 0, sizeof estimator->levels);
    estimator->trim = sine_cosine(0.0f);
    estimator->nis = 0.0f;
    estimator->nis_size = 0u;
    estimator->faults = 0u;
}

void estimator_init(estimator_t *estimator, const lever_config_t *config)
{
    const lever_settings_t *s = &config->settings;
    (void)memset(estimator, 0, sizeof *estimator);
    estimator->setup.settings = s;
    estimator->setup.model = config->model;
    estimator->setup.preload = config->preload;
    estimator->setup.estimator = config->estimator;
    estimator->setup.adaptation = config->adaptation;
    start_over(estimator);
}

/* --- commands -------------------------------------------------------------------------------------------------- */

static bool is_choice(uint8_t value, uint8_t count)
{
    return (value < count) || (value == (uint8_t)LEVER_KEEP);
}

/* The value of a choice that is to be, of what was asked and what is. */
static uint8_t chosen(uint8_t asked, uint8_t now)
{
    return (asked != (uint8_t)LEVER_KEEP) ? asked : now;
}

bool estimator_command(estimator_t *estimator, const lever_command_t *command)
{
    const bool known = (command->request <= (uint8_t)LEVER_REQUEST_RESET) &&
                       is_choice(command->model, (uint8_t)LEVER_MODEL_COUNT) &&
                       is_choice(command->preload, (uint8_t)LEVER_PRELOAD_COUNT) &&
                       is_choice(command->estimator, (uint8_t)LEVER_ESTIMATOR_COUNT) &&
                       is_choice(command->adaptation, (uint8_t)LEVER_ADAPTATION_COUNT);
    if (known) {
        setup_t *setup = &estimator->setup;
        const setup_t last = *setup;
        setup->model = chosen(command->model, last.model);
        setup->preload = chosen(command->preload, last.preload);
        setup->estimator = chosen(command->estimator, last.estimator);
        setup->adaptation = chosen(command->adaptation, last.adaptation);
        if (setup->adaptation != last.adaptation) {
            learning_adapt(setup, &estimator->dual);
        }
        if ((setup->model != last.model) || (setup->preload != last.preload) || (setup->estimator != last.estimator) ||
            (command->request == (uint8_t)LEVER_REQUEST_RESET)) {
            start_over(estimator);
        }
        if ((command->request == (uint8_t)LEVER_REQUEST_RUN) || (command->request == (uint8_t)LEVER_REQUEST_FREEZE)) {
            estimator->frozen = (command->request == (uint8_t)LEVER_REQUEST_FREEZE);
        }
    }
    return known;
}

/* --- samples --------------------------------------------------------------------------------------------------- */

/* A flagged value that is plausible; NaN is not. */
static bool is_usable(estimator_t *estimator, float value, bool valid, float most)
{
    const bool plausible = (fabsf(value) <= most);
    if (valid && !plausible) {
        estimator->corrupt++;
    }
    return valid && plausible;
}

/* What a sample is worth: its outputs, and inputs of which a missing base acceleration is the last one, a missing torque 0. */
typedef struct taken {
    measurement_t measurement;
    float z_ddot;
    float tau_m;
} taken_t;

/* Notes in the faults what is missing. */
static taken_t take_sample(estimator_t *estimator, const lever_sample_t *sample)
{
    taken_t taken;
    measurement_t *measurement = &taken.measurement;
    measurement->y[0] = sample->theta;
    measurement->y[1] = sample->theta_dot;
    measurement->valid[0] = is_usable(estimator, sample->theta, sample->theta_valid, THETA_MOST);
    measurement->valid[1] = is_usable(estimator, sample->theta_dot, sample->theta_dot_valid, OTHER_MOST);
    const bool torque = is_usable(estimator, sample->tau_m, sample->tau_m_valid, OTHER_MOST);
    const bool base = is_usable(estimator, sample->z_ddot, sample->z_ddot_valid, OTHER_MOST);
    taken.tau_m = torque ? sample->tau_m : 0.0f;
    taken.z_ddot = base ? sample->z_ddot : estimator->last_z_ddot;
    estimator->last_z_ddot = taken.z_ddot;
    estimator->last_tau_m = taken.tau_m;
    estimator->time_us = sample->time_us;

    uint32_t faults = 0u;
    faults |= measurement->valid[0] ? 0u : (uint32_t)LEVER_FAULT_THETA;
    faults |= measurement->valid[1] ? 0u : (uint32_t)LEVER_FAULT_THETA_DOT;
    faults |= torque ? 0u : (uint32_t)LEVER_FAULT_TORQUE;
    faults |= base ? 0u : (uint32_t)LEVER_FAULT_BASE;
    faults |= estimator->communication_fault ? (uint32_t)LEVER_FAULT_COMMUNICATION : 0u;
    estimator->faults = (uint16_t)faults;
    estimator->communication_fault = false;
    return taken;
}

static void note(estimator_t *estimator, bool present, enum lever_fault fault)
{
    if (present) {
        estimator->faults = (uint16_t)(estimator->faults | (uint16_t)fault);
    }
}

/* The state starts at this sample (deviations in preload trim), with the uncertainty of the measurement; an angle not
 * known is near the trim, a rate not known anything plausible. */
static void start_state(estimator_t *estimator, const measurement_t *measurement)
{
    const levels_t *levels = &estimator->levels;
    state_filter_t *state = &estimator->dual.state;
    state->x[0] = measurement->valid[0] ? measurement->y[0] : (levels->output[0].level - levels->origin[0]);
    state->x[1] = measurement->valid[1] ? measurement->y[1] : 0.0f;
    state->s[0] = measurement->valid[0] ? state->output_noise[0] : 0.1f;
    state->s[1] = 0.0f;
    state->s[2] = 0.0f;
    state->s[3] = measurement->valid[1] ? state->output_noise[1] : 1.0f;
    state->echo[0] = 0.0f;
    state->echo[1] = 0.0f;
    parameter_filter_forget_state(&estimator->dual.parameters);
}

/* Averages angles until align_time has passed, then starts the state at a valid one. */
static void align(estimator_t *estimator, const taken_t *taken, float elapsed)
{
    const lever_settings_t *settings = estimator->setup.settings;
    alignment_t *alignment = &estimator->alignment;
    measurement_t measurement = taken->measurement; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    alignment->time += elapsed;
    estimator->mode = LEVER_MODE_ALIGN;
    if (measurement.valid[0]) {
        alignment->theta_sum += measurement.y[0];
        alignment->count += 1.0f;
        levels_start(&estimator->levels, alignment->theta_sum / alignment->count, settings->trim_corner,
            estimator->constants.trim);
        estimator->trim = sine_cosine(estimator->levels.output[0].level);
        estimator->z_ddot = taken->z_ddot;
        estimator->tau_m = taken->tau_m;
        measurement.y[0] -= estimator->levels.origin[0];
        start_state(estimator, &measurement);
        if (alignment->time > (settings->align_time - (0.5f * settings->sample_period))) {
            estimator->mode = LEVER_MODE_RUN;
        }
    }
}

/* Excitation is presumed until it has been measured, so that annealing is not cut short at the start. */
static void begin_alignment(estimator_t *estimator, const taken_t *taken)
{
    (void)memset(&estimator->alignment, 0, sizeof estimator->alignment);
    estimator->followed.excitation_square = 4.0f * squared(estimator->setup.settings->excitation_least);
    estimator->followed.innovation_mean = 1.0f;
    align(estimator, taken, 0.0f);
}

/* What follows the estimate: excitation, innovation level, memory of restarts. */
static void follow(estimator_t *estimator, float elapsed)
{
    const lever_settings_t *s = estimator->setup.settings;
    followed_t *followed = &estimator->followed;
    const float share = (elapsed < s->excitation_time) ? (elapsed / s->excitation_time) : 1.0f;
    followed->excitation_square += share * (squared(estimator->dual.state.x[1]) - followed->excitation_square);
    followed->restart_debt -= followed->restart_debt * (elapsed / RESTART_MEMORY);
    if (estimator->nis_size != 0u) {
        const float ratio = estimator->nis / (float)estimator->nis_size;
        followed->innovation_mean += share * (ratio - followed->innovation_mean);
    }
}

/* Refuses an estimate that breaks an invariant, and starts again from the measurement and the first guess. Whether it
 * is finite is asked of every sample, the rest of the parameters when they have been revised. */
static void restart_if_invalid(estimator_t *estimator, const measurement_t *measurement)
{
    const dual_t *dual = &estimator->dual;
    if (!(learning_is_done(&estimator->learning) ? dual_is_valid(dual) : dual_is_finite(dual))) {
        init_dual(estimator);
        learning_start(&estimator->learning, &estimator->setup, &estimator->dual);
        start_state(estimator, measurement);
        estimator->followed.innovation_mean = 1.0f;
        estimator->nis = 0.0f;
        estimator->recoveries++;
        estimator->followed.restart_debt += 1.0f;
        note(estimator, true, LEVER_FAULT_RECOVERED);
    }
}

/* Predicts one period ahead, with the mean of the inputs at both ends. */
static void predict(estimator_t *estimator, float z_ddot, float tau_m, float period)
{
    levels_t *levels = &estimator->levels;
    const float z_deviation = levels_input(levels, 0u, z_ddot, period);
    const float tau_deviation = levels_input(levels, 1u, tau_m, period);
    levels_set_origin(levels);
    model_step_t step;
    step.period = period;
    step.z_ddot = 0.5f * (estimator->z_ddot + z_deviation);
    step.tau_m = 0.5f * (estimator->tau_m + tau_deviation);
    step.origin = levels->origin[0];
    step.trim = levels->output[0].level;
    step.trim_sine = estimator->trim.sine;
    step.trim_cosine = estimator->trim.cosine;
    dual_predict(&estimator->dual, model_of(estimator), &estimator->constants, &step);
    estimator->z_ddot = z_deviation;
    estimator->tau_m = tau_deviation;
}

/* After an outage the prediction is worth little, more so if the base was not known either: the state starts again where it
 * is measured. */
static void end_outage(estimator_t *estimator, const measurement_t *measurement)
{
    if (measurement->valid[0] && measurement->valid[1]) {
        start_state(estimator, measurement);
    }
    levels_unsettle(&estimator->levels);
}

/* Outputs become what the state counts them as, and the trim follows them. Returns true at the end of an outage. */
static bool refer(estimator_t *estimator, measurement_t *measurement, float period)
{
    levels_t *levels = &estimator->levels;
    const bool back = levels_refer(levels, estimator->dual.state.x, measurement, period);
    estimator->trim = sine_cosine(levels->output[0].level);
    return back;
}

/* Predicts to the sample in `substeps`, inputs in between on a straight line from the last ones. */
static void advance(
    estimator_t *estimator, taken_t *taken, float last_z_ddot, float last_tau_m, float period, uint32_t substeps)
{
    for (uint32_t i = 1u; i <= substeps; i++) {
        const float share = (float)i / (float)substeps;
        predict(estimator, last_z_ddot + (share * (taken->z_ddot - last_z_ddot)),
            last_tau_m + (share * (taken->tau_m - last_tau_m)), period);
        if (i < substeps) {
            measurement_t nothing = {.valid = {false, false}};
            (void)refer(estimator, &nothing, period);
        }
    }
    if (refer(estimator, &taken->measurement, period)) {
        end_outage(estimator, &taken->measurement);
    }
}

static enum lever_mode mode_of(const estimator_t *estimator, bool measured)
{
    enum lever_mode mode = measured ? LEVER_MODE_RUN : LEVER_MODE_COAST;
    if (estimator->frozen) {
        mode = LEVER_MODE_FROZEN;
    }
    if (estimator->followed.restart_debt > RESTARTS_TOLERATED) {
        mode = LEVER_MODE_FAULT;
    }
    return mode;
}

static void correct(estimator_t *estimator, const measurement_t *measurement, float elapsed)
{
    const float least = estimator->setup.settings->excitation_least;
    const bool measured = measurement->valid[0] || measurement->valid[1];
    const bool excited = (estimator->followed.excitation_square >= squared(least));
    const bool settled = estimator->levels.unsettled < (0.5f * estimator->setup.settings->sample_period);
    const bool learn = !estimator->frozen && settled;
    const lesson_t lesson = {.walks = !estimator->frozen, .teaches = learn && measured, .excited = excited};
    estimator->nis = dual_update(&estimator->dual, measurement, learn && excited);
    estimator->nis_size = (uint8_t)((measurement->valid[0] ? 1u : 0u) + (measurement->valid[1] ? 1u : 0u));
    learning_step(&estimator->learning, &estimator->setup, &estimator->dual, model_of(estimator), &estimator->constants,
        &lesson, elapsed);
    estimator->levels.unsettled -= elapsed;
    restart_if_invalid(estimator, measurement);
    follow(estimator, elapsed);
    uint32_t faults = estimator->faults;
    faults |= excited ? 0u : (uint32_t)LEVER_FAULT_EXCITATION;
    faults |= estimator->learning.bounded ? (uint32_t)LEVER_FAULT_BOUND : 0u;
    faults |= learning_has_changed(&estimator->learning) ? (uint32_t)LEVER_FAULT_CHANGE : 0u;
    faults |= (estimator->followed.innovation_mean > INNOVATION_TOLERATED) ? (uint32_t)LEVER_FAULT_INNOVATION : 0u;
    estimator->faults = (uint16_t)faults;
    estimator->mode = mode_of(estimator, measured);
}

/* Number of sample periods in `elapsed`, at least one. */
static uint32_t periods_in(const estimator_t *estimator, float elapsed)
{
    const float rounded = (elapsed / estimator->setup.settings->sample_period) + 0.5f;
    const uint32_t periods = (uint32_t)rounded;
    return (periods > 0u) ? periods : 1u;
}

static void take_and_step(estimator_t *estimator, const lever_sample_t *sample, float elapsed)
{
    const float last_z_ddot = estimator->last_z_ddot;
    const float last_tau_m = estimator->last_tau_m;
    const uint32_t periods = periods_in(estimator, elapsed);
    taken_t taken = take_sample(estimator, sample); /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    estimator->lost += periods - 1u;
    note(estimator, periods > 1u, LEVER_FAULT_GAP);

    if (estimator->mode == LEVER_MODE_FAULT) {
        /* only a reset helps */
    } else if (elapsed > estimator->setup.settings->gap_limit) {
        learning_skip(&estimator->learning, &estimator->setup, &estimator->dual, model_of(estimator),
            &estimator->constants, elapsed);
        begin_alignment(estimator, &taken);
    } else if (estimator->mode == LEVER_MODE_ALIGN) {
        align(estimator, &taken, elapsed);
    } else {
        const uint32_t substeps = (periods < SUBSTEPS_MOST) ? periods : SUBSTEPS_MOST;
        advance(estimator, &taken, last_z_ddot, last_tau_m, elapsed / (float)substeps, substeps);
        correct(estimator, &taken.measurement, elapsed);
    }
}

/* Counts a sample that is not newer than the last. Returns true when such samples have advanced for gap_limit: then they
 * are not late, but their sender has started its clock anew. */
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

enum lever_mode estimator_update(estimator_t *estimator, const lever_sample_t *sample)
{
    const uint32_t elapsed_us = sample->time_us - estimator->time_us;
    const bool late = (elapsed_us == 0u) || (elapsed_us >= HALF_TURN_OF_TIME);
    if (late && (estimator->mode != LEVER_MODE_INIT)) {
        const bool new_clock = is_new_clock(estimator, sample->time_us);
        if (new_clock && (estimator->mode != LEVER_MODE_FAULT)) {
            estimator->mode = LEVER_MODE_INIT;
        }
    }
    if (estimator->mode == LEVER_MODE_INIT) {
        const taken_t taken = take_sample(estimator, sample); /* cppcheck-suppress misra-c2012-9.3 ; D3 */
        estimator->samples++;
        begin_alignment(estimator, &taken);
        estimator->late_series_us = 0u;
    } else if (!late) {
        const float elapsed = (float)elapsed_us * 1.0e-6f;
        estimator->late_series_us = 0u;
        estimator->samples++;
        take_and_step(estimator, sample, elapsed);
    } else {
        estimator->faults = (uint16_t)LEVER_FAULT_CLOCK; /* late: counted above, otherwise ignored */
    }
    return estimator->mode;
}

/* --- what is known --------------------------------------------------------------------------------------------- */

float estimator_state(const estimator_t *estimator, uint32_t i)
{
    return estimator->levels.origin[i] + estimator->dual.state.x[i];
}

static model_step_t step_at_trim(const estimator_t *estimator)
{
    const sine_cosine_t *trim = &estimator->trim;
    const model_step_t step = {
        .trim = estimator->levels.output[0].level, .trim_sine = trim->sine, .trim_cosine = trim->cosine};
    return step;
}

void estimator_parameters(const estimator_t *estimator, float p[LEVER_PARAMETERS])
{
    (void)memcpy(p, estimator->dual.parameters.p, sizeof estimator->dual.parameters.p);
}

void estimator_parameter_sigma(const estimator_t *estimator, float sigma[LEVER_PARAMETERS])
{
    parameter_filter_sigma(&estimator->dual.parameters, sigma);
}

void estimator_derive(const estimator_t *estimator, derived_t *derived)
{
    const model_step_t step = step_at_trim(estimator);
    const parameter_filter_t *parameters = &estimator->dual.parameters;
    derived_begin(derived, parameters, model_of(estimator), &estimator->constants, &step);
    derived_end(derived, parameters, model_of(estimator), &estimator->constants, &step);
}

/* Standard deviation of state i. While its level waits for samples, what moves slower than trim_corner is not predicted: a
 * quarter of the rms rate, in the state's unit by `scale`. */
static float state_sigma(const estimator_t *estimator, uint32_t i, float scale)
{
    const bool waiting = estimator->constants.trim && levels_is_waiting(&estimator->levels, i);
    const float slow = waiting ? (0.25f * scale) : 0.0f;
    return sqrtf(
        squared(dual_state_sigma(&estimator->dual, i)) + (squared(slow) * estimator->followed.excitation_square));
}

void estimator_estimate(const estimator_t *estimator, lever_estimate_t *estimate)
{
    const dual_t *dual = &estimator->dual;
    estimate->time_us = estimator->time_us;
    estimate->theta = estimator_state(estimator, 0u);
    estimate->theta_dot = estimator_state(estimator, 1u);
    estimate->theta_sigma = state_sigma(estimator, 0u, 1.0f / (TURN * estimator->setup.settings->trim_corner));
    estimate->theta_dot_sigma = state_sigma(estimator, 1u, 1.0f);
    estimate->trim = estimator->levels.output[0].level;
    estimate->nis = estimator->nis;
    estimate->nis_size = estimator->nis_size;
    (void)memcpy(estimate->parameter, dual->parameters.p, sizeof estimate->parameter);
    parameter_filter_sigma(&dual->parameters, estimate->parameter_sigma);
    parameter_filter_correlation(&dual->parameters, estimate->parameter_correlation);

    derived_t derived;
    estimator_derive(estimator, &derived);
    estimate->natural_frequency = derived.mean.natural_frequency;
    estimate->natural_frequency_sigma = sqrtf(derived.variance.natural_frequency);
    estimate->damping_ratio = derived.mean.damping_ratio;
    estimate->damping_ratio_sigma = sqrtf(derived.variance.damping_ratio);
}

void estimator_health(const estimator_t *estimator, lever_health_t *health)
{
    health->mode = estimator->mode;
    health->faults = estimator->faults;
    health->samples = estimator->samples;
    health->lost = estimator->lost;
    health->corrupt = estimator->corrupt;
    health->late = estimator->late;
    health->recoveries = estimator->recoveries;
    health->excitation = sqrtf(estimator->followed.excitation_square);
}

const char *lever_parameter_name(uint8_t model, uint32_t index)
{
    const bool known = (model < (uint8_t)LEVER_MODEL_COUNT) && (index < (uint32_t)MODEL_PARAMETERS);
    return known ? models[model]->parameter[index].name : NULL;
}

const char *lever_parameter_unit(uint8_t model, uint32_t index)
{
    const bool known = (model < (uint8_t)LEVER_MODEL_COUNT) && (index < (uint32_t)MODEL_PARAMETERS);
    return known ? models[model]->parameter[index].unit : NULL;
}
