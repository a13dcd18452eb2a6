/* Estimation of measurement and process noise on line, from windows of innovations.
 *
 * Measurement noise by covariance matching (Mohamed & Schwarz 1999): the variance of the innovations over a window,
 * divided by what the filter predicted, scales the noise of each output. A ratio, unlike their difference C_nu - H P
 * H^T, cannot turn negative. It counts as far as the prediction is measurement noise: the rest is the uncertainty of
 * state and parameters. Only innovations that are far too large always count.
 *
 * Process noise not by their Q = K C_nu K^T: at a high sample rate the innovations' variance hardly depends on Q,
 * and that rule confirms any Q. The colour of the innovations does depend on Q: too little gain leaves a part of the
 * last innovations in the next ones (Mehra 1970). The response r of the state to past corrections obeys r- = F r,
 * then r = (I - K H) r- + K nu. The coefficient of the regression of the innovations on H r- says how much more gain
 * they ask for, and the variance Q goes with its square. When much more is asked for, the coefficient is less than it
 * should be, so that Q goes with its fourth power.
 *
 * Both stay within a factor about what is set.
 */
#ifndef FILTER_NOISE_ESTIMATION_H
#define FILTER_NOISE_ESTIMATION_H

#include "filter/cdkf.h"

#include <stdbool.h>

/* What is set. */
typedef struct noise_setting {
    float window;                     /* length of a window [s]; 0: the noise stays as set */
    float range;                      /* greatest factor about the values below, up and down */
    float output_noise[CDKF_OUTPUTS]; /* as in cdkf_t */
    float process_noise;              /* of theta_dot, likewise */
} noise_setting_t;

typedef struct noise_estimation {
    float elapsed; /* since the window began [s] */
    float samples[CDKF_OUTPUTS];
    float ratio[CDKF_OUTPUTS]; /* sum of squared innovations over their predicted variance */
    float share[CDKF_OUTPUTS]; /* the measurement noise's part in that variance, at the last sample */
    float covariance;          /* of innovation and response: sum over the innovations' variance */
    float variance;            /* of the response, likewise */
} noise_estimation_t;

/* Begins a window; drops the last one. */
void noise_estimation_begin(noise_estimation_t *noise);

/* Adds a sample's innovations, with the noise that the filter had. */
void noise_estimation_add(
    noise_estimation_t *noise, const innovation_t innovation[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS]);

/* After `period` seconds: at the end of a window sets the noise of the filter. Returns true when an output's noise
 * was far too small: then the parameters learnt with it are less certain than they seem. */
bool noise_estimation_step(noise_estimation_t *noise, cdkf_t *cdkf, const noise_setting_t *setting, float period);

#endif
