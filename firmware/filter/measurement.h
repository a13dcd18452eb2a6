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

#endif
