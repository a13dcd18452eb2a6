#include "filter/change.h"

#include <string.h>

#define L ((uint32_t)MODEL_PARAMETERS)
#define LONG 100.0f /* memory of the long average, in memories of the sum */

void change_init(change_detector_t *change)
{
    (void)memset(change, 0, sizeof *change);
    change->usual = 1.0f;
}

static float share_of(float period, float time)
{
    return (period < time) ? (period / time) : 1.0f;
}

bool change_step(change_detector_t *change, const float correction[MODEL_PARAMETERS],
    const float learnt[MODEL_PARAMETERS], float period, float memory, float threshold)
{
    const float keep = 1.0f - share_of(period, memory);
    float statistic = 0.0f;
    for (uint32_t i = 0u; i < L; i++) {
        change->drift[i] = (keep * change->drift[i]) + correction[i];
        change->variance[i] = (keep * keep * change->variance[i]) + ((learnt[i] > 0.0f) ? learnt[i] : 0.0f);
        if (change->variance[i] > 0.0f) {
            statistic += (change->drift[i] * change->drift[i]) / change->variance[i];
        }
    }
    change->usual += share_of(period, LONG * memory) * ((statistic / (float)L) - change->usual);
    const float usual = (change->usual > 1.0f) ? change->usual : 1.0f;
    const bool changed = (threshold > 0.0f) && (statistic > (threshold * usual));
    if (changed) {
        (void)memset(change->drift, 0, sizeof change->drift);
        (void)memset(change->variance, 0, sizeof change->variance);
    }
    return changed;
}
