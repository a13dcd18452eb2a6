#include "filter/derived.h"

#include "filter/sigma_points.h"
#include "math/factor.h"

/* What one pair of sigma points adds to a variance. */
static float spread(float plus, float minus, float mean)
{
    const float first = SIGMA_FIRST * (plus - minus);
    const float second = SIGMA_SECOND * ((plus - mean) + (minus - mean));
    return (first * first) + (second * second);
}

void derived_dynamics(const parameter_filter_t *filter, const model_t *model, const model_constants_t *constants,
    const model_step_t *step, model_dynamics_t *dynamics, model_dynamics_t *sigma)
{
    const float (*p)[MODEL_PARAMETERS] = filter->p;
    *dynamics = model->dynamics(constants, step, p[0]);
    float frequency = 0.0f;
    float damping = 0.0f;
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        const model_dynamics_t plus = model->dynamics(constants, step, p[1u + (2u * j)]);
        const model_dynamics_t minus = model->dynamics(constants, step, p[2u + (2u * j)]);
        frequency += spread(plus.natural_frequency, minus.natural_frequency, dynamics->natural_frequency);
        damping += spread(plus.damping_ratio, minus.damping_ratio, dynamics->damping_ratio);
    }
    sigma->natural_frequency = sqrtf(frequency);
    sigma->damping_ratio = sqrtf(damping);
}
