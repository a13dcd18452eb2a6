/* Values within bounds. */
#ifndef MATH_BOUNDS_H
#define MATH_BOUNDS_H

#include <math.h>
#include <stdbool.h>

static inline bool is_finite(float value)
{
    return fabsf(value) <= 3.0e38f; /* NaN is not */
}

/* From -most to most, which is not negative. */
static inline float clamped(float value, float most)
{
    const float above = (value > most) ? most : value;
    return (above < -most) ? -most : above;
}

#endif
