/* How the random walk of the parameters is adapted. */
#ifndef FILTER_ADAPTATION_H
#define FILTER_ADAPTATION_H

#include "filter/cdkf.h"

typedef struct adaptation {
    uint8_t kind;                  /* enum lever_adaptation */
    float floor[MODEL_PARAMETERS]; /* least variance of the walk of w, per second [1/s] */
    float ceiling;                 /* greatest, in floors */
    float annealing_time;          /* [s] */
    float averaging_time;          /* Robbins-Monro [s] */
    float forgetting_time;         /* [s] */
} adaptation_t;

/* The walk to start with: annealing at its ceiling, the others at their floor. */
void adaptation_start(const adaptation_t *adaptation, cdkf_t *cdkf);

/* Sets walk and growth for the next time from the correction of w that was learnt after `period` seconds.
 *   fixed          floor
 *   annealing      walk <- max(alpha walk, floor), alpha = exp(-period / annealing_time) to first order
 *   Robbins-Monro  walk <- (1 - nu) walk + nu correction^2 / period, nu = period / averaging_time, between floor and
 *                  ceiling: every walk is a fixed point when the innovations match, so it drifts without them
 *   forgetting     floor, and growth = 1 / forgetting_time: lambda = exp(-period / forgetting_time) to first order
 * Without excitation the walk is held at its floor and nothing is forgotten, whatever the kind. */
void adaptation_step(
    const adaptation_t *adaptation, float period, const float correction[MODEL_PARAMETERS], bool excited, cdkf_t *cdkf);

#endif
