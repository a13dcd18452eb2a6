/* Random numbers in double precision, the same in every run. */
#ifndef UNIT_MATH_RANDOM_H
#define UNIT_MATH_RANDOM_H

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
    const uint64_t bits = (source->state * 2685821657736338717ULL) >> 11;
    return ((double)bits + 0.5) / 9007199254740992.0;
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

static inline void random_floats(random_source_t *source, float *values, uint32_t count, double scale)
{
    for (uint32_t i = 0u; i < count; i++) {
        values[i] = (float)(scale * random_between(source, -1.0, 1.0));
    }
}

/* A factor [n x n] with diagonal in [1/2, 1], and rows below it. */
static inline void random_factor(random_source_t *source, float *s, uint32_t rows, uint32_t n)
{
    random_floats(source, s, rows * n, 1.0);
    for (uint32_t i = 0u; i < n; i++) {
        s[(i * n) + i] = (float)random_between(source, 0.5, 1.0);
        for (uint32_t j = i + 1u; j < n; j++) {
            s[(i * n) + j] = 0.0f;
        }
    }
}

#endif
