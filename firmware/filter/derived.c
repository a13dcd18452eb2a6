#include "filter/derived.h"

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

/* From the two quantities at the sigma points of the parameters: each pair adds its first and second difference. */
static deviation_t deviation_of(const couple_t value[MODEL_POINTS])
{
    couple_t variance = {0.0f, 0.0f};
    deviation_t result = {{0.0f, 0.0f}, 0.0f};
    for (uint32_t j = 1u; j < (uint32_t)MODEL_POINTS; j += 2u) {
        const couple_t plus = {value[j].first - value[0].first, value[j].second - value[0].second};
        const couple_t minus = {value[j + 1u].first - value[0].first, value[j + 1u].second - value[0].second};
        const couple_t slope = {SIGMA_FIRST * (plus.first - minus.first), SIGMA_FIRST * (plus.second - minus.second)};
        const couple_t curvature = {
            SIGMA_SECOND * (plus.first + minus.first), SIGMA_SECOND * (plus.second + minus.second)};
        variance.first += (slope.first * slope.first) + (curvature.first * curvature.first);
        variance.second += (slope.second * slope.second) + (curvature.second * curvature.second);
        result.covariance += (slope.first * slope.second) + (curvature.first * curvature.second);
    }
    result.sigma.first = sqrtf(variance.first);
    result.sigma.second = sqrtf(variance.second);
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

/* Real and imaginary part of forcing / (stiffness - omega^2 + i omega damping). */
static couple_t response_at(const model_dynamics_t *dynamics, float omega)
{
    const float in_phase = dynamics->stiffness - (omega * omega);
    const float quadrature = omega * dynamics->damping;
    const float scale = dynamics->forcing / ((in_phase * in_phase) + (quadrature * quadrature));
    const couple_t result = {scale * in_phase, -(scale * quadrature)};
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
    const deviation_t deviation = deviation_of(value);
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
    const deviation_t deviation = deviation_of(value);
    const float product = deviation.sigma.first * deviation.sigma.second;
    const derived_feedthrough_t result = {.real = mean.first,
        .imaginary = mean.second,
        .gain_sigma = deviation.sigma.first,
        .phase_sigma = deviation.sigma.second,
        .correlation = (product > 0.0f) ? (deviation.covariance / product) : 0.0f};
    return result;
}
