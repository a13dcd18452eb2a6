/* The involuntary motion of the lever: what base acceleration and motor make of it through the estimated arm.
 *
 *   theta_ddot + damping theta_dot + stiffness theta = forcing z_ddot + torque tau_m      (model_dynamics_t)
 *
 * about the trim, by the linearly implicit midpoint rule of the models. The lever's angle is no input: what the pilot
 * does on purpose is not in it. Angle and rate are states, which a change of the parameters leaves as they are.
 *
 * So that no bias of the accelerometer stays, z_ddot passes (s^2 + sqrt(2) w s) / (s^2 + sqrt(2) w s + w^2), w of the
 * corner: at ten times the corner it is off by 1 %, where a Butterworth high-pass leads by 8 degrees. What is driven by
 * the base's velocity gets a Butterworth high-pass, behind which the velocity of a bias is none. */
#ifndef BOUNCE_INVOLUNTARY_H
#define BOUNCE_INVOLUNTARY_H

#include "filter/trim.h"
#include "model/base_motion.h"
#include "model/model.h"

#include <stdbool.h>

typedef struct involuntary {
    high_pass_t base;
    base_motion_t base_motion;
    float z_ddot;    /* of the last sample, behind the high-pass that drives the arm, */
    float velocity;  /* and that for the base's velocity [m/s^2] */
    float theta;     /* [rad] */
    float theta_dot; /* [rad/s] */
} involuntary_t;

/* At rest, on a base with that acceleration [m/s^2]. */
void involuntary_start(involuntary_t *involuntary, float z_ddot);

/* To the next sample. `step`: trim and period since the last one, and z_ddot and tau_m: of the base now, of the motor
 * since the last sample. corner: of the high-pass [Hz]. Starts again, and returns false, where the parameters make no
 * stable arm. */
bool involuntary_step(involuntary_t *involuntary, const model_dynamics_t *dynamics, const model_constants_t *constants,
    const model_step_t *step, float corner);

/* The angle `ahead` seconds from now, at the rate of now [rad]. */
static inline float involuntary_angle(const involuntary_t *involuntary, float ahead)
{
    return involuntary->theta + (ahead * involuntary->theta_dot);
}

#endif
