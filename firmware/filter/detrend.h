/* Deviation of a signal from its slowly moving level.
 *
 * A second-order Butterworth high-pass, in the form of a tracker: the level follows the signal without lag on a ramp, the
 * deviation is what is left. When outputs and inputs of a linear system are detrended alike, the deviations obey the same
 * system, and whatever moves slowly and is not known drops out: the pilot's trim, gravity, the bias of an accelerometer.
 * To detrend the angle alone (a trim angle by low-pass) would bias the damping by 1 / (2 zeta omega T) and fail on a
 * re-trim, which for T of seconds looks like a torque larger than all others.
 */
#ifndef FILTER_DETREND_H
#define FILTER_DETREND_H

/* Of a corner w [rad/s]: w^2 and sqrt(2) w. */
typedef struct detrend_corner {
    float square;
    float damping;
} detrend_corner_t;

typedef struct detrend {
    float level; /* [unit of the signal] */
    float slope; /* [unit / s] */
} detrend_t;

/* Of a corner frequency [Hz]. */
detrend_corner_t detrend_corner(float frequency);

/* The signal starts at a level, at rest. */
void detrend_start(detrend_t *detrend, float level);

/* One value after `period` seconds. Returns its deviation from the level there was before it. */
float detrend_step(detrend_t *detrend, float value, const detrend_corner_t *corner, float period);

#endif
