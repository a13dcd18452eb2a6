/* The trim: the slow part of every signal, and the high-pass that separates it.
 *
 * A sixth-order Butterworth high-pass, three sections in series in the form of trackers: the level follows the signal
 * without lag on a ramp, the deviation is what is left. When outputs and inputs of a linear system pass the same
 * high-pass, the deviations obey the same system, and whatever is slow and not known drops out: the pilot's trim and
 * how he moves the lever on purpose, gravity, the bias of an accelerometer. Second order lets through enough of such
 * motion to be taken for a low stiffness: 3 degrees rms of random motion up to 0.5 Hz make 45 % of the natural
 * frequency; fourth order 5 %, sixth 1 %. To do so with the angle alone (a trim angle by low-pass) would bias the
 * damping by 1 / (2 zeta omega T) and fail on a re-trim, which for T of seconds looks like a torque larger than all
 * others.
 *
 * In preload trim the estimator works on deviations. In preload fixed signals stay as they come, and the level of
 * theta only serves as the trim angle.
 */
#ifndef FILTER_TRIM_H
#define FILTER_TRIM_H

#include "model/model.h"

#include <stdbool.h>
#include <stdint.h>

/* A section of second order, in time of 1 / corner. */
typedef struct high_pass {
    float level; /* [unit of the signal] */
    float slope; /* [unit corner] */
} high_pass_t;

#define HIGH_PASS_BUTTERWORTH 1.41421356f /* damping, twice the damping ratio, of one section alone */

/* One value; `turn`: the corner [rad/s] times the time since the last one. Returns its deviation from the level before
 * it. level / signal = (damping s + 1) / (s^2 + damping s + 1), by semi-implicit Euler. */
static inline float high_pass_step(high_pass_t *filter, float value, float turn, float damping)
{
    const float deviation = value - filter->level;
    filter->slope += turn * deviation;
    filter->level += turn * (filter->slope + (damping * deviation));
    return deviation;
}

#define TRIM_OUTAGE 0.0205f /* a signal missing for longer is out [s]; not a whole number of periods */

enum { TRIM_SECTIONS = 3 };

enum trim_signal {
    TRIM_FRICTION, /* of a newton metre */
    TRIM_Z_DDOT,
    TRIM_TAU_M,
    TRIM_STEP,       /* of 1, when levels are begun anew */
    TRIM_GRIP_FORCE, /* [N] */
    TRIM_INPUTS
};

/* A signal's slow part. */
typedef struct level {
    high_pass_t section[TRIM_SECTIONS];
} level_t;

typedef struct trim {
    level_t output[MODEL_STATES]; /* theta, whose level is the trim angle [rad], and theta_dot */
    level_t input[TRIM_INPUTS];   /* of enum trim_signal */
    float origin[MODEL_STATES];   /* of the state: the levels in preload trim, otherwise 0 */
    float begin_rate;             /* theta_dot when the levels were begun anew last [rad/s] */
    float missing[MODEL_STATES];  /* time since the last sample of each output [s] */
    float last[MODEL_STATES];     /* value of that sample */
    float unsettled;              /* time until the levels have settled: nothing can be learnt before [s] */
    float corner;                 /* [rad/s] */
    bool deviations;              /* preload trim */
} trim_t;

/* Starts at a trim angle, at rest; corner [Hz]. */
void trim_start(trim_t *trim, float angle, float corner, bool deviations);

/* The levels begin anew where the signals are, `x` from the last origin, as if nothing had been before: not even a rate,
 * so that theta moves by begin_rate besides, as far as the step of 1 has not passed away. */
void trim_begin(trim_t *trim, const float x[MODEL_STATES]);

/* From now on theta has `offset` more [rad], in preload trim. */
void trim_shift(trim_t *trim, float offset);

/* The trim angle [rad]. */
float trim_angle(const trim_t *trim);

/* `count` inputs from `first` on after `period` seconds: replaced by their deviations in preload trim. */
void trim_inputs(trim_t *trim, float value[], enum trim_signal first, uint32_t count, float period);

/* An input starts at a level that is `value`. */
void trim_start_input(trim_t *trim, enum trim_signal input, float value);

/* Sets the origin of the state to the levels: before a prediction. */
void trim_set_origin(trim_t *trim);

/* Replaces valid outputs y by deviations from the levels, in preload trim, `period` seconds after the last sample.
 * While an output is not valid its level waits, and when it is back takes the straight line between both samples: to
 * follow its own prediction would be to integrate six times (seen: one sample in three, and the state exploded). After
 * longer than 1 / corner it begins anew. Returns true when an output is back after an outage. */
bool trim_outputs(trim_t *trim, float y[MODEL_STATES], const bool valid[MODEL_STATES], float period);

/* The level of output i waits for samples. */
bool trim_is_waiting(const trim_t *trim, uint32_t i);

/* Time in which the levels settle [s]. */
float trim_settling_time(const trim_t *trim);

/* The levels are guesses: in preload trim nothing can be learnt until they have settled. What was left to settle comes
 * on top, up to twice the time. */
void trim_unsettle(trim_t *trim);

#endif
