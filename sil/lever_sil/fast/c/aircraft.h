/* The helicopter around the lever: aircraft/flight.py, which is the reference, in the order of its operations. */
#ifndef AIRCRAFT_H
#define AIRCRAFT_H

#include <stdint.h>

enum aircraft_limits { AIRCRAFT_STATES = 64, AIRCRAFT_INPUTS = 2, AIRCRAFT_OUTPUTS = 2 };

/* Arrays have a value for each sample. */
typedef struct aircraft {
    /* given */
    uint32_t states;
    uint32_t substeps;  /* in a sample period */
    const double *step; /* [states][states + 4]: of state, pitch and gust where a substep begins, those where it ends */
    const double *output;      /* [2][states + 2]: z_ddot at seat and accelerometer of state, pitch and gust */
    double approach;           /* share of its way that the actuator goes in a substep, without limits */
    double most_change;        /* of the pitch in a substep [rad] */
    double travel;             /* of the pitch [rad] */
    double delay;              /* [sample periods], at least 1 */
    double passed;             /* of a change of the lever's angle, in a sample period [1] */
    uint32_t correction_delay; /* [sample periods], at least 1 */
    const double *gearing;     /* pitch over the lever's angle [1] */
    const double *gust;        /* vertical force over mass [m/s^2] */
    double *correction;        /* room for what corrects the lever's angle [rad] */
    double *lever;             /* room for its angle with that [rad] */
    /* state; zero at the start */
    double state[AIRCRAFT_STATES];
    double pitch;  /* [rad] */
    double sensed; /* z_ddot at the accelerometer [m/s^2] */
} aircraft_t;

/* z_ddot at the pilot's seat [m/s^2] at the sample after the one numbered `sample`, at which the lever's angle about its trim is `delta`
 * [rad], and `correction` [rad] is put out, which is added to that angle correction_delay later. */
double aircraft_advance(aircraft_t *aircraft, uint32_t sample, double delta, double correction);

#endif
