#include "app/bounce.h"

#include "bounce/alarm.h"
#include "math/bounds.h"

#include <stddef.h>

#define MARGIN_US 40000u         /* least time between two margins */
#define BOUNCE_SILENCE_US 20000u /* or 1.25 sample periods: mitigation.h */

void bounce_choose(bounce_t *bounce, uint8_t mitigation)
{
    bounce->chosen = (mitigation != (uint8_t)LEVER_KEEP) ? mitigation : bounce->chosen;
    bounce->mitigates = bounce->mitigates || (bounce->chosen != (uint8_t)LEVER_MITIGATION_NONE);
}

bool bounce_set_aircraft(bounce_t *bounce, const lever_aircraft_t *aircraft, uint32_t time_us)
{
    const bool accepted = (aircraft == NULL) || margin_accepts(aircraft);
    if (accepted) {
        const margin_t unknown = {.gain = 0.0f};
        bounce->aircraft = aircraft;
        bounce->margin = unknown;
        bounce->time_us = (aircraft != NULL) ? (time_us - MARGIN_US) : 0u;
        bounce->state = (uint8_t)LEVER_BOUNCE_UNKNOWN;
    }
    return accepted;
}

/* --- margin -------------------------------------------------------------------------------------------------------- */

/* The estimate is trustworthy enough for a margin: it has been learnt, and the sensors work. */
static bool carries_margin(const estimator_t *estimator)
{
    const enum lever_mode mode = estimator->mode;
    return verdict_permits(verdict_rows[estimator->learning.verdict].margin, estimator->faults) &&
           ((mode == LEVER_MODE_RUN) || (mode == LEVER_MODE_FROZEN)) && (estimator->cdkf.trust >= 1.0f);
}

void bounce_watch(bounce_t *bounce, const estimator_t *estimator, uint32_t publish_us)
{
    const uint32_t time_us = estimator->time_us;
    if ((time_us - bounce->time_us) >= greater_count(publish_us, MARGIN_US)) {
        const bool doubtful = ((estimator->faults & (uint32_t)LEVER_FAULT_MISMATCH) != 0u);
        bounce->time_us = time_us;
        bounce->margin = estimator_margin(estimator, bounce->aircraft);
        bounce->state =
            alarm_next(bounce->state, &bounce->margin, bounce->aircraft, carries_margin(estimator), doubtful);
    }
}

void bounce_stability(const bounce_t *bounce, const estimator_t *estimator, bool is_now, lever_stability_t *stability)
{
    const margin_t *margin = &bounce->margin;
    const uint8_t state = bounce->state;
    const bool stands = is_now || (state == (uint8_t)LEVER_BOUNCE_ALARM);
    stability->state = stands ? state : (uint8_t)LEVER_BOUNCE_UNKNOWN;
    stability->valid = is_now && carries_margin(estimator) && (state != (uint8_t)LEVER_BOUNCE_UNKNOWN) &&
                       is_finite(margin->gain_sigma) && is_finite(margin->modulus_sigma);
    stability->gain_margin = margin->gain;
    stability->gain_margin_sigma = margin->gain_sigma;
    stability->modulus = margin->modulus;
    stability->modulus_sigma = margin->modulus_sigma;
    stability->frequency = margin->frequency;
    stability->frequency_sigma = margin->frequency_sigma;
}

/* --- mitigation ---------------------------------------------------------------------------------------------------- */

void bounce_sense(bounce_t *bounce, const evidence_t *evidence, const lever_sample_t *sample)
{
    const uint32_t theta = evidence_repeats(evidence, SIGNAL_THETA, sample->theta) ? (uint32_t)BOUNCE_SAME_THETA : 0u;
    const uint32_t base = evidence_repeats(evidence, SIGNAL_BASE, sample->z_ddot) ? (uint32_t)BOUNCE_SAME_Z_DDOT : 0u;
    bounce->same = (uint8_t)(theta | base);
}

void bounce_mitigate(
    bounce_t *bounce, const estimator_t *estimator, const torque_gate_t *gate, const torque_sample_t *to_gate)
{
    const setup_t *setup = &estimator->setup;
    const uint32_t period_us = gate->period_us;
    const uint32_t late_us = period_us + (period_us / 4u);
    const uint32_t faults = estimator->faults;
    mitigation_sample_t sample = {.constants = &setup->constants,
        .elapsed_us = to_gate->advances ? to_gate->elapsed_us : period_us,
        .silence_us = greater_count(late_us, BOUNCE_SILENCE_US),
        .theta = estimator_state(estimator, 0u),
        .theta_dot = estimator_state(estimator, 1u),
        .drive = gate->gain,
        .mitigation = bounce->chosen,
        .advances = to_gate->advances,
        .permitted = to_gate->permitted &&
                     verdict_permits(verdict_rows[estimator->learning.verdict].correction, faults) &&
                     !torque_gate_is_abandoned(gate),
        .sensed = ((faults & (uint32_t)LEVER_FAULT_THETA) == 0u) && (estimator->base_missing <= 0.0f),
        .fits = !evidence_has(&estimator->learning.evidence, EVIDENCE_BASE),
        .rated = ((faults & (uint32_t)LEVER_FAULT_THETA_DOT) == 0u),
        .same_theta = ((bounce->same & (uint32_t)BOUNCE_SAME_THETA) != 0u),
        .same_z_ddot = ((bounce->same & (uint32_t)BOUNCE_SAME_Z_DDOT) != 0u)};
    const model_dynamics_t dynamics = estimator_linearised(estimator, &sample.step);
    sample.dynamics = &dynamics;
    sample.step.period = 1.0e-6f * (float)sample.elapsed_us;
    sample.step.z_ddot = estimator->last_z_ddot;
    sample.step.tau_m = gate->torque;
    bounce->mitigates = mitigation_step(&bounce->mitigation, setup->settings, &sample);
}
