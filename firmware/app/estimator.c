#include "app/estimator.h"

#include "app/prior.h"
#include "filter/derived.h"
#include "math/trigonometry.h"

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

static float squared(float x)
{
    return x * x;
}

/* --- life ------------------------------------------------------------------------------------------------------ */

static void init_constants(model_constants_t *constants, const lever_config_t *config)
{
    const lever_settings_t *s = &config->settings;
    constants->length = s->lever_length;
    constants->length_squared = squared(s->lever_length);
    constants->mass_moment = s->lever_mass_position * s->lever_mass;
    constants->inertia =
        (squared(s->lever_mass_position) * s->lever_mass * squared(s->lever_length)) + s->lever_inertia;
    constants->damping = s->lever_damping;
    constants->stiffness = s->lever_stiffness;
    constants->arm_preload_sine = sine_cosine(s->arm_preload_angle).sine;
    constants->lever_preload_angle = s->lever_preload_angle;
    constants->trim = (config->preload == (uint8_t)LEVER_PRELOAD_TRIM);
}

static void init_dual(estimator_t *estimator)
{
    (void)memset(&estimator->dual, 0, sizeof estimator->dual);
    const lever_settings_t *s = &estimator->config.settings;
    const prior_t prior = prior_of(&estimator->config); /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    parameter_filter_init(&estimator->dual.parameters, estimator->model, &prior);

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
    estimator->model = models[estimator->config.model];
    init_constants(&estimator->constants, &estimator->config);
    init_dual(estimator);
    learning_start(&estimator->learning, &estimator->config, &estimator->dual);
    (void)memset(&estimator->followed, 0, sizeof estimator->followed);
    estimator->mode = LEVER_MODE_INIT;
    estimator->frozen = false;
    estimator->last_z_ddot = 0.0f;
    estimator->last_tau_m = 0.0f;
    (void)memset(&estimator->levels, 0, sizeof estimator->levels);
    estimator->nis = 0.0f;
    estimator->nis_size = 0u;
    estimator->faults = 0u;
}

void estimator_init(estimator_t *estimator, const lever_config_t *config)
{
    const lever_settings_t *s = &config->settings;
    (void)memset(estimator, 0, sizeof *estimator);
    estimator->config = *config;
    dither_init(&estimator->dither, s->dither_low, s->dither_high, s->sample_period, s->dither_limit, s->dither_fade);
    start_over(estimator);
}

/* --- commands -------------------------------------------------------------------------------------------------- */

static bool is_choice(uint8_t value, uint8_t count)
{
    return (value < count) || (value == (uint8_t)LEVER_KEEP);
}

static bool choose(uint8_t *choice, uint8_t value)
{
    const bool changed = (value != (uint8_t)LEVER_KEEP) && (value != *choice);
    if (changed) {
        *choice = value;
    }
    return changed;
}

bool estimator_command(estimator_t *estimator, const lever_command_t *command)
{
    const bool known = (command->request <= (uint8_t)LEVER_REQUEST_RESET) &&
                       is_choice(command->model, (uint8_t)LEVER_MODEL_COUNT) &&
                       is_choice(command->preload, (uint8_t)LEVER_PRELOAD_COUNT) &&
                       is_choice(command->estimator, (uint8_t)LEVER_ESTIMATOR_COUNT) &&
                       is_choice(command->adaptation, (uint8_t)LEVER_ADAPTATION_COUNT) &&
                       (command->dither_rms >= 0.0f) && (command->dither_rms <= OTHER_MOST);
    if (known) {
        lever_config_t *config = &estimator->config;
        const bool model = choose(&config->model, command->model);
        const bool preload = choose(&config->preload, command->preload);
        const bool kind = choose(&config->estimator, command->estimator);
        if (choose(&config->adaptation, command->adaptation)) {
            learning_adapt(config, &estimator->dual);
        }
        if (model || preload || kind || (command->request == (uint8_t)LEVER_REQUEST_RESET)) {
            start_over(estimator);
        }
        if (command->request == (uint8_t)LEVER_REQUEST_RUN) {
            estimator->frozen = false;
        }
        if (command->request == (uint8_t)LEVER_REQUEST_FREEZE) {
            estimator->frozen = true;
        }
        if (command->dither_rms < (float)LEVER_KEEP) {
            dither_set(&estimator->dither, command->dither_rms);
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
    faults |= (estimator->platform.faults != 0u) ? (uint32_t)LEVER_FAULT_PLATFORM : 0u;
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
    const lever_settings_t *settings = &estimator->config.settings;
    alignment_t *alignment = &estimator->alignment;
    measurement_t measurement = taken->measurement; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    alignment->time += elapsed;
    estimator->mode = LEVER_MODE_ALIGN;
    if (measurement.valid[0]) {
        alignment->theta_sum += measurement.y[0];
        alignment->count += 1.0f;
        levels_start(&estimator->levels, alignment->theta_sum / alignment->count, settings->trim_corner,
            estimator->constants.trim);
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
    estimator->followed.excitation_square = 4.0f * squared(estimator->config.settings.excitation_least);
    estimator->followed.innovation_mean = 1.0f;
    align(estimator, taken, 0.0f);
}

/* What follows the estimate: excitation, innovation level, memory of restarts. */
static void follow(estimator_t *estimator, float elapsed)
{
    const lever_settings_t *s = &estimator->config.settings;
    followed_t *followed = &estimator->followed;
    const float share = (elapsed < s->excitation_time) ? (elapsed / s->excitation_time) : 1.0f;
    followed->excitation_square += share * (squared(estimator->dual.state.x[1]) - followed->excitation_square);
    followed->restart_debt -= followed->restart_debt * (elapsed / RESTART_MEMORY);
    if (estimator->nis_size != 0u) {
        const float ratio = estimator->nis / (float)estimator->nis_size;
        followed->innovation_mean += share * (ratio - followed->innovation_mean);
    }
}

/* Refuses an estimate that breaks an invariant, and starts again from the measurement and the first guess. */
static void restart_if_invalid(estimator_t *estimator, const measurement_t *measurement)
{
    if (!dual_is_valid(&estimator->dual)) {
        init_dual(estimator);
        learning_start(&estimator->learning, &estimator->config, &estimator->dual);
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
    step.trim_sine = sine_cosine(step.trim).sine;
    dual_predict(&estimator->dual, estimator->model, &estimator->constants, &step);
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
            (void)levels_refer(&estimator->levels, estimator->dual.state.x, &nothing, period);
        }
    }
    if (levels_refer(&estimator->levels, estimator->dual.state.x, &taken->measurement, period)) {
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
    const float least = estimator->config.settings.excitation_least;
    const bool measured = measurement->valid[0] || measurement->valid[1];
    const bool excited = (estimator->followed.excitation_square >= squared(least));
    const bool settled = estimator->levels.unsettled < (0.5f * estimator->config.settings.sample_period);
    const bool learn = !estimator->frozen && settled;
    const lesson_t lesson = {.walks = !estimator->frozen, .teaches = learn && measured, .excited = excited};
    estimator->nis = dual_update(&estimator->dual, measurement, learn && excited);
    estimator->nis_size = (uint8_t)((measurement->valid[0] ? 1u : 0u) + (measurement->valid[1] ? 1u : 0u));
    learning_step(&estimator->learning, &estimator->config, &estimator->dual, &lesson, elapsed);
    estimator->levels.unsettled -= elapsed;
    restart_if_invalid(estimator, measurement);
    follow(estimator, elapsed);
    note(estimator, !excited, LEVER_FAULT_EXCITATION);
    note(estimator, estimator->learning.bounded, LEVER_FAULT_BOUND);
    note(estimator, learning_has_changed(&estimator->learning), LEVER_FAULT_CHANGE);
    note(estimator, estimator->followed.innovation_mean > INNOVATION_TOLERATED, LEVER_FAULT_INNOVATION);
    estimator->mode = mode_of(estimator, measured);
    if (estimator->mode == LEVER_MODE_FAULT) {
        dither_set(&estimator->dither, 0.0f);
    }
}

/* Number of sample periods in `elapsed`, at least one. */
static uint32_t periods_in(const estimator_t *estimator, float elapsed)
{
    const float rounded = (elapsed / estimator->config.settings.sample_period) + 0.5f;
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
    } else if (elapsed > estimator->config.settings.gap_limit) {
        float freed[PARAMETER_FILTER_FREED]; /* the state starts anew */
        parameter_filter_walk(&estimator->dual.parameters, elapsed, freed);
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
    const float limit_us = estimator->config.settings.gap_limit * 1.0e6f;
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
        dither_step(&estimator->dither, elapsed);
    } else {
        /* late: counted above, otherwise ignored */
    }
    return estimator->mode;
}

/* --- what is known --------------------------------------------------------------------------------------------- */

float estimator_state(const estimator_t *estimator, uint32_t i)
{
    return estimator->levels.origin[i] + estimator->dual.state.x[i];
}

void estimator_dynamics(const estimator_t *estimator, model_dynamics_t *dynamics, model_dynamics_t *sigma)
{
    const model_step_t step = {.trim = estimator->levels.output[0].level};
    derived_dynamics(&estimator->dual.parameters, estimator->model, &estimator->constants, &step, dynamics, sigma);
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
    estimate->theta_sigma = state_sigma(estimator, 0u, 1.0f / (TURN * estimator->config.settings.trim_corner));
    estimate->theta_dot_sigma = state_sigma(estimator, 1u, 1.0f);
    estimate->trim = estimator->levels.output[0].level;
    estimate->nis = estimator->nis;
    estimate->nis_size = estimator->nis_size;
    parameter_filter_physical(&dual->parameters, estimate->parameter);
    parameter_filter_sigma(&dual->parameters, estimate->parameter_sigma);
    parameter_filter_correlation(&dual->parameters, estimate->parameter_correlation);

    model_dynamics_t dynamics;
    model_dynamics_t sigma;
    estimator_dynamics(estimator, &dynamics, &sigma);
    estimate->natural_frequency = dynamics.natural_frequency;
    estimate->natural_frequency_sigma = sigma.natural_frequency;
    estimate->damping_ratio = dynamics.damping_ratio;
    estimate->damping_ratio_sigma = sigma.damping_ratio;
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
    health->dither = estimator->dither.torque;
}

void estimator_platform(estimator_t *estimator, const lever_platform_t *platform)
{
    estimator->platform = *platform;
    estimator->has_platform = true;
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
