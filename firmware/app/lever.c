/* The façade: lever_cdkf.h, over the parts of an instance. */
#include "app/instance.h"
#include "app/link.h"

#include <stddef.h>
#include <string.h>

/* cppcheck-suppress misra-c2012-2.3 ; D5 */
typedef char lever_fits_its_memory[(sizeof(struct lever) <= sizeof(lever_memory_t)) ? 1 : -1];

lever_t *lever_init(lever_memory_t *memory, const lever_config_t *config)
{
    lever_t *lever = NULL;
    if ((memory != NULL) && (config != NULL) && (lever_config_check(config) == NULL)) {
        /* cppcheck-suppress misra-c2012-11.5 ; D4 */
        lever = (lever_t *)(void *)memory; /* storage of the caller, as large and aligned as an instance */
        instance_init(lever, config);
        link_init(&lever->link, &config->settings);
    }
    return lever;
}

enum lever_mode lever_update(lever_t *lever, const lever_sample_t *sample)
{
    return instance_update(lever, sample);
}

void lever_idle(lever_t *lever, uint32_t elapsed_us)
{
    link_idle(lever, elapsed_us);
    torque_gate_idle(&lever->gate, elapsed_us);
    mitigation_idle(&lever->bounce.mitigation, elapsed_us);
}

bool lever_command(lever_t *lever, const lever_command_t *command)
{
    return instance_command(lever, command) == MESSAGE_RESULT_ACCEPTED;
}

void lever_platform(lever_t *lever, const lever_platform_t *platform)
{
    instance_platform(lever, platform);
}

bool lever_aircraft(lever_t *lever, const lever_aircraft_t *aircraft)
{
    const bool accepted = bounce_set_aircraft(&lever->bounce, aircraft, lever->estimator.time_us);
    if (accepted) {
        lever->estimator.seat.aircraft = aircraft;
    }
    return accepted;
}

/* --- what is known ---------------------------------------------------------------------------------------------------- */

bool lever_is_acting(const lever_t *lever)
{
    return instance_is_driving(lever) || (lever->bounce.mitigation.weight > 0.0f);
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

void lever_stability(const lever_t *lever, lever_stability_t *stability)
{
    const bool is_now = instance_is_estimating(lever) && torque_gate_has_output(&lever->gate);
    bounce_stability(&lever->bounce, &lever->estimator, is_now, stability);
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

void lever_test_ratios(const lever_t *lever, float ratio[LEVER_TEST_RATIOS])
{
    (void)memcpy(ratio, lever->estimator.learning.evidence.ratio, sizeof lever->estimator.learning.evidence.ratio);
}

/* --- CAN -------------------------------------------------------------------------------------------------------------- */

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
