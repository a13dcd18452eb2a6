/* Whether the sensors and the lever are what the settings say, from the innovations (Friedland 1969): with torque and
 * base both at work, mass, damping and stiffness cannot take up an error of gain, delay or friction altogether.
 */
#ifndef FILTER_CALIBRATION_H
#define FILTER_CALIBRATION_H

#include "filter/cdkf.h"

typedef struct calibration {
    score_t score[CDKF_CALIBRATION]; /* with exponential forgetting */
    bool wrong;
} calibration_t;

void calibration_start(calibration_t *calibration);

/* Adds a block of `period` seconds; an error counts when it is beyond what its standard deviation in `cdkf` and the
 * innovations' own noise allow. */
void calibration_step(
    calibration_t *calibration, const cdkf_t *cdkf, const score_t score[CDKF_CALIBRATION], float period);

#endif
