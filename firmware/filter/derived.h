/* Quantities derived from the parameters, with standard deviations. */
#ifndef FILTER_DERIVED_H
#define FILTER_DERIVED_H

#include "filter/cdkf.h"
#include "model/model.h"

typedef struct derived {
    model_dynamics_t mean;     /* natural frequency [Hz] and damping ratio [1] at the estimate */
    model_dynamics_t variance; /* of them */
} derived_t;

/* Both by the central difference transform over the covariance of the parameters (cdkf.h). */
void derived_compute(derived_t *derived, const cdkf_t *cdkf, const model_t *model, const model_constants_t *constants,
    const model_step_t *step);

#endif
