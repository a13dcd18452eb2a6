#include "filter/whiteness.h"

#include "math/bounds.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#define LAGS ((uint32_t)WHITENESS_LAGS)
#define WHITENESS_MEMORY 5.0f /* of the means [s]: 250 blocks of 20 ms, white correlations are then 0.05 */
#define WHITENESS_MIN 2.0f    /* before a verdict [s] */

void whiteness_start(whiteness_t *whiteness)
{
    (void)memset(whiteness, 0, sizeof *whiteness);
}

float whiteness_correlation(const whiteness_t *whiteness)
{
    float largest = 0.0f;
    for (uint32_t k = 0u; k < LAGS; k++) {
        largest = greater(fabsf(whiteness->product[k]), largest);
    }
    return (whiteness->time >= WHITENESS_MIN) ? (largest / greater(whiteness->variance, whiteness->expected)) : 0.0f;
}

void whiteness_end_block(whiteness_t *whiteness)
{
    const float sum = whiteness->sum;
    whiteness->time = lesser(whiteness->time + whiteness->elapsed, WHITENESS_MEMORY);
    const float share = whiteness->elapsed / whiteness->time;
    whiteness->variance += share * ((sum * sum) - whiteness->variance);
    whiteness->expected += share * (whiteness->count - whiteness->expected);
    for (uint32_t k = 0u; k < LAGS; k++) {
        whiteness->product[k] += share * ((sum * whiteness->before[k]) - whiteness->product[k]);
    }
    for (uint32_t k = LAGS - 1u; k > 0u; k--) {
        whiteness->before[k] = whiteness->before[k - 1u];
    }
    whiteness->before[0] = sum;
    whiteness->sum = 0.0f;
    whiteness->count = 0.0f;
    whiteness->elapsed = 0.0f;
}
