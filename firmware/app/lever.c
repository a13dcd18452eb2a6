/* The façade: an instance in memory of the caller, and how its parts work together. */
#include "app/instance.h"
#include "bounce/alarm.h"
#include "math/bounds.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define DITHER_MOST 1.0e4f        /* plausible [N m] */
#define MARGIN_US 40000u          /* least time between two margins */
#define SETTINGS_US 1000000u      /* between two looks at the settings, */
#define SETTINGS_LATE_US 1020000u /* and at most */
#define SILENCE_US 20000u         /* or 1.25 sample periods: mitigation.h */

/* cppcheck-suppress misra-c2012-2.3 ; D5 */
typedef char lever_fits_its_memory[(sizeof(struct lever) <= sizeof(lever_memory_t)) ? 1 : -1];

static void choose_mitigation(bounce_t *bounce, uint8_t mitigation)
{
    bounce->chosen = (mitigation != (uint8_t)LEVER_KEEP) ? mitigation : bounce->chosen;
    bounce->mitigates = bounce->mitigates || (bounce->chosen != (uint8_t)LEVER_MITIGATION_NONE);
}

/* Of all words, so that any word that changes changes it. */
static uint32_t sum_of(const lever_settings_t *settings)
{
    const uint8_t *bytes = (const uint8_t *)settings;
    uint32_t sum = 0u;
    for (uint32_t i = 0u; i < (uint32_t)(sizeof *settings / sizeof(uint32_t)); i++) {
        uint32_t word;
        (void)memcpy(&word, &bytes[4u * i], sizeof word); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
        sum += word;
    }
    return sum;
}

lever_t *lever_init(lever_memory_t *memory, const lever_config_t *config)
{
    lever_t *lever = NULL;
    if ((memory != NULL) && (config != NULL) && (lever_config_check(config) == NULL)) {
        /* cppcheck-suppress misra-c2012-11.5 ; D4 */
        lever = (lever_t *)(void *)memory; /* storage of the caller, as large and aligned as an instance */
        const lever_settings_t *s = &config->settings;
        const float rms_most = lesser(s->torque_rms, s->torque_limit);
        (void)memset(lever, 0, sizeof *lever);
        estimator_init(&lever->estimator, config);
        choose_mitigation(&lever->bounce, config->mitigation);
        dither_init(&lever->dither, s->dither_low, s->dither_high, s->sample_period, rms_most, s->dither_fade);
        torque_gate_init(&lever->gate, s);
        link_init(&lever->link, s);
        lever->settings_sum = sum_of(s);
    }
    return lever;
}

/* --- samples ------------------------------------------------------------------------------------------------------ */

static const verdict_row_t *verdict_of_now(const lever_t *lever)
{
    return &verdict_rows[lever->estimator.learning.verdict];
}

/* COAST is closed by torque_sample_t.measured, once it has lasted. */
static bool permits_torque(const lever_t *lever)
{
    const uint32_t broken = (uint32_t)LEVER_PLATFORM_ROM | (uint32_t)LEVER_PLATFORM_SELF_TEST |
                            (uint32_t)LEVER_PLATFORM_WATCHDOG | (uint32_t)LEVER_PLATFORM_HARD_FAULT;
    const enum lever_mode mode = lever->estimator.mode;
    return (mode >= LEVER_MODE_RUN) && (mode <= LEVER_MODE_FROZEN) && ((lever->platform.faults & broken) == 0u) &&
           !lever->settings_changed;
}

/* A fault of the memory that the settings are in stays, whatever is in it later. Not with the sample that ends a block,
 * where there is another, to bound the worst step. */
static void check_settings(lever_t *lever)
{
    const uint32_t time_us = lever->estimator.time_us;
    const uint32_t elapsed_us = time_us - lever->settings_us;
    const bool between = (lever->estimator.learning.elapsed > 0.0f);
    if ((elapsed_us >= SETTINGS_US) && (between || (elapsed_us >= SETTINGS_LATE_US))) {
        lever->settings_us = time_us;
        lever->settings_changed =
            lever->settings_changed || (sum_of(lever->estimator.setup.settings) != lever->settings_sum);
    }
}

bool instance_is_estimating(const lever_t *lever)
{
    const enum lever_mode mode = lever->estimator.mode;
    return (mode >= LEVER_MODE_RUN) && (mode <= LEVER_MODE_FROZEN) &&
           ((lever->estimator.faults & (uint32_t)LEVER_FAULT_CLOCK) == 0u);
}

/* The estimate is trustworthy enough for a margin: it has been learnt, and the sensors work. */
static bool carries_margin(const lever_t *lever)
{
    const enum lever_mode mode = lever->estimator.mode;
    return verdict_permits(verdict_of_now(lever)->margin, lever->estimator.faults) &&
           ((mode == LEVER_MODE_RUN) || (mode == LEVER_MODE_FROZEN)) && (lever->estimator.cdkf.trust >= 1.0f);
}

void instance_watch(lever_t *lever)
{
    bounce_t *bounce = &lever->bounce;
    const uint32_t time_us = lever->estimator.time_us;
    const uint32_t publish_us = lever->link.publish_us;
    if ((time_us - bounce->time_us) >= greater_count(publish_us, MARGIN_US)) {
        bounce->time_us = time_us;
        bounce->margin = estimator_margin(&lever->estimator, bounce->aircraft);
        const bool doubtful = ((lever->estimator.faults & (uint32_t)LEVER_FAULT_MISMATCH) != 0u);
        bounce->state = alarm_next(bounce->state, &bounce->margin, bounce->aircraft, carries_margin(lever), doubtful);
    }
}

/* Which sensors say what they said last. */
static uint8_t repeated(const evidence_t *evidence, const lever_sample_t *sample)
{
    const uint32_t theta = evidence_repeats(evidence, SIGNAL_THETA, sample->theta) ? (uint32_t)INSTANCE_SAME_THETA : 0u;
    const uint32_t base = evidence_repeats(evidence, SIGNAL_BASE, sample->z_ddot) ? (uint32_t)INSTANCE_SAME_Z_DDOT : 0u;
    return (uint8_t)(theta | base);
}

/* One sample: what the estimator makes of it, and what the torque gate is to know. */
static enum lever_mode update(lever_t *lever, const lever_sample_t *sample)
{
    const uint32_t blind = (uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_THETA_DOT;
    estimator_t *estimator = &lever->estimator;
    torque_sample_t *to_gate = &lever->to_gate;
    const uint32_t last_us = estimator->time_us;
    if (lever->bounce.mitigates) {
        lever->bounce.same = repeated(&estimator->learning.evidence, sample);
    }
    const bool starts = (estimator->mode == LEVER_MODE_INIT);
    const enum lever_mode mode = estimator_update(estimator, sample, lever->gate.torque);
    const uint32_t faults = estimator->faults;
    check_settings(lever);
    to_gate->elapsed_us = starts ? lever->gate.period_us : (estimator->time_us - last_us);
    to_gate->advances = ((faults & (uint32_t)LEVER_FAULT_CLOCK) == 0u);
    to_gate->measured = ((faults & blind) != blind);
    to_gate->permitted = permits_torque(lever);
    to_gate->harmful = !verdict_permits(verdict_of_now(lever)->torque, faults);
    return mode;
}

void instance_mitigate(lever_t *lever)
{
    const estimator_t *estimator = &lever->estimator;
    const setup_t *setup = &estimator->setup;
    const torque_sample_t *to_gate = &lever->to_gate;
    const uint32_t period_us = lever->gate.period_us;
    const uint32_t late_us = period_us + (period_us / 4u);
    const uint32_t faults = estimator->faults;
    mitigation_t *mitigation = &lever->bounce.mitigation;
    mitigation_sample_t sample = {.constants = &setup->constants,
        .elapsed_us = to_gate->advances ? to_gate->elapsed_us : period_us,
        .silence_us = greater_count(late_us, SILENCE_US),
        .theta = estimator_state(estimator, 0u),
        .theta_dot = estimator_state(estimator, 1u),
        .drive = lever->gate.gain,
        .mitigation = lever->bounce.chosen,
        .advances = to_gate->advances,
        .permitted = to_gate->permitted && verdict_permits(verdict_of_now(lever)->correction, faults) &&
                     !torque_gate_is_abandoned(&lever->gate),
        .sensed = ((faults & (uint32_t)LEVER_FAULT_THETA) == 0u) && (estimator->base_missing <= 0.0f),
        .fits = !evidence_has(&estimator->learning.evidence, EVIDENCE_BASE),
        .rated = ((faults & (uint32_t)LEVER_FAULT_THETA_DOT) == 0u),
        .same_theta = ((lever->bounce.same & (uint32_t)INSTANCE_SAME_THETA) != 0u),
        .same_z_ddot = ((lever->bounce.same & (uint32_t)INSTANCE_SAME_Z_DDOT) != 0u)};
    const model_dynamics_t dynamics = estimator_linearised(estimator, &sample.step);
    sample.dynamics = &dynamics;
    sample.step.period = 1.0e-6f * (float)sample.elapsed_us;
    sample.step.z_ddot = estimator->last_z_ddot;
    sample.step.tau_m = lever->gate.torque;
    lever->bounce.mitigates = mitigation_step(mitigation, setup->settings, &sample);
}

/* Called in sequence rather than nested, to bound peak stack. */
enum lever_mode lever_update(lever_t *lever, const lever_sample_t *sample)
{
    const enum lever_mode mode = update(lever, sample);
    if (lever->bounce.mitigates) {
        instance_mitigate(lever);
    }
    torque_gate_step(&lever->gate, dither_step(&lever->dither) + lever->bounce.mitigation.damping, &lever->to_gate);
    if (lever->bounce.aircraft != NULL) {
        instance_watch(lever);
    }
    return mode;
}

void lever_idle(lever_t *lever, uint32_t elapsed_us)
{
    link_idle(lever, elapsed_us);
    torque_gate_idle(&lever->gate, elapsed_us);
    mitigation_idle(&lever->bounce.mitigation, elapsed_us);
}

bool instance_is_driving(const lever_t *lever)
{
    return (lever->gate.torque != 0.0f) ||
           (lever->gate.open && (dither_is_on(&lever->dither) || mitigation_has_damping(lever->bounce.chosen)));
}

bool lever_is_acting(const lever_t *lever)
{
    return instance_is_driving(lever) || (lever->bounce.mitigation.weight > 0.0f);
}

/* --- commands ----------------------------------------------------------------------------------------------------- */

/* Something that IDENTITY says. */
static bool is_changed(const lever_t *lever, const setup_t *before, uint8_t chosen_before, float rms_before)
{
    const setup_t *setup = &lever->estimator.setup;
    return (setup->model != before->model) || (setup->preload != before->preload) ||
           (setup->estimator != before->estimator) || (setup->adaptation != before->adaptation) ||
           (lever->bounce.chosen != chosen_before) || (lever->dither.target < rms_before) ||
           (lever->dither.target > rms_before);
}

/* The command is more than a keep-alive: it names torque. */
static bool asks_for_torque(const lever_command_t *command)
{
    const bool damps = (command->mitigation != (uint8_t)LEVER_KEEP) && mitigation_has_damping(command->mitigation);
    return damps || ((command->dither_rms > 0.0f) && (command->dither_rms < (float)LEVER_KEEP));
}

/* Carries out what is not refused for the mode. Returns false, and changes nothing, when a value is not known. */
static bool carry_out(lever_t *lever, const lever_command_t *command)
{
    const setup_t before = lever->estimator.setup;
    const uint8_t chosen_before = lever->bounce.chosen;
    const float rms_before = lever->dither.target;
    const bool resets = (command->request == (uint8_t)LEVER_REQUEST_RESET);
    const bool plausible =
        (command->dither_rms >= 0.0f) && (command->dither_rms <= DITHER_MOST) &&
        ((command->mitigation < (uint8_t)LEVER_MITIGATION_COUNT) || (command->mitigation == (uint8_t)LEVER_KEEP));
    const bool known = plausible ? estimator_command(&lever->estimator, command) : false;
    if (known) {
        torque_gate_keep_alive(&lever->gate);
        torque_gate_ask(&lever->gate, asks_for_torque(command));
        choose_mitigation(&lever->bounce, command->mitigation);
        if (resets) {
            dither_reset(&lever->dither);
            lever->link.frequency = (uint8_t)MESSAGE_FEEDTHROUGH_LOWEST;
        }
        if (command->dither_rms < (float)LEVER_KEEP) {
            dither_set(&lever->dither, command->dither_rms, resets || !lever->gate.open); /* a reset closes it */
        }
        if (!permits_torque(lever)) {
            torque_gate_close(&lever->gate);
        }
        if (is_changed(lever, &before, chosen_before, rms_before)) {
            lever->link.pages |= (uint8_t)(1u << (uint32_t)MESSAGE_PAGE_CHOICES);
        }
    }
    return known;
}

enum message_result instance_command(lever_t *lever, const lever_command_t *command)
{
    enum message_result result = MESSAGE_RESULT_ACCEPTED;
    if ((lever->estimator.mode == LEVER_MODE_FAULT) && (command->request != (uint8_t)LEVER_REQUEST_RESET)) {
        result = MESSAGE_RESULT_FAULT_MODE;
    } else if (!carry_out(lever, command)) {
        result = MESSAGE_RESULT_UNKNOWN_VALUE;
    } else {
        /* accepted */
    }
    return result;
}

void instance_end(lever_t *lever, const lever_command_t *command)
{
    const bool ends_dither = (command->dither_rms <= 0.0f);
    const bool ends_mitigation = (command->mitigation == (uint8_t)LEVER_MITIGATION_NONE);
    if (ends_dither) {
        dither_set(&lever->dither, 0.0f, false);
    }
    if (ends_mitigation) {
        choose_mitigation(&lever->bounce, command->mitigation);
    }
    if (ends_dither || ends_mitigation) {
        lever->link.pages |= (uint8_t)(1u << (uint32_t)MESSAGE_PAGE_CHOICES);
    }
}

bool lever_command(lever_t *lever, const lever_command_t *command)
{
    return instance_command(lever, command) == MESSAGE_RESULT_ACCEPTED;
}

/* --- what is known ------------------------------------------------------------------------------------------------ */

uint32_t instance_faults(const lever_t *lever)
{
    uint32_t faults = lever->estimator.faults;
    faults |= ((lever->platform.faults != 0u) || lever->settings_changed) ? (uint32_t)LEVER_FAULT_PLATFORM : 0u;
    faults |= (lever->link.duplicate_us != 0u) ? (uint32_t)LEVER_FAULT_DUPLICATE : 0u;
    return faults;
}

void lever_estimate(const lever_t *lever, lever_estimate_t *estimate)
{
    estimator_estimate(&lever->estimator, estimate);
}

void lever_feedthrough(const lever_t *lever, float frequency, lever_feedthrough_t *feedthrough)
{
    const derived_feedthrough_t derived = estimator_feedthrough(&lever->estimator, frequency);
    feedthrough->real = derived.real;
    feedthrough->imaginary = derived.imaginary;
    feedthrough->gain_sigma = derived.gain_sigma;
    feedthrough->phase_sigma = derived.phase_sigma;
    feedthrough->correlation = derived.correlation;
}

bool lever_aircraft(lever_t *lever, const lever_aircraft_t *aircraft)
{
    const bool accepted = (aircraft == NULL) || margin_accepts(aircraft);
    if (accepted) {
        const margin_t unknown = {.gain = 0.0f};
        lever->bounce.aircraft = aircraft;
        lever->estimator.seat.aircraft = aircraft;
        lever->bounce.margin = unknown;
        lever->bounce.time_us = (aircraft != NULL) ? (lever->estimator.time_us - MARGIN_US) : 0u;
        lever->bounce.state = (uint8_t)LEVER_BOUNCE_UNKNOWN;
    }
    return accepted;
}

void lever_stability(const lever_t *lever, lever_stability_t *stability)
{
    const margin_t *margin = &lever->bounce.margin;
    const uint8_t state = lever->bounce.state;
    const bool is_now = instance_is_estimating(lever) && torque_gate_has_output(&lever->gate);
    const bool stands = is_now || (state == (uint8_t)LEVER_BOUNCE_ALARM);
    stability->state = stands ? state : (uint8_t)LEVER_BOUNCE_UNKNOWN;
    stability->valid = is_now && carries_margin(lever) && (state != (uint8_t)LEVER_BOUNCE_UNKNOWN) &&
                       is_finite(margin->gain_sigma) && is_finite(margin->modulus_sigma);
    stability->gain_margin = margin->gain;
    stability->gain_margin_sigma = margin->gain_sigma;
    stability->modulus = margin->modulus;
    stability->modulus_sigma = margin->modulus_sigma;
    stability->frequency = margin->frequency;
    stability->frequency_sigma = margin->frequency_sigma;
}

void lever_correction(const lever_t *lever, lever_correction_t *correction)
{
    *correction = mitigation_correction(&lever->bounce.mitigation);
}

void lever_health(const lever_t *lever, lever_health_t *health)
{
    estimator_health(&lever->estimator, health);
    health->faults = instance_faults(lever);
    health->torque = lever->gate.torque;
    health->gate_open = lever->gate.open;
}

void lever_platform(lever_t *lever, const lever_platform_t *platform)
{
    lever->platform = *platform;
    lever->has_platform = true;
    if (!permits_torque(lever)) {
        torque_gate_close(&lever->gate);
    }
}

/* --- CAN ---------------------------------------------------------------------------------------------------------- */

enum lever_frame_result lever_on_frame(lever_t *lever, const lever_frame_t *frame)
{
    return link_on_frame(lever, frame);
}

void lever_refuse(lever_t *lever, const lever_frame_t *command, uint8_t result)
{
    link_refuse(lever, command, result);
}

enum lever_mode lever_step(lever_t *lever)
{
    return link_step(lever);
}

bool lever_next_frame(lever_t *lever, lever_frame_t *frame)
{
    return link_next_frame(lever, frame);
}
