/* Quantities derived from the parameters, with standard deviations: the values are those at the estimate, the
 * deviations by the central difference transform over the covariance of the parameters (cdkf.h). */
#ifndef FILTER_DERIVED_H
#define FILTER_DERIVED_H

#include "filter/cdkf.h"
#include "model/model.h"

/* Without a restoring stiffness there is no natural frequency: it and the damping ratio are 0. */
typedef struct derived_dynamics {
    float natural_frequency; /* undamped [Hz] */
    float natural_frequency_sigma;
    float damping_ratio; /* [1] */
    float damping_ratio_sigma;
} derived_dynamics_t;

/* Biodynamic feedthrough theta/z_ddot at one frequency. Its error is given along the phasor, relative to its length:
 * the gain's; and across: the phase's. Not finite where there is no response, or an
 * undamped model is in resonance. */
typedef struct derived_feedthrough {
    float real; /* [rad/(m/s^2)] */
    float imaginary;
    float gain_sigma;  /* relative [1] */
    float phase_sigma; /* [rad] */
    float correlation; /* of the errors of gain and phase [1]; 0 without any */
} derived_feedthrough_t;

/* Two quantities at a sigma point of the parameters, or their standard deviations. */
typedef struct derived_couple {
    float first;
    float second;
} derived_couple_t;

/* Standard deviations of two quantities, given at the sigma points. */
derived_couple_t derived_sigma(const cdkf_t *cdkf, const derived_couple_t value[MODEL_POINTS]);

typedef struct derived_complex {
    float real;
    float imaginary;
} derived_complex_t;

/* theta/z_ddot of a model's dynamics at a frequency [Hz]; angle: base_motion_angle(). */
derived_complex_t derived_response(
    const model_dynamics_t *dynamics, const model_constants_t *constants, float angle, float frequency);

/* Of the model linearised about the trim, whose angle, sine and cosine are in `step`; frequency [Hz]. */
derived_dynamics_t derived_dynamics(
    const cdkf_t *cdkf, const model_t *model, const model_constants_t *constants, const model_step_t *step);
derived_feedthrough_t derived_feedthrough(const cdkf_t *cdkf, const model_t *model, const model_constants_t *constants,
    const model_step_t *step, float frequency);

#endif
