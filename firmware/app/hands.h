/* Whether anybody holds the lever.
 *
 * The lever alone is known. Over each block its rate changes as known torque, base and its own spring and damper make
 * it, when no hand is on it: then what is left over is small against the change itself. With a hand, whose inertia is
 * several times that of the lever, the lever alone would move much more than it does.
 */
#ifndef APP_HANDS_H
#define APP_HANDS_H

#include "model/model.h"

#include <stdbool.h>

typedef struct hands {
    float begin;    /* theta_dot at the beginning of the block [rad/s] */
    float impulse;  /* since then, without hands [N m s] */
    float drive;    /* its part that is torque and base */
    float change;   /* mean square of a block's change [rad^2/s^2] */
    float residual; /* mean square of what the lever alone does not explain of it, likewise */
    float elapsed;  /* since the block began [s] */
    bool idle;      /* there was not motion enough in all of it */
} hands_t;

/* A block that has ended. */
typedef struct hands_block {
    float length;  /* [s]; 0: none has */
    float of_hand; /* what the lever alone does not explain of it: the hand's impulse [N m s] */
    float driven;  /* its part that is torque and base */
    bool counted;  /* there was motion enough in all of it: the statistic is new */
} hands_block_t;

void hands_start(hands_t *hands);

/* A block begins, at rest; what was found of the hands stays. */
void hands_begin(hands_t *hands);

/* A step of the model, from the state x = [theta, theta_dot] on (deviations from the trim in preload trim). Returns the
 * impulse without hands [N m s]. */
float hands_predict(
    hands_t *hands, const model_constants_t *constants, const model_step_t *step, const float x[MODEL_STATES]);

/* After `period` seconds at theta_dot; `counts`: there was motion enough. Returns the block that this ends. */
hands_block_t hands_step(
    hands_t *hands, const model_constants_t *constants, float theta_dot, float period, bool counts);

/* Change of theta_dot over what the lever alone does not explain of it, in squares: large when nobody holds it. */
float hands_statistic(const hands_t *hands);

#endif
