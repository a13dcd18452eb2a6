#include "filter/noise_estimation.h"

#include "math/bounds.h"

#include <math.h>
#include <string.h>

#define OUTPUTS ((uint32_t)CDKF_OUTPUTS)
#define SAMPLES_LEAST 20.0f /* of an output, for a variance to mean anything */
#define FAR 1.5f            /* a greater factor is done at once, */
#define FAR_BELOW 0.67f     /* and a smaller one, */
#define STEP_LEAST 0.33f    /* within */
#define STEP_MOST 10.0f     /* these; of a nearer one only */
#define SHARE 0.2f          /* this part, which averages over about five windows */
#define Q_LEAST 0.6f        /* of a window for Q: there may have been rest in it */
#define STARVED 1.15f       /* more gain than this is missing: it is Q that is too small, not R */
#define CHANCE 3.0f         /* by so many standard deviations of the regression: 1 / sqrt(variance) */
#define CERTAIN 3.0f        /* a factor of R that is put down to R whatever its share */

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

/* A standard deviation times `factor`, within `range` of what is set. */
static float scaled(float now, float factor, float set, float range)
{
    const float bounded = lesser(greater(factor, STEP_LEAST), STEP_MOST);
    const bool far = (bounded > FAR) || (bounded < FAR_BELOW);
    const float step = far ? bounded : (1.0f + (SHARE * (bounded - 1.0f)));
    return lesser(greater(now * step, set / range), set * range);
}

/* Sets the noise of output i. With too little gain innovations are large although R is right: then it stays, and what
 * it was raised by before is halved, as a logarithm. Returns the factor. */
static float correct_output(
    const noise_estimation_t *noise, cdkf_t *cdkf, const noise_setting_t *setting, uint32_t i, bool starved)
{
    float *now = &cdkf->output_noise[i];
    const float set = setting->output_noise[i];
    const float excess = sqrtf(noise->ratio[i] / noise->samples[i]); /* how far its innovations are too large */
    float factor = 1.0f;
    if (!starved || (excess > CERTAIN) || (excess < 1.0f)) {
        factor = (excess > CERTAIN) ? excess : (1.0f + (noise->share[i] * (excess - 1.0f)));
        *now = scaled(*now, factor, set, setting->range);
    } else if (*now > set) {
        *now = sqrtf(*now * set);
    } else {
        /* it stays */
    }
    return factor;
}

bool noise_estimation_step(noise_estimation_t *noise, cdkf_t *cdkf, const noise_setting_t *setting, float period)
{
    bool far_too_small = false;
    noise->elapsed += period;
    if ((setting->window > 0.0f) && (noise->elapsed >= setting->window)) {
        float level = 1.0f; /* geometric mean of both outputs' factors: the gain stays when everything scales alike */
        const float gain = (noise->variance > 0.0f) ? (1.0f + (noise->covariance / noise->variance)) : 1.0f;
        const bool starved = (gain > STARVED) && (noise->covariance > (CHANCE * sqrtf(noise->variance)));
        for (uint32_t i = 0u; i < OUTPUTS; i++) {
            if (noise->samples[i] >= SAMPLES_LEAST) {
                const float factor = correct_output(noise, cdkf, setting, i, starved);
                level *= sqrtf(factor);
                far_too_small = far_too_small || (factor > FAR);
            }
        }
        const float factor = greater(starved ? (gain * gain) : (level * gain), Q_LEAST);
        const float before = cdkf->process_noise[1];
        cdkf->process_noise[1] = scaled(before, factor, setting->process_noise, setting->range);
        far_too_small = far_too_small || (cdkf->process_noise[1] > (FAR * before));
        noise_estimation_begin(noise);
    }
    return far_too_small;
}
