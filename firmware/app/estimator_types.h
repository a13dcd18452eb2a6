/* The members of an estimator, and what a sample is on its way: estimator.c, prediction.c and alignment.c work with them. */
#ifndef APP_ESTIMATOR_TYPES_H
#define APP_ESTIMATOR_TYPES_H

#include "app/delay_line.h"
#include "app/learning.h"
#include "app/setup.h"
#include "bounce/seat.h"
#include "filter/cdkf.h"
#include "filter/trim.h"
#include "lever_cdkf.h"
#include "math/trigonometry.h"
#include "model/base_motion.h"

#include <stdbool.h>
#include <stdint.h>

/* A sample after its checks: outputs, and inputs of which a missing base acceleration is the last one, a missing
 * torque 0. */
typedef struct checked {
    float y[CDKF_OUTPUTS];
    bool valid[CDKF_OUTPUTS];
    bool base;    /* the base acceleration is valid */
    bool torque;  /* the torque is measured, or the commanded one */
    float z_ddot; /* compensated for gain and delay of the sensor */
    float tau_m;
    float grip_force; /* [N] */
    bool gripped;     /* it is valid */
} checked_t;

/* The inputs of the last sample, compensated: base acceleration [m/s^2], torque [N m]. */
typedef struct inputs {
    float z_ddot;
    float tau_m;
} inputs_t;

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
    delay_line_t line;
    enum lever_mode mode;
    uint32_t time_us;      /* of the last sample */
    uint32_t late_time_us; /* of the last late one, and by how much such samples have advanced */
    uint32_t late_series_us;
    float raw_z_ddot;     /* as it came last [m/s^2] */
    float base_missing;   /* time since the base acceleration was valid last [s] */
    float torque_missing; /* likewise the torque, while it may be other than the commanded one [s] */
    seat_t seat;
    float last_z_ddot; /* inputs, compensated for what is known of the sensors, at the seat [m/s^2], [N m] */
    float last_tau_m;
    float z_ddot; /* the same as the model takes them: deviations in preload trim */
    float tau_m;
    float last_rate;           /* of the lever at the begin of the last step [rad/s] */
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

#endif
