#include "filter/derived.h"

#include "filter/sigma_points.h"

/* What one pair of sigma points adds to a variance. */
static float spread(float plus, float minus, float mean)
{
    const float first = SIGMA_FIRST * (plus - minus);
    const float second = SIGMA_SECOND * ((plus - mean) + (minus - mean));
    return (first * first) + (second * second);
}

static void add_pair(derived_t *derived, const parameter_filter_t *filter, const model_t *model,
    const model_constants_t *constants, const model_step_t *step, uint32_t j)
{
    const model_dynamics_t plus = model->dynamics(constants, step, &filter->arm[1u + (2u * j)]);
    const model_dynamics_t minus = model->dynamics(constants, step, &filter->arm[2u + (2u * j)]);
    const model_dynamics_t *mean = &derived->mean;
    derived->variance.natural_frequency +=
        spread(plus.natural_frequency, minus.natural_frequency, mean->natural_frequency);
    derived->variance.damping_ratio += spread(plus.damping_ratio, minus.damping_ratio, mean->damping_ratio);
}

void derived_begin(derived_t *derived, const parameter_filter_t *filter, const model_t *model,
    const model_constants_t *constants, const model_step_t *step)
{
    derived->mean = model->dynamics(constants, step, &filter->arm[0]);
    derived->variance.natural_frequency = 0.0f;
    derived->variance.damping_ratio = 0.0f;
    add_pair(derived, filter, model, constants, step, 0u);
}

void derived_end(derived_t *derived, const parameter_filter_t *filter, const model_t *model,
    const model_constants_t *constants, const model_step_t *step)
{
    for (uint32_t j = 1u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        add_pair(derived, filter, model, constants, step, j);
    }
}
