/* Square-root central difference Kalman filter for the lever's state [theta, theta_dot], parameters given.
 *
 * Additive process noise, outputs equal to the states with independent noise (so the measurement is linear, and exact
 * without sigma points of its own). The model is called by the owner (dual.c), once for this and the parameter filter.
 */
#ifndef FILTER_STATE_FILTER_H
#define FILTER_STATE_FILTER_H

#include "filter/measurement.h"
#include "model/model.h"

#include <stdbool.h>

typedef struct state_filter {
    float x[MODEL_STATES];                /* theta [rad], theta_dot [rad/s] */
    float s[MODEL_STATES * MODEL_STATES]; /* factor of their covariance, parameters given */
    float process_noise[MODEL_STATES];    /* random walk of each [unit / sqrt(s)] */
    float output_noise[MODEL_STATES];     /* standard deviation of each sample [unit] */
    float echo[MODEL_STATES];             /* what past corrections have come to (noise.h) */
} state_filter_t;

/* Draws the mean and the offsets of the state pairs into `points`. */
void state_filter_points(const state_filter_t *filter, model_points_t *points);

/* Time update over `period` [s] from the response that the model gave. */
void state_filter_predict(state_filter_t *filter, const model_response_t *response, float period);

/* Measurement update with the outputs that are valid; none of them: nothing changes. `sensitivity`, columns of
 * deviations of the state [MODEL_STATES x MODEL_PARAMETERS], shrinks as the state's own errors do: by I - K H. What the sample
 * said is left in `whitened`. */
void state_filter_update(state_filter_t *filter, const measurement_t *measurement,
    float sensitivity[MODEL_STATES * MODEL_PARAMETERS], whitened_t *whitened);

/* Finite estimate of a plausible angle (a few turns), valid factor. */
bool state_filter_is_valid(const state_filter_t *filter);

#endif
