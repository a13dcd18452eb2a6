/* Square-root central difference Kalman filter for the pilot's parameters.
 *
 * The filter works on w = ln(p / guess): positivity, a relative random walk and a small range come with that. Beside the
 * factor S_w of w it carries, for each column of it, the deviation of the state that goes with that column (T below).
 * T S_w^-1 is the sensitivity of the state estimate to the parameters, d x / d w: the recurrent derivative of Nelson
 * (2000), which is also the blending matrix of Friedland's two-stage filter (1969). Without it (x held fixed) a parameter
 * error shows in one step only, and standard deviations come out several times too large.
 */
#ifndef FILTER_PARAMETER_FILTER_H
#define FILTER_PARAMETER_FILTER_H

#include "filter/measurement.h"
#include "model/model.h"

#include <stdbool.h>

enum { PARAMETER_FILTER_ROWS = MODEL_PARAMETERS + MODEL_STATES };

typedef struct parameter_filter {
    float w[MODEL_PARAMETERS]; /* ln(p / guess) */
    /* cppcheck-suppress misra-c2012-10.4 ; D6 */
    float s[PARAMETER_FILTER_ROWS * MODEL_PARAMETERS]; /* [S_w; T]: factor of the covariance of w, state deviations */
    float walk[MODEL_PARAMETERS];                      /* variance of the random walk of w, per second [1/s] */
    float guess[MODEL_PARAMETERS];                     /* first guess, in the units of the model */
    float sigma[MODEL_PARAMETERS];                     /* relative standard deviation of the first guess, and cap */
    float least[MODEL_PARAMETERS];                     /* bounds of w */
    float greatest[MODEL_PARAMETERS];
} parameter_filter_t;

/* Starts at a first guess [units of the model] with relative standard deviations, uncorrelated, without a walk. Bounds
 * are those of the model, or the guess where that is outside. */
void parameter_filter_init(parameter_filter_t *filter, const model_t *model, const float guess[MODEL_PARAMETERS],
    const float sigma[MODEL_PARAMETERS]);

/* Opens the covariance to that of the first guess again, keeping the estimate. */
void parameter_filter_open(parameter_filter_t *filter);

/* The rows T [MODEL_STATES x MODEL_PARAMETERS] of s. */
float *parameter_filter_sensitivity(parameter_filter_t *filter);

/* Sets T to zero: for a state that starts anew, whatever the parameters are. */
void parameter_filter_forget_state(parameter_filter_t *filter);

/* p = guess exp(w), in the units of the model. */
void parameter_filter_physical(const parameter_filter_t *filter, float p[MODEL_PARAMETERS]);

/* Sigma points of the parameters alone, in the units of the model: the estimate, then the pair of each column of S_w. */
void parameter_filter_parameter_points(
    const parameter_filter_t *filter, float p[MODEL_PARAMETER_POINTS][MODEL_PARAMETERS]);

/* Draws the parameters of the points, and the states of the parameter pairs about the mean points->x[0]. */
void parameter_filter_points(const parameter_filter_t *filter, model_points_t *points);

/* Time update: T from the increments that the model gave, then the random walk of `period` seconds; standard deviations
 * are kept at or below their cap (wind-up). */
void parameter_filter_predict(parameter_filter_t *filter, float increment[MODEL_POINTS][MODEL_STATES], float period);

/* The random walk of `period` seconds alone: time in which nothing was predicted. */
void parameter_filter_walk(parameter_filter_t *filter, float period);

/* Measurement update. `output` [MEASUREMENT_OUTPUTS x MODEL_PARAMETERS] is T as predicted, before the state's update;
 * `innovation` y - x as predicted, both zero for outputs that are not valid; `noise` the factor of the covariance of the
 * innovation when the parameters are given. The correction of [w; x] is left in `correction`; w has it already.
 * Returns the normalised innovation squared. */
/* cppcheck-suppress misra-c2012-10.4 ; D6 */
float parameter_filter_update(parameter_filter_t *filter, float output[MEASUREMENT_OUTPUTS * MODEL_PARAMETERS],
    float innovation[MEASUREMENT_OUTPUTS], const float noise[MEASUREMENT_OUTPUTS * MEASUREMENT_OUTPUTS],
    float correction[PARAMETER_FILTER_ROWS]);

/* Keeps the estimate within the bounds of the model. Returns true when it rests on one. */
bool parameter_filter_bound(parameter_filter_t *filter);

/* Finite estimate within bounds, valid factor, walk finite and not negative. */
bool parameter_filter_is_valid(const parameter_filter_t *filter);

#endif
