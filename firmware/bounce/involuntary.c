#include "bounce/involuntary.h"

#include "math/bounds.h"
#include "math/trigonometry.h"

#include <math.h>
#include <string.h>

#define STIFFNESS_LEAST 10.0f  /* natural frequency of 0.5 Hz [1/s^2] */
#define INTEGRATION_MOST 0.02f /* of a step of integration [s] */
#define CALL_STEPS_MOST 5.0f   /* in a call */

void involuntary_start(involuntary_t *involuntary, float z_ddot)
{
    (void)memset(involuntary, 0, sizeof *involuntary);
    involuntary->base.level = z_ddot;
}

/* By the base acceleration at the end of the step; the torque is held. A trunk on its seat, or a hand that is damped in
 * space, is driven by the base's velocity, too: base_motion.h. */
static void integrate(involuntary_t *involuntary, const model_dynamics_t *dynamics, const model_constants_t *constants,
    const model_step_t *now, float turn)
{
    const float before = involuntary->z_ddot;
    const float velocity_before = involuntary->velocity;
    involuntary->velocity = high_pass_step(&involuntary->base, now->z_ddot, turn, HIGH_PASS_BUTTERWORTH);
    involuntary->z_ddot = involuntary->velocity + (HIGH_PASS_BUTTERWORTH * involuntary->base.slope);
    model_step_t step = *now;
    float drive = (dynamics->forcing * (0.5f * (before + involuntary->z_ddot))) + (dynamics->torque * step.tau_m);
    if ((dynamics->space > 0.0f) || (constants->seat_stiffness > 0.0f)) {
        step.z_ddot = 0.5f * (velocity_before + involuntary->velocity);
        base_motion_step(&involuntary->base_motion, constants, &step);
        drive += (dynamics->arm_stiffness * step.seat) + ((dynamics->arm_damping + dynamics->space) * step.seat_dot);
    }
    const float half = 0.5f * step.period;
    const float middle = involuntary->theta + (half * involuntary->theta_dot);
    const float force = drive - ((dynamics->stiffness * middle) + (dynamics->damping * involuntary->theta_dot));
    const float change = (step.period * force) / (1.0f + (half * dynamics->damping));
    involuntary->theta += step.period * (involuntary->theta_dot + (0.5f * change));
    involuntary->theta_dot += change;
}

bool involuntary_step(involuntary_t *involuntary, const model_dynamics_t *dynamics, const model_constants_t *constants,
    const model_step_t *step, float corner)
{
    model_step_t part = *step;
    uint32_t steps = 1u;
    if (step->period > INTEGRATION_MOST) {
        const float whole = (step->period / INTEGRATION_MOST) + 0.999f;
        steps = (uint32_t)lesser(whole, CALL_STEPS_MOST);
        part.period = step->period / (float)steps;
    }
    const bool stable = (dynamics->stiffness > STIFFNESS_LEAST) && (dynamics->damping > 0.0f);
    for (uint32_t i = 0u; stable && (i < steps); i++) {
        integrate(involuntary, dynamics, constants, &part, TURN * (corner * part.period));
    }
    const bool plausible = stable && (fabsf(involuntary->theta) <= MODEL_THETA_MOST); /* NaN is not */
    if (!plausible) {
        involuntary_start(involuntary, step->z_ddot);
    }
    return plausible;
}
