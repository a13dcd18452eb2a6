/* How near the pilot's arm, the lever and the helicopter are to collective bounce. The loop is
 *
 *     L = P H      P: z_ddot / delta of the aircraft, a table      H: theta / z_ddot of the arm on the lever, estimated
 *
 * and it becomes unstable where L crosses the real axis at +1 (Nyquist; P and H themselves are stable). The values are
 * those at the estimate; standard deviations are by the central difference transform over the covariance of the
 * parameters, and by what is stated of the table. Between two frequencies of the table P is linear. */
#ifndef BOUNCE_MARGIN_H
#define BOUNCE_MARGIN_H

#include "filter/cdkf.h"
#include "lever_cdkf.h"
#include "model/model.h"

#include <stdbool.h>

typedef struct margin {
    float gain; /* by which the loop may grow until it is unstable, at most 40 [dB] */
    float gain_sigma;
    float arm_sigma; /* the part of that which is the arm's, without the table's [dB] */
    float modulus;   /* least |1 - L|, negative where the loop is unstable [1] */
    float modulus_sigma;
    float frequency; /* of the crossing, or without one where |1 - L| is least [Hz] */
    float frequency_sigma;
} margin_t;

/* Of a model linearised about the trim, whose angle, sine and cosine are in `step`. */
margin_t margin_of(const lever_aircraft_t *aircraft, const cdkf_t *cdkf, const model_t *model,
    const model_constants_t *constants, const model_step_t *step);

/* Whether a table may be used: 3 to LEVER_AIRCRAFT_POINTS frequencies that rise from above 0, all of it finite. */
bool margin_accepts(const lever_aircraft_t *aircraft);

#endif
