#include "filter/trim.h"

#include <math.h>
#include <string.h>

#define TURN 6.28318531f
#define SQRT_TWO 1.41421356f
#define OUTAGE 0.0205f /* an output missing for longer is out [s]; not a whole number of periods */

high_pass_corner_t high_pass_corner(float frequency)
{
    const float w = TURN * frequency;
    const high_pass_corner_t corner = {w * w, SQRT_TWO * w};
    return corner;
}

/* level/signal = (sqrt(2) w s + w^2) / (s^2 + sqrt(2) w s + w^2), by semi-implicit Euler. */
float high_pass_step(high_pass_t *filter, float value, const high_pass_corner_t *corner, float period)
{
    const float deviation = value - filter->level;
    filter->slope += period * (corner->square * deviation);
    filter->level += period * (filter->slope + (corner->damping * deviation));
    return deviation;
}

void trim_start(trim_t *trim, float angle, float corner, bool deviations)
{
    (void)memset(trim, 0, sizeof *trim);
    trim->corner = high_pass_corner(corner);
    trim->settling_time = 1.0f / corner;
    trim->deviations = deviations;
    trim->output[0].level = angle;
    trim_set_origin(trim);
    trim_unsettle(trim);
}

void trim_set_origin(trim_t *trim)
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        trim->origin[i] = trim->deviations ? trim->output[i].level : 0.0f;
    }
}

void trim_unsettle(trim_t *trim)
{
    trim->unsettled = trim->deviations ? trim->settling_time : 0.0f;
}

static float pass(const trim_t *trim, high_pass_t *filter, float value, float period)
{
    const float deviation = high_pass_step(filter, value, &trim->corner, period);
    return trim->deviations ? deviation : value;
}

float trim_input(trim_t *trim, uint32_t i, float value, float period)
{
    return pass(trim, &trim->input[i], value, period);
}

bool trim_is_waiting(const trim_t *trim, uint32_t i)
{
    return trim->missing[i] > OUTAGE;
}

bool trim_outputs(
    trim_t *trim, const float x[MODEL_STATES], float y[MODEL_STATES], const bool valid[MODEL_STATES], float period)
{
    bool back = false;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        const bool waiting = trim_is_waiting(trim, i);
        if (valid[i]) {
            back = back || waiting;
            trim->missing[i] = 0.0f;
            y[i] = pass(trim, &trim->output[i], y[i], period);
        } else {
            trim->missing[i] += period;
            if (waiting) {
                trim->output[i].slope = 0.0f;
            } else {
                const float predicted = trim->origin[i] + ((fabsf(x[i]) <= MODEL_THETA_MOST) ? x[i] : 0.0f);
                (void)pass(trim, &trim->output[i], predicted, period);
            }
        }
    }
    return back;
}
