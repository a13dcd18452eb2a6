#include "filter/parameter_filter.h"

#include "filter/sigma_points.h"
#include "math/exponential.h"
#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define ROWS ((uint32_t)PARAMETER_FILTER_ROWS)
#define OUTPUTS ((uint32_t)MEASUREMENT_OUTPUTS)

void parameter_filter_open(parameter_filter_t *filter)
{
    (void)memset(filter->s, 0, sizeof filter->s);
    for (uint32_t i = 0u; i < L; i++) {
        filter->s[(i * L) + i] = filter->sigma[i];
    }
}

void parameter_filter_init(parameter_filter_t *filter, const model_t *model, const float guess[MODEL_PARAMETERS],
    const float sigma[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < L; i++) {
        filter->w[i] = 0.0f;
        filter->walk[i] = 0.0f;
        filter->guess[i] = guess[i];
        filter->sigma[i] = sigma[i];
        const float least = logarithm(model->parameter[i].least / guess[i]);
        const float greatest = logarithm(model->parameter[i].greatest / guess[i]);
        filter->least[i] = (least < 0.0f) ? least : 0.0f; /* a first guess is always within bounds */
        filter->greatest[i] = (greatest > 0.0f) ? greatest : 0.0f;
    }
    parameter_filter_open(filter);
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
}

void parameter_filter_physical(const parameter_filter_t *filter, float p[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < L; i++) {
        p[i] = filter->guess[i] * exponential(filter->w[i]);
    }
}

/* exp(w +- h s) = exp(w) exp(h s)^(+-1): one exponential a pair, and none above the diagonal, where s is 0. */
void parameter_filter_parameter_points(
    const parameter_filter_t *filter, float p[MODEL_PARAMETER_POINTS][MODEL_PARAMETERS])
{
    parameter_filter_physical(filter, p[0]);
    for (uint32_t j = 0u; j < L; j++) {
        for (uint32_t i = 0u; i < L; i++) {
            const float ratio = (i < j) ? 1.0f : exponential(SIGMA_SPREAD * filter->s[(i * L) + j]);
            p[1u + (2u * j)][i] = p[0][i] * ratio;
            p[2u + (2u * j)][i] = p[0][i] / ratio;
        }
    }
}

void parameter_filter_points(const parameter_filter_t *filter, model_points_t *points)
{
    parameter_filter_parameter_points(filter, points->p);
    for (uint32_t j = 0u; j < L; j++) {
        for (uint32_t i = 0u; i < N; i++) {
            const float offset = SIGMA_SPREAD * filter->s[((L + i) * L) + j];
            points->x[1u + (2u * j)][i] = points->x[0][i] + offset;
            points->x[2u + (2u * j)][i] = points->x[0][i] - offset;
        }
    }
}

/* Scales the rows of S_w whose standard deviation has outgrown that of the first guess. */
static void cap(parameter_filter_t *filter)
{
    for (uint32_t i = 0u; i < L; i++) {
        const float sigma = factor_sigma(filter->s, L, i);
        const float shrink = (sigma > filter->sigma[i]) ? (filter->sigma[i] / sigma) : 1.0f;
        for (uint32_t j = 0u; j <= i; j++) {
            filter->s[(i * L) + j] *= shrink;
        }
    }
}

void parameter_filter_walk(parameter_filter_t *filter, float period)
{
    float noise[L];
    float column[ROWS];
    for (uint32_t i = 0u; i < L; i++) {
        noise[i] = sqrtf(filter->walk[i] * period);
    }
    factor_add_noise(filter->s, ROWS, L, noise, column);
    cap(filter);
}

void parameter_filter_predict(parameter_filter_t *filter, float increment[MODEL_POINTS][MODEL_STATES], float period)
{
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t j = 0u; j < L; j++) {
            filter->s[((L + i) * L) + j] += SIGMA_FIRST * (increment[1u + (2u * j)][i] - increment[2u + (2u * j)][i]);
        }
    }
    parameter_filter_walk(filter, period);
}

/* cppcheck-suppress misra-c2012-10.4 ; D6 */
float parameter_filter_update(parameter_filter_t *filter, float output[MEASUREMENT_OUTPUTS * MODEL_PARAMETERS],
    float innovation[MEASUREMENT_OUTPUTS], const float noise[MEASUREMENT_OUTPUTS * MEASUREMENT_OUTPUTS],
    float correction[PARAMETER_FILTER_ROWS])
{
    float work[ROWS + OUTPUTS];
    factor_solve(noise, OUTPUTS, output, L);
    factor_solve(noise, OUTPUTS, innovation, 1u);
    const float nis = factor_update(filter->s, ROWS, L, output, OUTPUTS, innovation, 1u, correction, work);
    for (uint32_t i = 0u; i < L; i++) {
        filter->w[i] += correction[i];
    }
    return nis;
}

bool parameter_filter_bound(parameter_filter_t *filter)
{
    bool bounded = false;
    for (uint32_t i = 0u; i < L; i++) {
        if (filter->w[i] < filter->least[i]) {
            filter->w[i] = filter->least[i];
            bounded = true;
        }
        if (filter->w[i] > filter->greatest[i]) {
            filter->w[i] = filter->greatest[i];
            bounded = true;
        }
    }
    return bounded;
}

bool parameter_filter_is_valid(const parameter_filter_t *filter)
{
    bool valid = factor_is_valid(filter->s, L);
    for (uint32_t i = 0u; i < L; i++) {
        valid = valid && (filter->w[i] >= filter->least[i]) && (filter->w[i] <= filter->greatest[i]);
        valid = valid && (filter->walk[i] >= 0.0f) && (filter->walk[i] < 1.0e6f);
    }
    for (uint32_t i = L * L; i < (ROWS * L); i++) {
        valid = valid && (fabsf(filter->s[i]) < 1.0e6f);
    }
    return valid;
}
