/* Where the state starts: the first samples, averaged; and again after an outage. */
#ifndef APP_ALIGNMENT_H
#define APP_ALIGNMENT_H

#include "app/estimator_types.h"

#include <stdbool.h>

/* Begins with this sample. */
void alignment_begin(estimator_t *estimator, const checked_t *sample);

/* Averages angles until align_time has passed, then starts the state. Without any angle the trim is taken to be where
 * the lever's spring rests. */
void alignment_step(estimator_t *estimator, const checked_t *sample, float elapsed);

/* The state starts at outputs y, deviations in preload trim, with the uncertainty of the measurement. An angle that is
 * not known is near the trim, a rate that is not known anything plausible. */
void alignment_start_state(estimator_t *estimator, const float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS]);

/* Levels and state begin anew where the lever is, with a step of its acceleration: the pilot has gripped it anew, and
 * what was before does not tell of the arm that is now. */
void alignment_begin_grip(estimator_t *estimator, const checked_t *sample);

#endif
