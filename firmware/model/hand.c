/* A hand on the collective as Mayo has measured it (15th European Rotorcraft Forum, 1989, paper 81): its motion is
 * damped against the cabin and against space. With d its vertical motion relative to the cabin, per unit of its mass,
 *
 *   d_ddot = -k_hand d - c_hand d_dot - z_ddot - c_space z_dot + tau_m l cos(theta_0) / M
 *   theta = theta_0 + d / (l cos theta_0)
 *
 * with p = [k_hand, c_hand, c_space]: stiffness, all damping of d, and the part of it that is against space, which
 * acts on d_dot + z_dot. The lever then leans as long as the cabin climbs: theta/z_ddot has a zero, which no mass on
 * spring and damper has. Mayo's pilots: 452.3, 13.70, 8.51 (ectomorphic), 555.4, 13.31, 9.29 (mesomorphic).
 *
 * The mass itself is not known. So the motor torque acts on M = eta^2 m_l l^2 + J_l + m_p l^2 with the first guess of
 * m_p. z_dot: base_motion.h. In preload fixed its value at the start would have to be known.
 */
#include "model/base_motion.h"
#include "model/linear.h"
#include "model/model.h"

/* The step is that of linear.c, its two inputs the drive that no parameter changes and what c_space multiplies. */
static void prepare(
    const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_coefficients_t *coefficients)
{
    (void)constants;
    coefficients->c[LINEAR_STIFFNESS] = p[0];
    coefficients->c[LINEAR_DAMPING] = p[1];
    coefficients->c[LINEAR_BASE] = 1.0f;
    coefficients->c[LINEAR_TORQUE] = p[2];
}

static void respond(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    model_response_t *response)
{
    const float base = -base_motion_angle(constants, step);
    const float torque = 1.0f / constants->hand_inertia;
    model_step_t drive = *step;
    drive.z_ddot = (base * step->z_ddot) + (torque * step->tau_m);
    drive.tau_m = step->seat_dot; /* -z_dot, as an angle */
    linear_respond(constants, &drive, points, response);
    response->torque = torque * response->base;
    response->base *= base;
}

static model_dynamics_t dynamics(
    const model_constants_t *constants, const model_step_t *step, const model_coefficients_t *coefficients)
{
    const model_dynamics_t result = {.stiffness = coefficients->c[LINEAR_STIFFNESS],
        .damping = coefficients->c[LINEAR_DAMPING],
        .forcing = -base_motion_angle(constants, step),
        .space = coefficients->c[LINEAR_TORQUE],
        .arm_stiffness = 0.0f,
        .arm_damping = 0.0f,
        .torque = 1.0f / constants->hand_inertia};
    return result;
}

const model_t model_hand = {
    .name = "hand",
    .parameter = {{"k_hand", "1/s^2", 20.0f, 3200.0f}, {"c_hand", "1/s", 0.5f, 320.0f},
        {"c_space", "1/s", 0.1f, 320.0f}},
    .uses_base_motion = true,
    .positive = true,
    .prepare = prepare,
    .respond = respond,
    .dynamics = dynamics,
};
