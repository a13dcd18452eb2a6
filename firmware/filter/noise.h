/* Estimation of measurement and process noise on line, from windows of innovations.
 *
 * Measurement noise by covariance matching (Mohamed & Schwarz 1999): the variance of the innovations over a window against
 * what the filter predicted scales the noise of each output. A ratio, unlike their difference C_nu - H P H^T, cannot turn
 * negative. It counts as far as the prediction is measurement noise: the rest is what the filter knows of state and parameters.
 * Only innovations that are far too large always count.
 *
 * Process noise not by their Q = K C_nu K^T: at a high sample rate the innovations' variance hardly depends on Q, and that
 * rule confirms whatever Q there is. What does depend on Q is their colour: too little gain leaves something of the last
 * innovations in the next ones (Mehra 1970). The echo z is the state's answer to past corrections, z- = Phi z, then z = (I - K
 * H) z- + K nu (state_filter.h). The coefficient of the innovations' regression on H z- says how much more gain they ask for,
 * and Q goes with the square of the gain.
 *
 * Both stay within a factor about what is set.
 */
#ifndef FILTER_NOISE_H
#define FILTER_NOISE_H

#include "filter/measurement.h"
#include "filter/state_filter.h"

#include <stdbool.h>

/* What is set. */
typedef struct noise_setting {
    float window;                            /* length of a window [s]; 0: the noise stays as set */
    float range;                             /* greatest factor about the values below, up and down */
    float output_noise[MEASUREMENT_OUTPUTS]; /* as in state_filter_t */
    float process_noise;                     /* of theta_dot, likewise */
} noise_setting_t;

/* A symmetric matrix [a b; b d], and 1 / (a d - b^2). */
typedef struct spread {
    float a;
    float b;
    float d;
    float inverse;
} spread_t;

typedef struct noise_estimator {
    float elapsed; /* since the window began [s] */
    float samples[MEASUREMENT_OUTPUTS];
    float ratio[MEASUREMENT_OUTPUTS]; /* sum of innovation squares over their predicted variance */
    float share[MEASUREMENT_OUTPUTS]; /* sum of the measurement noise's part in that variance */
    float agreement;                  /* sum of products of whitened innovation and whitened echo */
    float strength;                   /* sum of squares of the whitened echo */
} noise_estimator_t;

/* Begins a window; what is in the last one is thrown away. */
void noise_begin(noise_estimator_t *noise);

/* Takes a sample as the filter saw it, with the noise that the filter had. `spread` is the covariance of the whitened
 * innovation, that of the parameters included: 1 + o o^T. */
void noise_gather(noise_estimator_t *noise, const float output_noise[MEASUREMENT_OUTPUTS],
    const measurement_t *measurement, const whitened_t *whitened, const spread_t *spread);

/* After `period` seconds: at the end of a window sets the noise of the filter. Returns true when an output's noise was far too
 * small until now: then whatever was learnt with it is less certain than it seems. */
bool noise_step(noise_estimator_t *noise, state_filter_t *filter, const noise_setting_t *setting, float period);

#endif
