/* Detection of a sudden change of the pilot.
 *
 * Corrections of w are white when the filter is right: each has the covariance by which it made w more certain,
 * independent of the last one. After a jump of the pilot they all point the same way. So the square of their sum over
 * a short time, by the inverse of its covariance C (Mahalanobis 1936), is chi-square with a degree of freedom for each
 * parameter, and large after a change: the generalised likelihood ratio of a jump (Willsky & Jones 1976) without a
 * bank of filters. What the samples tell of a combination of parameters counts however little they tell of each. The
 * statistic is compared with its own long average, which makes it insensitive to noise that is set wrongly.
 */
#ifndef FILTER_CHANGE_DETECTION_H
#define FILTER_CHANGE_DETECTION_H

#include "filter/cdkf.h"

typedef struct change_detection {
    float sum[MODEL_PARAMETERS];     /* of the corrections of w, with exponential forgetting */
    float covariance[CDKF_TRIANGLE]; /* expected of it, lower triangle */
    float average;                   /* of the statistic per parameter, over a long time; expected 1 */
} change_detection_t;

void change_detection_init(change_detection_t *change);

/* Takes a correction of w, `period` seconds after the last one; memory of the sum [s]. Returns the statistic. */
float change_detection_step(
    change_detection_t *change, const correction_t *correction, const scaling_t *scaling, float period, float memory);

/* The sum starts anew: after a change. */
void change_detection_restart(change_detection_t *change);

#endif
