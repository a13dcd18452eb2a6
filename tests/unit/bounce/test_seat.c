/* From the accelerometer to the pilot's seat: the response of the modes that it is given, and where it begins. */
#include "bounce/seat.h"

#include <math.h>
#include <string.h>

#include "test.h"

#define FULL_TURN 6.283185307179586
#define PERIOD 1.0e-3

/* 1 + 0.3 s^2 / (s^2 + 2.262 s + 1421) of a mode at 6 Hz, and a slower one. */
static const lever_aircraft_t bent = {.seat_modes = 2u,
    .seat_direct = 1.3f,
    .seat = {{.by_rate = -0.679f, .by_place = -426.4f, .damping = 2.262f, .stiffness = 1421.0f},
        {.by_rate = 2.0f, .by_place = 30.0f, .damping = 6.0f, .stiffness = 400.0f}}};

/* Real and imaginary part of the response at a frequency [Hz], after it has settled. */
static void respond(seat_t *seat, double frequency, double found[2])
{
    const double turn = FULL_TURN * frequency;
    found[0] = 0.0;
    found[1] = 0.0;
    for (uint32_t k = 0u; k < 30000u; k++) {
        const double phase = turn * PERIOD * (double)k;
        const double at_seat = (double)seat_step(seat, (float)sin(phase), (float)PERIOD);
        if (k >= 20000u) {
            found[0] += 2.0e-4 * at_seat * sin(phase);
            found[1] += 2.0e-4 * at_seat * cos(phase);
        }
    }
}

static void expect(double frequency, double expected[2])
{
    const double w = FULL_TURN * frequency;
    expected[0] = (double)bent.seat_direct;
    expected[1] = 0.0;
    for (uint32_t i = 0u; i < bent.seat_modes; i++) {
        const lever_seat_mode_t *mode = &bent.seat[i];
        const double below[2] = {(double)mode->stiffness - (w * w), (double)mode->damping * w};
        const double above[2] = {(double)mode->by_place, (double)mode->by_rate * w};
        const double square = (below[0] * below[0]) + (below[1] * below[1]);
        expected[0] += ((above[0] * below[0]) + (above[1] * below[1])) / square;
        expected[1] += ((above[1] * below[0]) - (above[0] * below[1])) / square;
    }
}

TEST(its_response_is_that_of_its_modes)
{
    static const double frequencies[] = {0.5, 1.5, 3.0, 4.5, 5.5, 7.0, 9.0};
    for (uint32_t i = 0u; i < (sizeof frequencies / sizeof frequencies[0]); i++) {
        seat_t seat = {.aircraft = &bent};
        double found[2];
        double expected[2];
        respond(&seat, frequencies[i], found);
        expect(frequencies[i], expected);
        TEST_ASSERT_FLOAT_WITHIN(0.02f, (float)expected[0], (float)found[0]);
        TEST_ASSERT_FLOAT_WITHIN(0.02f, (float)expected[1], (float)found[1]);
    }
}

TEST(it_begins_at_rest_and_so_it_does_after_a_gap)
{
    seat_t seat = {.aircraft = &bent};
    double expected[2];
    expect(0.0, expected);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 2.0f * (float)expected[0], seat_step(&seat, 2.0f, 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 2.0f * (float)expected[0], seat_step(&seat, 2.0f, 1.0e-3f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, -3.0f * (float)expected[0], seat_step(&seat, -3.0f, 0.5f));
}

TEST(without_modes_the_accelerometer_is_at_the_seat)
{
    static const lever_aircraft_t rigid = {.seat_direct = 0.0f};
    seat_t seat = {.aircraft = NULL};
    TEST_ASSERT_EQUAL_FLOAT(2.5f, seat_step(&seat, 2.5f, 1.0e-3f));
    seat.aircraft = &rigid;
    TEST_ASSERT_EQUAL_FLOAT(-1.5f, seat_step(&seat, -1.5f, 1.0e-3f));
}
