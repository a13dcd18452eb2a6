/* Dual estimation: a state filter and a parameter filter in step on the same sample.
 *
 * After Wan & Nelson (2001), with the recurrent sensitivity of the state to the parameters (Nelson 2000) carried as
 * columns of the parameter filter's factor, and the state corrected for what the parameters have just learned (the
 * two-stage filter of Friedland 1969). Both filters share one set of sigma points and one call of the model. With constant
 * parameters this equals the joint filter on [w; x]; when they walk, the part of the state's uncertainty that a walk sets
 * free is left out.
 */
#ifndef FILTER_DUAL_H
#define FILTER_DUAL_H

#include "filter/measurement.h"
#include "filter/parameter_filter.h"
#include "filter/state_filter.h"
#include "model/model.h"

#include <stdbool.h>

typedef struct dual {
    state_filter_t state;
    parameter_filter_t parameters;
} dual_t;

/* Time update over one step of the model. `learn` false: the parameters do not walk. */
void dual_predict(
    dual_t *dual, const model_t *model, const model_constants_t *constants, const model_step_t *step, bool learn);

/* Measurement update. The change of w is left in `correction`; `learn` false holds w and its covariance. Returns the
 * normalised innovation squared. */
float dual_update(dual_t *dual, const measurement_t *measurement, bool learn, float correction[MODEL_PARAMETERS]);

/* Standard deviation of state i, that of the parameters included. */
float dual_state_sigma(const dual_t *dual, uint32_t i);

/* Invariant of both filters. */
bool dual_is_valid(const dual_t *dual);

#endif
