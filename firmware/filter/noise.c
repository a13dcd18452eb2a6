#include "filter/noise.h"

#include <math.h>
#include <string.h>

#define OUTPUTS ((uint32_t)MEASUREMENT_OUTPUTS)
#define L ((uint32_t)MODEL_PARAMETERS)
#define SAMPLES_LEAST 20.0f /* of an output, for a variance to mean anything */
#define FAR 0.5f            /* a factor further than this from 1 is done at once, */
#define STEP_MOST 3.0f      /* up to this one; of a nearer one only */
#define SHARE 0.2f          /* this part, which averages over about five windows */

void noise_begin(noise_estimator_t *noise)
{
    noise->elapsed = 0.0f;
    noise->agreement = 0.0f;
    noise->strength = 0.0f;
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        noise->samples[i] = 0.0f;
        noise->ratio[i] = 0.0f;
        noise->share[i] = 0.0f;
    }
}

void noise_gather(noise_estimator_t *noise, const state_filter_t *filter, const measurement_t *measurement,
    const float innovation[MEASUREMENT_OUTPUTS], const float factor[MEASUREMENT_OUTPUTS * MEASUREMENT_OUTPUTS],
    /* cppcheck-suppress misra-c2012-10.4 ; D6 */
    const float output[MEASUREMENT_OUTPUTS * MODEL_PARAMETERS])
{
    /* covariance of the innovation [a b; b d] */
    float a = factor[0] * factor[0];
    float b = factor[0] * factor[2];
    float d = (factor[2] * factor[2]) + (factor[3] * factor[3]);
    for (uint32_t j = 0u; j < L; j++) {
        a += output[j] * output[j];
        b += output[j] * output[L + j];
        d += output[L + j] * output[L + j];
    }
    const float echo[OUTPUTS] = {
        measurement->valid[0] ? filter->echo[0] : 0.0f, measurement->valid[1] ? filter->echo[1] : 0.0f};
    const float inverse = 1.0f / ((a * d) - (b * b));
    const float weighted[OUTPUTS] = {
        inverse * ((d * echo[0]) - (b * echo[1])), inverse * ((a * echo[1]) - (b * echo[0]))};
    const float variance[OUTPUTS] = {a, d};
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        noise->agreement += weighted[i] * innovation[i];
        noise->strength += weighted[i] * echo[i];
        noise->ratio[i] += (innovation[i] * innovation[i]) / variance[i];
        if (measurement->valid[i]) {
            noise->samples[i] += 1.0f;
            noise->share[i] += (filter->output_noise[i] * filter->output_noise[i]) / variance[i];
        }
    }
}

static float clamped(float value, float least, float greatest)
{
    const float above = (value > least) ? value : least;
    return (above < greatest) ? above : greatest;
}

/* A standard deviation times `factor`, within `range` of what is set. */
static float scaled(float now, float factor, float set, float range)
{
    const float bounded = clamped(factor, 1.0f / STEP_MOST, STEP_MOST);
    const bool far = (bounded > (1.0f + FAR)) || (bounded < (1.0f - FAR));
    const float step = far ? bounded : (1.0f + (SHARE * (bounded - 1.0f)));
    return clamped(now * step, set / range, set * range);
}

/* By what factor the window says that the noise of output i is wrong. */
static float factor_of(const noise_estimator_t *noise, uint32_t i)
{
    const float factor = sqrtf(noise->ratio[i] / noise->samples[i]);
    const float share = noise->share[i] / noise->samples[i];
    return (factor > (1.0f + FAR)) ? factor : (1.0f + (share * (factor - 1.0f)));
}

bool noise_step(noise_estimator_t *noise, state_filter_t *filter, const noise_setting_t *setting, float period)
{
    bool far_too_small = false;
    noise->elapsed += period;
    if ((setting->window > 0.0f) && (noise->elapsed >= setting->window)) {
        float level = 1.0f; /* geometric mean of both outputs' factors: the gain stays when everything scales alike */
        for (uint32_t i = 0u; i < OUTPUTS; i++) {
            if (noise->samples[i] >= SAMPLES_LEAST) {
                const float factor = factor_of(noise, i);
                filter->output_noise[i] =
                    scaled(filter->output_noise[i], factor, setting->output_noise[i], setting->range);
                level *= sqrtf(factor);
                far_too_small = far_too_small || (factor > (1.0f + FAR));
            }
        }
        if (noise->strength > 0.0f) {
            const float gain = 1.0f + (noise->agreement / noise->strength);
            filter->process_noise[1] =
                scaled(filter->process_noise[1], level * gain, setting->process_noise, setting->range);
        }
        noise_begin(noise);
    }
    return far_too_small;
}
