#include "model/linear.h"

#include <math.h>

/* T / (1 + T/2 damping), or what replaces it when damping is negative. */
static float gain_of(const model_arm_t *arm, float period)
{
    const float half = 0.5f * period * arm->coefficient[LINEAR_DAMPING];
    return (half > 0.0f) ? (period / (1.0f + half)) : (period * (1.0f - half));
}

/* Change of x_dot with an arm, by its acceleration at the middle of the step. */
static float change_at(const model_arm_t *arm, const model_step_t *step, float middle, float rate)
{
    const float *of = arm->coefficient;
    const float drive = (of[LINEAR_BASE] * step->z_ddot) + (of[LINEAR_TORQUE] * step->tau_m);
    const float acceleration = drive - (of[LINEAR_STIFFNESS] * middle) - (of[LINEAR_DAMPING] * rate);
    return gain_of(arm, step->period) * acceleration;
}

void linear_respond(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
    model_response_t *response)
{
    const float half = 0.5f * step->period;
    const float rest = constants->trim ? step->trim : constants->lever_preload_angle;
    const float rate = points->x[1];
    const float middle = (step->origin - rest) + (points->x[0] + (half * rate));
    const model_arm_t *arm = points->arm;
    const float gain = gain_of(&arm[0], step->period);
    response->mean = change_at(&arm[0], step, middle, rate);
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PARAMETERS; j++) {
        const model_arm_t *plus = &arm[1u + (2u * j)];
        const model_arm_t *minus = &arm[2u + (2u * j)];
        const float more = points->offset[j][1];
        const float ahead = points->offset[j][0] + (half * more);
        model_response_pair(response, j, change_at(plus, step, middle + ahead, rate + more),
            change_at(minus, step, middle - ahead, rate - more));
    }
    for (uint32_t j = (uint32_t)MODEL_PARAMETERS; j < (uint32_t)MODEL_PAIRS; j++) { /* linear in the state: no bend */
        const float more = points->offset[j][1];
        const float ahead = points->offset[j][0] + (half * more);
        const float *of = arm[0].coefficient;
        response->difference[j] = -2.0f * gain * ((of[LINEAR_STIFFNESS] * ahead) + (of[LINEAR_DAMPING] * more));
        response->bend[j] = 0.0f;
    }
}

model_dynamics_t linear_dynamics(const model_constants_t *constants, const model_step_t *step, const model_arm_t *arm)
{
    (void)constants;
    (void)step;
    model_dynamics_t result = {0.0f, 0.0f};
    const float stiffness = arm->coefficient[LINEAR_STIFFNESS];
    if (stiffness > 0.0f) {
        const float omega = sqrtf(stiffness);
        result.natural_frequency = omega * MODEL_INVERSE_TURN;
        result.damping_ratio = arm->coefficient[LINEAR_DAMPING] / (2.0f * omega);
    }
    return result;
}
