#include "filter/derived.h"

/* The variance that one pair of sigma points adds. */
static float pair_variance(float plus, float minus, float mean)
{
    const float first = SIGMA_FIRST * (plus - minus);
    const float second = SIGMA_SECOND * ((plus - mean) + (minus - mean));
    return (first * first) + (second * second);
}

void derived_compute(derived_t *derived, const cdkf_t *cdkf, const model_t *model, const model_constants_t *constants,
    const model_step_t *step)
{
    const model_dynamics_t mean = model->dynamics(constants, step, &cdkf->points[0]);
    model_dynamics_t variance = {0.0f, 0.0f};
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        const model_dynamics_t plus = model->dynamics(constants, step, &cdkf->points[1u + (2u * j)]);
        const model_dynamics_t minus = model->dynamics(constants, step, &cdkf->points[2u + (2u * j)]);
        variance.natural_frequency +=
            pair_variance(plus.natural_frequency, minus.natural_frequency, mean.natural_frequency);
        variance.damping_ratio += pair_variance(plus.damping_ratio, minus.damping_ratio, mean.damping_ratio);
    }
    derived->mean = mean;
    derived->variance = variance;
}
