#include "bounce/margin.h"

#include "filter/derived.h"
#include "math/exponential.h"
#include "model/base_motion.h"

#include <math.h>

#define MARGIN_MOST 40.0f    /* where L does not cross the positive real axis, or not far from 0 [dB] */
#define LEAST_HEIGHT 0.01f   /* of L on the real axis: MARGIN_MOST */
#define DECIBELS 8.68588964f /* 20 / ln(10) */
#define SECANTS 5u           /* to find a crossing */
#define FIRST_STEP 0.1f      /* of them, in points of the table */
#define LEAST_CHANGE 1.0e-6f /* of the imaginary part that still says where to go */
#define FINE 0.25f           /* reach of the second parabola, likewise */
#define LAST_INTERVAL ((uint32_t)LEVER_AIRCRAFT_POINTS - 2u)
#define LEAST_POINTS 3u

/* A loop: the model at one sigma point, and what the aircraft's response is off by. */
typedef struct loop {
    const lever_aircraft_t *aircraft;
    const model_constants_t *constants;
    model_dynamics_t dynamics;
    float angle;          /* of the trim, for a base that moves [rad] */
    derived_complex_t by; /* factor of P */
} loop_t;

/* A point of L, by its place in the table. */
typedef struct point {
    float place;
    float frequency; /* [Hz] */
    derived_complex_t value;
} point_t;

/* The margins of one loop. */
typedef struct limits {
    float gain;
    float modulus;
    float frequency;
} limits_t;

static derived_complex_t product(derived_complex_t a, derived_complex_t b)
{
    const derived_complex_t result = {
        (a.real * b.real) - (a.imaginary * b.imaginary), (a.real * b.imaginary) + (a.imaginary * b.real)};
    return result;
}

static float between(float first, float second, float part)
{
    return first + (part * (second - first));
}

/* L at a place of the table, which need not be whole, nor quite inside. */
static point_t point_at(const loop_t *loop, float place)
{
    const lever_aircraft_t *aircraft = loop->aircraft;
    const uint32_t last = (uint32_t)aircraft->count - 2u;
    uint32_t i = (place > 0.0f) ? (uint32_t)place : 0u;
    i = (i < last) ? i : last;
    i = (i < LAST_INTERVAL) ? i : LAST_INTERVAL; /* whatever has become of the caller's table */
    const float part = place - (float)i;
    const float frequency = between(aircraft->frequency[i], aircraft->frequency[i + 1u], part);
    const derived_complex_t response = {between(aircraft->real[i], aircraft->real[i + 1u], part),
        between(aircraft->imaginary[i], aircraft->imaginary[i + 1u], part)};
    const derived_complex_t arm = derived_response(&loop->dynamics, loop->constants, loop->angle, frequency);
    const point_t point = {place, frequency, product(product(response, loop->by), arm)};
    return point;
}

static float distance_square(const point_t *point)
{
    const float real = 1.0f - point->value.real;
    return (real * real) + (point->value.imaginary * point->value.imaginary);
}

/* Where L is real, by secants from `place`; inside the table. */
static point_t crossing_near(const loop_t *loop, float place)
{
    const float last = (float)loop->aircraft->count - 1.0f;
    point_t before = point_at(loop, (place < (last - FIRST_STEP)) ? (place + FIRST_STEP) : (place - FIRST_STEP));
    point_t now = point_at(loop, place);
    for (uint32_t i = 0u; i < SECANTS; i++) {
        const float change = now.value.imaginary - before.value.imaginary;
        const float step = (fabsf(change) > LEAST_CHANGE) ? ((now.place - before.place) / change) : 0.0f;
        float next = now.place - (step * now.value.imaginary);
        next = (next > 0.0f) ? next : 0.0f;
        next = (next < last) ? next : last;
        before = now;
        now = point_at(loop, next);
    }
    return now;
}

/* The vertex of a parabola through |1 - L|^2 at a place and `reach` to both sides of it. */
typedef struct vertex {
    float place;
    float square;
} vertex_t;

static vertex_t vertex_near(const loop_t *loop, float place, float reach)
{
    float d[3];
    for (uint32_t i = 0u; i < 3u; i++) {
        const point_t point = point_at(loop, place + (reach * ((float)i - 1.0f)));
        d[i] = distance_square(&point);
    }
    const float slope = 0.5f * (d[2] - d[0]);
    const float bend = (d[2] - d[1]) - (d[1] - d[0]);
    float step = (bend > 0.0f) ? -(slope / bend) : 0.0f;
    step = (step > 1.0f) ? 1.0f : step;
    step = (step < -1.0f) ? -1.0f : step;
    const vertex_t vertex = {place + (reach * step), d[1] + (step * (slope + (0.5f * step * bend)))};
    return vertex;
}

/* The least |1 - L| about a point of the table inside it: first between its neighbours, then closely. */
static float modulus_near(const loop_t *loop, uint32_t at)
{
    const vertex_t coarse = vertex_near(loop, (float)at, 1.0f);
    const vertex_t fine = vertex_near(loop, coarse.place, FINE);
    return sqrtf((fine.square > 0.0f) ? fine.square : 0.0f);
}

/* Where in the table the margins of a loop are. */
typedef struct places {
    bool crosses;
    float crossing;
    uint32_t nearest; /* a point inside the table */
} places_t;

static places_t places_of(const loop_t *loop)
{
    places_t places = {false, 0.0f, 1u};
    float highest = LEAST_HEIGHT;
    float least = 0.0f;
    point_t before = {0.0f, 0.0f, {0.0f, 0.0f}};
    for (uint32_t i = 0u; i < loop->aircraft->count; i++) {
        const point_t point = point_at(loop, (float)i);
        const float square = distance_square(&point);
        const bool inside = (i > 0u) && ((i + 1u) < loop->aircraft->count);
        if (inside && ((i == 1u) || (square < least))) {
            least = square;
            places.nearest = i;
        }
        if ((i > 0u) && ((point.value.imaginary > 0.0f) != (before.value.imaginary > 0.0f))) {
            const float part = before.value.imaginary / (before.value.imaginary - point.value.imaginary);
            const float height = between(before.value.real, point.value.real, part);
            if (height > highest) {
                highest = height;
                places.crosses = true;
                places.crossing = (float)(i - 1u) + part;
            }
        }
        before = point;
    }
    return places;
}

static limits_t limits_at(const loop_t *loop, const places_t *places)
{
    limits_t limits = {MARGIN_MOST, modulus_near(loop, places->nearest), loop->aircraft->frequency[places->nearest]};
    if (places->crosses) {
        const point_t crossing = crossing_near(loop, places->crossing);
        const float height = (crossing.value.real > LEAST_HEIGHT) ? crossing.value.real : LEAST_HEIGHT;
        limits.gain = -DECIBELS * logarithm(height);
        limits.frequency = crossing.frequency;
        limits.modulus = (limits.gain < 0.0f) ? -limits.modulus : limits.modulus;
    }
    return limits;
}

static float hypotenuse(float a, float b, float c)
{
    return sqrtf((a * a) + ((b * b) + (c * c)));
}

margin_t margin_of(const lever_aircraft_t *aircraft, const cdkf_t *cdkf, const model_t *model,
    const model_constants_t *constants, const model_step_t *step)
{
    derived_couple_t gain_and_frequency[MODEL_POINTS];
    derived_couple_t modulus[MODEL_POINTS];
    places_t places = {false, 0.0f, 1u};
    loop_t loop = {.aircraft = aircraft,
        .constants = constants,
        .dynamics = model->dynamics(constants, step, &cdkf->points[0]),
        .angle = base_motion_angle(constants, step),
        .by = {1.0f, 0.0f}};
    places = places_of(&loop);
    const limits_t at = limits_at(&loop, &places);
    loop.by.real = 1.0f + aircraft->gain_sigma;
    const limits_t louder = limits_at(&loop, &places);
    loop.by.real = 1.0f;
    loop.by.imaginary = aircraft->phase_sigma;
    const limits_t later = limits_at(&loop, &places);
    loop.by.imaginary = 0.0f;
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        loop.dynamics = model->dynamics(constants, step, &cdkf->points[k]);
        const limits_t limits = limits_at(&loop, &places);
        gain_and_frequency[k].first = limits.gain;
        gain_and_frequency[k].second = limits.frequency;
        modulus[k].first = limits.modulus;
        modulus[k].second = 0.0f;
    }
    const derived_couple_t sigma = derived_sigma(cdkf, gain_and_frequency);
    const derived_couple_t modulus_sigma = derived_sigma(cdkf, modulus);
    const margin_t result = {.gain = at.gain,
        .gain_sigma = hypotenuse(sigma.first, louder.gain - at.gain, later.gain - at.gain),
        .modulus = at.modulus,
        .modulus_sigma = hypotenuse(modulus_sigma.first, louder.modulus - at.modulus, later.modulus - at.modulus),
        .frequency = at.frequency,
        .frequency_sigma = hypotenuse(sigma.second, louder.frequency - at.frequency, later.frequency - at.frequency)};
    return result;
}

static bool is_finite(float value)
{
    return fabsf(value) <= 3.0e38f; /* NaN is not */
}

bool margin_accepts(const lever_aircraft_t *aircraft)
{
    const uint32_t count = aircraft->count;
    bool accepted = (count >= LEAST_POINTS) && (count <= (uint32_t)LEVER_AIRCRAFT_POINTS);
    accepted = accepted && (aircraft->gain_sigma >= 0.0f) && (aircraft->gain_sigma <= 1.0f);
    accepted = accepted && (aircraft->phase_sigma >= 0.0f) && (aircraft->phase_sigma <= 1.0f);
    accepted = accepted && is_finite(aircraft->alarm) && (aircraft->warning >= aircraft->alarm) &&
               is_finite(aircraft->warning);
    float last = 0.0f;
    for (uint32_t i = 0u; accepted && (i < count); i++) {
        accepted = (aircraft->frequency[i] > last) && is_finite(aircraft->frequency[i]) &&
                   is_finite(aircraft->real[i]) && is_finite(aircraft->imaginary[i]);
        last = aircraft->frequency[i];
    }
    return accepted;
}
