/* The outputs of one sample, as the filters take them. */
#ifndef FILTER_MEASUREMENT_H
#define FILTER_MEASUREMENT_H

#include "model/model.h"

#include <stdbool.h>

enum { MEASUREMENT_OUTPUTS = 2 };

/* y = [theta rad, theta_dot rad/s]; an output that is not valid is not read. */
typedef struct measurement {
    float y[MEASUREMENT_OUTPUTS];
    bool valid[MEASUREMENT_OUTPUTS];
} measurement_t;

/* What a sample says, before the update with it, of outputs made independent of each other and of variance 1 when the
 * parameters are given: theta, then theta_dot given theta. All of an output that is not valid is zero. */
typedef struct whitened {
    float innovation[MEASUREMENT_OUTPUTS];
    float output[MEASUREMENT_OUTPUTS][MODEL_PARAMETERS]; /* deviations that go with the parameters */
    float echo[MEASUREMENT_OUTPUTS];                     /* of past corrections (noise.h) */
    float scale[MEASUREMENT_OUTPUTS]; /* what made them so: an output is scale times its whitened one, */
    float coupling;                   /* for theta_dot plus coupling times the whitened theta */
} whitened_t;

#endif
