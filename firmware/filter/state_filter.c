#include "filter/state_filter.h"

#include "filter/sigma_points.h"
#include "math/factor.h"

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define COLUMNS (N + 2u) /* of the predicted factor: its own, and two of what is added */

void state_filter_points(const state_filter_t *filter, model_points_t *points)
{
    for (uint32_t i = 0u; i < N; i++) {
        points->x[i] = filter->x[i];
        for (uint32_t j = 0u; j < N; j++) {
            points->offset[L + j][i] = SIGMA_SPREAD * filter->s[(i * N) + j];
        }
    }
}

/* Moves the mean. The bend is that of all pairs. */
static void predict_mean(state_filter_t *filter, const model_response_t *response, float period)
{
    float bend = 0.0f;
    for (uint32_t pair = 0u; pair < (uint32_t)MODEL_PAIRS; pair++) {
        bend += response->bend[pair];
    }
    const float change = response->mean + (SIGMA_MEAN * bend);
    filter->x[0] += period * (filter->x[1] + (0.5f * change));
    filter->x[1] += change;
}

/* What a step adds to the covariance, as two columns. Both what theta_dot's random walk q gives when theta integrates it,
 * q^2 [T^3/3, T^2/2; T^2/2, T] (van Loan 1978), and the second order of all pairs have a column along [T/2; 1]: what is not
 * linear in the parameters is uncertainty of the state. A random walk of theta itself comes on top. */
static void added_columns(
    const state_filter_t *filter, const model_response_t *response, float period, float *theta, float *theta_dot)
{
    const float variance = filter->process_noise[1] * filter->process_noise[1] * period;
    const float walk = filter->process_noise[0] * filter->process_noise[0] * period;
    float square = 0.0f;
    for (uint32_t pair = 0u; pair < (uint32_t)MODEL_PAIRS; pair++) {
        square += response->bend[pair] * response->bend[pair];
    }
    const float rate = sqrtf(variance + (SIGMA_SECOND * SIGMA_SECOND * square));
    theta[0] = 0.5f * period * rate;
    theta[1] = sqrtf((variance * (period * period * 0.0833333333f)) + walk);
    theta_dot[0] = rate;
    theta_dot[1] = 0.0f;
}

/* S- = tria[c1 (F+ - F-), c2 (F+ + F- - 2 F0), S_v] with F = X + increment, so c1 (F+ - F-) = S + c1 (D+ - D-). The echo moves
 * as the columns of S do. */
void state_filter_predict(state_filter_t *filter, const model_response_t *response, float period)
{
    float a[N * COLUMNS];
    float *theta = &a[0];
    float *theta_dot = &a[COLUMNS];
    factor_solve(filter->s, N, filter->echo, 1u);
    const float share[N] = {filter->echo[0], filter->echo[1]};
    filter->echo[0] = 0.0f;
    filter->echo[1] = 0.0f;
    for (uint32_t j = 0u; j < N; j++) {
        const float rate = filter->s[N + j];
        const float change = SIGMA_FIRST * response->difference[L + j];
        theta[j] = filter->s[j] + (period * (rate + (0.5f * change)));
        theta_dot[j] = rate + change;
        filter->echo[0] += share[j] * theta[j];
        filter->echo[1] += share[j] * theta_dot[j];
    }
    added_columns(filter, response, period, &theta[N], &theta_dot[N]);
    factor_tria(a, N, COLUMNS, filter->s);
    predict_mean(filter, response, period);
}

/* What an output does to the rest of the belief; all zero when it is not valid. */
typedef struct gain {
    float root;    /* standard deviation of the innovation */
    float inverse; /* of that */
    float of[MODEL_STATES];
} gain_t;

/* Both functions: conditions the factor on one output by Carlson's triangular form (1973), here for lower-triangular factors:
 * column by column from the output's own to the first; no downdate, the diagonal is only ever multiplied by factors in
 * (0, 1], so it cannot fail. */
static gain_t condition_on_theta(float *s, float noise)
{
    gain_t gain;
    gain.root = sqrtf((noise * noise) + (s[0] * s[0]));
    gain.inverse = 1.0f / gain.root;
    const float share = s[0] * gain.inverse * gain.inverse;
    const float keep = noise * gain.inverse;
    gain.of[0] = share * s[0];
    gain.of[1] = share * s[2];
    s[0] *= keep;
    s[2] *= keep;
    return gain;
}

static gain_t condition_on_theta_dot(float *s, float noise)
{
    const float own = s[3] * s[3];
    const float own_variance = (noise * noise) + own;
    const float own_root = sqrtf(own_variance);
    const float own_inverse = 1.0f / own_root;
    gain_t gain;
    gain.root = sqrtf(own_variance + (s[2] * s[2]));
    gain.inverse = 1.0f / gain.root;
    const float square = gain.inverse * gain.inverse;
    gain.of[0] = s[0] * s[2] * square;
    gain.of[1] = ((s[2] * s[2]) + own) * square;
    const float keep = own_root * gain.inverse;
    s[0] *= keep;
    s[2] = (s[2] * keep) - (own * s[2] * (own_inverse * gain.inverse));
    s[3] *= noise * own_inverse;
    return gain;
}

/* Takes from a deviation of the state [theta, theta_dot] what both outputs correct, one after the other, and leaves what they
 * saw of it, whitened. */
static inline void correct(float *theta, float *theta_dot, const gain_t gain[2], float *first, float *second)
{
    const float seen = *theta;
    const float given = *theta_dot - (gain[0].of[1] * seen);
    *first = gain[0].inverse * seen;
    *second = gain[1].inverse * given;
    *theta = (seen - (gain[0].of[0] * seen)) - (gain[1].of[0] * given);
    *theta_dot = given - (gain[1].of[1] * given);
}

void state_filter_update(state_filter_t *filter, const measurement_t *measurement,
    float sensitivity[MODEL_STATES * MODEL_PARAMETERS], whitened_t *whitened)
{
    const gain_t none = {.root = 1.0f};
    const float covariance = filter->s[0] * filter->s[2];
    gain_t gain[2] = {none, none}; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    float error[N] = {0.0f, 0.0f}; /* what the state lacks to what was measured */
    if (measurement->valid[0]) {
        gain[0] = condition_on_theta(filter->s, filter->output_noise[0]);
        error[0] = measurement->y[0] - filter->x[0];
    }
    if (measurement->valid[1]) {
        gain[1] = condition_on_theta_dot(filter->s, filter->output_noise[1]);
        error[1] = measurement->y[1] - filter->x[1];
    }
    whitened->coupling = covariance * gain[0].inverse;
    for (uint32_t j = 0u; j < L; j++) {
        correct(&sensitivity[j], &sensitivity[L + j], gain, &whitened->output[0][j], &whitened->output[1][j]);
    }
    float *echo =
        filter->echo; /* it is corrected as a deviation is, and is the answer to the correction of the state */
    correct(&echo[0], &echo[1], gain, &whitened->echo[0], &whitened->echo[1]);
    const float measured[N] = {error[0], error[1]};
    correct(&error[0], &error[1], gain, &whitened->innovation[0], &whitened->innovation[1]);
    for (uint32_t i = 0u; i < N; i++) {
        const float correction = measured[i] - error[i];
        filter->x[i] += correction;
        filter->echo[i] += correction;
        whitened->scale[i] = gain[i].root;
    }
}

bool state_filter_is_valid(const state_filter_t *filter)
{
    const float *s = filter->s;
    const bool echo = (fabsf(filter->echo[0]) + fabsf(filter->echo[1])) < 1.0e6f;
    const bool factor = (s[0] > 0.0f) && (s[3] > 0.0f) && (s[1] == 0.0f) && ((s[0] + fabsf(s[2]) + s[3]) < 1.0e17f);
    return echo && factor && (fabsf(filter->x[0]) < 25.0f) && (fabsf(filter->x[1]) < 1.0e4f);
}
