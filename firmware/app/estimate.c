/* What is known: from the belief to the estimate that is reported. */
#include "app/estimator.h"
#include "math/trigonometry.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

float estimator_state(const estimator_t *estimator, uint32_t i)
{
    return estimator->trim.origin[i] + estimator->cdkf.x[i];
}

void estimator_parameters(const estimator_t *estimator, float parameter[LEVER_PARAMETERS])
{
    (void)memcpy(parameter, estimator->cdkf.p, sizeof estimator->cdkf.p);
}

void estimator_parameter_sigma(const estimator_t *estimator, float sigma[LEVER_PARAMETERS])
{
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        sigma[i] = cdkf_parameter_sigma(&estimator->cdkf, i);
    }
}

/* The trim angle of a sample follows large motion; what is reported is about its mean. */
static model_step_t at_rest(const estimator_t *estimator)
{
    const sine_cosine_t angle = sine_cosine(estimator->rest_angle);
    const model_step_t step = {.trim = estimator->rest_angle, .trim_sine = angle.sine, .trim_cosine = angle.cosine};
    return step;
}

derived_dynamics_t estimator_dynamics(const estimator_t *estimator)
{
    const setup_t *setup = &estimator->setup;
    const model_step_t step = at_rest(estimator);
    return derived_dynamics(&estimator->cdkf, setup->model_in_use, &setup->constants, &step);
}

model_dynamics_t estimator_linearised(const estimator_t *estimator, model_step_t *step)
{
    const setup_t *setup = &estimator->setup;
    *step = at_rest(estimator);
    return setup->model_in_use->dynamics(&setup->constants, step, &estimator->cdkf.points[0]);
}

derived_feedthrough_t estimator_feedthrough(const estimator_t *estimator, float frequency)
{
    const setup_t *setup = &estimator->setup;
    const model_step_t step = at_rest(estimator);
    return derived_feedthrough(&estimator->cdkf, setup->model_in_use, &setup->constants, &step, frequency);
}

margin_t estimator_margin(const estimator_t *estimator, const lever_aircraft_t *aircraft)
{
    const setup_t *setup = &estimator->setup;
    const model_step_t step = at_rest(estimator);
    return margin_of(aircraft, &estimator->cdkf, setup->model_in_use, &setup->constants, &step);
}

#define LEVEL_NOISE 22.2f /* noise bandwidth of the level, 2 x integral of |1 - H|^2, in corners */

/* Standard deviation of state i. The level, to which the deviation is added, has the noise of the samples too; while it
 * waits for samples, what it makes up of the motion is not predicted: the rms rate, in the state's unit by `scale`. */
static float state_sigma(const estimator_t *estimator, uint32_t i, float scale)
{
    const lever_settings_t *s = estimator->setup.settings;
    const bool trimmed = estimator->setup.constants.trim;
    const float slow = (trimmed && trim_is_waiting(&estimator->trim, i)) ? scale : 0.0f;
    const float noise = trimmed ? estimator->cdkf.output_noise[i] : 0.0f;
    const float sigma = cdkf_state_sigma(&estimator->cdkf, i);
    return sqrtf((sigma * sigma) + ((noise * noise) * (LEVEL_NOISE * (s->trim_corner * s->sample_period))) +
                 ((slow * slow) * estimator->learning.evidence.motion.slow));
}

void estimator_estimate(const estimator_t *estimator, lever_estimate_t *estimate)
{
    const derived_dynamics_t dynamics = estimator_dynamics(estimator);
    const setup_t *setup = &estimator->setup;
    const float delay_us = (float)setup->delay_samples * (setup->settings->sample_period * 1.0e6f);
    estimate->time_us = estimator->time_us - (uint32_t)(delay_us + 0.5f);
    estimate->theta = estimator_state(estimator, 0u);
    estimate->theta_dot = estimator_state(estimator, 1u);
    estimate->theta_sigma = state_sigma(estimator, 0u, 1.0f / (TURN * estimator->setup.settings->trim_corner));
    estimate->theta_dot_sigma = state_sigma(estimator, 1u, 1.0f);
    estimate->trim = estimator->rest_angle;
    estimate->nis = estimator->nis;
    estimate->nis_size = estimator->nis_size;
    estimator_parameters(estimator, estimate->parameter);
    estimator_parameter_sigma(estimator, estimate->parameter_sigma);
    cdkf_correlation(&estimator->cdkf, estimate->parameter_correlation);
    estimate->natural_frequency = dynamics.natural_frequency;
    estimate->natural_frequency_sigma = dynamics.natural_frequency_sigma;
    estimate->damping_ratio = dynamics.damping_ratio;
    estimate->damping_ratio_sigma = dynamics.damping_ratio_sigma;
}

void estimator_health(const estimator_t *estimator, lever_health_t *health)
{
    health->mode = estimator->mode;
    health->samples = estimator->samples;
    health->lost = estimator->lost;
    health->corrupt = estimator->corrupt;
    health->late = estimator->late;
    health->recoveries = estimator->recoveries;
    health->excitation = sqrtf(estimator->learning.evidence.motion.slow);
}

const char *lever_parameter_name(uint8_t model, uint32_t index)
{
    const model_t *found = setup_model(model);
    return ((found != NULL) && (index < (uint32_t)MODEL_PARAMETERS)) ? found->parameter[index].name : NULL;
}

const char *lever_parameter_unit(uint8_t model, uint32_t index)
{
    const model_t *found = setup_model(model);
    return ((found != NULL) && (index < (uint32_t)MODEL_PARAMETERS)) ? found->parameter[index].unit : NULL;
}
