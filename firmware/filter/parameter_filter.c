#include "filter/parameter_filter.h"

#include "filter/sigma_points.h"
#include "math/exponential.h"
#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define OUTPUTS ((uint32_t)MEASUREMENT_OUTPUTS)

/* --- start ------------------------------------------------------------------------------------------------------ */

float parameter_filter_prior_sigma(const parameter_filter_t *filter, uint32_t i)
{
    return filter->positive ? filter->prior.sigma[i] : 1.0f;
}

static float scaled(const parameter_filter_t *filter, uint32_t i, float p)
{
    const float guess = filter->prior.guess[i];
    return filter->positive ? logarithm(p / guess) : ((p - guess) / filter->prior.sigma[i]);
}

/* p = guess exp(w): exp(w +- h s) = exp(w) exp(h s)^(+-1), one exponential a pair, none above the diagonal, where s is 0. */
void parameter_filter_spread(
    const parameter_filter_t *filter, const float *s, uint32_t j, float spread[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < L; i++) {
        const float offset = SIGMA_SPREAD * s[(i * L) + j];
        if (filter->positive) {
            spread[i] = (i < j) ? 1.0f : exponential(offset);
        } else {
            spread[i] = offset * filter->prior.sigma[i];
        }
    }
}

void parameter_filter_arm(parameter_filter_t *filter, const model_t *model, const model_constants_t *constants,
    const float p[MODEL_PARAMETERS], const float spread[MODEL_PARAMETERS * MODEL_PARAMETERS])
{
    model->prepare(constants, p, &filter->arm[0]);
    for (uint32_t j = 0u; j < L; j++) {
        float plus[L];
        float minus[L];
        for (uint32_t i = 0u; i < L; i++) {
            const float apart = spread[(j * L) + i];
            plus[i] = filter->positive ? (p[i] * apart) : (p[i] + apart);
            minus[i] = filter->positive ? (p[i] / apart) : (p[i] - apart);
        }
        model->prepare(constants, plus, &filter->arm[1u + (2u * j)]);
        model->prepare(constants, minus, &filter->arm[2u + (2u * j)]);
    }
}

void parameter_filter_open(parameter_filter_t *filter, const model_t *model, const model_constants_t *constants)
{
    (void)memset(filter->s, 0, sizeof filter->s);
    for (uint32_t i = 0u; i < L; i++) {
        filter->s[(i * L) + i] = parameter_filter_prior_sigma(filter, i);
    }
    (void)memset(&filter->gathered, 0, sizeof filter->gathered);
    filter->trust = 0.0f;
    parameter_filter_at(filter, filter->w, filter->p);
    float spread[L * L];
    for (uint32_t j = 0u; j < L; j++) {
        parameter_filter_spread(filter, filter->s, j, &spread[j * L]);
    }
    parameter_filter_arm(filter, model, constants, filter->p, spread);
}

void parameter_filter_init(
    parameter_filter_t *filter, const model_t *model, const model_constants_t *constants, const prior_t *prior)
{
    (void)memset(filter, 0, sizeof *filter);
    filter->prior = *prior;
    filter->positive = model->positive;
    for (uint32_t i = 0u; i < L; i++) {
        const float least = scaled(filter, i, model->parameter[i].least);
        const float greatest = scaled(filter, i, model->parameter[i].greatest);
        filter->least[i] = (least < 0.0f) ? least : 0.0f; /* a first guess is always within bounds */
        filter->greatest[i] = (greatest > 0.0f) ? greatest : 0.0f;
    }
    parameter_filter_open(filter, model, constants);
}

float *parameter_filter_sensitivity(parameter_filter_t *filter)
{
    return &filter->s[L * L];
}

void parameter_filter_forget_state(parameter_filter_t *filter)
{
    float *sensitivity = parameter_filter_sensitivity(filter);
    for (uint32_t k = 0u; k < (N * L); k++) {
        sensitivity[k] = 0.0f;
    }
    (void)memset(&filter->gathered, 0, sizeof filter->gathered);
}

bool parameter_filter_bound(const parameter_filter_t *filter, float w[MODEL_PARAMETERS])
{
    bool bounded = false;
    for (uint32_t i = 0u; i < L; i++) {
        if (w[i] < filter->least[i]) {
            w[i] = filter->least[i];
            bounded = true;
        }
        if (w[i] > filter->greatest[i]) {
            w[i] = filter->greatest[i];
            bounded = true;
        }
    }
    return bounded;
}

/* --- what is known ---------------------------------------------------------------------------------------------- */

void parameter_filter_at(const parameter_filter_t *filter, const float w[MODEL_PARAMETERS], float p[MODEL_PARAMETERS])
{
    const prior_t *prior = &filter->prior;
    for (uint32_t i = 0u; i < L; i++) {
        p[i] = filter->positive ? (prior->guess[i] * exponential(w[i])) : (prior->guess[i] + (prior->sigma[i] * w[i]));
    }
}

void parameter_filter_sigma(const parameter_filter_t *filter, float sigma[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < L; i++) {
        const float slope = filter->positive ? filter->p[i] : filter->prior.sigma[i]; /* d p / d w */
        sigma[i] = slope * factor_sigma(filter->s, L, i);
    }
}

static float correlation_of(const parameter_filter_t *filter, uint32_t i, uint32_t j)
{
    float product = 0.0f;
    for (uint32_t k = 0u; k < L; k++) {
        product += filter->s[(i * L) + k] * filter->s[(j * L) + k];
    }
    return product / (factor_sigma(filter->s, L, i) * factor_sigma(filter->s, L, j));
}

void parameter_filter_correlation(const parameter_filter_t *filter, float correlation[MODEL_PARAMETERS])
{
    correlation[0] = correlation_of(filter, 0u, 1u);
    correlation[1] = correlation_of(filter, 0u, 2u);
    correlation[2] = correlation_of(filter, 1u, 2u);
}

/* --- a sample --------------------------------------------------------------------------------------------------- */

void parameter_filter_points(const parameter_filter_t *filter, model_points_t *points)
{
    points->arm = filter->arm;
    for (uint32_t j = 0u; j < L; j++) {
        for (uint32_t i = 0u; i < N; i++) {
            points->offset[j][i] = SIGMA_SPREAD * filter->s[((L + i) * L) + j];
        }
    }
}

void parameter_filter_predict(parameter_filter_t *filter, const model_response_t *response, float period)
{
    float *theta = &filter->s[L * L];
    float *theta_dot = &filter->s[(L + 1u) * L];
    for (uint32_t j = 0u; j < L; j++) {
        const float change = SIGMA_FIRST * response->difference[j];
        theta[j] += period * (theta_dot[j] + (0.5f * change));
        theta_dot[j] += change;
    }
}

void parameter_filter_gather(parameter_filter_t *filter, const whitened_t *whitened)
{
    information_t *gathered = &filter->gathered;
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        const float *row = whitened->output[i];
        for (uint32_t j = 0u; j < L; j++) {
            gathered->score[j] += row[j] * whitened->innovation[i];
        }
        gathered->upper[0] += row[0] * row[0];
        gathered->upper[1] += row[0] * row[1];
        gathered->upper[2] += row[0] * row[2];
        gathered->upper[3] += row[1] * row[1];
        gathered->upper[4] += row[1] * row[2];
        gathered->upper[5] += row[2] * row[2];
    }
}

static inline float size_of_row(const parameter_filter_t *filter, uint32_t i)
{
    const float *row = &filter->s[i * L];
    return fabsf(row[0]) + fabsf(row[1]) + fabsf(row[2]);
}

bool parameter_filter_is_valid(const parameter_filter_t *filter)
{
    const float *s = filter->s;
    bool valid = (s[1] == 0.0f) && (s[2] == 0.0f) && (s[L + 2u] == 0.0f); /* above the diagonal */
    for (uint32_t i = 0u; i < L; i++) {
        valid = valid && (s[(i * L) + i] > 0.0f) && (filter->walk[i] >= 0.0f);
        valid = valid && (filter->w[i] >= filter->least[i]) && (filter->w[i] <= filter->greatest[i]);
    }
    return valid && parameter_filter_is_finite(filter);
}

bool parameter_filter_is_finite(const parameter_filter_t *filter)
{
    float size = 0.0f;
    float moving = 0.0f;
    for (uint32_t i = 0u; i < L; i++) {
        size += fabsf(filter->w[i]) + fabsf(filter->walk[i]) + size_of_row(filter, i);
    }
    for (uint32_t i = L; i < (uint32_t)PARAMETER_FILTER_ROWS; i++) {
        moving += size_of_row(filter, i);
    }
    return (size < 1.0e17f) && (moving < 1.0e6f);
}
