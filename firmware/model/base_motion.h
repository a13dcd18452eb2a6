/* What follows from the base acceleration besides itself, for the models that use it.
 *
 * z_dot, the base's velocity: in preload trim without its slow part, as z_ddot is.
 *
 * seat, how far the pilot's trunk gives way on its seat. Trunk and seat are a mass on a spring and a damper,
 *   s_ddot = -z_ddot - seat_damping s_dot - seat_stiffness s,
 * which the arm, of a twentieth of the mass, is taken not to move: that costs 2 % of theta/z_ddot, and makes it a filter
 * of z_ddot. seat = s / (l cos(trim)) is the angle by which the trunk moves the arm's rest. The lever's own spring and
 * damper do not move with it: their torque by seat is taken from tau_m.
 */
#ifndef MODEL_BASE_MOTION_H
#define MODEL_BASE_MOTION_H

#include "model/model.h"

typedef struct base_motion {
    float z_dot;    /* [m/s] */
    float seat;     /* s [m] */
    float seat_dot; /* [m/s] */
} base_motion_t;

/* Moves on by a step, and fills in its z_dot, seat [rad] and seat_dot [rad/s]: those at the middle. Starts at zero. */
void base_motion_step(base_motion_t *motion, const model_constants_t *constants, model_step_t *step);

/* Angle of the lever by which the hand rises a metre, about the trim [rad/m]. */
float base_motion_angle(const model_constants_t *constants, const model_step_t *step);

#endif
