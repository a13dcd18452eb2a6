#include "filter/whiteness.h"

#include "math/bounds.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LAGS ((uint32_t)WHITENESS_LAGS)
#define MEMORY 5.0f /* of the means [s]: 250 blocks of 20 ms, white correlations are then 0.05 */
#define LEAST 2.0f  /* before a verdict [s] */
#define COLOURED 0.35f
#define WHITE 0.25f

void whiteness_start(whiteness_t *whiteness)
{
    (void)memset(whiteness, 0, sizeof *whiteness);
}

float whiteness_correlation(const whiteness_t *whiteness)
{
    float largest = 0.0f; /* also where nothing moves: 0 / 0 is not larger */
    if (whiteness->time >= LEAST) {
        for (uint32_t k = 0u; k < LAGS; k++) {
            largest = greater(fabsf(whiteness->product[k]) / whiteness->variance, largest);
        }
    }
    return largest;
}

void whiteness_step(whiteness_t *whiteness, float period, bool counts)
{
    const float sum = whiteness->sum;
    whiteness->sum = 0.0f;
    if (counts) {
        whiteness->time = lesser(whiteness->time + period, MEMORY);
        const float share = period / whiteness->time;
        whiteness->variance += share * ((sum * sum) - whiteness->variance);
        for (uint32_t k = 0u; k < LAGS; k++) {
            whiteness->product[k] += share * ((sum * whiteness->before[k]) - whiteness->product[k]);
        }
        for (uint32_t k = LAGS - 1u; k > 0u; k--) {
            whiteness->before[k] = whiteness->before[k - 1u];
        }
        whiteness->before[0] = sum;
        whiteness->coloured = (whiteness_correlation(whiteness) > (whiteness->coloured ? WHITE : COLOURED));
    }
}
