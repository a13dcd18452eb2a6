#include "app/dither.h"

#include <math.h>
#include <string.h>

#define HIGHEST 0.1f     /* greatest corner, in samples^-1: what the integration below is good for */
#define SEED 2463534242u /* any but 0 (Marsaglia 2003) */
#define SETTLING 16384u  /* samples of the impulse response that are summed up */

/* Butterworth low-pass of second order behind the high-pass of detrend.h, by semi-implicit Euler. */
static float filter(dither_t *dither, float in, float period)
{
    const float deviation = detrend_step(&dither->high_pass, in, &dither->low, period);
    const float force =
        (dither->high.square * (deviation - dither->low_pass)) - (dither->high.damping * dither->low_pass_rate);
    dither->low_pass_rate += period * force;
    dither->low_pass += period * dither->low_pass_rate;
    return dither->low_pass;
}

/* Uniform in [-1, 1), by xorshift32 (Marsaglia 2003). */
static float uniform(uint32_t *state)
{
    uint32_t x = *state;
    x ^= x << 13;
    x ^= x >> 17;
    x ^= x << 5;
    *state = x;
    return ((float)(x >> 8) * 1.1920929e-7f) - 1.0f;
}

/* White noise of variance 1/3 through the band has variance 1/3 of the energy of its impulse response. */
static float band_energy(const dither_t *dither, float period)
{
    dither_t copy = *dither;
    float energy = 0.0f;
    for (uint32_t i = 0u; i < SETTLING; i++) {
        const float response = filter(&copy, (i == 0u) ? 1.0f : 0.0f, period);
        energy += response * response;
    }
    return energy;
}

void dither_init(dither_t *dither, float low, float high, float period, float limit, float fade)
{
    const float highest = HIGHEST / period;
    (void)memset(dither, 0, sizeof *dither);
    dither->low = detrend_corner((low < highest) ? low : highest);
    dither->high = detrend_corner((high < highest) ? high : highest);
    dither->limit = limit;
    dither->fade = fade;
    dither->noise = SEED;
    dither->scale = sqrtf(3.0f / band_energy(dither, period));
}

void dither_set(dither_t *dither, float rms)
{
    dither->target = (rms < dither->limit) ? rms : dither->limit;
    dither->slope = (dither->fade > 0.0f) ? (fabsf(dither->target - dither->level) / dither->fade) : 1.0e6f;
}

void dither_step(dither_t *dither, float period)
{
    const float step = dither->slope * period;
    const float left = dither->target - dither->level;
    if (fabsf(left) <= step) {
        dither->level = dither->target;
    } else {
        dither->level += (left > 0.0f) ? step : -step;
    }
    const float noise = filter(dither, uniform(&dither->noise), period);
    const float torque = dither->level * dither->scale * noise;
    const float above = (torque > dither->limit) ? dither->limit : torque;
    dither->torque = (above < -dither->limit) ? -dither->limit : above;
}

bool dither_is_on(const dither_t *dither)
{
    return (dither->level > 0.0f) || (dither->target > 0.0f);
}
