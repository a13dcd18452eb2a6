/* Estimation of state and parameters together, on the same sample: the belief, and the two ways to advance it.
 *
 * The belief on [w; x] is one covariance factor, lower block-triangular with the parameters first: [S_w 0; T S_x]. S_w and T
 * are the parameter filter's, S_x, the uncertainty of the state when the parameters are given, is the state filter's. A
 * prediction touches the rows of the state only.
 *
 * Dual: a state filter at the estimated parameters and a parameter filter in step (Wan & Nelson 2001), with the recurrent
 * sensitivity of the state to the parameters (Nelson 2000), and the state corrected for what the parameters have just
 * learned (the two-stage filter of Friedland 1969). Joint: the same, but what a walk of the parameters makes independent of
 * them stays with the state as uncertainty of its own, so that the belief is that of one filter on [w; x] (van der Merwe
 * 2004) exactly; the dual filter leaves it out. With constant parameters both are equal.
 *
 * Both share one set of sigma points and one call of the model a sample.
 */
#ifndef FILTER_DUAL_H
#define FILTER_DUAL_H

#include "filter/measurement.h"
#include "filter/noise.h"
#include "filter/parameter_filter.h"
#include "filter/revision.h"
#include "filter/state_filter.h"
#include "model/model.h"

#include <stdbool.h>

typedef struct dual {
    state_filter_t state;
    parameter_filter_t parameters;
    revision_t revision; /* of the parameters: under way, or as adopted last */
    noise_estimator_t noise;
} dual_t;

/* Time update over one step of the model; the parameters stand still. */
void dual_predict(dual_t *dual, const model_t *model, const model_constants_t *constants, const model_step_t *step);

/* Measurement update of the state. `learn`: what the sample says of the parameters is gathered. Returns the normalised
 * innovation squared; when not learning, that of the parameters being right. */
float dual_update(dual_t *dual, const measurement_t *measurement, bool learn);

/* The parameters learn by the functions of revision.h, in their order. These two of them concern the state, too: what
 * becomes independent of the parameters stays with it in the joint filter, and is left out in the dual one. Of w from `first`
 * on `count` parameters walk. */
void dual_forget(dual_t *dual, float period, bool joint);
void dual_walk(
    dual_t *dual, uint32_t first, uint32_t count, float period, const float variance[MODEL_PARAMETERS], bool joint);

/* Instead of revision_condition(): opens the parameters' covariance to that of their prior. What they have made uncertain of the
 * state stays with it. */
void dual_open(dual_t *dual);

/* Standard deviation of state i, that of the parameters included. */
float dual_state_sigma(const dual_t *dual, uint32_t i);

/* Invariant of both filters. */
bool dual_is_valid(const dual_t *dual);

/* The part of it that is cheap: all is finite, and the state filter valid. */
bool dual_is_finite(const dual_t *dual);

#endif
