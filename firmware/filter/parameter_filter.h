/* Square-root central difference Kalman filter for the model's parameters.
 *
 * The filter works on scaled parameters w: ln(p / guess) where they are positive (positivity, a relative random walk and a
 * small range come with that), (p - guess) / sigma where they have a sign. Beside the factor S_w of w it carries, for each
 * column of it, the deviation of the state that goes with that column (T below). T S_w^-1 is the sensitivity of the state
 * estimate to the parameters, d x / d w: the recurrent derivative of Nelson (2000), which is also the blending matrix of
 * Friedland's two-stage filter (1969). Without it (x held fixed) a parameter error shows in one step only, and standard
 * deviations come out several times too large.
 *
 * Rate. What samples say of w is gathered, and learnt every few samples, together with the random walk of that time: S_w,
 * the sigma points drawn from it, and w stand still in between, T does not. Nothing is lost by that (the sum of the samples'
 * information is exact), single precision sees increments that are large enough not to be rounded away, and it is cheaper.
 */
#ifndef FILTER_PARAMETER_FILTER_H
#define FILTER_PARAMETER_FILTER_H

#include "filter/measurement.h"
#include "model/model.h"

#include <stdbool.h>

enum {
    PARAMETER_FILTER_ROWS = MODEL_PARAMETERS + MODEL_STATES,
    PARAMETER_FILTER_FREED = 2 * MODEL_PARAMETERS * MODEL_STATES
};

/* What is known of the parameters before the first sample. */
typedef struct prior {
    float guess[MODEL_PARAMETERS]; /* in the units of the model */
    float sigma[MODEL_PARAMETERS]; /* standard deviation: relative for positive parameters, else in their units */
} prior_t;

typedef struct parameter_filter {
    float w[MODEL_PARAMETERS];
    /* cppcheck-suppress misra-c2012-10.4 ; D6 */
    float s[PARAMETER_FILTER_ROWS * MODEL_PARAMETERS]; /* [S_w; T]: factor of the covariance of w, state deviations */
    float walk[MODEL_PARAMETERS];                      /* variance of the random walk of w, per second [1/s] */
    float growth;                                      /* forgetting: relative growth of the covariance [1/s] */
    float trust;                                       /* part of the information that counts */
    float information[MODEL_PARAMETERS * MODEL_PARAMETERS]; /* gathered, in coordinates of the columns of S_w */
    float score[MODEL_PARAMETERS];                          /* the same: information times correction */
    float p[MODEL_PARAMETER_POINTS][MODEL_PARAMETERS];      /* sigma points of S_w, in the units of the model */
    prior_t prior;
    float least[MODEL_PARAMETERS]; /* bounds of w */
    float greatest[MODEL_PARAMETERS];
    bool positive; /* logarithmic scale */
} parameter_filter_t;

/* Starts at the prior, uncorrelated, without a walk. Bounds are those of the model, or the guess where that is outside. */
void parameter_filter_init(parameter_filter_t *filter, const model_t *model, const prior_t *prior);

/* Opens the covariance to that of the prior again, keeping the estimate, uncorrelated with the state; drops what was gathered. */
void parameter_filter_open(parameter_filter_t *filter);

/* Adds independent uncertainty: variances of w. `freed` as of parameter_filter_walk. */
void parameter_filter_widen(
    parameter_filter_t *filter, const float variance[MODEL_PARAMETERS], float freed[PARAMETER_FILTER_FREED]);

/* The rows T [MODEL_STATES x MODEL_PARAMETERS] of s. */
float *parameter_filter_sensitivity(parameter_filter_t *filter);

/* Sets T to zero: for a state that starts anew, whatever the parameters are. */
void parameter_filter_forget_state(parameter_filter_t *filter);

/* Parameters in the units of the model, and their standard deviations to first order. */
void parameter_filter_physical(const parameter_filter_t *filter, float p[MODEL_PARAMETERS]);
void parameter_filter_sigma(const parameter_filter_t *filter, float sigma[MODEL_PARAMETERS]);

/* Correlations of w: first and second, first and third, second and third parameter. */
void parameter_filter_correlation(const parameter_filter_t *filter, float correlation[MODEL_PARAMETERS]);

/* The parameters of the points, and the states of the parameter pairs about the mean points->x[0]. */
void parameter_filter_points(const parameter_filter_t *filter, model_points_t *points);

/* Time update of T from the increments that the model gave. */
void parameter_filter_predict(parameter_filter_t *filter, float increment[MODEL_POINTS][MODEL_STATES]);

/* Gathers what a sample says. `output` [MEASUREMENT_OUTPUTS x MODEL_PARAMETERS] is T as predicted, before the state's update;
 * `innovation` y - x as predicted, both zero for outputs that are not valid; both are used up. `noise` is the factor of the
 * covariance of the innovation when the parameters are given. Returns the normalised innovation squared. */
/* cppcheck-suppress misra-c2012-10.4 ; D6 */
float parameter_filter_gather(parameter_filter_t *filter, float output[MEASUREMENT_OUTPUTS * MODEL_PARAMETERS],
    float innovation[MEASUREMENT_OUTPUTS], const float noise[MEASUREMENT_OUTPUTS * MEASUREMENT_OUTPUTS]);

/* Learns what was gathered in `period` seconds. From the start, or an opened covariance, on it counts in part only, in
 * proportion to the time that was learnt in, and fully after `caution` seconds: far from the truth the sensitivities are wrong,
 * and would make the filter certain of what the samples do not tell (the common scale of the parameters). The correction of [w; x] is left in `correction`; w has it already, kept within the bounds of the
 * model. By how much the variances of w have become smaller is left in `learnt`. Returns true when w rests on a bound. */
bool parameter_filter_learn(parameter_filter_t *filter, float period, float caution,
    float correction[PARAMETER_FILTER_ROWS], float learnt[MODEL_PARAMETERS]);

/* Random walk and forgetting over `period` seconds; standard deviations are kept at or below those of the prior (wind-up).
 * What becomes independent of w by that is still uncertainty of the state: it is left in `freed` [MODEL_STATES x
 * 2 MODEL_PARAMETERS], columns of deviations of the state. Draws the sigma points of the next samples. */
void parameter_filter_walk(parameter_filter_t *filter, float period, float freed[PARAMETER_FILTER_FREED]);

/* Finite estimate within bounds, valid factor, walk finite and not negative. */
bool parameter_filter_is_valid(const parameter_filter_t *filter);

#endif
