#include "aircraft.h"

#include <math.h>

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
    const double ends[AIRCRAFT_ENDS] = {aircraft->state[0], aircraft->state[1], aircraft->state[2], before,
        gust + (begin * rise), aircraft->pitch, gust + (end * rise)};
    for (uint32_t i = 0u; i < (uint32_t)AIRCRAFT_STATES; i++) {
        aircraft->state[i] = dot(aircraft->step[i], ends, (uint32_t)AIRCRAFT_ENDS);
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
    const double inputs[AIRCRAFT_INPUTS] = {
        aircraft->state[0], aircraft->state[1], aircraft->state[2], aircraft->pitch, aircraft->gust[sample + 1u]};
    return dot(aircraft->output, inputs, (uint32_t)AIRCRAFT_INPUTS);
}
