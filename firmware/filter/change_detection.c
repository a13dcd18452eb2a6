#include "filter/change_detection.h"
#include "math/bounds.h"
#include "math/factor.h"
#include "math/share.h"

#include <string.h>

#define L ((uint32_t)MODEL_PARAMETERS)
#define LONG 100.0f       /* memory of the long average, in memories of the sum */
#define SUM_LEAST 1.0e-3f /* standard deviation that the sum always has, in those of the prior: beyond rounding */

void change_detection_init(change_detection_t *change)
{
    (void)memset(change, 0, sizeof *change);
    change->average = 1.0f;
}

float change_detection_step(
    change_detection_t *change, const correction_t *correction, const scaling_t *scaling, float period, float memory)
{
    const float share = share_of(period, memory);
    const float keep = 1.0f - share;
    float u[MODEL_PARAMETERS * MODEL_PARAMETERS];
    float z[MODEL_PARAMETERS];
    float inverse[MODEL_PARAMETERS];
    uint32_t k = 0u;
    for (uint32_t i = 0u; i < L; i++) {
        change->sum[i] = (keep * change->sum[i]) + correction->w[i];
        inverse[i] = 1.0f / (SUM_LEAST * scaling_prior_sigma(scaling, i));
        z[i] = inverse[i] * change->sum[i];
        for (uint32_t j = 0u; j <= i; j++) {
            change->covariance[k] = (keep * keep * change->covariance[k]) + correction->covariance[k];
            u[(j * L) + i] = (inverse[i] * inverse[j]) * change->covariance[k];
            k++;
        }
    }
    factor_reverse(u, L);
    factor_reverse_solve(u, L, z, L);
    const float statistic = factor_dot_three(z, z);
    change->average += (share / LONG) * ((statistic / (float)L) - change->average);
    return statistic / greater(change->average, 1.0f);
}

void change_detection_restart(change_detection_t *change)
{
    (void)memset(change->sum, 0, sizeof change->sum);
    (void)memset(change->covariance, 0, sizeof change->covariance);
}
