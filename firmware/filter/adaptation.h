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
    float memory;                  /* likewise [s] */
    float forgetting_time;         /* [s] */
} adaptation_t;

/* The walk to start with: annealing at its ceiling, the others at their floor. */
void adaptation_start(const adaptation_t *adaptation, cdkf_t *cdkf);

/* Sets walk and growth for the next time from the correction of w that was learnt after `period` seconds.
 *   fixed          floor
 *   annealing      walk <- max(alpha walk, floor), alpha = exp(-period / annealing_time) to first order
 *   Robbins-Monro  walk <- (1 - nu) walk + nu drift^2 / (memory / 2), nu = period / averaging_time, between floor
 *                  and ceiling. drift is the sum of the corrections with exponential forgetting. In steady flight they
 *                  are white, and drift^2 is memory / 2 times the walk; behind a ramp they add up, which the squares
 *                  of single corrections, nearly all noise, do not show (they are the limit of a memory of a period).
 *   forgetting     floor, and growth = 1 / forgetting_time: lambda = exp(-period / forgetting_time) to first order
 * Without excitation the walk is held at its floor and nothing is forgotten, whatever the kind. */
void adaptation_step(
    const adaptation_t *adaptation, float period, const float correction[MODEL_PARAMETERS], bool excited, cdkf_t *cdkf);

#endif
