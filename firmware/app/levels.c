#include "app/levels.h"

#include <math.h>
#include <string.h>

#define OUTAGE 0.0205f   /* an output missing for longer is out [s]; not a whole number of periods */
#define STATE_MOST 25.0f /* a prediction beyond is none [rad], [rad/s] */

void levels_start(levels_t *levels, float trim, float corner, bool counted)
{
    (void)memset(levels, 0, sizeof *levels);
    levels->corner = detrend_corner(corner);
    levels->settling = 1.0f / corner;
    levels->counted = counted;
    detrend_start(&levels->output[0], trim);
    levels_set_origin(levels);
    levels_unsettle(levels);
}

static float deviation(const levels_t *levels, detrend_t *detrend, float value, float period)
{
    const float result = detrend_step(detrend, value, &levels->corner, period);
    return levels->counted ? result : value;
}

float levels_input(levels_t *levels, uint32_t i, float value, float period)
{
    return deviation(levels, &levels->input[i], value, period);
}

void levels_set_origin(levels_t *levels)
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        levels->origin[i] = levels->counted ? levels->output[i].level : 0.0f;
    }
}

bool levels_refer(levels_t *levels, const float x[MODEL_STATES], measurement_t *measurement, float period)
{
    bool back = false;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        const float predicted = levels->origin[i] + ((fabsf(x[i]) <= STATE_MOST) ? x[i] : 0.0f);
        const bool waiting = levels_is_waiting(levels, i);
        if (measurement->valid[i]) {
            measurement->y[i] = deviation(levels, &levels->output[i], measurement->y[i], period);
            levels->missing[i] = 0.0f;
            back = back || waiting;
        } else {
            levels->missing[i] += period;
            if (waiting) {
                levels->output[i].slope = 0.0f;
            } else {
                (void)deviation(levels, &levels->output[i], predicted, period);
            }
        }
    }
    return back;
}

bool levels_is_waiting(const levels_t *levels, uint32_t i)
{
    return levels->missing[i] > OUTAGE;
}

void levels_unsettle(levels_t *levels)
{
    levels->unsettled = levels->counted ? levels->settling : 0.0f;
}
