/* The margins of a loop against a search through it in double precision. The loops are made up: where they cross the
 * real axis, and how, is what the tests are about. */
#include "app/instance.h"
#include "bounce/margin.h"

#include <complex.h>
#include <math.h>

#include "test.h"

#define FULL_TURN 6.283185307179586
#define IMAGINARY ((double complex)I)
#define TRIM 0.34906585
#define FINE 1000u

enum { POINTS = LEVER_AIRCRAFT_POINTS };

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static lever_aircraft_t aircraft;
static double complex wanted[POINTS]; /* L at the points of the table */

/* An estimator at rest, of one arm that it is almost certain of, but for its stiffness. */
static void start_with(float seat_frequency, float k_p_sigma)
{
    lever_config_default(&config);
    config.settings.m_p_sigma = 1.0e-3f;
    config.settings.c_p_sigma = 1.0e-3f;
    config.settings.k_p_sigma = k_p_sigma;
    config.settings.seat_frequency = seat_frequency;
    lever = lever_init(&memory, &config);
    for (uint32_t k = 0u; k < 3u; k++) {
        const lever_sample_t sample = {.time_us = 1000u * k,
            .theta = (float)TRIM,
            .theta_valid = true,
            .theta_dot_valid = true,
            .tau_m_valid = true,
            .z_ddot_valid = true};
        (void)lever_update(lever, &sample);
    }
}

static void start(float seat_frequency)
{
    start_with(seat_frequency, 1.0e-3f);
}

/* As firmware/THEORY.md has it. */
static double complex arm_at(double frequency)
{
    const lever_settings_t *s = &config.settings;
    const double rise = (double)s->lever_length * cos(TRIM);
    const double inertia = 0.020 + (0.225 * 0.225 * 1.2) + (0.45 * 0.45 * (double)s->m_p);
    const double complex at = IMAGINARY * FULL_TURN * frequency;
    const double complex held = rise * rise * ((double)s->k_p + (at * (double)s->c_p)) / inertia;
    const double seat = FULL_TURN * (double)s->seat_frequency;
    const double complex trunk = (at * at) + (2.0 * (double)s->seat_damping_ratio * seat * at) + (seat * seat);
    const double complex by_seat = (seat > 0.0) ? (held / (rise * trunk)) : 0.0;
    const double complex drive = -(rise * (0.6 + (double)s->m_p) / inertia) - by_seat;
    return drive / ((at * at) + (0.5 * at / inertia) + held + (5.0 / inertia));
}

/* The table with which the loop is `wanted` at its points. */
static void make_aircraft(void)
{
    aircraft = (lever_aircraft_t){.count = POINTS, .warning = 6.0f, .alarm = 3.0f};
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        const double frequency = 1.5 + (0.5 * (double)i);
        const double complex response = wanted[i] / arm_at(frequency);
        aircraft.frequency[i] = (float)frequency;
        aircraft.real[i] = (float)creal(response);
        aircraft.imaginary[i] = (float)cimag(response);
    }
}

/* L at a place of the table, by straight lines between the aircraft's points. */
static double complex loop_at(double place)
{
    const uint32_t i = (place < (double)(POINTS - 2)) ? (uint32_t)place : (uint32_t)(POINTS - 2);
    const double part = place - (double)i;
    const double complex first = (double)aircraft.real[i] + (IMAGINARY * (double)aircraft.imaginary[i]);
    const double complex second = (double)aircraft.real[i + 1u] + (IMAGINARY * (double)aircraft.imaginary[i + 1u]);
    return (first + (part * (second - first))) * arm_at(1.5 + (0.5 * place));
}

/* The highest crossing of the positive real axis, or where it is nearest to 1; gain and modulus as in margin_t. */
static margin_t searched(void)
{
    margin_t found = {.gain = 40.0f};
    double least = INFINITY;
    double nearest = 0.0;
    double highest = 0.01;
    double crossing = -1.0;
    double complex before = loop_at(0.0);
    for (uint32_t k = 0u; k <= ((POINTS - 1u) * FINE); k++) {
        const double place = (double)k / (double)FINE;
        const double complex value = loop_at(place);
        if (cabs(1.0 - value) < least) {
            least = cabs(1.0 - value);
            nearest = place;
        }
        if (((cimag(value) > 0.0) != (cimag(before) > 0.0)) && (creal(value) > highest)) {
            highest = creal(value);
            crossing = place;
        }
        before = value;
    }
    found.gain = (crossing >= 0.0) ? (float)(-20.0 * log10(highest)) : 40.0f;
    found.modulus = (float)((highest > 1.0) ? -least : least);
    found.frequency = (float)(1.5 + (0.5 * ((crossing >= 0.0) ? crossing : nearest)));
    return found;
}

static margin_t margin(void)
{
    return estimator_margin(&lever->estimator, &aircraft);
}

static void assert_as_searched(float frequency_within)
{
    const margin_t expected = searched();
    const margin_t found = margin();
    TEST_ASSERT_FLOAT_WITHIN(0.05f, expected.gain, found.gain);
    TEST_ASSERT_FLOAT_WITHIN(frequency_within, expected.frequency, found.frequency);
    TEST_ASSERT_FLOAT_WITHIN(0.02f, expected.modulus, found.modulus);
}

/* A turn about the origin that crosses the real axis at `place`, at that height. */
static void cross_at(double place, double height, double turn)
{
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        wanted[i] = height * cexp(IMAGINARY * turn * ((double)i - place)) / (1.0 + (0.02 * ((double)i - place)));
    }
    make_aircraft();
}

/* R42 */
TEST_EACH(3, a_crossing_anywhere_in_the_table_is_found)
{
    static const double places[] = {0.05, 0.5, 0.95, 1.0, 3.3, 7.0, 9.7, 16.1, 22.95};
    static const double heights[] = {0.012, 0.5, 0.9, 1.3};
    static const float seats[] = {0.0f, 4.5f, 0.1f};
    start(seats[test_round]);
    for (uint32_t k = 0u; k < (sizeof places / sizeof places[0]); k++) {
        for (uint32_t i = 0u; i < 4u; i++) {
            cross_at(places[k], heights[i], -0.2);
            assert_as_searched(0.01f);
        }
    }
}

/* Of two crossings the higher one counts, whichever comes first. */
TEST_EACH(2, the_highest_crossing_counts)
{
    start(0.0f);
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        const double x = (double)((test_round == 0u) ? i : (POINTS - 1u - i));
        wanted[i] = (0.7 - (0.02 * x)) + (IMAGINARY * 0.02 * (x - 3.4) * (x - 14.6));
    }
    make_aircraft();
    assert_as_searched(0.01f);
    TEST_ASSERT_FLOAT_WITHIN(0.1f, (test_round == 0u) ? 3.2f : 11.3f, margin().frequency);
}

/* R42 */
TEST(a_loop_without_a_crossing_has_the_greatest_margin_where_it_is_nearest)
{
    start(0.0f);
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        const double x = (double)i - 16.3;
        wanted[i] = (0.5 - (0.03 * x * x)) + (0.3 * IMAGINARY);
    }
    make_aircraft();
    assert_as_searched(0.2f); /* straight lines between points have corners, where a parabola has none */
    TEST_ASSERT_TRUE(margin().gain == 40.0f);
    cross_at((double)POINTS - 0.5, 0.5, -0.2); /* not in the table */
    TEST_ASSERT_TRUE(margin().gain == 40.0f);
    aircraft = (lever_aircraft_t){.count = POINTS, .warning = 6.0f}; /* it does nothing */
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        aircraft.frequency[i] = 1.5f + (0.5f * (float)i);
    }
    TEST_ASSERT_EQUAL_FLOAT(1.0f, margin().modulus);
}

/* R42 */
TEST(a_loop_that_may_cross_beyond_the_table_is_not_known_to_be_stable)
{
    for (uint32_t end = 0u; end < 3u; end++) {
        start(0.0f);
        for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
            wanted[i] = 0.005 * IMAGINARY;
        }
        make_aircraft();
        TEST_ASSERT_EQUAL_FLOAT(0.0f, margin().gain_sigma);
        const uint32_t at = (end == 0u) ? 0u : ((uint32_t)POINTS - 1u);
        aircraft.real[at] *= (end == 2u) ? 1.0e38f : 2.4f;
        aircraft.imaginary[at] *= (end == 2u) ? 1.0e38f : 2.4f;
        TEST_ASSERT_FALSE(margin().gain_sigma < 40.0f);
        TEST_ASSERT_TRUE((end == 2u) || (margin().gain_sigma < 40.001f));
        wanted[POINTS - 2] = ((end == 0u) ? 0.009 : 0.001) * IMAGINARY; /* it is the last point that counts */
        wanted[POINTS - 1] = ((end == 0u) ? 0.001 : 0.0105) * IMAGINARY;
        make_aircraft();
        TEST_ASSERT_EQUAL(end == 0u, margin().gain_sigma < 40.0f);
    }
}

/* By central differences of the search. */
TEST(an_uncertain_arm_makes_the_frequency_uncertain)
{
    float frequency[2];
    start_with(0.0f, 0.05f);
    cross_at(5.4, 0.5, -0.2);
    for (uint32_t i = 0u; i < 2u; i++) {
        const float k_p = config.settings.k_p;
        config.settings.k_p *= (i == 0u) ? 1.05f : (1.0f / 1.05f);
        frequency[i] = searched().frequency;
        config.settings.k_p = k_p;
    }
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.5f * fabsf(frequency[0] - frequency[1]), margin().frequency_sigma);
}

/* Then the slope does not say where to go. */
TEST(a_loop_along_the_real_axis_stays_where_it_is)
{
    start(0.0f);
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        wanted[i] = 0.5 + (IMAGINARY * ((i < 7u) ? 2.0e-7 : -2.0e-7));
    }
    make_aircraft();
    const margin_t found = margin();
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 6.02f, found.gain);
    TEST_ASSERT_TRUE((found.frequency >= 1.5f) && (found.frequency <= 13.0f));
    TEST_ASSERT_TRUE(isfinite(found.gain_sigma) && isfinite(found.frequency_sigma));
}

/* How uncertain aircraft and frequency are, at the end of the table where one of both sides is outside. */
TEST(what_the_aircraft_may_be_off_by_is_said_of_the_margin)
{
    start(0.0f);
    cross_at(5.4, 0.5, -0.2);
    const margin_t exact = margin();
    TEST_ASSERT_TRUE((exact.gain_sigma < 0.05f) && (exact.frequency_sigma < 0.01f));
    aircraft.gain_sigma = 0.1f;
    const margin_t by_gain = margin();
    TEST_ASSERT_FLOAT_WITHIN(0.02f, 0.83f, by_gain.gain_sigma);
    TEST_ASSERT_FLOAT_WITHIN(0.005f, 0.05f, by_gain.modulus_sigma);
    TEST_ASSERT_TRUE(by_gain.frequency_sigma < 0.01f);
    aircraft.gain_sigma = 0.0f;
    aircraft.phase_sigma = 0.1f;
    TEST_ASSERT_FLOAT_WITHIN(0.03f, 0.25f, margin().frequency_sigma); /* half a point */
    cross_at(0.1, 0.5, 0.2);
    aircraft.phase_sigma = 0.1f;
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.05f, margin().frequency_sigma); /* a tenth, to its end */
}

/* R42 */
TEST(a_table_is_accepted_to_the_last_of_its_limits)
{
    start(0.0f);
    cross_at(5.4, 0.5, -0.2);
    aircraft.gain_sigma = 0.0f;
    aircraft.phase_sigma = 1.0f;
    aircraft.warning = aircraft.alarm;
    TEST_ASSERT_TRUE(margin_accepts(&aircraft));
    aircraft.gain_sigma = 1.0f;
    aircraft.phase_sigma = 0.0f;
    aircraft.count = 3u;
    TEST_ASSERT_TRUE(margin_accepts(&aircraft));
    aircraft.frequency[0] = 0.5f;
    TEST_ASSERT_TRUE(margin_accepts(&aircraft));
    aircraft.frequency[0] = 0.0f;
    TEST_ASSERT_FALSE(margin_accepts(&aircraft));
    aircraft.frequency[0] = 0.5f;
    aircraft.real[0] = NAN;
    TEST_ASSERT_FALSE(margin_accepts(&aircraft));
    aircraft.real[0] = 1.0f;
    aircraft.seat_modes = 1u;
    aircraft.seat[0].damping = 0.1f;
    aircraft.seat[0].stiffness = 0.1f;
    TEST_ASSERT_TRUE(margin_accepts(&aircraft));
    aircraft.seat[0].damping = 0.0f;
    TEST_ASSERT_FALSE(margin_accepts(&aircraft));
    aircraft.seat[0].damping = 0.1f;
    aircraft.seat[0].stiffness = 0.0f;
    TEST_ASSERT_FALSE(margin_accepts(&aircraft));
    aircraft.seat_modes = 0u;
    for (uint32_t i = 0u; i < (uint32_t)LEVER_AIRCRAFT_POINTS; i++) {
        aircraft.frequency[i] = 1.0f + (float)i;
        aircraft.real[i] = 1.0f;
    }
    aircraft.count = (uint8_t)LEVER_AIRCRAFT_POINTS;
    TEST_ASSERT_TRUE(margin_accepts(&aircraft));
}
