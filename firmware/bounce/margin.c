#include "bounce/margin.h"

#include "filter/derived.h"
#include "math/bounds.h"
#include "math/exponential.h"
#include "math/trigonometry.h"
#include "model/base_motion.h"

#include <math.h>

#define MARGIN_MOST 40.0f    /* where L does not cross the positive real axis, or not far from 0 [dB] */
#define LEAST_HEIGHT 0.01f   /* of L on the real axis: MARGIN_MOST */
#define DECIBELS 8.68588964f /* 20 / ln(10) */
#define CHORDS_FIRST 4u      /* to find the crossing at the estimate, */
#define CHORDS 2u            /* and from there that of a loop which is little different */
#define LEAST_SLOPE 1.0e-6f  /* of the imaginary part that still says where to go */
#define SIDE 0.1f            /* for the slope there, in points of the table */
#define FINE 0.25f           /* reach of the parabola, in points of the table */
#define LAST_INTERVAL ((uint32_t)LEVER_AIRCRAFT_POINTS - 2u)
#define LEAST_POINTS 3u /* of the table of an aircraft */

/* A loop: the model at one sigma point, and what the aircraft's response is off by. */
typedef struct loop {
    const lever_aircraft_t *aircraft;
    const model_constants_t *constants;
    model_dynamics_t dynamics;
    float angle;          /* of the trim, for a base that moves [rad] */
    derived_complex_t by; /* factor of P */
} loop_t;

/* Where in the table a loop crosses the real axis, how it runs there, and where it is nearest to the critical point. */
typedef struct places {
    bool crosses;
    float crossing;
    derived_complex_t slope; /* of L there, per point of the table */
    float nearest;
} places_t;

/* The margins of one loop, and where it has them. */
typedef struct limits {
    float height; /* on the real axis, at least LEAST_HEIGHT */
    float modulus;
    float crossing;
    float nearest;
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

/* --- L at places of the table, which need not be whole, nor quite inside ------------------------------------------- */

static uint32_t interval_at(const lever_aircraft_t *aircraft, float place)
{
    const uint32_t last = (uint32_t)aircraft->count - 2u;
    const uint32_t i = (uint32_t)greater(place, 0.0f);
    return lesser_count(lesser_count(i, last), LAST_INTERVAL); /* whatever has become of the caller's table */
}

static float frequency_at(const lever_aircraft_t *aircraft, float place)
{
    const uint32_t i = interval_at(aircraft, place);
    return between(aircraft->frequency[i], aircraft->frequency[i + 1u], place - (float)i);
}

/* The arm's response; that of a trunk on its seat, or of a hand that is damped in space, takes longer. */
static derived_complex_t arm_at(const loop_t *loop, float frequency)
{
    const model_dynamics_t *dynamics = &loop->dynamics;
    derived_complex_t arm;
    if ((loop->constants->seat_stiffness > 0.0f) || (dynamics->space > 0.0f)) {
        arm = derived_response(dynamics, loop->constants, loop->angle, frequency);
    } else {
        const float omega = TURN * frequency;
        const float real = dynamics->stiffness - (omega * omega);
        const float imaginary = dynamics->damping * omega;
        const float scale = dynamics->forcing / ((real * real) + (imaginary * imaginary));
        arm.real = scale * real;
        arm.imaginary = -(scale * imaginary);
    }
    return arm;
}

static derived_complex_t loop_at(const loop_t *loop, float place)
{
    const lever_aircraft_t *aircraft = loop->aircraft;
    const uint32_t i = interval_at(aircraft, place);
    const float part = place - (float)i;
    const float frequency = between(aircraft->frequency[i], aircraft->frequency[i + 1u], part);
    const derived_complex_t response = {between(aircraft->real[i], aircraft->real[i + 1u], part),
        between(aircraft->imaginary[i], aircraft->imaginary[i + 1u], part)};
    return product(product(response, loop->by), arm_at(loop, frequency));
}

static float distance_square(derived_complex_t value)
{
    const float real = 1.0f - value.real;
    return (real * real) + (value.imaginary * value.imaginary);
}

/* --- margins of a loop -------------------------------------------------------------------------------------------- */

/* From a place to where L is real, if it goes on by the slope that is known. */
static float step_of(const loop_t *loop, const places_t *places, float place, derived_complex_t value)
{
    const bool steep = (fabsf(places->slope.imaginary) > LEAST_SLOPE);
    const float to = steep ? (place - (value.imaginary / places->slope.imaginary)) : place;
    const float last = (float)loop->aircraft->count - 1.0f;
    return lesser(greater(to, 0.0f), last) - place;
}

/* The points of the table between which L crosses the real axis highest, and about which it is nearest. */
static places_t places_of(const loop_t *loop)
{
    places_t places = {.nearest = 1.0f};
    float highest = LEAST_HEIGHT;
    float least = 0.0f;
    derived_complex_t before = loop_at(loop, 0.0f);
    for (uint32_t i = 1u; i < loop->aircraft->count; i++) {
        const derived_complex_t value = loop_at(loop, (float)i);
        const float square = distance_square(value);
        if (((i + 1u) < loop->aircraft->count) && ((i == 1u) || (square < least))) {
            least = square;
            places.nearest = (float)i;
        }
        if ((value.imaginary > 0.0f) != (before.imaginary > 0.0f)) {
            const float part = before.imaginary / (before.imaginary - value.imaginary);
            const float height = between(before.real, value.real, part);
            if (height > highest) {
                highest = height;
                places.crosses = true;
                places.crossing = ((float)i - 1.0f) + part;
                places.slope.imaginary = value.imaginary - before.imaginary;
            }
        }
        before = value;
    }
    return places;
}

/* The crossing at the estimate, by chords of the straight line between two points of the table; afterwards the places are
 * there, with the slope of L itself. */
static void find_crossing(const loop_t *loop, places_t *places)
{
    derived_complex_t value = {0.0f, 0.0f};
    for (uint32_t i = 0u; i < CHORDS_FIRST; i++) {
        value = loop_at(loop, places->crossing);
        places->crossing += step_of(loop, places, places->crossing, value);
    }
    value = loop_at(loop, places->crossing);
    const float side = (places->crossing < 1.0f) ? SIDE : -SIDE;
    const derived_complex_t beside = loop_at(loop, places->crossing + side);
    places->slope.real = (beside.real - value.real) / side;
    places->slope.imaginary = (beside.imaginary - value.imaginary) / side;
}

/* Height and place of the crossing of a loop that is little different, by chords. */
static void follow_crossing(const loop_t *loop, const places_t *places, limits_t *limits)
{
    limits->height = LEAST_HEIGHT;
    limits->crossing = places->crossing;
    for (uint32_t i = 0u; places->crosses && (i < CHORDS); i++) {
        const derived_complex_t value = loop_at(loop, limits->crossing);
        const float step = step_of(loop, places, limits->crossing, value);
        const float height = value.real + (step * places->slope.real);
        limits->height = greater(height, LEAST_HEIGHT);
        limits->crossing += step;
    }
}

/* The least |1 - L|, by a parabola through its square at a place and `reach` to both sides of it. */
static void find_nearest(const loop_t *loop, float place, float reach, limits_t *limits)
{
    float d[3];
    for (uint32_t i = 0u; i < 3u; i++) {
        d[i] = distance_square(loop_at(loop, place + (reach * ((float)i - 1.0f))));
    }
    const float slope = 0.5f * (d[2] - d[0]);
    const float bend = (d[2] - d[1]) - (d[1] - d[0]);
    const float step = (bend > 0.0f) ? clamped(-(slope / bend), 1.0f) : 0.0f;
    const float square = d[1] + (step * (slope + (0.5f * step * bend)));
    const float modulus = sqrtf(greater(square, 0.0f));
    limits->modulus = (limits->height > 1.0f) ? -modulus : modulus;
    limits->nearest = place + (reach * step);
}

/* Those of a loop that is little different from the one at the estimate: where it is nearest to the critical point has
 * moved along with the crossing. */
static limits_t limits_near(const loop_t *loop, const places_t *places)
{
    limits_t limits;
    follow_crossing(loop, places, &limits);
    find_nearest(loop, places->nearest + (limits.crossing - places->crossing), FINE, &limits);
    return limits;
}

/* Those of the loop at the estimate; afterwards the places are where it has them. */
static limits_t limits_at(const loop_t *loop, places_t *places)
{
    limits_t limits = {.height = 0.0f};
    if (places->crosses) {
        find_crossing(loop, places);
    }
    find_nearest(loop, places->nearest, 1.0f, &limits);
    places->nearest = limits.nearest;
    limits = limits_near(loop, places);
    places->nearest = limits.nearest;
    return limits;
}

/* --- with standard deviations ------------------------------------------------------------------------------------- */

/* Where a loop becomes unstable, or without a crossing is nearest to that. */
static float critical_frequency(const loop_t *loop, const places_t *places, const limits_t *limits)
{
    return frequency_at(loop->aircraft, places->crosses ? limits->crossing : limits->nearest);
}

/* By how much a loop of that height is louder than that at the estimate [dB]: 20 log10 of the quotient, by the first
 * term of its series, which is good for 1 % up to 3 dB. */
static float louder_by(const limits_t *limits, const limits_t *at)
{
    return (2.0f * DECIBELS) * ((limits->height - at->height) / (limits->height + at->height));
}

static float hypotenuse(float a, float b, float c)
{
    return sqrtf((a * a) + ((b * b) + (c * c)));
}

static bool is_small(derived_complex_t value)
{
    return ((value.real * value.real) + (value.imaginary * value.imaginary)) <= (LEAST_HEIGHT * LEAST_HEIGHT);
}

/* Where L does not cross within the table it may beyond it, unless it has become small there. NaN has not. */
static float hidden_beyond(const loop_t *loop)
{
    const float last = (float)loop->aircraft->count - 1.0f;
    return (is_small(loop_at(loop, 0.0f)) && is_small(loop_at(loop, last))) ? 0.0f : MARGIN_MOST;
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
        .by = {1.0f, 0.0f}};
    places_t places = places_of(&loop);
    const limits_t at = limits_at(&loop, &places);
    const float hidden = places.crosses ? 0.0f : hidden_beyond(&loop);
    const float frequency = critical_frequency(&loop, &places, &at);
    loop.by.real = 1.0f + aircraft->gain_sigma;
    const limits_t louder = limits_near(&loop, &places);
    loop.by.real = 1.0f;
    loop.by.imaginary = aircraft->phase_sigma;
    const limits_t later = limits_near(&loop, &places);
    loop.by.imaginary = 0.0f;
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        loop.dynamics = model->dynamics(constants, step, &cdkf->points[k]);
        const limits_t limits = (k == 0u) ? at : limits_near(&loop, &places);
        gain_and_frequency[k].first = louder_by(&limits, &at);
        gain_and_frequency[k].second = critical_frequency(&loop, &places, &limits);
        modulus[k].first = limits.modulus;
        modulus[k].second = 0.0f;
    }
    const derived_couple_t sigma = derived_sigma(cdkf, gain_and_frequency);
    const derived_couple_t modulus_sigma = derived_sigma(cdkf, modulus);
    const float by_phase = critical_frequency(&loop, &places, &later) - frequency;
    const margin_t result = {.gain = (at.height > LEAST_HEIGHT) ? -(DECIBELS * logarithm(at.height)) : MARGIN_MOST,
        .gain_sigma = hidden + hypotenuse(sigma.first, louder_by(&louder, &at), louder_by(&later, &at)),
        .arm_sigma = hidden + sigma.first,
        .modulus = at.modulus,
        .modulus_sigma = hypotenuse(modulus_sigma.first, louder.modulus - at.modulus, later.modulus - at.modulus),
        .frequency = frequency,
        .frequency_sigma = hypotenuse(sigma.second, 0.0f, by_phase)};
    return result;
}

bool margin_accepts(const lever_aircraft_t *aircraft)
{
    const uint32_t count = aircraft->count;
    bool accepted = (count >= LEAST_POINTS) && (count <= (uint32_t)LEVER_AIRCRAFT_POINTS);
    accepted = accepted && (aircraft->gain_sigma >= 0.0f) && (aircraft->gain_sigma <= 1.0f);
    accepted = accepted && (aircraft->phase_sigma >= 0.0f) && (aircraft->phase_sigma <= 1.0f);
    accepted = accepted && is_finite(aircraft->alarm) && (aircraft->warning >= aircraft->alarm) &&
               is_finite(aircraft->warning);
    accepted = accepted && (aircraft->seat_modes <= (uint8_t)LEVER_SEAT_MODES) && is_finite(aircraft->seat_direct);
    for (uint32_t i = 0u; accepted && (i < aircraft->seat_modes); i++) {
        const lever_seat_mode_t *mode = &aircraft->seat[i];
        accepted = (mode->damping > 0.0f) && is_finite(mode->damping) && (mode->stiffness > 0.0f) &&
                   is_finite(mode->stiffness) && is_finite(mode->by_rate) && is_finite(mode->by_place);
    }
    float last = 0.0f;
    for (uint32_t i = 0u; accepted && (i < count); i++) {
        accepted = (aircraft->frequency[i] > last) && is_finite(aircraft->frequency[i]) &&
                   is_finite(aircraft->real[i]) && is_finite(aircraft->imaginary[i]);
        last = aircraft->frequency[i];
    }
    return accepted;
}
