#include "filter/dual.h"

#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)

void dual_predict(dual_t *dual, const model_t *model, const model_constants_t *constants, const model_step_t *step)
{
    model_points_t points;
    model_response_t response;
    state_filter_points(&dual->state, &points);
    parameter_filter_points(&dual->parameters, &points);
    model->respond(constants, step, &points, &response);
    parameter_filter_predict(&dual->parameters, &response, step->period);
    state_filter_predict(&dual->state, &response, step->period);
}

/* Covariance of whitened innovations, what the parameters make uncertain included. */
static spread_t spread_of(const whitened_t *whitened)
{
    const float *theta = whitened->output[0];
    const float *theta_dot = whitened->output[1];
    spread_t spread = {.a = 1.0f, .b = 0.0f, .d = 1.0f};
    for (uint32_t j = 0u; j < L; j++) {
        spread.a += theta[j] * theta[j];
        spread.b += theta[j] * theta_dot[j];
        spread.d += theta_dot[j] * theta_dot[j];
    }
    spread.inverse = 1.0f / ((spread.a * spread.d) - (spread.b * spread.b));
    return spread;
}

float dual_update(dual_t *dual, const measurement_t *measurement, bool learn)
{
    whitened_t whitened;
    float *sensitivity = parameter_filter_sensitivity(&dual->parameters);
    state_filter_update(&dual->state, measurement, sensitivity, &whitened);
    const spread_t spread = spread_of(&whitened);
    noise_gather(&dual->noise, dual->state.output_noise, measurement, &whitened, &spread);
    const float *nu = whitened.innovation;
    float nis = (nu[0] * nu[0]) + (nu[1] * nu[1]);
    if (learn) {
        parameter_filter_gather(&dual->parameters, &whitened);
        nis = (spread.d * nu[0] * nu[0]) + (spread.a * nu[1] * nu[1]) - (2.0f * spread.b * nu[0] * nu[1]);
        nis *= spread.inverse;
    }
    return nis;
}

/* Adds independent deviations of the state, columns [MODEL_STATES x MODEL_PARAMETERS], to its uncertainty. */
static void add_to_state(state_filter_t *filter, const float deviations[N * L])
{
    float a[N * (N + L)];
    for (uint32_t i = 0u; i < N; i++) {
        float *row = &a[i * (N + L)];
        (void)memcpy(row, &filter->s[i * N], N * sizeof row[0]);
        (void)memcpy(&row[N], &deviations[i * L], L * sizeof row[0]);
    }
    factor_tria(a, N, N + L, filter->s);
}

void dual_forget(dual_t *dual, float period, bool joint)
{
    float freed[N * L];
    if (revision_forget(&dual->revision, &dual->parameters, period, freed) && joint) {
        add_to_state(&dual->state, freed);
    }
}

void dual_walk(
    dual_t *dual, uint32_t first, uint32_t count, float period, const float variance[MODEL_PARAMETERS], bool joint)
{
    float freed[N * L] = {0.0f}; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    for (uint32_t i = first; i < (first + count); i++) {
        revision_walk(&dual->revision, &dual->parameters, i, period, variance[i], freed);
    }
    if (joint) {
        add_to_state(&dual->state, freed);
    }
}

void dual_open(dual_t *dual)
{
    add_to_state(&dual->state, parameter_filter_sensitivity(&dual->parameters));
    revision_open(&dual->revision, &dual->parameters);
}

float dual_state_sigma(const dual_t *dual, uint32_t i)
{
    const float *sensitivity = &dual->parameters.s[(L + i) * L];
    float square = 0.0f;
    for (uint32_t k = 0u; k < L; k++) {
        square += sensitivity[k] * sensitivity[k];
    }
    for (uint32_t k = 0u; k < N; k++) {
        square += dual->state.s[(i * N) + k] * dual->state.s[(i * N) + k];
    }
    return sqrtf(square);
}

bool dual_is_valid(const dual_t *dual)
{
    return state_filter_is_valid(&dual->state) && parameter_filter_is_valid(&dual->parameters);
}

bool dual_is_finite(const dual_t *dual)
{
    return state_filter_is_valid(&dual->state) && parameter_filter_is_finite(&dual->parameters);
}
