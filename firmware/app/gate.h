/* The gate that refuses single samples: a value far outside of what is expected is refused until it has been so for
 * GATE_TIME, and believed from then on. For outputs the innovation is expected, for inputs the usual change. */
#ifndef APP_GATE_H
#define APP_GATE_H

#include "math/bounds.h"
#include "math/share.h"

#include <stdbool.h>

#define GATE_SIGMA 8.0f      /* standard deviations */
#define GATE_TIME 0.02f      /* [s] */
#define GATE_MEMORY 1.0f     /* of the usual change of an input [s] */
#define GATE_COUNTED 0.0625f /* part of the limit that a refused change counts as, so that it hardly raises the mean */

/* Time for which samples have been refused [s]. Returns true while this one is. */
static inline bool gate_refuses(float *refused, bool far, float elapsed)
{
    *refused = far ? (*refused + elapsed) : 0.0f;
    return far && (*refused < GATE_TIME);
}

/* How an input changes from sample to sample. */
typedef struct input_gate {
    float limit;   /* square of the change that is refused */
    float sum;     /* squares of the changes in this block */
    float refused; /* [s] */
} input_gate_t;

/* An input that has changed by `change` since it was believed last, `elapsed` seconds after the last sample. */
static inline bool input_gate_step(input_gate_t *gate, float change, float elapsed)
{
    const float square = change * change;
    const bool far = (square > gate->limit);
    gate->sum += far ? (GATE_COUNTED * gate->limit) : square;
    return gate_refuses(&gate->refused, far, elapsed);
}

/* After a block of `period` seconds of samples `sample_period` apart; `least`: square of a change that does no harm. */
static inline void input_gate_end_block(input_gate_t *gate, float least, float period, float sample_period)
{
    const float each = (GATE_SIGMA * GATE_SIGMA) * (sample_period / period);
    gate->limit += share_of(period, GATE_MEMORY) * (((each * gate->sum) + least) - gate->limit);
    gate->sum = 0.0f;
}

#endif
