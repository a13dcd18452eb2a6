/* What is done against collective bounce, by README.md: a correction of the lever's angle for the flight control
 * computer, and torque against the lever's rate. All of it passes one gate, which is open while all of this holds:
 *   - the mode, the sample clock and the machine permit it, and somebody holds the lever: mitigation_sample_t;
 *   - a sample with all its sensors came within 20 ms or 1.25 sample periods, whichever is longer;
 *   - neither theta nor z_ddot has been the very same for more than 22 ms, and for much longer than is usual of it.
 * It opens within half a second. Otherwise all fades to zero within 70 ms; for that no sample is needed: the port calls
 * mitigation_idle().
 *
 * The correction also needs that the estimated arm explains how the lever moves: that of the lever's rate, between 1.5
 * and 8 Hz, at least half of what is expected is there. Where it is not, the correction would add to the motion. */
#ifndef BOUNCE_MITIGATION_H
#define BOUNCE_MITIGATION_H

#include "bounce/involuntary.h"
#include "lever_cdkf.h"
#include "model/model.h"

#include <stdbool.h>
#include <stdint.h>

/* A signal from 1.5 to 8 Hz: the part of a first-order low-pass that is above a first-order high-pass. */
typedef struct mitigation_band {
    float low_pass;
    float level;
} mitigation_band_t;

/* A sensor that has noise does not say the very same for long. */
typedef struct mitigation_reading {
    uint8_t same;    /* samples for which it has been the same, */
    uint8_t longest; /* and the most for which it was, lately */
} mitigation_reading_t;

/* A second-order filter at the natural frequency. */
typedef struct mitigation_notch {
    float low_pass;
    float band_pass;
} mitigation_notch_t;

/* What is left of the lever's motion, about the frequency at which most of it is. */
typedef struct mitigation_rest {
    mitigation_band_t band;
    float square;      /* means of its square in the band [rad^2], */
    float rate_square; /* and of that of its rate [rad^2/s^2] */
    float turn;        /* frequency [rad/s] */
    float weight;      /* 0 to 1 */
    mitigation_notch_t notch;
} mitigation_rest_t;

enum mitigation_rests { MITIGATION_RESTS = 2 };

typedef struct mitigation {
    involuntary_t involuntary;
    mitigation_band_t moved;    /* of theta_dot, */
    mitigation_band_t expected; /* and of the involuntary theta_dot */
    float expected_square;      /* means of the latter's square, and of the product of both [rad^2/s^2] */
    float product;
    float trust; /* weight of the involuntary motion: how far the estimated arm explains the lever's, 0 to 1 */
    mitigation_rest_t rest[MITIGATION_RESTS]; /* of theta less that: each of what the one before leaves */
    mitigation_notch_t notch;
    float correction;       /* before the fade [rad] */
    float weight;           /* of the correction, 0 to 1 */
    float damping_weight;   /* of the torque */
    float damping;          /* torque to ask of the motor [N m], */
    float expected_damping; /* and what it would be with the involuntary theta_dot */
    uint32_t sensed_left;   /* time for which the last sample with all its sensors serves [us] */
    uint32_t counted;       /* time since the last sample that mitigation_idle() has counted [us] */
    mitigation_reading_t theta;
    mitigation_reading_t z_ddot;
    uint8_t samples; /* with all sensors; wraps */
    bool rated;      /* theta_dot has been measured: from then on it is missed */
    bool explained;  /* the estimated arm explains how the lever moves */
    bool notches;    /* the correction is the notch's */
    bool open;
    bool started;
} mitigation_t;

/* A sample, to the mitigation. */
typedef struct mitigation_sample {
    const model_dynamics_t *dynamics;
    const model_constants_t *constants;
    model_step_t step;   /* trim; period: time since the last sample; z_ddot; tau_m: of the motor in that time */
    uint32_t elapsed_us; /* the same time; where the clock stands, of a sample period */
    uint32_t silence_us; /* longest time without all sensors */
    float theta;         /* estimated [rad] */
    float theta_dot;     /* [rad/s] */
    float drive;         /* share of what was asked of the motor that the torque gate has let through: 0 to 1 */
    uint8_t mitigation;  /* enum lever_mitigation */
    bool advances;       /* the sample clock */
    bool permitted;
    bool sensed;      /* theta and z_ddot are valid, */
    bool rated;       /* and theta_dot */
    bool fits;        /* z_ddot is not found to be wrong */
    bool same_theta;  /* theta as measured is that of the sample before, */
    bool same_z_ddot; /* and z_ddot */
} mitigation_sample_t;

/* A sample came: renews the correction, and the torque to ask of the motor. Returns false when none is chosen and all has
 * faded: then it need not be called. */
bool mitigation_step(mitigation_t *mitigation, const lever_settings_t *settings, const mitigation_sample_t *sample);

/* No sample came for `elapsed_us` since the last call of this or the last sample. */
void mitigation_idle(mitigation_t *mitigation, uint32_t elapsed_us);

/* What it says now. */
lever_correction_t mitigation_correction(const mitigation_t *mitigation);

/* Whether one of enum lever_mitigation has torque for the motor: every other. */
static inline bool mitigation_has_damping(uint8_t mitigation)
{
    return (mitigation & (uint8_t)LEVER_MITIGATION_DAMPING) != 0u;
}

#endif
