#include "filter/state_filter.h"

#include "filter/sigma_points.h"
#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define OUTPUTS ((uint32_t)MEASUREMENT_OUTPUTS)
#define FIRST_PAIR ((uint32_t)MODEL_PARAMETER_POINTS) /* index of the first point of the state pairs */
#define COLUMNS ((3u * N) + L)                        /* first order, second order of all pairs, process noise */
#define SETS (2u + L) /* innovations to update with: of x, of each sensitivity, of the echo */

void state_filter_points(const state_filter_t *filter, model_points_t *points)
{
    for (uint32_t i = 0u; i < N; i++) {
        points->x[0][i] = filter->x[i];
        for (uint32_t j = 0u; j < N; j++) {
            const float offset = SIGMA_SPREAD * filter->s[(i * N) + j];
            points->x[FIRST_PAIR + (2u * j)][i] = filter->x[i] + offset;
            points->x[FIRST_PAIR + (2u * j) + 1u][i] = filter->x[i] - offset;
        }
    }
}

/* A factor of the discrete process noise: q^2 [T^3/3, T^2/2; T^2/2, T], which theta_dot's random walk q gives exactly
 * when theta integrates it (van Loan 1978), and a random walk of theta itself on top. */
static void process_noise_columns(const state_filter_t *filter, float period, float *row_theta, float *row_theta_dot)
{
    const float rate = filter->process_noise[1] * sqrtf(period);
    const float integrated = rate * period * 0.288675135f; /* 1 / sqrt(12) */
    const float walk = filter->process_noise[0];
    row_theta[0] = 0.5f * rate * period;
    row_theta[1] = sqrtf((integrated * integrated) + (walk * walk * period));
    row_theta_dot[0] = rate;
    row_theta_dot[1] = 0.0f;
}

/* S- = tria[c1 (F+ - F-), c2 (F+ + F- - 2 F0), S_v] with F = X + increment, so c1 (F+ - F-) = S + c1 (D+ - D-). The second
 * order is that of all pairs: what is not linear in the parameters is uncertainty of the state. */
void state_filter_predict(state_filter_t *filter, float increment[MODEL_POINTS][MODEL_STATES], float period)
{
    float a[N * COLUMNS];
    factor_solve(filter->s, N, filter->echo, 1u);
    const float share[N] = {filter->echo[0], filter->echo[1]}; /* of each column of S: they move as the columns do */
    for (uint32_t i = 0u; i < N; i++) {
        float *row = &a[i * COLUMNS];
        const float mean = increment[0][i];
        filter->echo[i] = 0.0f;
        float bend = 0.0f;
        for (uint32_t pair = 0u; pair < (L + N); pair++) {
            const float plus = increment[1u + (2u * pair)][i];
            const float minus = increment[2u + (2u * pair)][i];
            const float second = (plus - mean) + (minus - mean);
            bend += second;
            row[pair] = SIGMA_SECOND * second;
            if (pair >= L) {
                row[N + pair] = filter->s[(i * N) + (pair - L)] + (SIGMA_FIRST * (plus - minus));
                filter->echo[i] += share[pair - L] * row[N + pair];
            }
        }
        filter->x[i] += mean + (SIGMA_MEAN * bend);
    }
    process_noise_columns(filter, period, &a[COLUMNS - N], &a[(2u * COLUMNS) - N]);
    factor_tria(a, N, COLUMNS, filter->s);
}

void state_filter_innovation(const state_filter_t *filter, const measurement_t *measurement,
    float factor[MEASUREMENT_OUTPUTS * MEASUREMENT_OUTPUTS])
{
    float a[OUTPUTS * (N + OUTPUTS)];
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        float *row = &a[i * (N + OUTPUTS)];
        const bool valid = measurement->valid[i];
        const float noise = valid ? filter->output_noise[i] : 1.0f;
        for (uint32_t j = 0u; j < N; j++) {
            row[j] = valid ? filter->s[(i * N) + j] : 0.0f;
            row[N + j] = (i == j) ? noise : 0.0f;
        }
    }
    factor_tria(a, OUTPUTS, N + OUTPUTS, factor);
}

float state_filter_update(
    state_filter_t *filter, const measurement_t *measurement, float sensitivity[MODEL_STATES * MODEL_PARAMETERS])
{
    float c[OUTPUTS * N];
    float innovation[OUTPUTS * SETS];
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        const float weight = measurement->valid[i] ? (1.0f / filter->output_noise[i]) : 0.0f;
        innovation[i * SETS] = measurement->valid[i] ? (weight * (measurement->y[i] - filter->x[i])) : 0.0f;
        for (uint32_t j = 0u; j < L; j++) {
            innovation[(i * SETS) + 1u + j] = -weight * sensitivity[(i * L) + j];
        }
        innovation[(i * SETS) + 1u + L] = -weight * filter->echo[i];
        for (uint32_t j = 0u; j < N; j++) {
            c[(i * N) + j] = weight * filter->s[(i * N) + j];
        }
    }
    float correction[N * SETS];
    float work[N + OUTPUTS];
    const float nis = factor_update(filter->s, N, N, c, OUTPUTS, innovation, SETS, correction, work);
    for (uint32_t i = 0u; i < N; i++) {
        filter->x[i] += correction[i * SETS];
        filter->echo[i] += correction[i * SETS] + correction[(i * SETS) + 1u + L];
        for (uint32_t j = 0u; j < L; j++) {
            sensitivity[(i * L) + j] += correction[(i * SETS) + 1u + j];
        }
    }
    return nis;
}

void state_filter_add(state_filter_t *filter, const float deviations[STATE_FILTER_ADDED])
{
    float a[N * (N + (2u * L))];
    for (uint32_t i = 0u; i < N; i++) {
        float *row = &a[i * (N + (2u * L))];
        (void)memcpy(row, &filter->s[i * N], N * sizeof row[0]);
        (void)memcpy(&row[N], &deviations[i * 2u * L], 2u * L * sizeof row[0]);
    }
    factor_tria(a, N, N + (2u * L), filter->s);
}

bool state_filter_is_valid(const state_filter_t *filter)
{
    const bool echo = (fabsf(filter->echo[0]) < 1.0e6f) && (fabsf(filter->echo[1]) < 1.0e6f);
    return echo && factor_is_valid(filter->s, N) && (fabsf(filter->x[0]) < 25.0f) && (fabsf(filter->x[1]) < 1.0e4f);
}
