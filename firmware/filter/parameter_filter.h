/* Square-root central difference Kalman filter for the model's parameters.
 *
 * The filter works on scaled parameters w: ln(p / guess) where they are positive (positivity, a relative random walk and a
 * small range come with that), (p - guess) / sigma where they have a sign. Beside the factor S_w of w it carries, for each
 * column of it, the deviation of the state that goes with that column (T below). T S_w^-1 is the sensitivity of the state
 * estimate to the parameters, d x / d w: the recurrent derivative of Nelson (2000), which is also the blending matrix of
 * Friedland's two-stage filter (1969). Without it (x held fixed) a parameter error shows in one step only, and standard
 * deviations come out several times too large.
 *
 * Rate. What samples say of w is gathered, and learnt every few samples (revision.h): S_w, the sigma points drawn from it,
 * and w stand still in between, T does not. Nothing is lost by that (the sum of the samples' information is exact), single
 * precision sees increments that are large enough not to be rounded away, and it is cheaper.
 */
#ifndef FILTER_PARAMETER_FILTER_H
#define FILTER_PARAMETER_FILTER_H

#include "filter/measurement.h"
#include "model/model.h"

#include <stdbool.h>

enum { PARAMETER_FILTER_ROWS = MODEL_PARAMETERS + MODEL_STATES };

/* What is known of the parameters before the first sample. */
typedef struct prior {
    float guess[MODEL_PARAMETERS]; /* in the units of the model */
    float sigma[MODEL_PARAMETERS]; /* standard deviation: relative for positive parameters, else in their units */
} prior_t;

/* What samples say, in coordinates of the columns of S_w. */
enum { INFORMATION_SIZE = MODEL_PARAMETERS * (MODEL_PARAMETERS + 1) / 2 };
typedef struct information {
    float upper[INFORMATION_SIZE]; /* a symmetric matrix: its upper triangle, row by row */
    float score[MODEL_PARAMETERS]; /* the matrix times the correction */
} information_t;

typedef struct parameter_filter {
    float w[MODEL_PARAMETERS];
    float p[MODEL_PARAMETERS]; /* the parameters there, in the units of the model */
    /* cppcheck-suppress misra-c2012-10.4 ; D6 */
    float s[PARAMETER_FILTER_ROWS * MODEL_PARAMETERS]; /* [S_w; T]: factor of the covariance of w, state deviations */
    float walk[MODEL_PARAMETERS];                      /* variance of the random walk of w, per second [1/s] */
    float growth;                                      /* forgetting: relative growth of the covariance [1/s] */
    float trust;                                       /* part of the information that counts */
    information_t gathered;                            /* since the parameters learnt last */
    model_arm_t arm[MODEL_PARAMETER_POINTS];           /* at the sigma points of S_w */
    prior_t prior;
    float least[MODEL_PARAMETERS]; /* bounds of w */
    float greatest[MODEL_PARAMETERS];
    bool positive; /* logarithmic scale */
} parameter_filter_t;

/* Starts at the prior, uncorrelated, without a walk. Bounds are those of the model, or the guess where that is outside. */
void parameter_filter_init(
    parameter_filter_t *filter, const model_t *model, const model_constants_t *constants, const prior_t *prior);

/* Opens the covariance to that of the prior again, keeping the estimate, uncorrelated with the state; drops what was gathered. */
void parameter_filter_open(parameter_filter_t *filter, const model_t *model, const model_constants_t *constants);

/* The rows T [MODEL_STATES x MODEL_PARAMETERS] of s. */
float *parameter_filter_sensitivity(parameter_filter_t *filter);

/* Sets T to zero: for a state that starts anew, whatever the parameters are. */
void parameter_filter_forget_state(parameter_filter_t *filter);

/* Standard deviations of p, to first order. */
void parameter_filter_sigma(const parameter_filter_t *filter, float sigma[MODEL_PARAMETERS]);

/* Correlations of w: first and second, first and third, second and third parameter. */
void parameter_filter_correlation(const parameter_filter_t *filter, float correlation[MODEL_PARAMETERS]);

/* Standard deviation of w before the first sample, which it never exceeds. */
float parameter_filter_prior_sigma(const parameter_filter_t *filter, uint32_t i);

/* Keeps w within the bounds of the model. Returns true when it rests on one. */
bool parameter_filter_bound(const parameter_filter_t *filter, float w[MODEL_PARAMETERS]);

/* The parameters at w, in the units of the model. */
void parameter_filter_at(const parameter_filter_t *filter, const float w[MODEL_PARAMETERS], float p[MODEL_PARAMETERS]);

/* How far the pair of sigma points of column j of a factor S_w is from the mean: ratios of positive parameters, differences of
 * others. */
void parameter_filter_spread(
    const parameter_filter_t *filter, const float *s, uint32_t j, float spread[MODEL_PARAMETERS]);

/* Makes the arms at parameters p and of the pairs about it, each a row of `spread`. */
void parameter_filter_arm(parameter_filter_t *filter, const model_t *model, const model_constants_t *constants,
    const float p[MODEL_PARAMETERS], const float spread[MODEL_PARAMETERS * MODEL_PARAMETERS]);

/* The arms of the points, and the offsets of the parameter pairs. */
void parameter_filter_points(const parameter_filter_t *filter, model_points_t *points);

/* Time update of T over `period` [s] from the response that the model gave. */
void parameter_filter_predict(parameter_filter_t *filter, const model_response_t *response, float period);

/* Gathers what a sample says. */
void parameter_filter_gather(parameter_filter_t *filter, const whitened_t *whitened);

/* Finite estimate within bounds, valid factor, walk finite and not negative. */
bool parameter_filter_is_valid(const parameter_filter_t *filter);

/* The part of that which is cheap. */
bool parameter_filter_is_finite(const parameter_filter_t *filter);

#endif
