#include "filter/derived.h"

#include "math/factor.h"

#include <math.h>

#define TURN 6.28318531f

/* Two quantities: at a sigma point, or summed up. */
typedef struct couple {
    float first;
    float second;
} couple_t;

/* Standard deviations of two quantities, and the covariance of their errors. */
typedef struct deviation {
    couple_t sigma;
    float covariance;
} deviation_t;

/* Sums of squares and product. */
typedef struct moments {
    couple_t square;
    float product;
} moments_t;

static void add(moments_t *moments, float first, float second)
{
    moments->square.first += first * first;
    moments->square.second += second * second;
    moments->product += first * second;
}

/* From the two quantities at the sigma points of the parameters: each pair adds its first and second difference, each
 * considered error what it makes of the parameters, along the first differences. */
static deviation_t deviation_of(const cdkf_t *cdkf, const couple_t value[MODEL_POINTS])
{
    moments_t moments = {{0.0f, 0.0f}, 0.0f};
    float first[MODEL_PARAMETERS];
    float second[MODEL_PARAMETERS];
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        const couple_t *pair = &value[1u + (2u * j)];
        const couple_t plus = {pair[0].first - value[0].first, pair[0].second - value[0].second};
        const couple_t minus = {pair[1].first - value[0].first, pair[1].second - value[0].second};
        first[j] = SIGMA_FIRST * (plus.first - minus.first);
        second[j] = SIGMA_FIRST * (plus.second - minus.second);
        add(&moments, first[j], second[j]);
        add(&moments, SIGMA_SECOND * (plus.first + minus.first), SIGMA_SECOND * (plus.second + minus.second));
    }
    for (uint32_t c = 0u; c < (uint32_t)CDKF_CONSIDERED; c++) {
        const float *w = cdkf->considered[c].w;
        const float sigma = cdkf->considered_sigma[c];
        add(&moments, sigma * factor_dot_three(w, first), sigma * factor_dot_three(w, second));
    }
    const deviation_t result = {{sqrtf(moments.square.first), sqrtf(moments.square.second)}, moments.product};
    return result;
}

/* omega = sqrt(stiffness), zeta = damping / (2 omega): frequency [Hz] and damping ratio. */
static couple_t oscillation(const model_dynamics_t *dynamics)
{
    couple_t result = {0.0f, 0.0f};
    if (dynamics->stiffness > 0.0f) {
        const float omega = sqrtf(dynamics->stiffness);
        result.first = omega * MODEL_INVERSE_TURN;
        result.second = dynamics->damping / (2.0f * omega);
    }
    return result;
}

/* Real and imaginary part of forcing (1 + space / (i omega)) / (stiffness - omega^2 + i omega damping). */
static couple_t response_at(const model_dynamics_t *dynamics, float omega)
{
    const float in_phase = dynamics->stiffness - (omega * omega);
    const float quadrature = omega * dynamics->damping;
    const float scale = dynamics->forcing / ((in_phase * in_phase) + (quadrature * quadrature));
    const float lag = (dynamics->space > 0.0f) ? (dynamics->space / omega) : 0.0f;
    const couple_t result = {scale * (in_phase - (lag * quadrature)), -(scale * (quadrature + (lag * in_phase)))};
    return result;
}

derived_dynamics_t derived_dynamics(
    const cdkf_t *cdkf, const model_t *model, const model_constants_t *constants, const model_step_t *step)
{
    couple_t value[MODEL_POINTS];
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        const model_dynamics_t dynamics = model->dynamics(constants, step, &cdkf->points[k]);
        value[k] = oscillation(&dynamics);
    }
    const deviation_t deviation = deviation_of(cdkf, value);
    const derived_dynamics_t result = {.natural_frequency = value[0].first,
        .natural_frequency_sigma = deviation.sigma.first,
        .damping_ratio = value[0].second,
        .damping_ratio_sigma = deviation.sigma.second};
    return result;
}

derived_feedthrough_t derived_feedthrough(const cdkf_t *cdkf, const model_t *model, const model_constants_t *constants,
    const model_step_t *step, float frequency)
{
    couple_t value[MODEL_POINTS]; /* in units of the response at the estimate */
    couple_t mean = {0.0f, 0.0f};
    float inverse = 0.0f;
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        const model_dynamics_t dynamics = model->dynamics(constants, step, &cdkf->points[k]);
        const couple_t at = response_at(&dynamics, TURN * frequency);
        if (k == 0u) {
            mean = at;
            inverse = 1.0f / ((at.first * at.first) + (at.second * at.second));
        }
        value[k].first = inverse * ((at.first * mean.first) + (at.second * mean.second));
        value[k].second = inverse * ((at.second * mean.first) - (at.first * mean.second));
    }
    const deviation_t deviation = deviation_of(cdkf, value);
    const float product = deviation.sigma.first * deviation.sigma.second;
    const derived_feedthrough_t result = {.real = mean.first,
        .imaginary = mean.second,
        .gain_sigma = deviation.sigma.first,
        .phase_sigma = deviation.sigma.second,
        .correlation = (product > 0.0f) ? (deviation.covariance / product) : 0.0f};
    return result;
}
