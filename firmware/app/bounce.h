/* Collective bounce, of an instance: the watch over the loop of arm, lever and rotor, and what is done about it. */
#ifndef APP_BOUNCE_H
#define APP_BOUNCE_H

#include "app/estimator.h"
#include "app/torque_gate.h"
#include "bounce/mitigation.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

enum bounce_same { BOUNCE_SAME_THETA = 1, BOUNCE_SAME_Z_DDOT = 2 };

typedef struct bounce {
    mitigation_t mitigation;
    uint8_t chosen;                   /* enum lever_mitigation */
    uint8_t state;                    /* enum lever_bounce */
    uint8_t same;                     /* of enum bounce_same: what the last sample measured as the one before */
    bool mitigates;                   /* one is chosen, or still fades */
    const lever_aircraft_t *aircraft; /* NULL: none */
    margin_t margin;
    uint32_t time_us; /* of the sample with which it was worked out */
} bounce_t;

/* Chooses an enum lever_mitigation; LEVER_KEEP changes nothing. */
void bounce_choose(bounce_t *bounce, uint8_t mitigation);

/* The aircraft whose margin is watched from the sample at time_us on, NULL for none. Returns false, and changes nothing,
 * when its table cannot be used. */
bool bounce_set_aircraft(bounce_t *bounce, const lever_aircraft_t *aircraft, uint32_t time_us);

/* Before the estimator takes a sample: which sensors repeat their last value. */
void bounce_sense(bounce_t *bounce, const evidence_t *evidence, const lever_sample_t *sample);

/* After the estimator and the torque gate's sample: renews correction and lever damping.
 *
 * This and bounce_watch() must not be inlined: link-time optimisation inlines a function that is called once, and then
 * their variables lie beneath the calls of the estimator, which are the deepest: 1,416 bytes of stack instead of 848. */
__attribute__((noinline)) void bounce_mitigate(
    bounce_t *bounce, const estimator_t *estimator, const torque_gate_t *gate, const torque_sample_t *to_gate);

/* With an aircraft: works the margin out, once a publish_period, but at most 25 times a second. */
__attribute__((noinline)) void bounce_watch(bounce_t *bounce, const estimator_t *estimator, uint32_t publish_us);

/* `is_now`: the estimate may be used, and its last sample is not old. */
void bounce_stability(const bounce_t *bounce, const estimator_t *estimator, bool is_now, lever_stability_t *stability);

#endif
