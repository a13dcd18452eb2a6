/* The optional sensor of the force between hand and lever. With base motion alone it tells what nothing else does: the
 * common scale of mass, damping and stiffness.
 *
 * The force is used when it has agreed for a while with what the lever's own equation of motion says of the hand
 * (app/hands.h). Its gain error, which is constant, is treated as white noise of the density at which a filter of
 * parameters that walk by q becomes as certain as the gain is, sigma: density = sigma^4 / q^2. So the force never makes
 * them more certain than its gain, and one whose gain is not known does nothing.
 */
#ifndef APP_GRIP_FORCE_H
#define APP_GRIP_FORCE_H

#include "app/hands.h"
#include "app/setup.h"
#include "filter/cdkf.h"
#include "filter/trim.h"

#include <stdbool.h>

#ifndef LEVER_GRIP_FORCE
#define LEVER_GRIP_FORCE 1 /* 0: forces are received, and nothing is made of them (2 KiB less) */
#endif

/* Means over blocks (hands.h), of the hand's impulse times the drive: what the force sensor and what the lever's motion
 * say of it. Their ratio is the sensor's gain error. */
typedef struct grip_comparison {
    float measured;
    float expected;
    float difference_square; /* of both impulses, and of the drive: how certain that is */
    float drive_square;
    float time; /* compared so far, up to the memory of the means [s] */
} grip_comparison_t;

typedef struct grip_force {
    float raw;      /* the last valid one, compensated for gain and bias [N] */
    float missing;  /* time since then [s] */
    float settling; /* time until its slow part is known [s] */
    float square;   /* mean square of the same without its slow part [N^2] */
    float impulse;  /* of the force since the beginning of the block of hands_t [N m s] */
    grip_comparison_t means;
    bool seen;  /* a force has come */
    bool right; /* its gain is certain to be what the settings say, about */
    bool wrong; /* its gain is not what the settings say; until a reset */
} grip_force_t;

/* The force of a sample, `period` seconds after the last one; NULL: missing. Returns true when the force over the step
 * is known, and then fills in what the filter takes, but for `learn`. `alone`: the impulse without hands
 * (hands_predict); `error` as for cdkf_time_update(). */
bool grip_force_step(grip_force_t *grip, const setup_t *setup, trim_t *trim, const float *force,
    const model_step_t *step, float alone, const float error[CDKF_CONSIDERED], cdkf_grip_t *seen);

/* The force is used. */
static inline bool grip_force_is_used(const grip_force_t *grip)
{
    return grip->right && !grip->wrong;
}

/* After hands_step(). Returns true when the force was compared, and its gain error over what that may be. */
bool grip_force_judge(grip_force_t *grip, const setup_t *setup, const hands_block_t *hands, float *away);

#endif
