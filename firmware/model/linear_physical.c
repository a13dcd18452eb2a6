/* Mass, spring and damper on an accelerated base (DESIGN section 3):
 *
 *   x_ddot = -(k/m) x - (c/m) x_dot + z_ddot + f/m
 *
 * with p = [m, c, k]. x is what the samples carry as theta, f what they carry as motor torque: with theta in metres and
 * torque in newtons the units below hold; with radians and newton metres m is an inertia, c and k are rotational. m is known
 * by f alone: without it only k/m and c/m can be. x counts from the trim (preload trim) or from lever_preload_angle.
 */
#include "model/linear.h"
#include "model/model.h"

static linear_t system_of(const model_step_t *step, const float p[MODEL_PARAMETERS])
{
    const float inverse = 1.0f / p[0];
    linear_t system;
    system.stiffness = p[2] * inverse;
    system.damping = p[1] * inverse;
    system.drive = step->z_ddot + (step->tau_m * inverse);
    return system;
}

static void propagate(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    float increment[MODEL_POINTS][MODEL_STATES])
{
    linear_propagate(system_of, constants, step, points, increment);
}

static model_dynamics_t dynamics(
    const model_constants_t *constants, const model_step_t *step, const float p[MODEL_PARAMETERS])
{
    (void)constants;
    (void)step;
    return linear_dynamics(p[2] / p[0], p[1] / p[0]);
}

const model_t model_linear_physical = {
    .name = "linear_physical",
    .parameter = {{"m", "kg", 0.05f, 60.0f}, {"c", "N s/m", 0.1f, 600.0f}, {"k", "N/m", 1.0f, 6500.0f}},
    .positive = true,
    .propagate = propagate,
    .dynamics = dynamics,
};
