/* Whether friction holds the lever between its motions (stick-slip). The model knows no standstill, and would learn
 * damping from it.
 *
 * Of Gaussian motion a part of about 0.8 r / sigma is slower than r, where r is well below the standard deviation sigma
 * of the rate; of a lever that sticks, more is. Here the rate is the mean over 20 ms, and r a fifth of the rms rate,
 * with the noise of the sensor besides. Not seen: a sinusoid, of which less is slow; motion not much larger than the
 * noise of such a mean; friction that damps, but does not hold. */
#ifndef FILTER_STICKING_H
#define FILTER_STICKING_H

#include <stdbool.h>

#define STICKING_BLOCK 0.0195f /* [s] */

/* All of it 0 at the start. */
typedef struct sticking {
    float sum;     /* of the rates of this block [rad/s] */
    float count;   /* of them */
    float elapsed; /* since it began [s] */
    float motion;  /* mean square of the rate without noise [rad^2/s^2]; 0 where blocks do not count */
    float noise;   /* variance of the sensor's noise, likewise */
    float still;   /* time at standstill, until it moves again [s] */
    float time;    /* that the excess is of, up to its memory [s] */
    float excess;  /* mean part of the time at standstill over that of Gaussian motion, less 1 */
} sticking_t;

void sticking_end_block(sticking_t *sticking);

/* A measured rate [rad/s], with its slow part, `elapsed` seconds after the last. */
static inline void sticking_add(sticking_t *sticking, float rate, float elapsed)
{
    sticking->sum += rate;
    sticking->count += 1.0f;
    sticking->elapsed += elapsed;
    if (sticking->elapsed > STICKING_BLOCK) {
        sticking_end_block(sticking);
    }
}

/* What is to be known of the motion; `moves`: blocks count. Returns the excess, less where it is of a shorter time, as
 * chance is larger then: in flight 0.05 +- 0.1, of a lever that sticks 1 to 2.5. */
float sticking_judge(sticking_t *sticking, float motion, float noise, bool moves);

#endif
