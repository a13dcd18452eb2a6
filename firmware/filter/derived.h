/* Quantities derived from the parameters, with standard deviations. */
#ifndef FILTER_DERIVED_H
#define FILTER_DERIVED_H

#include "filter/parameter_filter.h"
#include "model/model.h"

/* Natural frequency [Hz] and damping ratio [1] at the estimate, and their standard deviations by the central difference
 * transform over the covariance of the parameters (sigma_points.h). Seven calls of model->dynamics. */
void derived_dynamics(const parameter_filter_t *filter, const model_t *model, const model_constants_t *constants,
    const model_step_t *step, model_dynamics_t *dynamics, model_dynamics_t *sigma);

#endif
