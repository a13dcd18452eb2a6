#include "filter/dual.h"

#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define OUTPUTS ((uint32_t)MEASUREMENT_OUTPUTS)

void dual_predict(dual_t *dual, const model_t *model, const model_constants_t *constants, const model_step_t *step)
{
    model_points_t points;
    float increment[MODEL_POINTS][MODEL_STATES];
    state_filter_points(&dual->state, &points);
    parameter_filter_points(&dual->parameters, &points);
    model->propagate(constants, step, &points, increment);
    parameter_filter_predict(&dual->parameters, increment);
    state_filter_predict(&dual->state, increment, step->period);
}

float dual_update(dual_t *dual, const measurement_t *measurement, bool learn)
{
    float *sensitivity = parameter_filter_sensitivity(&dual->parameters);
    float noise[OUTPUTS * OUTPUTS];
    float output[OUTPUTS * L];
    float innovation[OUTPUTS];
    state_filter_innovation(&dual->state, measurement, noise);
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        innovation[i] = measurement->valid[i] ? (measurement->y[i] - dual->state.x[i]) : 0.0f;
        for (uint32_t j = 0u; j < L; j++) {
            output[(i * L) + j] = measurement->valid[i] ? sensitivity[(i * L) + j] : 0.0f;
        }
    }
    noise_gather(&dual->noise, &dual->state, measurement, innovation, noise, output);
    const float nis = state_filter_update(&dual->state, measurement, sensitivity);
    return learn ? parameter_filter_gather(&dual->parameters, output, innovation, noise) : nis;
}

bool dual_learn(dual_t *dual, float period, float caution, bool joint, float correction[MODEL_PARAMETERS],
    float learnt[MODEL_PARAMETERS])
{
    float change[PARAMETER_FILTER_ROWS];
    float freed[PARAMETER_FILTER_FREED];
    const bool bounded = parameter_filter_learn(&dual->parameters, period, caution, change, learnt);
    for (uint32_t i = 0u; i < N; i++) {
        dual->state.x[i] += change[L + i];
    }
    parameter_filter_walk(&dual->parameters, period, freed);
    if (joint) {
        state_filter_add(&dual->state, freed);
    }
    (void)memcpy(correction, change, L * sizeof correction[0]);
    return bounded;
}

void dual_widen(dual_t *dual, const float variance[MODEL_PARAMETERS], bool joint)
{
    float freed[PARAMETER_FILTER_FREED];
    parameter_filter_widen(&dual->parameters, variance, freed);
    if (joint) {
        state_filter_add(&dual->state, freed);
    }
}

void dual_open(dual_t *dual)
{
    const float *sensitivity = parameter_filter_sensitivity(&dual->parameters);
    float freed[PARAMETER_FILTER_FREED] = {0.0f}; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    for (uint32_t i = 0u; i < N; i++) {
        (void)memcpy(&freed[i * 2u * L], &sensitivity[i * L], L * sizeof freed[0]);
    }
    state_filter_add(&dual->state, freed);
    parameter_filter_open(&dual->parameters);
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
