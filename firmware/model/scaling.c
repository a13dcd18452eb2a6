#include "model/scaling.h"

#include "math/bounds.h"
#include "math/exponential.h"

#define L ((uint32_t)MODEL_PARAMETERS)

static float scaled(const scaling_t *scaling, uint32_t i, float p)
{
    const float guess = scaling->prior.guess[i];
    return scaling->positive ? logarithm(p / guess) : ((p - guess) / scaling->prior.sigma[i]);
}

void scaling_init(scaling_t *scaling, const model_t *model, const prior_t *prior)
{
    scaling->prior = *prior;
    scaling->positive = model->positive;
    for (uint32_t i = 0u; i < L; i++) {
        const float least = scaled(scaling, i, model->parameter[i].least);
        const float greatest = scaled(scaling, i, model->parameter[i].greatest);
        scaling->least[i] = lesser(least, 0.0f);
        scaling->greatest[i] = greater(greatest, 0.0f);
    }
}

void scaling_parameters(const scaling_t *scaling, const float w[MODEL_PARAMETERS], float p[MODEL_PARAMETERS])
{
    const prior_t *prior = &scaling->prior;
    for (uint32_t i = 0u; i < L; i++) {
        p[i] = scaling->positive ? (prior->guess[i] * exponential(w[i])) : (prior->guess[i] + (prior->sigma[i] * w[i]));
    }
}

float scaling_slope(const scaling_t *scaling, const float p[MODEL_PARAMETERS], uint32_t i)
{
    return scaling->positive ? p[i] : scaling->prior.sigma[i];
}

void scaling_pair(const scaling_t *scaling, const float p[MODEL_PARAMETERS], const float offset[MODEL_PARAMETERS],
    float plus[MODEL_PARAMETERS], float minus[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < L; i++) {
        if (scaling->positive) { /* exp(w +- offset) = exp(w) exp(offset)^(+-1) */
            const float ratio = (offset[i] == 0.0f) ? 1.0f : exponential(offset[i]);
            plus[i] = p[i] * ratio;
            minus[i] = p[i] / ratio;
        } else {
            const float difference = offset[i] * scaling->prior.sigma[i];
            plus[i] = p[i] + difference;
            minus[i] = p[i] - difference;
        }
    }
}

float scaling_prior_sigma(const scaling_t *scaling, uint32_t i)
{
    return scaling->positive ? scaling->prior.sigma[i] : 1.0f;
}

bool scaling_bound(const scaling_t *scaling, float w[MODEL_PARAMETERS])
{
    bool rests = false;
    for (uint32_t i = 0u; i < L; i++) {
        w[i] = greater(scaling->least[i], lesser(scaling->greatest[i], w[i]));
        rests = rests || !((w[i] > scaling->least[i]) && (w[i] < scaling->greatest[i]));
    }
    return rests;
}
