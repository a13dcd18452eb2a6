/* The estimator without CAN: samples in, modes, health, estimates out. What lever_cdkf.h promises is done here. */
#ifndef APP_ESTIMATOR_H
#define APP_ESTIMATOR_H

#include "app/learning.h"
#include "app/levels.h"
#include "app/prior.h"
#include "filter/derived.h"
#include "filter/dual.h"
#include "lever_cdkf.h"
#include "math/trigonometry.h"
#include "model/model.h"

#include <stdbool.h>
#include <stdint.h>

/* The first samples, averaged. */
typedef struct alignment {
    float theta_sum; /* [rad] */
    float count;     /* valid angles in the sum */
    float time;      /* since the first sample [s] */
} alignment_t;

/* Slow companions of the estimate. */
typedef struct followed {
    float excitation_square; /* mean square of theta_dot [rad^2/s^2] */
    float innovation_mean;   /* mean of nis / nis_size */
    float restart_debt;      /* restarts, forgotten over RESTART_MEMORY */
} followed_t;

typedef struct estimator {
    setup_t setup;
    model_constants_t constants;
    dual_t dual;
    learning_t learning;
    levels_t levels;
    sine_cosine_t trim; /* of the trim angle */
    followed_t followed;
    alignment_t alignment;
    enum lever_mode mode;
    uint32_t time_us;      /* of the last sample */
    uint32_t late_time_us; /* of the last late one, and how long such a series has advanced */
    uint32_t late_series_us;
    float last_z_ddot; /* inputs as they came [m/s^2], [N m] */
    float last_tau_m;
    float z_ddot; /* the same as levels.h counts them */
    float tau_m;
    float nis; /* of the last sample */
    uint8_t nis_size;
    bool frozen;
    uint16_t faults;
    bool communication_fault; /* reported by the CAN side for the next sample */
    uint32_t samples;
    uint32_t lost;
    uint32_t corrupt;
    uint32_t late;
    uint32_t recoveries;
} estimator_t;

/* Starts from a checked configuration, whose settings are used as long as the instance is; all counts are zero. */
void estimator_init(estimator_t *estimator, const lever_config_t *config);

/* The functions of lever_cdkf.h of the same names. A command's dither_rms is not looked at; health is but for torque, gate, and
 * the faults of machine and bus. */
enum lever_mode estimator_update(estimator_t *estimator, const lever_sample_t *sample);
bool estimator_command(estimator_t *estimator, const lever_command_t *command);
void estimator_estimate(const estimator_t *estimator, lever_estimate_t *estimate);

/* State i of the estimate as the sensors see it: theta [rad], theta_dot [rad/s]. */
float estimator_state(const estimator_t *estimator, uint32_t i);

/* The parameters of the model and their standard deviations, in their units. */
void estimator_parameters(const estimator_t *estimator, float p[LEVER_PARAMETERS]);
void estimator_parameter_sigma(const estimator_t *estimator, float sigma[LEVER_PARAMETERS]);

/* The part of the estimate that is derived from the parameters. */
void estimator_derive(const estimator_t *estimator, derived_t *derived);

void estimator_health(const estimator_t *estimator, lever_health_t *health);

#endif
