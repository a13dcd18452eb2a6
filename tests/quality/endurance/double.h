/* Read before every file of the core: makes it compute in double precision, with libm's functions for its own. */
#ifndef ENDURANCE_DOUBLE_H
#define ENDURANCE_DOUBLE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define MATH_EXPONENTIAL_H /* instead of these two headers: */
#define MATH_TRIGONOMETRY_H

#define TURN 6.283185307179586

static inline double exponential(double x)
{
    return exp(x);
}

static inline double logarithm(double x)
{
    return log(x);
}

typedef struct sine_cosine {
    double sine;
    double cosine;
} sine_cosine_t;

static inline sine_cosine_t sine_cosine(double angle)
{
    const sine_cosine_t result = {sin(angle), cos(angle)};
    return result;
}

static inline sine_cosine_t sine_cosine_small(double angle)
{
    return sine_cosine(angle);
}

#define float double
#define sqrtf sqrt
#define fabsf fabs

#endif
