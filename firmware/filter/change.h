/* Detection of a sudden change of the pilot.
 *
 * What the parameters learn is white when the filter is right: each correction of w has the variance by which it made w more
 * certain, and no memory of the last one. After a jump of the pilot the corrections all point the same way. So their sum over
 * a short time, squared and over its variance, is chi-square with a degree of freedom for each parameter (in steady state
 * each correction makes up for the walk, whose parts are independent), or large after a change: the generalised likelihood
 * ratio of a jump (Willsky & Jones 1976) without a bank of filters. It is compared with its own long average, which makes it
 * insensitive to noise that is set wrongly.
 */
#ifndef FILTER_CHANGE_H
#define FILTER_CHANGE_H

#include "model/model.h"

#include <stdbool.h>

typedef struct change_detector {
    float drift[MODEL_PARAMETERS];    /* leaky sum of the corrections of w */
    float variance[MODEL_PARAMETERS]; /* and what it is expected to be */
    float usual;                      /* long average of the statistic per parameter; 1 is expected */
} change_detector_t;

/* Starts without a memory. */
void change_init(change_detector_t *change);

/* What the parameters have learnt `period` seconds after they did so last: the correction of w, and by how much its variances
 * have become smaller. Memory of the sum [s]; threshold on the statistic (0: never). True: a change; the sum starts anew. */
bool change_step(change_detector_t *change, const float correction[MODEL_PARAMETERS],
    const float learnt[MODEL_PARAMETERS], float period, float memory, float threshold);

#endif
