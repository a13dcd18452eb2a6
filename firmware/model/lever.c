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

#define GRAVITY 9.80665f /* [m/s^2] */

/* What depends on the angle only. */
typedef struct geometry {
    float cosine;
    float cosine_squared;
    float arm_stretch; /* (sin theta - sine at rest) cos theta */
    float torque;      /* lever spring and motor [N m] */
} geometry_t;

/* What depends on the parameters only. */
typedef struct arm {
    float inertia;   /* M [kg m^2] */
    float forcing;   /* torque per cosine by base acceleration and gravity [N m] */
    float damping;   /* l^2 c_p */
    float stiffness; /* l^2 k_p */
} arm_t;

static inline float middle_of(const model_step_t *step, const float x[MODEL_STATES])
{
    return step->origin + x[0] + (0.5f * step->period * x[1]);
}

static inline geometry_t geometry_at(
    const model_constants_t *constants, const model_step_t *step, float middle, const sine_cosine_t *sc)
{
    const float rest_sine = constants->trim ? step->trim_sine : constants->arm_preload_sine;
    const float rest_angle = constants->trim ? step->trim : constants->lever_preload_angle;
    geometry_t geometry;
    geometry.cosine = sc->cosine;
    geometry.cosine_squared = sc->cosine * sc->cosine;
    geometry.arm_stretch = (sc->sine - rest_sine) * sc->cosine;
    geometry.torque = step->tau_m - (constants->stiffness * (middle - rest_angle));
    return geometry;
}

static inline arm_t arm_of(
    const model_constants_t *constants, const model_step_t *step, const float p[MODEL_PARAMETERS])
{
    const float acceleration = constants->trim ? step->z_ddot : (step->z_ddot + GRAVITY);
    arm_t arm;
    arm.inertia = constants->inertia + (constants->length_squared * p[0]);
    arm.forcing = constants->length * (constants->mass_moment + p[0]) * acceleration;
    arm.damping = constants->length_squared * p[1];
    arm.stiffness = constants->length_squared * p[2];
    return arm;
}

static inline void advance(const model_constants_t *constants, const model_step_t *step, const geometry_t *geometry,
    const arm_t *arm, float theta_dot, float increment[MODEL_STATES])
{
    const float damping = (arm->damping * geometry->cosine_squared) + constants->damping;
    const float force = geometry->torque - (arm->forcing * geometry->cosine) - (arm->stiffness * geometry->arm_stretch);
    const float impulse = step->period * (force - (damping * theta_dot));
    const float change = impulse / (arm->inertia + (0.5f * step->period * damping));
    increment[0] = step->period * (theta_dot + (0.5f * change));
    increment[1] = change;
}

static void propagate(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    float increment[MODEL_POINTS][MODEL_STATES])
{
    const float mean_middle = middle_of(step, points->x[0]);
    const sine_cosine_t mean_sc = sine_cosine(mean_middle);
    const arm_t mean_arm = arm_of(constants, step, points->p[0]);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_POINTS; i++) {
        const float middle = middle_of(step, points->x[i]);
        const sine_cosine_t sc = sine_cosine_near(&mean_sc, middle - mean_middle);
        const geometry_t geometry = geometry_at(constants, step, middle, &sc);
        const arm_t arm = (i < (uint32_t)MODEL_PARAMETER_POINTS) ? arm_of(constants, step, points->p[i]) : mean_arm;
        advance(constants, step, &geometry, &arm, points->x[i][1], increment[i]);
    }
}

/* K = d/dtheta of the restoring torque and D at the trim; omega = sqrt(K/M), zeta = D / (2 sqrt(K M)). A trim at which
 * the lever would fall (K <= 0) has frequency 0 and damping ratio 0. */
static model_dynamics_t dynamics(
    const model_constants_t *constants, const model_step_t *step, const float p[MODEL_PARAMETERS])
{
    const sine_cosine_t sc = sine_cosine(step->trim);
    const float arm_stiffness = constants->length_squared * p[2];
    const float weight = GRAVITY * constants->length * (constants->mass_moment + p[0]);
    const float geometric =
        constants->trim ? 0.0f : ((arm_stiffness * (constants->arm_preload_sine - sc.sine)) - weight);
    const float stiffness = (arm_stiffness * sc.cosine * sc.cosine) + (geometric * sc.sine) + constants->stiffness;
    const float damping = (constants->length_squared * p[1] * sc.cosine * sc.cosine) + constants->damping;
    const float inertia = constants->inertia + (constants->length_squared * p[0]);
    model_dynamics_t result = {0.0f, 0.0f};
    if (stiffness > 0.0f) {
        result.natural_frequency = sqrtf(stiffness / inertia) * MODEL_INVERSE_TURN;
        result.damping_ratio = damping / (2.0f * sqrtf(stiffness * inertia));
    }
    return result;
}

const model_t model_lever = {
    .name = "lever",
    .parameter = {{"m_p", "kg", 0.3f, 10.0f}, {"c_p", "N s/m", 2.0f, 400.0f}, {"k_p", "N/m", 50.0f, 6500.0f}},
    .positive = true,
    .propagate = propagate,
    .dynamics = dynamics,
};
