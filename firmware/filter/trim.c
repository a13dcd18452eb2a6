#include "filter/trim.h"

#include <math.h>
#include <string.h>

#define TURN 6.28318531f
#define OUTAGE 0.0205f /* an output missing for longer is out [s]; not a whole number of periods */

high_pass_corner_t high_pass_corner(float frequency, float damping)
{
    const float w = TURN * frequency;
    const high_pass_corner_t corner = {w * w, damping * w};
    return corner;
}

/* level/signal = (d w s + w^2) / (s^2 + d w s + w^2), by semi-implicit Euler. */
float high_pass_step(high_pass_t *filter, float value, const high_pass_corner_t *corner, float period)
{
    const float deviation = value - filter->level;
    filter->slope += period * (corner->square * deviation);
    filter->level += period * (filter->slope + (corner->damping * deviation));
    return deviation;
}

static float level_of(const level_t *level)
{
    return level->section[0].level + level->section[1].level + level->section[2].level;
}

float trim_angle(const trim_t *trim)
{
    return level_of(&trim->output[0]);
}

void trim_start(trim_t *trim, float angle, float corner, bool deviations)
{
    static const float damping[TRIM_SECTIONS] = {1.93185165f, 1.41421356f, 0.517638090f}; /* 2 cos(pi / 12), ... */
    (void)memset(trim, 0, sizeof *trim);
    for (uint32_t i = 0u; i < (uint32_t)TRIM_SECTIONS; i++) {
        trim->corner[i] = high_pass_corner(corner, damping[i]);
    }
    trim->settling_time = 0.9f / corner;
    trim->deviations = deviations;
    trim->output[0].section[0].level = angle;
    trim_set_origin(trim);
    trim_unsettle(trim);
}

void trim_set_origin(trim_t *trim)
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        trim->origin[i] = trim->deviations ? level_of(&trim->output[i]) : 0.0f;
    }
}

void trim_unsettle(trim_t *trim)
{
    trim->unsettled = trim->deviations ? trim->settling_time : 0.0f;
}

static float pass(const trim_t *trim, level_t *level, float value, float period)
{
    float deviation = value;
    for (uint32_t i = 0u; i < (uint32_t)TRIM_SECTIONS; i++) {
        deviation = high_pass_step(&level->section[i], deviation, &trim->corner[i], period);
    }
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
                for (uint32_t k = 0u; k < (uint32_t)TRIM_SECTIONS; k++) {
                    trim->output[i].section[k].slope = 0.0f;
                }
            } else {
                const float predicted = trim->origin[i] + ((fabsf(x[i]) <= MODEL_THETA_MOST) ? x[i] : 0.0f);
                (void)pass(trim, &trim->output[i], predicted, period);
            }
        }
    }
    return back;
}
