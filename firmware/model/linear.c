#include "model/linear.h"

/* Change of x_dot as a quotient, period force / inertia: see linear.h. */
typedef struct quotient {
    float force;
    float inertia;
} quotient_t;

/* What multiplies an acceleration, as a quotient: 1 / (1 + T/2 damping), or 1 - T/2 damping when damping is
 * negative. */
static inline quotient_t gain_of(const float *c, float period)
{
    const float half = 0.5f * period * c[LINEAR_DAMPING];
    const bool damped = (half > 0.0f);
    const quotient_t gain = {damped ? 1.0f : (1.0f - half), damped ? (1.0f + half) : 1.0f};
    return gain;
}

/* The change with coefficients c, by the acceleration at the middle of the step. */
static inline quotient_t change_at(const float *c, const model_step_t *step, float middle, float rate)
{
    const float drive = (c[LINEAR_BASE] * step->z_ddot) + (c[LINEAR_TORQUE] * step->tau_m);
    quotient_t change = gain_of(c, step->period);
    change.force *= drive - (c[LINEAR_STIFFNESS] * middle) - (c[LINEAR_DAMPING] * rate);
    return change;
}

void linear_respond(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    model_response_t *response)
{
    const float half = 0.5f * step->period;
    const float rest = constants->trim ? step->trim : constants->lever_preload_angle;
    const float rate = points->x[1];
    const float middle = (step->origin - rest) + (points->x[0] + (half * rate));
    const float *c = points->coefficients[0].c;
    const quotient_t mean = change_at(c, step, middle, rate);
    const float inverse = step->period / mean.inertia;
    const float gain = gain_of(c, step->period).force * inverse;
    response->mean = mean.force * inverse;
    response->base = gain * c[LINEAR_BASE];
    response->torque = gain * c[LINEAR_TORQUE];
    response->slope[0] = -(gain * c[LINEAR_STIFFNESS]);
    response->slope[1] = (half * response->slope[0]) - (gain * c[LINEAR_DAMPING]);
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        const float more = points->offset[j][1];
        const float ahead = points->offset[j][0] + (half * more);
        const quotient_t plus = change_at(points->coefficients[1u + (2u * j)].c, step, middle + ahead, rate + more);
        const quotient_t minus = change_at(points->coefficients[2u + (2u * j)].c, step, middle - ahead, rate - more);
        model_response_pair(response, j, step->period, plus.force, plus.inertia, minus.force, minus.inertia);
    }
}

model_dynamics_t linear_dynamics(
    const model_constants_t *constants, const model_step_t *step, const model_coefficients_t *coefficients)
{
    (void)constants;
    (void)step;
    const model_dynamics_t result = {.stiffness = coefficients->c[LINEAR_STIFFNESS],
        .damping = coefficients->c[LINEAR_DAMPING],
        .forcing = coefficients->c[LINEAR_BASE],
        .space = 0.0f,
        .arm_stiffness = 0.0f,
        .arm_damping = 0.0f,
        .torque = coefficients->c[LINEAR_TORQUE]};
    return result;
}
