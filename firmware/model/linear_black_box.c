/* A second-order system that nobody looks into:
 *
 *   x_ddot = a21 x + a22 x_dot + b21 z_ddot
 *
 * with p = [a21, a22, b21] of any sign. x is theta as a deviation from the trim (preload trim) or from
 * lever_preload_angle. The motor torque is not part of it: run it without one.
 */
#include "model/linear.h"
#include "model/model.h"

static void prepare(
    const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_coefficients_t *coefficients)
{
    (void)constants;
    coefficients->c[LINEAR_STIFFNESS] = -p[0];
    coefficients->c[LINEAR_DAMPING] = -p[1];
    coefficients->c[LINEAR_BASE] = p[2];
    coefficients->c[LINEAR_TORQUE] = 0.0f;
}

const model_t model_linear_black_box = {
    .name = "linear_black_box",
    .parameter = {{"a21", "1/s^2", -3200.0f, 3200.0f}, {"a22", "1/s", -320.0f, 320.0f}, {"b21", "1", -32.0f, 32.0f}},
    .uses_base_motion = false,
    .positive = false,
    .prepare = prepare,
    .respond = linear_respond,
    .dynamics = linear_dynamics,
};
