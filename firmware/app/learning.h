/* When and how the parameters learn: every learn_period, with a walk that adapts; more after a sudden change of the pilot; and
 * with the noise that the innovations show. The work of it is spread over the samples of the period, a step each, so that
 * every sample costs about the same.
 */
#ifndef APP_LEARNING_H
#define APP_LEARNING_H

#include "app/prior.h"
#include "filter/change.h"
#include "filter/dual.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct learning {
    change_detector_t change;
    float changed;  /* time left to report a change [s] */
    float unlearnt; /* time since the last revision of the parameters began [s] */
    float period;   /* what that one learns from [s] */
    uint8_t step;   /* of that one, to be done next */
    uint8_t pace;   /* steps a sample */
    bool teaches;   /* as in lesson_t, when it began */
    bool excited;
    bool widens;  /* it found a change */
    bool opens;   /* the next one starts from the prior */
    bool bounded; /* a parameter rested on a bound then */
} learning_t;

/* Starts for parameters at their first guess. */
void learning_start(learning_t *learning, const setup_t *setup, dual_t *dual);

/* Starts the adaptation that is chosen now; the rest goes on. */
void learning_adapt(const setup_t *setup, dual_t *dual);

/* What a sample was good for. */
typedef struct lesson {
    bool walks;   /* the parameters may walk: not frozen */
    bool teaches; /* it was measured, and the levels have settled */
    bool excited; /* there was enough motion lately: at rest, only the walk goes on */
} lesson_t;

/* After the update with a sample, `elapsed` seconds after the last one. */
void learning_step(learning_t *learning, const setup_t *setup, dual_t *dual, const model_t *model,
    const model_constants_t *constants, const lesson_t *lesson, float elapsed);

/* After `elapsed` seconds without samples: what was gathered is learnt at once, and the parameters walk for that time. */
void learning_skip(learning_t *learning, const setup_t *setup, dual_t *dual, const model_t *model,
    const model_constants_t *constants, float elapsed);

/* No revision of the parameters is under way. */
bool learning_is_done(const learning_t *learning);

/* A sudden change was detected within the last second. */
bool learning_has_changed(const learning_t *learning);

#endif
