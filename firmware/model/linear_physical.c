/* Mass, spring and damper on an accelerated base:
 *
 *   x_ddot = -(k/m) x - (c/m) x_dot + z_ddot + f/m
 *
 * with p = [m, c, k]. x is what the samples carry as theta, f what they carry as motor torque: with theta in metres and
 * torque in newtons the units below hold; with radians and newton metres m is an inertia, c and k are rotational. m
 * is known by f alone: without it only k/m and c/m can be. x counts from the trim (preload trim) or from
 * lever_preload_angle.
 */
#include "model/linear.h"
#include "model/model.h"

static void prepare(
    const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_coefficients_t *coefficients)
{
    const float inverse = 1.0f / p[0];
    (void)constants;
    coefficients->c[LINEAR_STIFFNESS] = p[2] * inverse;
    coefficients->c[LINEAR_DAMPING] = p[1] * inverse;
    coefficients->c[LINEAR_BASE] = 1.0f;
    coefficients->c[LINEAR_TORQUE] = inverse;
}

const model_t model_linear_physical = {
    .name = "linear_physical",
    .parameter = {{"m", "kg", 0.05f, 60.0f}, {"c", "N s/m", 0.1f, 600.0f}, {"k", "N/m", 1.0f, 6500.0f}},
    .uses_base_motion = false,
    .positive = true,
    .prepare = prepare,
    .respond = linear_respond,
    .dynamics = linear_dynamics,
};
