#include "filter/change_detection.h"
#include "math/bounds.h"
#include "math/share.h"

#include <string.h>

#define L ((uint32_t)MODEL_PARAMETERS)
#define LONG 100.0f /* memory of the long average, in memories of the sum */

void change_detection_init(change_detection_t *change)
{
    (void)memset(change, 0, sizeof *change);
    change->average = 1.0f;
}

float change_detection_step(change_detection_t *change, const correction_t *correction, float period, float memory)
{
    const float share = share_of(period, memory);
    const float keep = 1.0f - share;
    float statistic = 0.0f;
    for (uint32_t i = 0u; i < L; i++) {
        const float variance = greater(correction->variance[i], 0.0f);
        change->sum[i] = (keep * change->sum[i]) + correction->w[i];
        change->variance[i] = (keep * keep * change->variance[i]) + variance;
        if (change->variance[i] > 0.0f) {
            statistic += (change->sum[i] * change->sum[i]) / change->variance[i];
        }
    }
    change->average += (share / LONG) * ((statistic / (float)L) - change->average);
    return statistic / greater(change->average, 1.0f);
}

void change_detection_restart(change_detection_t *change)
{
    (void)memset(change->sum, 0, sizeof change->sum);
    (void)memset(change->variance, 0, sizeof change->variance);
}
