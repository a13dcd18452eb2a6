/* Sine and cosine of one angle, together, without libm: the same bits on every IEEE 754 machine.
 *
 * Method: the angle is reduced to [-pi/4, pi/4] by a multiple of pi/2 (in two parts, Cody & Waite 1980), where minimax
 * polynomials of degree 7 (sine) and 8 (cosine) are used. No branch depends on the angle's value.
 * Domain: |angle| <= 30 rad; beyond it, or for NaN, the result is that of 0 rad (callers refuse such angles first).
 * Error: at most 1.2e-7 absolute (test_trigonometry.c compares with double over the domain).
 */
#ifndef MATH_TRIGONOMETRY_H
#define MATH_TRIGONOMETRY_H

#define TURN 6.28318531f /* [rad] */

typedef struct sine_cosine {
    float sine;
    float cosine;
} sine_cosine_t;

sine_cosine_t sine_cosine(float angle);

/* The same of a small angle, by Taylor series. Error: at most 1.2e-7 for |angle| <= 0.25 rad, 2e-6 for 0.5 rad. A
 * quarter of the cost. */
static inline sine_cosine_t sine_cosine_small(float angle)
{
    const float z = angle * angle;
    sine_cosine_t result;
    result.sine = angle * (1.0f - (z * (0.166666667f - (z * 0.00833333333f))));
    result.cosine = 1.0f - (z * (0.5f - (z * (0.0416666667f - (z * 0.00138888889f)))));
    return result;
}

#endif
