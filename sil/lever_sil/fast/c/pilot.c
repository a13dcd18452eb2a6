#include "pilot.h"

#include <math.h>
#include <stddef.h>

#define CORRECTION_HOLDS_US 100000u

/* --- sensors ----------------------------------------------------------------------------------------------------- */

/* Without faults. */
static double reading(const loop_sensor_t *sensor, const double *signal, int64_t sample)
{
    double value = signal[sample];
    if ((sensor->whole > 0u) || (sensor->part > 0.0)) {
        const int64_t newer = sample - (int64_t)sensor->whole;
        const double new_value = signal[(newer > 0) ? newer : 0];
        const double old_value = signal[(newer > 1) ? (newer - 1) : 0];
        value = new_value + (sensor->part * (old_value - new_value));
    }
    return (sensor->gain * value) + sensor->offset[sample];
}

double pilot_reading(const loop_t *loop, enum loop_signal which)
{
    const loop_sensor_t *sensor = &loop->sensor[which];
    const uint32_t sample = loop->sample;
    double value;
    if (sensor->source == NULL) {
        value = reading(sensor, loop->signal[which], (int64_t)sample);
    } else {
        value = (sensor->factor[sample] * reading(sensor, loop->signal[which], sensor->source[sample])) +
                sensor->error[sample];
    }
    return value;
}

void pilot_note(loop_t *loop)
{
    const plant_t *plant = &loop->plant;
    loop->signal[LOOP_THETA][loop->sample] = plant->theta;
    loop->signal[LOOP_THETA_DOT][loop->sample] = plant->theta_dot;
    loop->signal[LOOP_TAU_M][loop->sample] = plant->tau_m;
    if (loop->has_grip) {
        loop->signal[LOOP_GRIP_FORCE][loop->sample] = plant->grip_force;
    }
}

double pilot_base(const loop_t *loop)
{
    return loop->cabin.exists ? pilot_reading(loop, LOOP_Z_DDOT) : loop->base[loop->sample];
}

/* --- frames ------------------------------------------------------------------------------------------------------- */

bool pilot_fits(const loop_field_t *field, double steps)
{
    const double most = (double)(field->mask >> 1u);
    return (steps > (-most - 0.5)) && (steps < (most + 0.5));
}

uint64_t pilot_bits(const loop_field_t *field, double value)
{
    const double steps = value / field->scale;
    uint64_t bits = 0u;
    if (pilot_fits(field, steps)) {
        const uint32_t count = (uint32_t)(int32_t)rint(steps) & field->mask;
        bits = ((uint64_t)count << field->start) | ((uint64_t)1u << field->valid);
    } else if (!isnan(value)) {
        bits = (uint64_t)(field->mask ^ (field->mask >> 1u)) << field->start;
    } else {
        /* all 0 */
    }
    return bits;
}

double pilot_value(const loop_field_t *field, uint64_t payload)
{
    const uint32_t sign = field->mask ^ (field->mask >> 1u);
    const uint32_t flipped = ((uint32_t)(payload >> field->start) & field->mask) ^ sign;
    return (double)((int32_t)flipped - (int32_t)sign) * field->scale;
}

/* --- motion ------------------------------------------------------------------------------------------------------- */

void pilot_age_correction(loop_t *loop)
{
    loop->silent_us = (loop->no_base[loop->sample] == 0u) ? 0u : (loop->silent_us + loop->period_us);
    if (loop->silent_us > CORRECTION_HOLDS_US) {
        loop->correction = 0.0;
    }
}

/* The cabin, to the next sample. */
static void advance_cabin(loop_t *loop)
{
    loop_cabin_t *cabin = &loop->cabin;
    double *z_ddot = cabin->seat;
    const uint32_t now = loop->sample;
    const double delta = loop->plant.theta - cabin->rest;
    z_ddot[now + 1u] = aircraft_advance(&cabin->aircraft, now, delta, loop->correction);
    loop->signal[LOOP_Z_DDOT][now + 1u] = cabin->aircraft.sensed;
    cabin->speed += 0.5 * cabin->period * (z_ddot[now + 1u] + z_ddot[now]);
    cabin->felt[now + 1u] = z_ddot[now + 1u] + (cabin->outside * cabin->speed);
}

void pilot_advance(loop_t *loop)
{
    if (loop->cabin.exists) {
        advance_cabin(loop);
    }
    plant_advance(&loop->plant, loop->sample, loop->asked + loop->torque[loop->sample]);
}
