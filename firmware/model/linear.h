/* The step of a linear second-order system, shared by the linear models.
 *
 *   x_ddot = drive - stiffness x - damping x_dot      (all per unit of mass)
 *
 * Discretisation: linearly implicit midpoint, as in lever.c:
 *   x_m = x + T/2 x_dot,  d x_dot = T (drive - stiffness x_m - damping x_dot) / (1 + T/2 damping),
 *   d x = T (x_dot + d x_dot / 2)
 * A negative damping, for which this has a pole at T/2 damping = -1, takes the same to second order without one:
 *   d x_dot = T (drive - stiffness x_m - damping x_dot) (1 - T/2 damping)
 */
#ifndef MODEL_LINEAR_H
#define MODEL_LINEAR_H

#include "model/model.h"

#include <math.h>

typedef struct linear {
    float stiffness; /* [1/s^2] */
    float damping;   /* [1/s] */
    float drive;     /* [unit of x / s^2] */
} linear_t;

/* What the state's position is to be added to for the deviation from rest; 0 in preload trim, where it is one already. */
static inline float linear_offset(const model_constants_t *constants, const model_step_t *step)
{
    return step->origin - (constants->trim ? step->trim : constants->lever_preload_angle);
}

static inline void linear_increment(
    const linear_t *system, float offset, float period, const float x[MODEL_STATES], float increment[MODEL_STATES])
{
    const float middle = offset + x[0] + (0.5f * period * x[1]);
    const float impulse = period * (system->drive - (system->stiffness * middle) - (system->damping * x[1]));
    const float half = 0.5f * period * system->damping;
    const float change = (half > 0.0f) ? (impulse / (1.0f + half)) : (impulse * (1.0f - half));
    increment[0] = period * (x[1] + (0.5f * change));
    increment[1] = change;
}

/* Increments of all points of a model whose system at given parameters `system_of` tells. */
static inline void linear_propagate(linear_t (*system_of)(const model_step_t *step, const float p[MODEL_PARAMETERS]),
    const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    float increment[MODEL_POINTS][MODEL_STATES])
{
    const float offset = linear_offset(constants, step);
    const linear_t mean = system_of(step, points->p[0]);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_POINTS; i++) {
        const linear_t system = (i < (uint32_t)MODEL_PARAMETER_POINTS) ? system_of(step, points->p[i]) : mean;
        linear_increment(&system, offset, step->period, points->x[i], increment[i]);
    }
}

/* Without a restoring stiffness there is no natural frequency: both are 0. */
static inline model_dynamics_t linear_dynamics(float stiffness, float damping)
{
    model_dynamics_t result = {0.0f, 0.0f};
    if (stiffness > 0.0f) {
        const float omega = sqrtf(stiffness);
        result.natural_frequency = omega * MODEL_INVERSE_TURN;
        result.damping_ratio = damping / (2.0f * omega);
    }
    return result;
}

#endif
