#include "filter/derived.h"

#include "math/factor.h"
#include "math/trigonometry.h"
#include "model/base_motion.h"

#include <math.h>

/* Variance of gain [1] and of phase [rad^2] where a trunk on a seat is part of the model: its filter is off by so much
 * with seat settings that are 10 % off. */
#define SEAT_VARIANCE 1.6e-3f

/* Standard deviations of two quantities, and the covariance of their errors. */
typedef struct deviation {
    derived_couple_t sigma;
    float covariance;
} deviation_t;

/* Sums of squares and product. */
typedef struct moments {
    derived_couple_t square;
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
static deviation_t deviation_of(const cdkf_t *cdkf, const derived_couple_t value[MODEL_POINTS])
{
    moments_t moments = {{0.0f, 0.0f}, 0.0f};
    float first[MODEL_PARAMETERS];
    float second[MODEL_PARAMETERS];
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        const derived_couple_t *pair = &value[1u + (2u * j)];
        const derived_couple_t plus = {pair[0].first - value[0].first, pair[0].second - value[0].second};
        const derived_couple_t minus = {pair[1].first - value[0].first, pair[1].second - value[0].second};
        first[j] = SIGMA_FIRST * (plus.first - minus.first);
        second[j] = SIGMA_FIRST * (plus.second - minus.second);
        add(&moments, first[j], second[j]);
        add(&moments, SIGMA_SECOND * (plus.first + minus.first), SIGMA_SECOND * (plus.second + minus.second));
    }
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        const float *w = cdkf->considered[c].w;
        const float sigma = cdkf->considered_sigma[c];
        add(&moments, sigma * factor_dot_three(w, first), sigma * factor_dot_three(w, second));
    }
    const deviation_t result = {{sqrtf(moments.square.first), sqrtf(moments.square.second)}, moments.product};
    return result;
}

/* omega = sqrt(stiffness), zeta = damping / (2 omega): frequency [Hz] and damping ratio. */
static derived_couple_t oscillation(const model_dynamics_t *dynamics)
{
    derived_couple_t result = {0.0f, 0.0f};
    if (dynamics->stiffness > 0.0f) {
        const float omega = sqrtf(dynamics->stiffness);
        result.first = omega * MODEL_INVERSE_TURN;
        result.second = dynamics->damping / (2.0f * omega);
    }
    return result;
}

static derived_complex_t quotient(float real, float imaginary, float by_real, float by_imaginary)
{
    const float scale = 1.0f / ((by_real * by_real) + (by_imaginary * by_imaginary));
    const derived_complex_t result = {scale * ((real * by_real) + (imaginary * by_imaginary)),
        scale * ((imaginary * by_real) - (real * by_imaginary))};
    return result;
}

/* At s = i omega, z_dot = z_ddot / s, and with a trunk that gives way
 * seat = -angle z_ddot / (s^2 + seat_damping s + seat_stiffness). */
derived_complex_t derived_response(
    const model_dynamics_t *dynamics, const model_constants_t *constants, float angle, float frequency)
{
    const float omega = TURN * frequency;
    const float square = omega * omega;
    float real = dynamics->forcing;
    float imaginary = (dynamics->space > 0.0f) ? -(dynamics->forcing * (dynamics->space / omega)) : 0.0f;
    if (constants->seat_stiffness > 0.0f) {
        const derived_complex_t arm = quotient(dynamics->arm_stiffness, omega * dynamics->arm_damping,
            constants->seat_stiffness - square, omega * constants->seat_damping);
        real -= angle * arm.real;
        imaginary -= angle * arm.imaginary;
    }
    return quotient(real, imaginary, dynamics->stiffness - square, omega * dynamics->damping);
}

derived_couple_t derived_sigma(const cdkf_t *cdkf, const derived_couple_t value[MODEL_POINTS])
{
    return deviation_of(cdkf, value).sigma;
}

derived_dynamics_t derived_dynamics(
    const cdkf_t *cdkf, const model_t *model, const model_constants_t *constants, const model_step_t *step)
{
    derived_couple_t value[MODEL_POINTS];
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
    derived_couple_t value[MODEL_POINTS]; /* in units of the response at the estimate */
    derived_complex_t mean = {0.0f, 0.0f};
    float inverse = 0.0f;
    const float angle = base_motion_angle(constants, step);
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        const model_dynamics_t dynamics = model->dynamics(constants, step, &cdkf->points[k]);
        const derived_complex_t at = derived_response(&dynamics, constants, angle, frequency);
        if (k == 0u) {
            mean = at;
            inverse = 1.0f / ((at.real * at.real) + (at.imaginary * at.imaginary));
        }
        value[k].first = inverse * ((at.real * mean.real) + (at.imaginary * mean.imaginary));
        value[k].second = inverse * ((at.imaginary * mean.real) - (at.real * mean.imaginary));
    }
    const deviation_t deviation = deviation_of(cdkf, value);
    const float more = (constants->seat_stiffness > 0.0f) ? SEAT_VARIANCE : 0.0f;
    const float gain_sigma = sqrtf((deviation.sigma.first * deviation.sigma.first) + more);
    const float phase_sigma = sqrtf((deviation.sigma.second * deviation.sigma.second) + more);
    const float product = gain_sigma * phase_sigma;
    const derived_feedthrough_t result = {.real = mean.real,
        .imaginary = mean.imaginary,
        .gain_sigma = gain_sigma,
        .phase_sigma = phase_sigma,
        .correlation = (product > 0.0f) ? (deviation.covariance / product) : 0.0f};
    return result;
}
