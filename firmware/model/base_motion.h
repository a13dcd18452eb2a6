/* What follows from the base acceleration besides itself, for the models that use it: the motion in the cabin of a mass
 * on a spring and a damper,
 *
 *   s_ddot = -z_ddot - seat_damping s_dot - seat_stiffness s
 *
 * On a seat it is the pilot's trunk, which the arm, of a twentieth of its mass, is taken not to move: that costs 2 % of
 * theta/z_ddot, and makes it a filter of z_ddot. On none it stays in space, and s_dot = -z_dot is the base's velocity: in
 * preload trim without its slow part, as z_ddot is. seat = s / (l cos(trim)) is s as an angle of the lever.
 */
#ifndef MODEL_BASE_MOTION_H
#define MODEL_BASE_MOTION_H

#include "model/model.h"

typedef struct base_motion {
    float seat;     /* s [m]; 0 without a seat */
    float seat_dot; /* [m/s] */
} base_motion_t;

/* Moves on by a step, and fills in its seat [rad] and seat_dot [rad/s], those at the middle. On a seat, takes the torque of
 * the lever's own spring and damper by them from tau_m: these do not move with the trunk. Starts at zero. */
void base_motion_step(base_motion_t *motion, const model_constants_t *constants, model_step_t *step);

/* Angle of the lever by which the hand rises a metre, about the trim [rad/m]. */
float base_motion_angle(const model_constants_t *constants, const model_step_t *step);

#endif
