/* Scaling of a model's parameters p for the filter, which works on w.
 *
 * w = ln(p / guess) where all parameters are positive: positivity, a relative random walk and a small range come
 * with that. w = (p - guess) / sigma where they have a sign. guess and sigma are those of the prior.
 */
#ifndef MODEL_SCALING_H
#define MODEL_SCALING_H

#include "model/model.h"

/* What is known of the parameters before the first sample. */
typedef struct prior {
    float guess[MODEL_PARAMETERS]; /* in the units of the model */
    float sigma[MODEL_PARAMETERS]; /* standard deviation: relative for positive parameters, else in their units */
} prior_t;

typedef struct scaling {
    prior_t prior;
    float least[MODEL_PARAMETERS]; /* bounds of w */
    float greatest[MODEL_PARAMETERS];
    bool positive; /* logarithmic */
} scaling_t;

/* Bounds are those of the model, or the guess where that is outside. */
void scaling_init(scaling_t *scaling, const model_t *model, const prior_t *prior);

/* p at w, and dp_i / dw_i there. */
void scaling_parameters(const scaling_t *scaling, const float w[MODEL_PARAMETERS], float p[MODEL_PARAMETERS]);
float scaling_slope(const scaling_t *scaling, const float p[MODEL_PARAMETERS], uint32_t i);

/* p at w + offset and w - offset, where p is at w. */
void scaling_pair(const scaling_t *scaling, const float p[MODEL_PARAMETERS], const float offset[MODEL_PARAMETERS],
    float plus[MODEL_PARAMETERS], float minus[MODEL_PARAMETERS]);

/* Standard deviation of w_i before the first sample. */
float scaling_prior_sigma(const scaling_t *scaling, uint32_t i);

/* Keeps w within its bounds. Returns true when it then rests on one, clipped or not. */
bool scaling_bound(const scaling_t *scaling, float w[MODEL_PARAMETERS]);

#endif
