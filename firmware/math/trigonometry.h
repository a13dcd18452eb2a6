/* Sine and cosine of one angle, together, without libm: the same bits on every IEEE 754 machine.
 *
 * Method: the angle is reduced to [-pi/4, pi/4] by a multiple of pi/2 (in two parts, Cody & Waite 1980), where minimax
 * polynomials of degree 7 (sine) and 8 (cosine) are used. No branch depends on the angle's value.
 * Domain: |angle| <= 30 rad; beyond it, or for NaN, the result is that of 0 rad (callers refuse such angles first).
 * Error: at most 1.2e-7 absolute (test_trigonometry.c compares with double over the domain).
 */
#ifndef MATH_TRIGONOMETRY_H
#define MATH_TRIGONOMETRY_H

#include <math.h>
#include <stdint.h>

typedef struct sine_cosine {
    float sine;
    float cosine;
} sine_cosine_t;

static inline sine_cosine_t sine_cosine(float angle)
{
    const float inside = (fabsf(angle) <= 30.0f) ? angle : 0.0f;
    const float turns = inside * 0.636619772f; /* in units of pi/2 */
    const int32_t quadrant = (int32_t)(turns + ((turns < 0.0f) ? -0.5f : 0.5f));
    const float multiple = (float)quadrant;
    const float r = (inside - (multiple * 1.5703125f)) - (multiple * 4.83826794e-4f); /* pi/2 in two parts */

    const float z = r * r;
    const float s = r + ((r * z) * (-0.166666552f + (z * (0.00833215471f + (z * -0.000195140848f)))));
    const float c = (1.0f - (0.5f * z)) + ((z * z) * (0.0416666456f + (z * (-0.00138873374f + (z * 2.44348466e-5f)))));

    const uint32_t q = (uint32_t)quadrant & 3u;
    const float sine = ((q & 1u) != 0u) ? c : s;
    const float cosine = ((q & 1u) != 0u) ? s : c;
    sine_cosine_t result;
    result.sine = ((q & 2u) != 0u) ? -sine : sine;
    result.cosine = (((q + 1u) & 2u) != 0u) ? -cosine : cosine;
    return result;
}

/* Sine and cosine of an angle `delta` away from one whose sine and cosine are known: addition theorem with Taylor series
 * for delta. Error: at most 5e-7 for |delta| <= 0.25 rad, 3e-5 for 0.5 rad. A third of the cost of sine_cosine(). */
static inline sine_cosine_t sine_cosine_near(const sine_cosine_t *known, float delta)
{
    const float z = delta * delta;
    const float s = delta * (1.0f - (z * (0.166666667f - (z * 0.00833333333f))));
    const float c = 1.0f - (z * (0.5f - (z * 0.0416666667f)));
    sine_cosine_t result;
    result.sine = (known->sine * c) + (known->cosine * s);
    result.cosine = (known->cosine * c) - (known->sine * s);
    return result;
}

#endif
