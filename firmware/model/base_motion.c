#include "model/base_motion.h"

#include "math/bounds.h"

#define KEPT 0.99998f     /* of s_dot in a step: what rounding adds is forgotten */
#define COSINE_LEAST 0.2f /* a trim beyond 78 degrees is taken for that */

float base_motion_angle(const model_constants_t *constants, const model_step_t *step)
{
    return 1.0f / (constants->length * greater(step->trim_cosine, COSINE_LEAST));
}

/* By the linearly implicit midpoint rule, as in linear.h. */
void base_motion_step(base_motion_t *motion, const model_constants_t *constants, model_step_t *step)
{
    const float half = 0.5f * step->period;
    const float angle = base_motion_angle(constants, step);
    const float middle = motion->seat + (half * motion->seat_dot);
    const float force =
        -(step->z_ddot + (constants->seat_damping * motion->seat_dot) + (constants->seat_stiffness * middle));
    const float change = (half * force) / (1.0f + (half * constants->seat_damping)); /* to the middle */
    const float rate = motion->seat_dot + change;
    motion->seat_dot = (KEPT * rate) + change;
    step->seat_dot = angle * rate;
    if (constants->seat_stiffness > 0.0f) {
        motion->seat += step->period * rate;
        step->seat = angle * middle;
        step->tau_m -= (constants->stiffness * step->seat) + (constants->damping * step->seat_dot);
    }
}
