/* Times that pass, in steps. */
#ifndef MATH_ELAPSED_H
#define MATH_ELAPSED_H

#include "math/bounds.h"

#include <stdbool.h>
#include <stdint.h>

/* Times may wrap: one that is less than this after another is the later of the two [us]. */
#define HALF_TURN_OF_TIME 0x80000000u

/* Whether no sample was lost between two that are so far apart, by their clock. */
static inline bool is_successive(float elapsed, float sample_period)
{
    return elapsed <= (1.5f * sample_period);
}

/* The nearest number of microseconds. */
static inline uint32_t microseconds_of(float seconds)
{
    const float rounded = (seconds * 1.0e6f) + 0.5f;
    return (uint32_t)rounded;
}

/* What is left of a time after some of it. */
static inline uint32_t time_left(uint32_t time, uint32_t elapsed)
{
    return time - lesser_count(elapsed, time);
}

/* Both together, or the longest time there is. */
static inline uint32_t time_sum(uint32_t time, uint32_t elapsed)
{
    const uint32_t sum = time + elapsed;
    return (sum >= time) ? sum : UINT32_MAX;
}

#endif
