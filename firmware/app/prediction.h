/* From one sample to the next: the time update of the filter with the inputs of both, the levels of the trim, and
 * which outputs of the next sample are spikes. */
#ifndef APP_PREDICTION_H
#define APP_PREDICTION_H

#include "app/estimator_types.h"

#include <stdint.h>

/* Predicts to the sample, `periods` sample periods after the last one. Its outputs become deviations from the trim;
 * those that are spikes become invalid, which the faults say. */
void prediction_advance(
    estimator_t *estimator, checked_t *sample, const inputs_t *last, float elapsed, uint32_t periods);

#endif
