/* The nonlinear lever: a rigid lever on a vertically accelerated base, held by a pilot's arm.
 *
 *   M theta_ddot + (c_p l^2 cos^2 theta + c_l) theta_dot + g l mu cos theta + l^2 k_p (sin theta - sin theta_a) cos theta
 *     + k_l (theta - theta_l) = -l mu cos theta z_ddot + tau_m
 *   M = l^2 (eta^2 m_l + m_p) + J_l,   mu = eta m_l + m_p
 *
 * Lagrangian with the arm as mass, damper and spring acting vertically at the grip (DESIGN section 3). The equation as
 * published prints m_l + m_p in the gravity and forcing terms and loses sin theta_a and theta_l; this is the form that
 * follows from the energies (tests/python/sil derives it again).
 *
 * Preload fixed: theta_a and theta_l are given. Preload trim: theta_l = theta_0 and sin theta_a = sin theta_0 +
 * g mu / (k_p l), so that gravity cancels and the arm's spring rests at the trim angle theta_0.
 *
 * Discretisation: linearly implicit midpoint, of second order with one evaluation of the forces:
 *   theta_m = theta + T/2 theta_dot,  d theta_dot = T (F(theta_m) - D(theta_m) theta_dot) / (M + T/2 D(theta_m)),
 *   d theta = T (theta_dot + d theta_dot / 2);   D: damping, F: all other torques.
 * Explicit Euler would add -omega T/2 to the damping ratio: 4 % of it at 1 kHz.
 */
#include "math/trigonometry.h"
#include "model/model.h"

#include <math.h>

#define GRAVITY 9.80665f /* [m/s^2] */

/* The coefficients of an arm. */
enum arm {
    INERTIA,  /* M [kg m^2] */
    FORCING,  /* l mu: torque per acceleration and cosine [kg m] */
    DAMPING,  /* l^2 c_p [N m s/rad] */
    STIFFNESS /* l^2 k_p [N m/rad] */
};

static void prepare(const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_arm_t *arm)
{
    arm->coefficient[INERTIA] = constants->inertia + (constants->length_squared * p[0]);
    arm->coefficient[FORCING] = constants->length * (constants->mass_moment + p[0]);
    arm->coefficient[DAMPING] = constants->length_squared * p[1];
    arm->coefficient[STIFFNESS] = constants->length_squared * p[2];
}

/* What the points of a step share. */
typedef struct shared {
    float period;
    float half;         /* of the period */
    float acceleration; /* of the base, and gravity unless preload trim has it cancel [m/s^2] */
    float rest_sine;    /* of the angle at which the arm's spring rests */
    float damping;      /* the lever's own */
} shared_t;

/* Change of theta_dot at a point: angle by sine and cosine, torque of lever spring and motor there. */
static inline float change_at(
    const shared_t *shared, const model_arm_t *arm, float sine, float cosine, float torque, float theta_dot)
{
    const float *of = arm->coefficient;
    const float damping = (of[DAMPING] * (cosine * cosine)) + shared->damping;
    const float arm_force = (of[FORCING] * shared->acceleration) + (of[STIFFNESS] * (sine - shared->rest_sine));
    const float force = (torque - (cosine * arm_force)) - (damping * theta_dot);
    return (shared->period * force) / (of[INERTIA] + (shared->half * damping));
}

static void respond(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    model_response_t *response)
{
    const shared_t shared = {.period = step->period,
        .half = 0.5f * step->period,
        .acceleration = constants->trim ? step->z_ddot : (step->z_ddot + GRAVITY),
        .rest_sine = constants->trim ? step->trim_sine : constants->arm_preload_sine,
        .damping = constants->damping};
    const float rest = constants->trim ? step->trim : constants->lever_preload_angle;
    const float theta_dot = points->x[1];
    const float middle = step->origin + (points->x[0] + (shared.half * theta_dot));
    const sine_cosine_t at = sine_cosine(middle);
    const float torque = step->tau_m - (constants->stiffness * (middle - rest));
    response->mean = change_at(&shared, &points->arm[0], at.sine, at.cosine, torque, theta_dot);
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PAIRS; j++) {
        const bool moves_arm = (j < (uint32_t)MODEL_PARAMETERS);
        const model_arm_t *plus_arm = &points->arm[moves_arm ? (1u + (2u * j)) : 0u];
        const model_arm_t *minus_arm = &points->arm[moves_arm ? (2u + (2u * j)) : 0u];
        const float rate = points->offset[j][1];
        const float angle = points->offset[j][0] + (shared.half * rate);
        const sine_cosine_t by = sine_cosine_small(angle);
        const float sine = at.sine * by.cosine; /* addition theorem: the parts that + and - share, and the others */
        const float cosine = at.cosine * by.cosine;
        const float more_sine = at.cosine * by.sine;
        const float less_cosine = at.sine * by.sine;
        const float less_torque = constants->stiffness * angle;
        const float plus = change_at(
            &shared, plus_arm, sine + more_sine, cosine - less_cosine, torque - less_torque, theta_dot + rate);
        const float minus = change_at(
            &shared, minus_arm, sine - more_sine, cosine + less_cosine, torque + less_torque, theta_dot - rate);
        model_response_pair(response, j, plus, minus);
    }
}

/* K = d/dtheta of the restoring torque and D at the trim; omega = sqrt(K/M), zeta = D / (2 M omega). A trim at which the
 * lever would fall (K <= 0) has frequency 0 and damping ratio 0. */
static model_dynamics_t dynamics(const model_constants_t *constants, const model_step_t *step, const model_arm_t *arm)
{
    const float *of = arm->coefficient;
    const float squared = step->trim_cosine * step->trim_cosine;
    const float weight = GRAVITY * of[FORCING];
    const float geometric =
        constants->trim ? 0.0f : ((of[STIFFNESS] * (constants->arm_preload_sine - step->trim_sine)) - weight);
    const float stiffness = (of[STIFFNESS] * squared) + (geometric * step->trim_sine) + constants->stiffness;
    const float damping = (of[DAMPING] * squared) + constants->damping;
    model_dynamics_t result = {0.0f, 0.0f};
    if (stiffness > 0.0f) {
        const float omega = sqrtf(stiffness / of[INERTIA]);
        result.natural_frequency = omega * MODEL_INVERSE_TURN;
        result.damping_ratio = damping / (2.0f * (of[INERTIA] * omega));
    }
    return result;
}

const model_t model_lever = {
    .name = "lever",
    .parameter = {{"m_p", "kg", 0.3f, 10.0f}, {"c_p", "N s/m", 2.0f, 400.0f}, {"k_p", "N/m", 50.0f, 6500.0f}},
    .positive = true,
    .prepare = prepare,
    .respond = respond,
    .dynamics = dynamics,
};
