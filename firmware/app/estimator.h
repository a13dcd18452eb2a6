/* The estimator without CAN and torque: samples in, modes, health, estimates out. What lever_cdkf.h promises is done
 * here. */
#ifndef APP_ESTIMATOR_H
#define APP_ESTIMATOR_H

#include "app/learning.h"
#include "app/setup.h"
#include "bounce/margin.h"
#include "bounce/seat.h"
#include "filter/cdkf.h"
#include "filter/derived.h"
#include "filter/trim.h"
#include "lever_cdkf.h"
#include "math/trigonometry.h"
#include "model/base_motion.h"

#include <stdbool.h>
#include <stdint.h>

/* The first samples, averaged. */
typedef struct alignment {
    float count; /* valid angles in the mean, which the trim has */
    float time;  /* since the first sample [s] */
} alignment_t;

typedef struct estimator {
    setup_t setup;
    cdkf_t cdkf;
    learning_t learning;
    trim_t trim;
    sine_cosine_t trim_sine_cosine; /* sine and cosine of the trim angle */
    float rest_angle;               /* mean trim angle, about which dynamics are reported [rad] */
    alignment_t alignment;
    enum lever_mode mode;
    uint32_t time_us;      /* of the last sample */
    uint32_t late_time_us; /* of the last late one, and by how much such samples have advanced */
    uint32_t late_series_us;
    float raw_z_ddot;   /* as it came last [m/s^2] */
    float base_missing; /* time since the base acceleration was valid last [s] */
    seat_t seat;
    float last_z_ddot; /* inputs, compensated for what is known of the sensors, at the seat [m/s^2], [N m] */
    float last_tau_m;
    float z_ddot; /* the same as the model takes them: deviations in preload trim */
    float tau_m;
    base_motion_t base_motion; /* what follows from that */
    float restarts;            /* of the filter, those of more than some 10 s ago forgotten */
    float nis;                 /* of the last sample */
    uint8_t nis_size;
    bool frozen;
    bool communication_fault; /* reported by the CAN side for the next sample */
    uint32_t faults;          /* of enum lever_fault, of the last sample */
    uint32_t samples;
    uint32_t lost;
    uint32_t corrupt;
    uint32_t late;
    uint32_t recoveries;
} estimator_t;

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
