#include "filter/trim.h"

#include "math/bounds.h"
#include "math/trigonometry.h"

#include <math.h>
#include <string.h>

#define SECTIONS ((uint32_t)TRIM_SECTIONS)
#define SETTLING_TURNS 0.9f   /* of the corner */
#define UNSETTLED_MOST 2.0f   /* settling times, of outages in a row [sway_sample_100ms] */
#define LINE_STEPS_MOST 24.0f /* of that line */

/* The sections in units of the corner: 2 cos(pi / 12), 2 cos(3 pi / 12), 2 cos(5 pi / 12). */
static const float damping[TRIM_SECTIONS] = {1.93185165f, 1.41421356f, 0.517638090f};

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
    (void)memset(trim, 0, sizeof *trim);
    trim->corner = TURN * corner;
    trim->deviations = deviations;
    trim->output[0].section[0].level = angle;
    trim->last[0] = angle;
    trim_set_origin(trim);
    trim_unsettle(trim);
}

void trim_set_origin(trim_t *trim)
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        trim->origin[i] = trim->deviations ? level_of(&trim->output[i]) : 0.0f;
    }
}

static void begin(level_t *level, float value)
{
    (void)memset(level, 0, sizeof *level);
    level->section[0].level = value;
}

void trim_begin(trim_t *trim, const float x[MODEL_STATES])
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        begin(&trim->output[i], trim->origin[i] + x[i]);
    }
    for (uint32_t i = 0u; i < (uint32_t)TRIM_INPUTS; i++) {
        begin(&trim->input[i], (i == (uint32_t)TRIM_STEP) ? 0.0f : level_of(&trim->input[i]));
    }
    trim->begin_rate = trim->output[1].section[0].level;
    trim_set_origin(trim);
}

void trim_shift(trim_t *trim, float offset)
{
    trim->output[0].section[0].level += offset;
    trim->last[0] += offset;
    trim_set_origin(trim);
}

float trim_settling_time(const trim_t *trim)
{
    return (SETTLING_TURNS * TURN) / trim->corner;
}

void trim_unsettle(trim_t *trim)
{
    const float time = trim_settling_time(trim);
    trim->unsettled = trim->deviations ? lesser(greater(trim->unsettled, 0.0f) + time, UNSETTLED_MOST * time) : 0.0f;
}

/* The deviation of a value, `turn` = corner times period after the last one. */
static inline float pass(level_t *level, float value, float turn)
{
    float deviation = value;
    for (uint32_t i = 0u; i < SECTIONS; i++) {
        deviation = high_pass_step(&level->section[i], deviation, turn, damping[i]);
    }
    return deviation;
}

void trim_inputs(trim_t *trim, float value[], enum trim_signal first, uint32_t count, float period)
{
    const float turn = trim->corner * period;
    if (trim->deviations) {
        for (uint32_t i = 0u; i < count; i++) {
            value[i] = pass(&trim->input[(uint32_t)first + i], value[i], turn);
        }
    }
}

void trim_start_input(trim_t *trim, enum trim_signal input, float value)
{
    begin(&trim->input[input], value);
}

bool trim_is_waiting(const trim_t *trim, uint32_t i)
{
    return trim->missing[i] > TRIM_OUTAGE;
}

/* The deviation of output i, which is back at `value`: its level takes the straight line from the last one. */
static float pass_line(trim_t *trim, uint32_t i, float value, float period)
{
    const float elapsed = trim->missing[i] + period;
    const float whole = (elapsed / period) + 0.5f;
    const uint32_t steps = (uint32_t)lesser(whole, LINE_STEPS_MOST);
    const float part = 1.0f / (float)steps;
    const float turn = trim->corner * (part * elapsed);
    float deviation = 0.0f;
    for (uint32_t k = 1u; k <= steps; k++) {
        const float between = trim->last[i] + ((part * (float)k) * (value - trim->last[i]));
        deviation = pass(&trim->output[i], between, turn);
    }
    return deviation;
}

/* An output is missing for so long that a straight line says little of its motion. */
static bool is_forgotten(const trim_t *trim, uint32_t i)
{
    return (trim->corner * trim->missing[i]) > 1.0f;
}

/* The level of a missing output stays, as its sections would integrate their own sum. */
static void wait_for_output(trim_t *trim, uint32_t i, float period)
{
    if (is_forgotten(trim, i)) {
        for (uint32_t k = 0u; k < SECTIONS; k++) {
            trim->output[i].section[k].slope = 0.0f;
        }
    }
    trim->missing[i] += period;
}

/* An output that is missing, or was. Returns the deviation of a valid one. */
static float irregular(trim_t *trim, uint32_t i, float value, bool valid, float period, bool *back)
{
    float deviation = value;
    if (!valid) {
        wait_for_output(trim, i, period);
    } else {
        *back = *back || trim_is_waiting(trim, i);
        deviation = is_forgotten(trim, i) ? pass(&trim->output[i], value, trim->corner * period)
                                          : pass_line(trim, i, value, period);
        trim->missing[i] = 0.0f;
    }
    return deviation;
}

bool trim_outputs(trim_t *trim, float y[MODEL_STATES], const bool valid[MODEL_STATES], float period)
{
    const float turn = trim->corner * period;
    bool back = false;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        const float value = y[i];
        const bool regular = valid[i] && (trim->missing[i] <= 0.0f);
        const float deviation =
            regular ? pass(&trim->output[i], value, turn) : irregular(trim, i, value, valid[i], period, &back);
        y[i] = (valid[i] && trim->deviations) ? deviation : value;
        trim->last[i] = valid[i] ? value : trim->last[i];
    }
    return back;
}
