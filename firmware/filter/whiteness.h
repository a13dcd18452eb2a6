/* Whether the innovations are white, which those of a filter with the right model are (Kailath 1968).
 *
 * At 1 kHz what a wrong model leaves over is far below the noise of a sample: NIS does not see it. It stays alike for
 * some time, which the noise does not: so innovations are averaged over a block, and blocks correlated with those
 * before them. Where innovations are smaller than expected, as of sensors that are quieter than stated, the correlation
 * is over the expected variance: so small, it is no fault of the model. Seen by it: torque that nobody knows below some 10 Hz, an arm of another order. Not seen: errors that
 * the parameters can take up, of gain, of delay, of friction.
 */
#ifndef FILTER_WHITENESS_H
#define FILTER_WHITENESS_H

enum { WHITENESS_LAGS = 4 }; /* blocks of 20 ms: 20 to 80 ms */

typedef struct whiteness {
    float sum;                     /* of this block's normalised innovations */
    float count;                   /* of them */
    float elapsed;                 /* since it began [s] */
    float before[WHITENESS_LAGS];  /* sums of the last blocks, the latest first */
    float variance;                /* mean square of a sum, */
    float expected;                /* and what is expected of it: the mean number of innovations in one */
    float product[WHITENESS_LAGS]; /* mean product of a sum and that so many blocks before */
    float time;                    /* that these means are made of, up to their memory [s] */
} whiteness_t;

void whiteness_start(whiteness_t *whiteness);

#define WHITENESS_BLOCK 0.0195f /* [s] */

void whiteness_end_block(whiteness_t *whiteness);

/* Adds a normalised innovation of a sample in flight, `elapsed` seconds after the last. */
static inline void whiteness_add(whiteness_t *whiteness, float innovation, float elapsed)
{
    whiteness->sum += innovation;
    whiteness->count += 1.0f;
    whiteness->elapsed += elapsed;
    if (whiteness->elapsed > WHITENESS_BLOCK) {
        whiteness_end_block(whiteness);
    }
}

/* Largest correlation, 0 before enough has been seen. */
float whiteness_correlation(const whiteness_t *whiteness);

#endif
