/* Exponential and natural logarithm without libm: the same bits on every IEEE 754 machine.
 *
 * Method: x = n ln 2 + r with |r| <= ln(2)/2 (ln 2 in two parts, Cody & Waite 1980); exp(r) by a minimax polynomial of
 * degree 6, the factor 2^n by the exponent field.
 * Domain: |x| <= 80; beyond it the result is that of the nearer end. NaN gives the result for 80 (callers refuse NaN).
 * Error: at most 2e-7 relative (test_exponential.c compares with double over the domain).
 */
#ifndef MATH_EXPONENTIAL_H
#define MATH_EXPONENTIAL_H

#include "math/bounds.h"
#include "math/rounding.h"

#include <stdint.h>
#include <string.h>

static inline float exponential(float x)
{
    const float inside = greater(lesser(x, 80.0f), -80.0f);
    const float multiple = nearest_integer(inside * 1.44269504f);
    const int32_t n = (int32_t)multiple;
    const float r = (inside - (multiple * 0.693359375f)) + (multiple * 2.12194440e-4f); /* ln 2 in two parts */

    const float tail =
        0.5f + (r * (0.166665122f + (r * (0.0416661873f + (r * (0.00836959854f + (r * 0.00139517197f)))))));
    const float mantissa = 1.0f + (r + ((r * r) * tail));

    const int32_t exponent = n + 127;
    const uint32_t bits = (uint32_t)exponent << 23;
    float scale;
    (void)memcpy(&scale, &bits, sizeof scale); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    return mantissa * scale;
}

/* Natural logarithm for x in [1e-4, 1e4], at most 2e-6 absolute off: Newton on the exponential from exponent and
 * mantissa as first guess (0.06 off). For initialisation. */
static inline float logarithm(float x)
{
    uint32_t bits;
    (void)memcpy(&bits, &x, sizeof bits); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    float y = (((float)bits * 1.1920929e-7f) - 127.0f) * 0.693147181f;
    for (uint32_t i = 0u; i < 3u; i++) {
        y += (x * exponential(-y)) - 1.0f;
    }
    return y;
}

#endif
