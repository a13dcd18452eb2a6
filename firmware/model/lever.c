/* The nonlinear lever: a rigid lever on a vertically accelerated base, held by a pilot's arm.
 *
 *   M theta_ddot + (c_p l^2 cos^2 theta + c_l) theta_dot + g l mu cos theta + l^2 k_p (sin theta - sin theta_a) cos
 * theta
 *     + k_l (theta - theta_l) = -l mu cos theta z_ddot + tau_m
 *   M = l^2 (eta^2 m_l + m_p) + J_l,   mu = eta m_l + m_p
 *
 * Lagrangian with the arm as mass, damper and spring acting vertically at the grip. The equation as
 * published prints m_l + m_p in the gravity and forcing terms and loses sin theta_a and theta_l; this is the form that
 * follows from the energies (tests/python/plants derives it again).
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

/* The coefficients. */
enum {
    INERTIA,  /* M [kg m^2] */
    FORCING,  /* l mu: torque per acceleration and cosine [kg m] */
    DAMPING,  /* l^2 c_p [N m s/rad] */
    STIFFNESS /* l^2 k_p [N m/rad] */
};

static void prepare(
    const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_coefficients_t *coefficients)
{
    coefficients->c[INERTIA] = constants->inertia + (constants->length_squared * p[0]);
    coefficients->c[FORCING] = constants->length * (constants->mass_moment + p[0]);
    coefficients->c[DAMPING] = constants->length_squared * p[1];
    coefficients->c[STIFFNESS] = constants->length_squared * p[2];
}

/* What the points of a step share. */
typedef struct shared {
    float period;
    float half;         /* of the period */
    float acceleration; /* of the base, and gravity unless preload trim has it cancel [m/s^2] */
    float damping;      /* the lever's own */
} shared_t;

/* A point's change of theta_dot is T force / inertia. */
typedef struct fraction {
    float arm;     /* force of the arm along cos theta, gravity and base included */
    float damping; /* D */
    float force;
    float inertia; /* M + T/2 D */
} fraction_t;

/* At a point: sine of the angle, less that at which the arm's spring rests, and cosine; torque of lever spring and motor. */
static inline fraction_t fraction_at(
    const shared_t *shared, const float *c, float sine, float cosine, float torque, float theta_dot)
{
    fraction_t at;
    at.arm = (c[FORCING] * shared->acceleration) + (c[STIFFNESS] * sine);
    at.damping = (c[DAMPING] * (cosine * cosine)) + shared->damping;
    at.force = (torque - (cosine * at.arm)) - (at.damping * theta_dot);
    at.inertia = c[INERTIA] + (shared->half * at.damping);
    return at;
}

/* Change at the mean and its slopes there, by the quotient rule; theta_m depends on theta_dot, too. */
static inline void respond_at_mean(const shared_t *shared, const float *c, const fraction_t *at, sine_cosine_t angle,
    float stiffness, float theta_dot, model_response_t *response)
{
    const float gain = shared->period / at->inertia;
    const float change = at->force * gain;
    const float damping_slope = -2.0f * (c[DAMPING] * (angle.cosine * angle.sine));
    const float arm_slope = (angle.sine * at->arm) - (c[STIFFNESS] * (angle.cosine * angle.cosine));
    const float force_slope = (arm_slope - stiffness) - (damping_slope * (theta_dot + (0.5f * change)));
    const float slope = force_slope * gain;
    response->mean = change;
    response->slope[0] = slope;
    response->slope[1] = (shared->half * slope) - (at->damping * gain);
    response->torque = gain;
    response->base = -(angle.cosine * c[FORCING]) * gain;
}

/* Sine and cosine of an angle that is mostly near the trim, of which they are known. */
static inline sine_cosine_t sine_cosine_beside(const model_step_t *step, float angle)
{
    const float beside = angle - step->trim;
    sine_cosine_t result;
    if (fabsf(beside) <= 0.25f) {
        const sine_cosine_t by = sine_cosine_small(beside);
        result.sine = (step->trim_sine * by.cosine) + (step->trim_cosine * by.sine);
        result.cosine = (step->trim_cosine * by.cosine) - (step->trim_sine * by.sine);
    } else {
        result = sine_cosine(angle);
    }
    return result;
}

static void respond(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    model_response_t *response)
{
    const shared_t shared = {.period = step->period,
        .half = 0.5f * step->period,
        .acceleration = constants->trim ? step->z_ddot : (step->z_ddot + MODEL_GRAVITY),
        .damping = constants->damping};
    const float rest = constants->trim ? step->trim : constants->lever_preload_angle;
    const float theta_dot = points->x[1];
    const float middle = step->origin + (points->x[0] + (shared.half * theta_dot));
    const sine_cosine_t angle = sine_cosine_beside(step, middle);
    const float sine = angle.sine - (constants->trim ? step->trim_sine : constants->arm_preload_sine);
    const float torque = step->tau_m - (constants->stiffness * (middle - rest));
    const float *c = points->coefficients[0].c;
    const fraction_t mean = fraction_at(&shared, c, sine, angle.cosine, torque, theta_dot);
    respond_at_mean(&shared, c, &mean, angle, constants->stiffness, theta_dot, response);
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        const float rate = points->offset[j][1];
        const float ahead = points->offset[j][0] + (shared.half * rate);
        const float more_sine = angle.cosine * ahead; /* offsets are so small that their sines are they themselves */
        const float less_cosine = angle.sine * ahead;
        const float less_torque = constants->stiffness * ahead;
        const fraction_t plus = fraction_at(&shared, points->coefficients[1u + (2u * j)].c, sine + more_sine,
            angle.cosine - less_cosine, torque - less_torque, theta_dot + rate);
        const fraction_t minus = fraction_at(&shared, points->coefficients[2u + (2u * j)].c, sine - more_sine,
            angle.cosine + less_cosine, torque + less_torque, theta_dot - rate);
        model_response_pair(response, j, shared.period, plus.force, plus.inertia, minus.force, minus.inertia);
    }
}

/* A trunk that gives way on its seat (base_motion.h) moves where the arm rests by the angle `seat`: this is the lever as
 * seen from there. Cosines are taken of the angle from there, a few milliradians off. */
static void respond_on_seat(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    model_response_t *response)
{
    model_points_t from_seat = *points; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    from_seat.x[0] -= step->seat - ((0.5f * step->period) * step->seat_dot);
    from_seat.x[1] -= step->seat_dot;
    respond(constants, step, &from_seat, response);
}

/* K = d/dtheta of the restoring torque, D and l mu cos theta at the trim, each over M. */
static model_dynamics_t dynamics(
    const model_constants_t *constants, const model_step_t *step, const model_coefficients_t *coefficients)
{
    const float *c = coefficients->c;
    const float squared = step->trim_cosine * step->trim_cosine;
    const float weight = MODEL_GRAVITY * c[FORCING];
    const float geometric =
        constants->trim ? 0.0f : ((c[STIFFNESS] * (constants->arm_preload_sine - step->trim_sine)) - weight);
    const float stiffness = (c[STIFFNESS] * squared) + (geometric * step->trim_sine) + constants->stiffness;
    const float damping = (c[DAMPING] * squared) + constants->damping;
    const float inverse = 1.0f / c[INERTIA];
    const model_dynamics_t result = {.stiffness = stiffness * inverse,
        .damping = damping * inverse,
        .forcing = -((c[FORCING] * step->trim_cosine) * inverse),
        .space = 0.0f,
        .arm_stiffness = (c[STIFFNESS] * squared) * inverse,
        .arm_damping = (c[DAMPING] * squared) * inverse,
        .torque = inverse};
    return result;
}

#define PARAMETER {{"m_p", "kg", 0.3f, 10.0f}, {"c_p", "N s/m", 2.0f, 400.0f}, {"k_p", "N/m", 50.0f, 6500.0f}}

const model_t model_lever = {
    .name = "lever",
    .parameter = PARAMETER,
    .uses_base_motion = false,
    .positive = true,
    .prepare = prepare,
    .respond = respond,
    .dynamics = dynamics,
};

const model_t model_lever_on_seat = {
    .name = "lever",
    .parameter = PARAMETER,
    .uses_base_motion = true,
    .positive = true,
    .prepare = prepare,
    .respond = respond_on_seat,
    .dynamics = dynamics,
};
