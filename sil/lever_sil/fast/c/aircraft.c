#include "aircraft.h"

#include <math.h>
#include <string.h>

static double dot(const double *row, const double *values, uint32_t count)
{
    double total = 0.0;
    for (uint32_t i = 0u; i < count; i++) {
        total += row[i] * values[i];
    }
    return total;
}

static double limited(double value, double most)
{
    return fmin(fmax(value, -most), most);
}

/* The corrected angle of the lever at a time [samples] that is past; 0 before the start. */
static double delayed(const aircraft_t *aircraft, double time)
{
    double angle = 0.0;
    if (time >= 0.0) {
        const uint32_t whole = (uint32_t)time;
        const double before = aircraft->lever[whole];
        angle = before + ((time - (double)whole) * (aircraft->lever[whole + 1u] - before));
    }
    return angle;
}

static void advance_substep(aircraft_t *aircraft, uint32_t sample, uint32_t substep)
{
    const double count = (double)aircraft->substeps;
    const double begin = (double)substep / count;
    const double end = ((double)substep + 1.0) / count;
    const double gust = aircraft->gust[sample];
    const double rise = aircraft->gust[sample + 1u] - gust;
    const double before = aircraft->pitch;
    const double time = (double)sample + (0.5 * (begin + end)) - aircraft->delay;
    const double command = aircraft->gearing[sample] * delayed(aircraft, time);
    const double change = limited(aircraft->approach * (command - before), aircraft->most_change);
    aircraft->pitch = limited(before + change, aircraft->travel);
    const uint32_t states = aircraft->states;
    const uint32_t row = states + (2u * (uint32_t)AIRCRAFT_INPUTS);
    double ends[AIRCRAFT_STATES + (2 * AIRCRAFT_INPUTS)];
    (void)memcpy(ends, aircraft->state, states * sizeof ends[0]);
    ends[states] = before;
    ends[states + 1u] = gust + (begin * rise);
    ends[states + 2u] = aircraft->pitch;
    ends[states + 3u] = gust + (end * rise);
    for (uint32_t i = 0u; i < states; i++) {
        aircraft->state[i] = dot(&aircraft->step[(size_t)i * row], ends, row);
    }
}

double aircraft_advance(aircraft_t *aircraft, uint32_t sample, double delta, double correction)
{
    const uint32_t late = aircraft->correction_delay;
    aircraft->correction[sample] = correction;
    double angle = delta + ((sample >= late) ? aircraft->correction[sample - late] : 0.0);
    if (aircraft->passed < 1.0) {
        const double last = (sample > 0u) ? aircraft->lever[sample - 1u] : 0.0;
        angle = last + (aircraft->passed * (angle - last));
    }
    aircraft->lever[sample] = angle;
    for (uint32_t i = 0u; i < aircraft->substeps; i++) {
        advance_substep(aircraft, sample, i);
    }
    const uint32_t row = aircraft->states + (uint32_t)AIRCRAFT_INPUTS;
    double given[AIRCRAFT_STATES + AIRCRAFT_INPUTS];
    (void)memcpy(given, aircraft->state, aircraft->states * sizeof given[0]);
    given[aircraft->states] = aircraft->pitch;
    given[aircraft->states + 1u] = aircraft->gust[sample + 1u];
    aircraft->sensed = dot(&aircraft->output[row], given, row);
    return dot(aircraft->output, given, row);
}
