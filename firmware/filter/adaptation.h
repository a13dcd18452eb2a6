/* How the random walk of the parameters is set while running. */
#ifndef FILTER_ADAPTATION_H
#define FILTER_ADAPTATION_H

#include "filter/parameter_filter.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct adaptation {
    uint8_t kind;                    /* enum lever_adaptation */
    float floor[MODEL_PARAMETERS];   /* least variance of the walk of w, per second [1/s] */
    float ceiling[MODEL_PARAMETERS]; /* greatest */
    float annealing_time;            /* [s] */
    float averaging_time;            /* Robbins-Monro [s] */
} adaptation_t;

/* The walk to start with: annealing at its ceiling, the others at their floor. */
void adaptation_start(const adaptation_t *adaptation, float walk[MODEL_PARAMETERS]);

/* Sets the walk for the next step from the correction of w that this step of `period` seconds made.
 *   fixed          floor
 *   annealing      walk <- max(alpha walk, floor), alpha = exp(-period / annealing_time) to first order
 *   Robbins-Monro  walk <- (1 - nu) walk + nu correction^2 / period, nu = period / averaging_time, between floor and
 *                  ceiling: every walk is a fixed point when the innovations match, so it drifts without them
 * Without excitation the walk is held at its floor, whatever the kind. */
void adaptation_step(const adaptation_t *adaptation, float period, const float correction[MODEL_PARAMETERS],
    bool excited, float walk[MODEL_PARAMETERS]);

#endif
