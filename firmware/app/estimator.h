/* The estimator without CAN and torque: samples in, modes, health, estimates out. What lever_cdkf.h promises is done
 * here. */
#ifndef APP_ESTIMATOR_H
#define APP_ESTIMATOR_H

#include "app/estimator_types.h"
#include "bounce/margin.h"
#include "filter/derived.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

/* Starts from a checked configuration, whose settings are used as long as the instance is. All of it is zero before. */
void estimator_init(estimator_t *estimator, const lever_config_t *config);

/* Back to before the first sample, with the choices as they are; counts go on. */
void estimator_start_over(estimator_t *estimator);

/* The functions of lever_cdkf.h of the same names. commanded_torque: what was asked of the motor until this sample [N m], for
 * when the measured torque is missing. A command's dither is not the estimator's. */
enum lever_mode estimator_update(estimator_t *estimator, const lever_sample_t *sample, float commanded_torque);
bool estimator_command(estimator_t *estimator, const lever_command_t *command);
void estimator_estimate(const estimator_t *estimator, lever_estimate_t *estimate);

/* State i of the estimate as the sensors see it: theta [rad], theta_dot [rad/s]. */
float estimator_state(const estimator_t *estimator, uint32_t i);

/* The parameters in the units of the model, and their standard deviations. */
void estimator_parameters(const estimator_t *estimator, float parameter[LEVER_PARAMETERS]);
void estimator_parameter_sigma(const estimator_t *estimator, float sigma[LEVER_PARAMETERS]);

/* The quantities that are derived from the parameters; frequency [Hz]. */
derived_dynamics_t estimator_dynamics(const estimator_t *estimator);
derived_feedthrough_t estimator_feedthrough(const estimator_t *estimator, float frequency);

/* The model about the trim, which is written into the step. */
model_dynamics_t estimator_linearised(const estimator_t *estimator, model_step_t *step);

margin_t estimator_margin(const estimator_t *estimator, const lever_aircraft_t *aircraft);

/* Mode, excitation and counts; faults are instance_faults(), and torque is not the estimator's. */
void estimator_health(const estimator_t *estimator, lever_health_t *health);

#endif
