#include "pilot.h"

#include "can/messages.h"

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
    if ((which == LOOP_Z_DDOT) && !loop->cabin.exists) {
        value = loop->base[sample];
    } else if (sensor->source == NULL) {
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

/* --- frames ------------------------------------------------------------------------------------------------------- */

bool pilot_fits(const loop_field_t *field, double value)
{
    return fabs(value / field->step) < (field->most + 0.5);
}

double pilot_rounded(const loop_field_t *field, double value)
{
    return rint(value / field->step) * field->step;
}

static float sent(const loop_t *loop, enum loop_signal which, bool *valid)
{
    const double value = pilot_rounded(&loop->sensor[which].field, pilot_reading(loop, which));
    *valid = !isnan(value);
    return (float)value;
}

void pilot_lever_sample(const loop_t *loop, struct lever_frame *frame)
{
    message_lever_sample_t message;
    message.theta = sent(loop, LOOP_THETA, &message.theta_valid);
    message.theta_dot = sent(loop, LOOP_THETA_DOT, &message.theta_dot_valid);
    message.tau_m = sent(loop, LOOP_TAU_M, &message.tau_m_valid);
    (void)message_lever_sample_encode(frame, &message);
}

void pilot_base_sample(const loop_t *loop, struct lever_frame *frame)
{
    message_base_sample_t message = {.time_us = loop->sample * loop->period_us};
    message.z_ddot = sent(loop, LOOP_Z_DDOT, &message.z_ddot_valid);
    (void)message_base_sample_encode(frame, &message);
}

void pilot_grip_sample(const loop_t *loop, struct lever_frame *frame)
{
    message_grip_sample_t message;
    message.grip_force = sent(loop, LOOP_GRIP_FORCE, &message.grip_force_valid);
    (void)message_grip_sample_encode(frame, &message);
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
