#include "app/instance.h"

#include "math/bounds.h"

#include <stddef.h>
#include <string.h>

#define DITHER_MOST 1.0e4f        /* plausible [N m] */
#define SETTINGS_US 1000000u      /* between two looks at the settings, */
#define SETTINGS_LATE_US 1020000u /* and at most */

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

void instance_init(lever_t *lever, const lever_config_t *config)
{
    const lever_settings_t *s = &config->settings;
    const float rms_most = lesser(s->torque_rms, s->torque_limit);
    (void)memset(lever, 0, sizeof *lever);
    estimator_init(&lever->estimator, config);
    bounce_choose(&lever->bounce, config->mitigation);
    dither_init(&lever->dither, s->dither_low, s->dither_high, s->sample_period, rms_most, s->dither_fade);
    torque_gate_init(&lever->gate, s);
    lever->settings_sum = sum_of(s);
}

/* --- samples ---------------------------------------------------------------------------------------------------------- */

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

/* One sample: what the estimator makes of it, and what the torque gate is to know. */
static enum lever_mode update(lever_t *lever, const lever_sample_t *sample)
{
    const uint32_t blind = (uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_THETA_DOT;
    estimator_t *estimator = &lever->estimator;
    torque_sample_t *to_gate = &lever->to_gate;
    const uint32_t last_us = estimator->time_us;
    if (lever->bounce.mitigates) {
        bounce_sense(&lever->bounce, &estimator->learning.evidence, sample);
    }
    const bool starts = (estimator->mode == LEVER_MODE_INIT);
    const enum lever_mode mode = estimator_update(estimator, sample, lever->gate.torque);
    const uint32_t faults = estimator->faults;
    check_settings(lever);
    to_gate->elapsed_us = starts ? lever->gate.period_us : (estimator->time_us - last_us);
    to_gate->advances = ((faults & (uint32_t)LEVER_FAULT_CLOCK) == 0u);
    to_gate->measured = ((faults & blind) != blind);
    to_gate->permitted = permits_torque(lever);
    to_gate->harmful = !verdict_permits(verdict_rows[estimator->learning.verdict].torque, faults);
    return mode;
}

/* Damping by a motor that may do the reverse does harm. */
static void note_damping(lever_t *lever)
{
    const uint32_t forbids = verdict_rows[lever->estimator.learning.verdict].torque;
    if (mitigation_has_damping(lever->bounce.chosen) && !verdict_permits(forbids, VERDICT_DAMPING)) {
        lever->to_gate.harmful = true;
    }
}

/* Called in sequence rather than nested, to bound peak stack. */
enum lever_mode instance_update(lever_t *lever, const lever_sample_t *sample)
{
    bounce_t *bounce = &lever->bounce;
    const enum lever_mode mode = update(lever, sample);
    if (bounce->mitigates) {
        bounce_mitigate(bounce, &lever->estimator, &lever->gate, &lever->to_gate);
        note_damping(lever);
    }
    torque_gate_step(&lever->gate, dither_step(&lever->dither) + bounce->mitigation.damping, &lever->to_gate);
    if (bounce->aircraft != NULL) {
        bounce_watch(bounce, &lever->estimator, lever->link.publish_us);
    }
    return mode;
}

/* --- commands --------------------------------------------------------------------------------------------------------- */

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
        bounce_choose(&lever->bounce, command->mitigation);
        if (resets) {
            dither_reset(&lever->dither);
            lever->link.frequency = (uint8_t)MESSAGE_FEEDTHROUGH_LOWEST;
            lever->link.evidence = 0u;
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
        bounce_choose(&lever->bounce, command->mitigation);
    }
    if (ends_dither || ends_mitigation) {
        lever->link.pages |= (uint8_t)(1u << (uint32_t)MESSAGE_PAGE_CHOICES);
    }
}

void instance_platform(lever_t *lever, const lever_platform_t *platform)
{
    lever->platform = *platform;
    lever->has_platform = true;
    if (!permits_torque(lever)) {
        torque_gate_close(&lever->gate);
    }
}

/* --- state ------------------------------------------------------------------------------------------------------------ */

bool instance_is_estimating(const lever_t *lever)
{
    const enum lever_mode mode = lever->estimator.mode;
    return (mode >= LEVER_MODE_RUN) && (mode <= LEVER_MODE_FROZEN) &&
           ((lever->estimator.faults & (uint32_t)LEVER_FAULT_CLOCK) == 0u);
}

bool instance_is_driving(const lever_t *lever)
{
    return (lever->gate.torque != 0.0f) ||
           (lever->gate.open && (dither_is_on(&lever->dither) || mitigation_has_damping(lever->bounce.chosen)));
}

uint32_t instance_faults(const lever_t *lever)
{
    uint32_t faults = lever->estimator.faults;
    faults |= ((lever->platform.faults != 0u) || lever->settings_changed) ? (uint32_t)LEVER_FAULT_PLATFORM : 0u;
    faults |= (lever->link.duplicate_us != 0u) ? (uint32_t)LEVER_FAULT_DUPLICATE : 0u;
    return faults;
}
