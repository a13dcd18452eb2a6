#include "app/dither.h"

#include "math/bounds.h"
#include "math/trigonometry.h"

#include <math.h>
#include <string.h>

#define HIGHEST 0.1f     /* greatest corner, in samples^-1: what the integration below is good for */
#define LEAST 1.0e-6f    /* a fade is never slower than over this change: one of 1e-40 would not end [N m] */
#define SEED 2463534242u /* any but 0 (Marsaglia 2003) */

/* Butterworth low-pass of second order behind the high-pass of trim.h, by semi-implicit Euler. */
static float filter(dither_t *dither, float in)
{
    const float deviation = high_pass_step(&dither->high_pass, in, dither->low, HIGH_PASS_BUTTERWORTH);
    const float force = (deviation - dither->low_pass) - (HIGH_PASS_BUTTERWORTH * dither->low_pass_rate);
    dither->low_pass_rate += dither->high * force;
    dither->low_pass += dither->high * dither->low_pass_rate;
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

/* Both filters above have the denominator z^2 - (2 - a - d) z + (1 - d), with a = (w T)^2 and d = sqrt(2) w T of their
 * corner. Its squared magnitude at z = exp(jv) is a^2 + a d x + (1 - d) x^2 in x = 4 sin^2(v/2), and with s = j
 * tan(v/2) that is |p[2] s^2 + p[1] s + p[0]|^2 / (1 - s^2)^2. */
static void denominator_of(float p[3], float corner)
{
    const float a = corner * corner;
    const float d = HIGH_PASS_BUTTERWORTH * corner;
    p[0] = a;
    p[2] = sqrtf((a * (a + (4.0f * d))) + (16.0f * (1.0f - d)));
    p[1] = sqrtf(2.0f * a * (a + (2.0f * d) + p[2]));
}

/* Variance of white noise of variance 1 behind both filters: 32 b^2 times Phillips' integral I4 of (s^3 + s^2) over the
 * product of both denominators (James, Nichols, Phillips 1947), b = (w T)^2 of the low-pass. Exact; every term is
 * positive, so that float does. */
static float band_variance(const dither_t *dither)
{
    float p[3];
    float q[3];
    denominator_of(p, dither->low);
    denominator_of(q, dither->high);
    const float b = q[0];
    const float d1 = (p[1] * q[0]) + (p[0] * q[1]);
    const float d3 = (p[2] * q[1]) + (p[1] * q[2]);
    const float apart = (p[2] * q[0]) - (p[0] * q[2]);
    const float numerator = (d1 * p[2] * q[2]) + (p[1] * q[0] * ((p[2] * q[0]) + (p[1] * q[1]))) +
                            (p[0] * q[1] * ((p[1] * q[1]) + (p[0] * q[2])));
    const float determinant = p[1] * q[1] * ((apart * apart) + (d3 * d1));
    return 16.0f * b * b * (numerator / (p[2] * q[2] * determinant));
}

void dither_init(dither_t *dither, float low, float high, float period, float rms_most, float fade)
{
    const float highest = HIGHEST / period;
    dither->low = (TURN * period) * low; /* 2 Hz of at least 50 samples a second */
    dither->high = (TURN * period) * lesser(high, highest);
    dither->scale = sqrtf(3.0f / band_variance(dither)); /* uniform() has a variance of 1/3 */
    dither->rms_most = rms_most;
    dither->fade = fade / period;
    dither_reset(dither);
}

void dither_reset(dither_t *dither)
{
    dither->high_pass.level = 0.0f;
    dither->high_pass.slope = 0.0f;
    dither->low_pass = 0.0f;
    dither->low_pass_rate = 0.0f;
    dither->target = 0.0f;
    dither->level = 0.0f;
    dither->slope = 0.0f;
    dither->noise = SEED;
}

void dither_set(dither_t *dither, float rms, bool at_once)
{
    const float target = lesser(rms, dither->rms_most);
    const float change = greater(fabsf(target - dither->level), LEAST);
    if (at_once) {
        dither->slope = change;
    } else if ((target < dither->target) || (target > dither->target)) { /* the same again goes on as it does */
        dither->slope = change / greater(dither->fade, 1.0f);
    } else {
        /* repeated */
    }
    dither->target = target;
}

/* The level goes to its target by at most the slope. */
static void fade(dither_t *dither)
{
    const float left = dither->target - dither->level;
    if (fabsf(left) <= dither->slope) {
        dither->level = dither->target;
    } else {
        dither->level += (left > 0.0f) ? dither->slope : -dither->slope;
    }
}

float dither_step(dither_t *dither)
{
    float torque = 0.0f;
    if (dither_is_on(dither)) {
        fade(dither);
        torque = dither->level * dither->scale * filter(dither, uniform(&dither->noise));
    }
    return torque;
}

bool dither_is_on(const dither_t *dither)
{
    return (dither->level > 0.0f) || (dither->target > 0.0f);
}
