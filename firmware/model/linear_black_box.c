/* A second-order system that nobody looks into (DESIGN section 3):
 *
 *   x_ddot = a21 x + a22 x_dot + b21 z_ddot
 *
 * with p = [a21, a22, b21] of any sign. x is theta as a deviation from the trim (preload trim) or from lever_preload_angle. The
 * motor torque is not part of it: run it without one.
 */
#include "model/linear.h"
#include "model/model.h"

static linear_t system_of(const model_step_t *step, const float p[MODEL_PARAMETERS])
{
    linear_t system;
    system.stiffness = -p[0];
    system.damping = -p[1];
    system.drive = p[2] * step->z_ddot;
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
    return linear_dynamics(-p[0], -p[1]);
}

const model_t model_linear_black_box = {
    .name = "linear_black_box",
    .parameter = {{"a21", "1/s^2", -3200.0f, 3200.0f}, {"a22", "1/s", -320.0f, 320.0f}, {"b21", "1", -32.0f, 32.0f}},
    .positive = false,
    .propagate = propagate,
    .dynamics = dynamics,
};
