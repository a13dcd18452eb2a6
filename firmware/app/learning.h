/* When and how the parameters learn: every learn_period, with a walk that adapts; at once after a sudden change of the pilot; and
 * with the noise that the innovations show.
 */
#ifndef APP_LEARNING_H
#define APP_LEARNING_H

#include "filter/change.h"
#include "filter/dual.h"
#include "lever_cdkf.h"

#include <stdbool.h>

typedef struct learning {
    change_detector_t change;
    float changed;  /* time left to report a change [s] */
    float unlearnt; /* time since the parameters learnt last [s] */
    bool bounded;   /* a parameter rested on a bound then */
} learning_t;

/* Starts for parameters at their first guess. */
void learning_start(learning_t *learning, const lever_config_t *config, dual_t *dual);

/* Starts the adaptation that the configuration has now; the rest goes on. */
void learning_adapt(const lever_config_t *config, dual_t *dual);

/* What a sample was good for. */
typedef struct lesson {
    bool walks;   /* the parameters may walk: not frozen */
    bool teaches; /* it was measured, and the levels have settled */
    bool excited; /* there was enough motion lately: at rest, only the walk goes on */
} lesson_t;

/* After the update with a sample, `elapsed` seconds after the last one. */
void learning_step(
    learning_t *learning, const lever_config_t *config, dual_t *dual, const lesson_t *lesson, float elapsed);

/* A sudden change was detected within the last second. */
bool learning_has_changed(const learning_t *learning);

#endif
