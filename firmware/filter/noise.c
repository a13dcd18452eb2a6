#include "filter/noise.h"

#include <math.h>
#include <string.h>

#define OUTPUTS ((uint32_t)MEASUREMENT_OUTPUTS)
#define SAMPLES_LEAST 20.0f /* of an output, for a variance to mean anything */
#define FAR 0.5f            /* a factor further than this from 1 is done at once, */
#define STEP_MOST 3.0f      /* up to this one; of a nearer one only */
#define SHARE 0.2f          /* this part, which averages over about five windows */

void noise_begin(noise_estimator_t *noise)
{
    (void)memset(noise, 0, sizeof *noise);
}

void noise_gather(noise_estimator_t *noise, const float output_noise[MEASUREMENT_OUTPUTS],
    const measurement_t *measurement, const whitened_t *whitened, const spread_t *spread)
{
    const float *echo = whitened->echo;
    const float *innovation = whitened->innovation;
    const float *scale = whitened->scale;
    const float coupling = whitened->coupling;
    const float first = spread->inverse * ((spread->d * echo[0]) - (spread->b * echo[1]));
    const float second = spread->inverse * ((spread->a * echo[1]) - (spread->b * echo[0]));
    noise->agreement += (first * innovation[0]) + (second * innovation[1]);
    noise->strength += (first * echo[0]) + (second * echo[1]);
    /* of the outputs themselves: their innovations, and the variances of those */
    const float raw[OUTPUTS] = {scale[0] * innovation[0], (coupling * innovation[0]) + (scale[1] * innovation[1])};
    const float cross = 2.0f * coupling * scale[1] * spread->b;
    const float variance[OUTPUTS] = {
        scale[0] * scale[0] * spread->a, (coupling * coupling * spread->a) + cross + (scale[1] * scale[1] * spread->d)};
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        if (measurement->valid[i]) {
            const float inverse = 1.0f / variance[i];
            noise->samples[i] += 1.0f;
            noise->ratio[i] += raw[i] * raw[i] * inverse;
            noise->share[i] += output_noise[i] * output_noise[i] * inverse;
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
