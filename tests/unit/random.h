/* Random numbers in double precision, the same in every run. */
#ifndef UNIT_RANDOM_H
#define UNIT_RANDOM_H

#include <math.h>
#include <stdint.h>

typedef struct random_source {
    uint64_t state; /* any but 0 */
} random_source_t;

/* Uniform in (0, 1): xorshift64* (Vigna 2016). */
static inline double random_unit(random_source_t *source)
{
    source->state ^= source->state >> 12;
    source->state ^= source->state << 25;
    source->state ^= source->state >> 27;
    return ((double)((source->state * 2685821657736338717ULL) >> 11) + 0.5) / 9007199254740992.0;
}

static inline double random_between(random_source_t *source, double least, double greatest)
{
    return least + ((greatest - least) * random_unit(source));
}

/* Normal with mean 0 and variance 1 (Box & Muller 1958). */
static inline double random_normal(random_source_t *source)
{
    const double radius = sqrt(-2.0 * log(random_unit(source)));
    return radius * cos(6.283185307179586 * random_unit(source));
}

#endif
