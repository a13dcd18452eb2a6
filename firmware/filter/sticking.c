#include "filter/sticking.h"

#include "math/bounds.h"

#include <math.h>

#define STICKING_MEMORY 4.0f /* [s] */
#define STILL_MOST 1.0f      /* a longer standstill is no part of the motion [s] */
#define PART 0.2f            /* of the rms rate: below it the lever is at standstill */
#define GAUSSIAN 0.8f /* sqrt(2 / pi): part of Gaussian motion below a rate, over that rate in standard deviations */

void sticking_end_block(sticking_t *sticking)
{
    if (sticking->motion > 0.0f) {
        const float mean = sticking->sum / sticking->count;
        const float noise = sticking->noise / sticking->count;
        const float slow = ((PART * PART) * sticking->motion) + noise;
        if ((mean * mean) < slow) {
            sticking->still += sticking->elapsed;
        } else {
            const float still = (sticking->still < STILL_MOST) ? sticking->still : 0.0f;
            const float since = still + sticking->elapsed;
            const float expected = GAUSSIAN * sqrtf(slow / (sticking->motion + noise));
            sticking->time = lesser(sticking->time + since, STICKING_MEMORY);
            sticking->excess += ((still / expected) - (since * (1.0f + sticking->excess))) / sticking->time;
            sticking->still = 0.0f;
        }
    }
    sticking->sum = 0.0f;
    sticking->count = 0.0f;
    sticking->elapsed = 0.0f;
}

float sticking_judge(sticking_t *sticking, float motion, float noise, bool moves)
{
    sticking->motion = moves ? motion : 0.0f;
    sticking->noise = noise * noise;
    return sticking->excess * sqrtf(sticking->time * (1.0f / STICKING_MEMORY));
}
