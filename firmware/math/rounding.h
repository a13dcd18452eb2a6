/* Rounding without libm or a branch. */
#ifndef MATH_ROUNDING_H
#define MATH_ROUNDING_H

/* Nearest integer of |x| < 2^22, ties to even: beside 1.5 2^23 a float has no fraction bits. */
static inline float nearest_integer(float x)
{
    return (x + 12582912.0f) - 12582912.0f;
}

#endif
