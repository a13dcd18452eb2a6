/* Quantities derived from the parameters, with standard deviations. */
#ifndef FILTER_DERIVED_H
#define FILTER_DERIVED_H

#include "filter/parameter_filter.h"
#include "model/model.h"

typedef struct derived {
    model_dynamics_t mean;     /* natural frequency [Hz] and damping ratio [1] at the estimate */
    model_dynamics_t variance; /* of them */
} derived_t;

/* Both by the central difference transform over the covariance of the parameters (sigma_points.h), in parts of about equal cost:
 * first the mean and the pair of the first parameter, then the other pairs. */
void derived_begin(derived_t *derived, const parameter_filter_t *filter, const model_t *model,
    const model_constants_t *constants, const model_step_t *step);
void derived_end(derived_t *derived, const parameter_filter_t *filter, const model_t *model,
    const model_constants_t *constants, const model_step_t *step);

#endif
