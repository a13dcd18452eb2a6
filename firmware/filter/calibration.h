/* Whether the sensors and the lever are what the settings say, from the innovations (Friedland 1969): with torque and
 * base both at work, mass, damping and stiffness cannot take up an error of gain, delay or friction altogether.
 */
#ifndef FILTER_CALIBRATION_H
#define FILTER_CALIBRATION_H

#include "filter/cdkf.h"

typedef struct calibration {
    score_t score[CDKF_CALIBRATION]; /* with exponential forgetting over 20 s, */
    score_t now[CDKF_CALIBRATION];   /* and over 0.5 s, which an error that is large does not wait for */
} calibration_t;

void calibration_start(calibration_t *calibration);

/* Adds a block of `period` seconds, from the pending scores. Returns the largest error over what its standard deviation
 * and the innovations' own noise allow. */
float calibration_step(calibration_t *calibration, const cdkf_t *cdkf, float period);

#endif
