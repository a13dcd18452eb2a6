/* Values within bounds. */
#ifndef MATH_BOUNDS_H
#define MATH_BOUNDS_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

static inline bool is_finite(float value)
{
    return fabsf(value) <= 3.0e38f; /* NaN is not */
}

/* The second where one of both is NaN. */
static inline float lesser(float a, float b)
{
    return (a < b) ? a : b;
}

static inline float greater(float a, float b)
{
    return (a > b) ? a : b;
}

static inline uint32_t lesser_count(uint32_t a, uint32_t b)
{
    return (a < b) ? a : b;
}

static inline uint32_t greater_count(uint32_t a, uint32_t b)
{
    return (a > b) ? a : b;
}

/* From -most to most, which is not negative; NaN stays. */
static inline float clamped(float value, float most)
{
    return greater(-most, lesser(most, value));
}

#endif
