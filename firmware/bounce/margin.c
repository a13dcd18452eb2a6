#include "bounce/margin.h"

#include "filter/derived.h"
#include "filter/trim.h"
#include "math/exponential.h"
#include "model/base_motion.h"

#include <math.h>

#define MARGIN_MOST 40.0f    /* where L does not cross the positive real axis, or not far from 0 [dB] */
#define LEAST_HEIGHT 0.01f   /* of L on the real axis: MARGIN_MOST */
#define DECIBELS 8.68588964f /* 20 / ln(10) */
#define SECANTS 4u           /* to find a crossing, */
#define CHORDS 2u            /* and that of a loop which is little different */
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
    float angle; /* of the trim, for a base that moves [rad] */
    float phase; /* by which P is off [rad] */
} loop_t;

/* A point of L, by its place in the table. */
typedef struct point {
    float place;
    float frequency; /* [Hz] */
    derived_complex_t value;
} point_t;

/* The margins of one loop. */
typedef struct limits {
    float height; /* of L on the real axis, at least LEAST_HEIGHT */
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

/* The arm's response; that of a trunk on its seat, or of a hand that is damped in space, is longer. */
static derived_complex_t arm_at(const loop_t *loop, float frequency)
{
    const model_dynamics_t *dynamics = &loop->dynamics;
    derived_complex_t arm;
    if ((loop->constants->seat_stiffness > 0.0f) || (dynamics->space > 0.0f)) {
        arm = derived_response(dynamics, loop->constants, loop->angle, frequency);
    } else {
        const float omega = HIGH_PASS_TURN * frequency;
        const float real = dynamics->stiffness - (omega * omega);
        const float imaginary = dynamics->damping * omega;
        const float scale = dynamics->forcing / ((real * real) + (imaginary * imaginary));
        arm.real = scale * real;
        arm.imaginary = -(scale * imaginary);
    }
    return arm;
}

/* The interval of the table in which a place is, or next to which. */
static uint32_t interval_at(const lever_aircraft_t *aircraft, float place)
{
    const uint32_t last = (uint32_t)aircraft->count - 2u;
    uint32_t i = (place > 0.0f) ? (uint32_t)place : 0u;
    i = (i < last) ? i : last;
    return (i < LAST_INTERVAL) ? i : LAST_INTERVAL; /* whatever has become of the caller's table */
}

static float frequency_at(const lever_aircraft_t *aircraft, float place)
{
    const uint32_t i = interval_at(aircraft, place);
    return between(aircraft->frequency[i], aircraft->frequency[i + 1u], place - (float)i);
}

/* L at a place of the table, which need not be whole, nor quite inside. */
static point_t point_at(const loop_t *loop, float place)
{
    const lever_aircraft_t *aircraft = loop->aircraft;
    const uint32_t i = interval_at(aircraft, place);
    const float part = place - (float)i;
    const float frequency = between(aircraft->frequency[i], aircraft->frequency[i + 1u], part);
    const derived_complex_t response = {between(aircraft->real[i], aircraft->real[i + 1u], part),
        between(aircraft->imaginary[i], aircraft->imaginary[i + 1u], part)};
    const derived_complex_t value = product(response, arm_at(loop, frequency));
    const point_t point = {
        place, frequency, {value.real - (loop->phase * value.imaginary), value.imaginary + (loop->phase * value.real)}};
    return point;
}

static float distance_square(const point_t *point)
{
    const float real = 1.0f - point->value.real;
    return (real * real) + (point->value.imaginary * point->value.imaginary);
}

/* A place inside the table. */
static float inside(const loop_t *loop, float place)
{
    const float last = (float)loop->aircraft->count - 1.0f;
    const float above = (place > 0.0f) ? place : 0.0f;
    return (above < last) ? above : last;
}

/* Where L is real, by secants from `place`. */
static point_t crossing_near(const loop_t *loop, float place)
{
    point_t before = point_at(loop, (place < 1.0f) ? (place + FIRST_STEP) : (place - FIRST_STEP));
    point_t now = point_at(loop, place);
    for (uint32_t i = 0u; i < SECANTS; i++) {
        const float change = now.value.imaginary - before.value.imaginary;
        const float step = (fabsf(change) > LEAST_CHANGE) ? ((now.place - before.place) / change) : 0.0f;
        const float next = inside(loop, now.place - (step * now.value.imaginary));
        before = now;
        now = point_at(loop, next);
    }
    return now;
}

/* A parabola through |1 - L|^2 at a place and `reach` to both sides of it. */
typedef struct parabola {
    float place;  /* of its vertex, within `reach` */
    float square; /* there */
    float bend;   /* second difference */
} parabola_t;

/* Its vertex, where the middle is `middle`, and the first and second differences are known. */
static parabola_t parabola_of(float place, float reach, float middle, float slope, float bend)
{
    float step = (bend > 0.0f) ? -(slope / bend) : 0.0f;
    step = (step > 1.0f) ? 1.0f : step;
    step = (step < -1.0f) ? -1.0f : step;
    const parabola_t parabola = {place + (reach * step), middle + (step * (slope + (0.5f * step * bend))), bend};
    return parabola;
}

static parabola_t parabola_near(const loop_t *loop, float place)
{
    float d[3];
    for (uint32_t i = 0u; i < 3u; i++) {
        const point_t point = point_at(loop, place + (FINE * ((float)i - 1.0f)));
        d[i] = distance_square(&point);
    }
    return parabola_of(place, FINE, d[1], 0.5f * (d[2] - d[0]), (d[2] - d[1]) - (d[1] - d[0]));
}

/* Where in the table the margins of a loop are, and how L runs there. */
typedef struct places {
    bool crosses;
    float crossing;
    derived_complex_t slope; /* of L there, per point of the table */
    float nearest;           /* to the critical point */
    float bend;              /* of |1 - L|^2 there, over FINE */
} places_t;

/* L at a point of the table. */
static point_t tabulated(const loop_t *loop, uint32_t i)
{
    const lever_aircraft_t *aircraft = loop->aircraft;
    const derived_complex_t response = {aircraft->real[i], aircraft->imaginary[i]};
    const point_t point = {(float)i, aircraft->frequency[i], product(response, arm_at(loop, aircraft->frequency[i]))};
    return point;
}

/* Where L crosses the real axis highest, on a straight line between two points of the table, and where it is nearest to
 * the critical point, on a parabola through three of them. */
static places_t places_of(const loop_t *loop)
{
    places_t places = {.nearest = 1.0f};
    float highest = LEAST_HEIGHT;
    float least = 0.0f;
    float square[2] = {0.0f, 0.0f};
    point_t before = tabulated(loop, 0u);
    square[1] = distance_square(&before);
    for (uint32_t i = 1u; i < loop->aircraft->count; i++) {
        const point_t point = tabulated(loop, i);
        const float next = distance_square(&point);
        if ((i > 1u) && ((i == 2u) || (square[1] < least))) {
            const float bend = (next - square[1]) - (square[1] - square[0]);
            least = square[1];
            places.nearest = parabola_of((float)i - 1.0f, 1.0f, least, 0.5f * (next - square[0]), bend).place;
        }
        if ((point.value.imaginary > 0.0f) != (before.value.imaginary > 0.0f)) {
            const float part = before.value.imaginary / (before.value.imaginary - point.value.imaginary);
            const float height = between(before.value.real, point.value.real, part);
            if (height > highest) {
                highest = height;
                places.crosses = true;
                places.crossing = before.place + part;
            }
        }
        square[0] = square[1];
        square[1] = next;
        before = point;
    }
    return places;
}

static limits_t limits_of(float height, float frequency, float square)
{
    const float distance = sqrtf((square > 0.0f) ? square : 0.0f);
    const limits_t limits = {
        (height > LEAST_HEIGHT) ? height : LEAST_HEIGHT, (height > 1.0f) ? -distance : distance, frequency};
    return limits;
}

/* Those of the loop at the estimate; finds the places closely. */
static limits_t limits_at(const loop_t *loop, places_t *places)
{
    const parabola_t fine = parabola_near(loop, places->nearest);
    float frequency = frequency_at(loop->aircraft, fine.place);
    float height = 0.0f;
    if (places->crosses) {
        const point_t at = crossing_near(loop, places->crossing);
        const float side = (at.place < 1.0f) ? FIRST_STEP : -FIRST_STEP;
        const point_t beside = point_at(loop, at.place + side);
        places->crossing = at.place;
        places->slope.real = (beside.value.real - at.value.real) / side;
        places->slope.imaginary = (beside.value.imaginary - at.value.imaginary) / side;
        height = at.value.real;
        frequency = at.frequency;
    }
    places->nearest = fine.place;
    places->bend = fine.bend;
    return limits_of(height, frequency, fine.square);
}

/* Those of a loop that is little different: it runs as the one at the estimate does, and is nearest to the critical
 * point about where that would be, moved along with the crossing. */
static limits_t limits_near(const loop_t *loop, const places_t *places)
{
    float height = 0.0f;
    float moved = 0.0f;
    if (places->crosses && (fabsf(places->slope.imaginary) > LEAST_CHANGE)) {
        for (uint32_t i = 0u; i < CHORDS; i++) {
            const float place = places->crossing + moved;
            const point_t point = point_at(loop, place);
            const float next = inside(loop, place - (point.value.imaginary / places->slope.imaginary));
            height = point.value.real + ((next - place) * places->slope.real);
            moved = next - places->crossing;
        }
    }
    const float middle = inside(loop, places->nearest + moved);
    const point_t below = point_at(loop, middle - FINE);
    const point_t above = point_at(loop, middle + FINE);
    const float lower = distance_square(&below);
    const float upper = distance_square(&above);
    const parabola_t fine =
        parabola_of(middle, FINE, 0.5f * ((lower + upper) - places->bend), 0.5f * (upper - lower), places->bend);
    const float place = places->crosses ? (places->crossing + moved) : fine.place;
    return limits_of(height, frequency_at(loop->aircraft, place), fine.square);
}

/* Those of the loop when it is louder by a factor. */
static limits_t limits_louder(const loop_t *loop, const places_t *places, const limits_t *at, float factor)
{
    point_t point = point_at(loop, places->nearest);
    point.value.real *= factor;
    point.value.imaginary *= factor;
    return limits_of(at->height * factor, at->frequency, distance_square(&point));
}

/* By how much a loop of that height is louder than that at the estimate [dB]: 20 log10 of the quotient, by the first
 * term of its series, which is good for 1 % up to 3 dB. */
static float louder_by(float height, float at)
{
    return (2.0f * DECIBELS) * ((height - at) / (height + at));
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
    loop_t loop = {.aircraft = aircraft,
        .constants = constants,
        .dynamics = model->dynamics(constants, step, &cdkf->points[0]),
        .angle = base_motion_angle(constants, step),
        .phase = 0.0f};
    places_t places = places_of(&loop);
    const limits_t at = limits_at(&loop, &places);
    const limits_t louder = limits_louder(&loop, &places, &at, 1.0f + aircraft->gain_sigma);
    loop.phase = aircraft->phase_sigma;
    const limits_t later = limits_near(&loop, &places);
    loop.phase = 0.0f;
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        loop.dynamics = model->dynamics(constants, step, &cdkf->points[k]);
        const limits_t limits = (k == 0u) ? at : limits_near(&loop, &places);
        gain_and_frequency[k].first = louder_by(limits.height, at.height);
        gain_and_frequency[k].second = limits.frequency;
        modulus[k].first = limits.modulus;
        modulus[k].second = 0.0f;
    }
    const derived_couple_t sigma = derived_sigma(cdkf, gain_and_frequency);
    const derived_couple_t modulus_sigma = derived_sigma(cdkf, modulus);
    const margin_t result = {.gain = (at.height > LEAST_HEIGHT) ? -(DECIBELS * logarithm(at.height)) : MARGIN_MOST,
        .gain_sigma = hypotenuse(sigma.first, louder_by(louder.height, at.height), louder_by(later.height, at.height)),
        .modulus = at.modulus,
        .modulus_sigma = hypotenuse(modulus_sigma.first, louder.modulus - at.modulus, later.modulus - at.modulus),
        .frequency = at.frequency,
        .frequency_sigma = hypotenuse(sigma.second, 0.0f, later.frequency - at.frequency)};
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
