/* The slow part of every signal. In preload trim the estimator counts all signals from it: lever, base and motor alike
 * (filter/detrend.h says why); in preload fixed they stay as they come, and the level of theta only serves as the trim.
 */
#ifndef APP_LEVELS_H
#define APP_LEVELS_H

#include "filter/detrend.h"
#include "filter/measurement.h"
#include "model/model.h"

#include <stdbool.h>
#include <stdint.h>

enum { LEVELS_INPUTS = 2 };

typedef struct levels {
    detrend_t output[MODEL_STATES]; /* theta, whose level is the trim angle [rad], and theta_dot */
    detrend_t input[LEVELS_INPUTS]; /* z_ddot, tau_m */
    float origin[MODEL_STATES];     /* what the state counts from: levels in preload trim, otherwise 0 */
    float missing[MODEL_STATES];    /* time since the last sample of each output [s] */
    float unsettled;                /* time still to wait before anything can be learnt [s] */
    float settling;                 /* how long that is at first [s] */
    detrend_corner_t corner;
    bool counted; /* preload trim */
} levels_t;

/* Starts at a trim angle, nothing moving; corner [Hz]. */
void levels_start(levels_t *levels, float trim, float corner, bool counted);

/* An input (0 z_ddot, 1 tau_m) after `period` seconds, as the estimator counts it. */
float levels_input(levels_t *levels, uint32_t i, float value, float period);

/* Renews origin from the levels: before a prediction. */
void levels_set_origin(levels_t *levels);

/* Turns the outputs after `period` seconds into what the state x counts them as. The level of an output that is not valid
 * follows the prediction for a few samples and then waits: to follow itself for long would be to integrate twice. Returns
 * true when an output is back after that. */
bool levels_refer(levels_t *levels, const float x[MODEL_STATES], measurement_t *measurement, float period);

/* The level of output i waits for samples. */
bool levels_is_waiting(const levels_t *levels, uint32_t i);

/* The levels are guesses: in preload trim nothing can be learnt until they have settled. */
void levels_unsettle(levels_t *levels);

#endif
