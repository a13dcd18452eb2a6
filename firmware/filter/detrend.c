#include "filter/detrend.h"

#define TURN 6.28318531f
#define SQRT_TWO 1.41421356f

detrend_corner_t detrend_corner(float frequency)
{
    const float w = TURN * frequency;
    const detrend_corner_t corner = {w * w, SQRT_TWO * w};
    return corner;
}

void detrend_start(detrend_t *detrend, float level)
{
    detrend->level = level;
    detrend->slope = 0.0f;
}

/* level/signal = (sqrt(2) w s + w^2) / (s^2 + sqrt(2) w s + w^2), by semi-implicit Euler. */
float detrend_step(detrend_t *detrend, float value, const detrend_corner_t *corner, float period)
{
    const float deviation = value - detrend->level;
    detrend->slope += period * (corner->square * deviation);
    detrend->level += period * (detrend->slope + (corner->damping * deviation));
    return deviation;
}
