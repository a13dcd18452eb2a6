#include "filter/parameter_filter.h"

#include "filter/sigma_points.h"
#include "math/exponential.h"
#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define ROWS ((uint32_t)PARAMETER_FILTER_ROWS)
#define OUTPUTS ((uint32_t)MEASUREMENT_OUTPUTS)

/* --- start ------------------------------------------------------------------------------------------------------ */

/* Standard deviation of w before the first sample. */
static float prior_sigma(const parameter_filter_t *filter, uint32_t i)
{
    return filter->positive ? filter->prior.sigma[i] : 1.0f;
}

static float scaled(const parameter_filter_t *filter, uint32_t i, float p)
{
    const float guess = filter->prior.guess[i];
    return filter->positive ? logarithm(p / guess) : ((p - guess) / filter->prior.sigma[i]);
}

static void start_gathering(parameter_filter_t *filter)
{
    (void)memset(filter->information, 0, sizeof filter->information);
    (void)memset(filter->score, 0, sizeof filter->score);
}

/* p = guess exp(w): exp(w +- h s) = exp(w) exp(h s)^(+-1), one exponential a pair, none above the diagonal, where s is 0. */
static void draw_positive(parameter_filter_t *filter)
{
    for (uint32_t j = 0u; j < L; j++) {
        for (uint32_t i = 0u; i < L; i++) {
            const float ratio = (i < j) ? 1.0f : exponential(SIGMA_SPREAD * filter->s[(i * L) + j]);
            filter->p[1u + (2u * j)][i] = filter->p[0][i] * ratio;
            filter->p[2u + (2u * j)][i] = filter->p[0][i] / ratio;
        }
    }
}

static void draw_signed(parameter_filter_t *filter)
{
    for (uint32_t j = 0u; j < L; j++) {
        for (uint32_t i = 0u; i < L; i++) {
            const float offset = SIGMA_SPREAD * filter->s[(i * L) + j] * filter->prior.sigma[i];
            filter->p[1u + (2u * j)][i] = filter->p[0][i] + offset;
            filter->p[2u + (2u * j)][i] = filter->p[0][i] - offset;
        }
    }
}

static void draw(parameter_filter_t *filter)
{
    parameter_filter_physical(filter, filter->p[0]);
    if (filter->positive) {
        draw_positive(filter);
    } else {
        draw_signed(filter);
    }
}

void parameter_filter_open(parameter_filter_t *filter)
{
    (void)memset(filter->s, 0, sizeof filter->s);
    for (uint32_t i = 0u; i < L; i++) {
        filter->s[(i * L) + i] = prior_sigma(filter, i);
    }
    start_gathering(filter);
    filter->trust = 0.0f;
    draw(filter);
}

void parameter_filter_init(parameter_filter_t *filter, const model_t *model, const prior_t *prior)
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
    start_gathering(filter);
}

/* --- what is known ---------------------------------------------------------------------------------------------- */

void parameter_filter_physical(const parameter_filter_t *filter, float p[MODEL_PARAMETERS])
{
    const prior_t *prior = &filter->prior;
    for (uint32_t i = 0u; i < L; i++) {
        p[i] = filter->positive ? (prior->guess[i] * exponential(filter->w[i]))
                                : (prior->guess[i] + (prior->sigma[i] * filter->w[i]));
    }
}

void parameter_filter_sigma(const parameter_filter_t *filter, float sigma[MODEL_PARAMETERS])
{
    parameter_filter_physical(filter, sigma);
    for (uint32_t i = 0u; i < L; i++) {
        const float slope = filter->positive ? sigma[i] : filter->prior.sigma[i]; /* d p / d w */
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
    (void)memcpy(points->p, filter->p, sizeof points->p);
    for (uint32_t j = 0u; j < L; j++) {
        for (uint32_t i = 0u; i < N; i++) {
            const float offset = SIGMA_SPREAD * filter->s[((L + i) * L) + j];
            points->x[1u + (2u * j)][i] = points->x[0][i] + offset;
            points->x[2u + (2u * j)][i] = points->x[0][i] - offset;
        }
    }
}

void parameter_filter_predict(parameter_filter_t *filter, float increment[MODEL_POINTS][MODEL_STATES])
{
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t j = 0u; j < L; j++) {
            filter->s[((L + i) * L) + j] += SIGMA_FIRST * (increment[1u + (2u * j)][i] - increment[2u + (2u * j)][i]);
        }
    }
}

/* nu^T (I + O O^T)^-1 nu for two whitened outputs O and innovations nu. */
static float normalised_square(const float *output, const float *innovation)
{
    float a = 1.0f;
    float b = 0.0f;
    float d = 1.0f;
    for (uint32_t j = 0u; j < L; j++) {
        a += output[j] * output[j];
        b += output[j] * output[L + j];
        d += output[L + j] * output[L + j];
    }
    const float square = (d * innovation[0] * innovation[0]) + (a * innovation[1] * innovation[1]);
    return (square - (2.0f * b * innovation[0] * innovation[1])) / ((a * d) - (b * b));
}

/* cppcheck-suppress misra-c2012-10.4 ; D6 */
float parameter_filter_gather(parameter_filter_t *filter, float output[MEASUREMENT_OUTPUTS * MODEL_PARAMETERS],
    float innovation[MEASUREMENT_OUTPUTS], const float noise[MEASUREMENT_OUTPUTS * MEASUREMENT_OUTPUTS])
{
    factor_solve(noise, OUTPUTS, output, L);
    factor_solve(noise, OUTPUTS, innovation, 1u);
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        const float *row = &output[i * L];
        for (uint32_t j = 0u; j < L; j++) {
            filter->score[j] += row[j] * innovation[i];
            for (uint32_t k = 0u; k < L; k++) {
                filter->information[(j * L) + k] += row[j] * row[k];
            }
        }
    }
    return normalised_square(output, innovation);
}

/* --- every few samples ------------------------------------------------------------------------------------------ */

/* Keeps the estimate within the bounds of the model. Returns true when it rests on one. */
static bool bound(parameter_filter_t *filter)
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

static float variance_of(const parameter_filter_t *filter, uint32_t i)
{
    const float sigma = factor_sigma(filter->s, L, i);
    return sigma * sigma;
}

/* What was gathered counts by `trust`, which grows when there is something. */
static void weigh(parameter_filter_t *filter, float period, float caution)
{
    const bool informed = (filter->information[0] > 0.0f);
    const float more = filter->trust + ((period < caution) ? (period / caution) : 1.0f);
    if (informed) {
        filter->trust = (more < 1.0f) ? more : 1.0f;
    }
    for (uint32_t i = 0u; i < L; i++) {
        filter->score[i] *= filter->trust;
        for (uint32_t j = 0u; j < L; j++) {
            filter->information[(i * L) + j] *= filter->trust;
        }
    }
}

bool parameter_filter_learn(parameter_filter_t *filter, float period, float caution,
    float correction[PARAMETER_FILTER_ROWS], float learnt[MODEL_PARAMETERS])
{
    weigh(filter, period, caution);
    for (uint32_t i = 0u; i < L; i++) {
        learnt[i] = variance_of(filter, i);
    }
    factor_condition(filter->s, ROWS, L, filter->information, filter->score, correction);
    for (uint32_t i = 0u; i < L; i++) {
        filter->w[i] += correction[i];
        learnt[i] -= variance_of(filter, i);
    }
    start_gathering(filter);
    return bound(filter);
}

/* Scales the rows of S_w whose standard deviation has outgrown that of the prior. */
static void cap(parameter_filter_t *filter)
{
    for (uint32_t i = 0u; i < L; i++) {
        const float sigma = factor_sigma(filter->s, L, i);
        const float most = prior_sigma(filter, i);
        const float shrink = (sigma > most) ? (most / sigma) : 1.0f;
        for (uint32_t j = 0u; j <= i; j++) {
            filter->s[(i * L) + j] *= shrink;
        }
    }
}

/* P_w / lambda with 1 / lambda = 1 + growth, by noise independent of the rest: the covariance T S_w^T stays, so T shrinks as
 * S_w grows; the rest of T is freed. */
static void forget(parameter_filter_t *filter, float growth, float *freed)
{
    const float stretch = sqrtf(1.0f + growth);
    const float shrink = 1.0f / stretch;
    const float rest = sqrtf(growth) * shrink;
    for (uint32_t k = 0u; k < (L * L); k++) {
        filter->s[k] *= stretch;
    }
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t j = 0u; j < L; j++) {
            float *deviation = &filter->s[((L + i) * L) + j];
            freed[(i * 2u * L) + L + j] = rest * *deviation;
            *deviation *= shrink;
        }
    }
}

/* Adds variances of w; what that frees goes into the first columns of `freed`. */
static void add_variance(parameter_filter_t *filter, const float variance[MODEL_PARAMETERS], float period, float *freed)
{
    float rest[L * ROWS];
    float noise[L];
    for (uint32_t i = 0u; i < L; i++) {
        noise[i] = sqrtf(variance[i] * period);
    }
    factor_add_noise(filter->s, ROWS, L, noise, rest);
    for (uint32_t i = 0u; i < N; i++) {
        for (uint32_t j = 0u; j < L; j++) {
            freed[(i * 2u * L) + j] = rest[(j * ROWS) + L + i];
        }
    }
    cap(filter);
    draw(filter);
}

void parameter_filter_walk(parameter_filter_t *filter, float period, float freed[PARAMETER_FILTER_FREED])
{
    forget(filter, filter->growth * period, freed);
    add_variance(filter, filter->walk, period, freed);
}

void parameter_filter_widen(
    parameter_filter_t *filter, const float variance[MODEL_PARAMETERS], float freed[PARAMETER_FILTER_FREED])
{
    (void)memset(freed, 0, PARAMETER_FILTER_FREED * sizeof freed[0]);
    add_variance(filter, variance, 1.0f, freed);
}

bool parameter_filter_is_valid(const parameter_filter_t *filter)
{
    bool valid = factor_is_valid(filter->s, L);
    for (uint32_t i = 0u; i < L; i++) {
        valid = valid && (filter->w[i] >= filter->least[i]) && (filter->w[i] <= filter->greatest[i]);
        valid = valid && (filter->walk[i] >= 0.0f) && (filter->walk[i] < 1.0e17f);
    }
    for (uint32_t i = L * L; i < (ROWS * L); i++) {
        valid = valid && (fabsf(filter->s[i]) < 1.0e6f);
    }
    return valid;
}
