#include "filter/noise_estimation.h"

#include <math.h>
#include <string.h>

#define OUTPUTS ((uint32_t)CDKF_OUTPUTS)
#define SAMPLES_LEAST 20.0f /* of an output, for a variance to mean anything */
#define FAR 0.5f            /* a factor further than this from 1 is done at once, */
#define STEP_MOST 10.0f     /* up to this one; of a nearer one only */
#define SHARE 0.2f          /* this part, which averages over about five windows */

void noise_estimation_begin(noise_estimation_t *noise)
{
    (void)memset(noise, 0, sizeof *noise);
}

void noise_estimation_add(
    noise_estimation_t *noise, const innovation_t innovation[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS])
{
    for (uint32_t i = 0u; i < OUTPUTS; i++) {
        if (valid[i]) {
            const innovation_t *of = &innovation[i];
            const float response = of->response * of->inverse_variance;
            noise->samples[i] += 1.0f;
            noise->ratio[i] += of->value * of->value * of->inverse_variance;
            noise->share[i] = of->noise_variance * of->inverse_variance;
            noise->covariance += of->value * response;
            noise->variance += of->response * response;
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
    const float step = (fabsf(bounded - 1.0f) > FAR) ? bounded : (1.0f + (SHARE * (bounded - 1.0f)));
    return clamped(now * step, set / range, set * range);
}

/* The factor by which the noise of output i is wrong, by this window. */
static float factor_of(const noise_estimation_t *noise, uint32_t i)
{
    const float factor = sqrtf(noise->ratio[i] / noise->samples[i]);
    return (factor > 3.0f) ? factor : (1.0f + (noise->share[i] * (factor - 1.0f)));
}

bool noise_estimation_step(noise_estimation_t *noise, cdkf_t *cdkf, const noise_setting_t *setting, float period)
{
    bool far_too_small = false;
    noise->elapsed += period;
    if ((setting->window > 0.0f) && (noise->elapsed >= setting->window)) {
        float level = 1.0f; /* geometric mean of both outputs' factors: the gain stays when everything scales alike */
        const float gain = (noise->variance > 0.0f) ? (1.0f + (noise->covariance / noise->variance)) : 1.0f;
        const bool starved = (gain > 1.15f); /* far too little gain: it is Q that is too small, not R */
        for (uint32_t i = 0u; i < OUTPUTS; i++) {
            const float raw = sqrtf(noise->ratio[i] / (noise->samples[i] + 1.0f));
            if (starved && (raw < 3.0f)) {
                if (cdkf->output_noise[i] > setting->output_noise[i]) {
                    cdkf->output_noise[i] = sqrtf(cdkf->output_noise[i] * setting->output_noise[i]);
                }
            } else if (noise->samples[i] >= SAMPLES_LEAST) {
                const float factor = factor_of(noise, i);
                cdkf->output_noise[i] = scaled(cdkf->output_noise[i], factor, setting->output_noise[i], setting->range);
                level *= sqrtf(factor);
                far_too_small = far_too_small || (factor > (1.0f + FAR));
            }
        }
        if (noise->variance > 0.0f) {
            const float factor = starved ? (gain * gain) : (level * gain);
            const float before = cdkf->process_noise[1];
            cdkf->process_noise[1] = scaled(before, factor, setting->process_noise, setting->range);
            far_too_small = far_too_small || (cdkf->process_noise[1] > ((1.0f + FAR) * before));
        }
        noise_estimation_begin(noise);
    }
    return far_too_small;
}
