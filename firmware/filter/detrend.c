#include "filter/detrend.h"

#define TURN 6.28318531f
#define SQRT_TWO 1.41421356f

void detrend_start(detrend_t *detrend, float level)
{
    detrend->level = level;
    detrend->slope = 0.0f;
}

/* level/signal = (sqrt(2) w s + w^2) / (s^2 + sqrt(2) w s + w^2), by semi-implicit Euler. */
float detrend_step(detrend_t *detrend, float value, float corner, float period)
{
    const float w = TURN * corner;
    const float deviation = value - detrend->level;
    detrend->slope += period * w * w * deviation;
    detrend->level += period * (detrend->slope + (SQRT_TWO * w * deviation));
    return deviation;
}
