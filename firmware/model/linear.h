/* The step of a linear second-order system, shared by the linear models and the hand.
 *
 *   x_ddot = base z_ddot + torque tau_m - stiffness x - damping x_dot      (all per unit of mass)
 *
 * Discretisation: linearly implicit midpoint, as in lever.c:
 *   x_m = x + T/2 x_dot,  d x_dot = T (drive - stiffness x_m - damping x_dot) / (1 + T/2 damping)
 * A negative damping, for which this has a pole at T/2 damping = -1, takes the same to second order without one:
 *   d x_dot = T (drive - stiffness x_m - damping x_dot) (1 - T/2 damping)
 */
#ifndef MODEL_LINEAR_H
#define MODEL_LINEAR_H

#include "model/model.h"

/* The coefficients. */
enum {
    LINEAR_STIFFNESS, /* [1/s^2] */
    LINEAR_DAMPING,   /* [1/s] */
    LINEAR_BASE,      /* answer to the base acceleration [unit of x / m] */
    LINEAR_TORQUE     /* and to the motor torque [unit of x / (s^2 N m)] */
};

/* model_t.respond and model_t.dynamics of the linear models. */
void linear_respond(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    model_response_t *response);
model_dynamics_t linear_dynamics(
    const model_constants_t *constants, const model_step_t *step, const model_coefficients_t *coefficients);

#endif
