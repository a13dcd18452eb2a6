/* Steps of a first-order mean. */
#ifndef MATH_SHARE_H
#define MATH_SHARE_H

#include "math/bounds.h"

/* The share of the new value in a mean over `time`, `period` after the last value; at most 1. Both positive [s]. */
static inline float share_of(float period, float time)
{
    return lesser(period / time, 1.0f);
}

#endif
