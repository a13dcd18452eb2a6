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

double pilot_reading(const loop_t *loop, enum loop_signal which, uint32_t sample)
{
    const loop_sensor_t *sensor = &loop->sensor[which];
    double value;
    if ((which == LOOP_Z_DDOT) && (loop->base != NULL)) {
        value = loop->base[sample];
    } else if (sensor->source == NULL) {
        value = reading(sensor, loop->signal[which], (int64_t)sample);
    } else {
        value = (sensor->factor[sample] * reading(sensor, loop->signal[which], sensor->source[sample])) +
                sensor->error[sample];
    }
    return value;
}

uint32_t pilot_time_us(const loop_t *loop, uint32_t sample)
{
    return (loop->time_us != NULL) ? loop->time_us[sample] : (sample * loop->period_us);
}

void pilot_note(loop_t *loop)
{
    const plant_t *plant = &loop->plant;
    if (loop->lanes == NULL) {
        loop->signal[LOOP_THETA][loop->sample] = plant->theta;
        loop->signal[LOOP_THETA_DOT][loop->sample] = plant->theta_dot;
        loop->signal[LOOP_TAU_M][loop->sample] = plant->tau_m;
        if (loop->has_grip) {
            loop->signal[LOOP_GRIP_FORCE][loop->sample] = plant->grip_force;
        }
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

static float sent(const loop_t *loop, enum loop_signal which, uint32_t sample, bool *valid)
{
    const double value = pilot_rounded(&loop->sensor[which].field, pilot_reading(loop, which, sample));
    *valid = !isnan(value);
    return (float)value;
}

void pilot_lever_sample(const loop_t *loop, uint32_t sample, struct lever_frame *frame)
{
    message_lever_sample_t message;
    message.theta = sent(loop, LOOP_THETA, sample, &message.theta_valid);
    message.theta_dot = sent(loop, LOOP_THETA_DOT, sample, &message.theta_dot_valid);
    message.tau_m = sent(loop, LOOP_TAU_M, sample, &message.tau_m_valid);
    (void)message_lever_sample_encode(frame, &message);
}

void pilot_base_sample(const loop_t *loop, uint32_t sample, struct lever_frame *frame)
{
    message_base_sample_t message = {.time_us = pilot_time_us(loop, sample)};
    message.z_ddot = sent(loop, LOOP_Z_DDOT, sample, &message.z_ddot_valid);
    (void)message_base_sample_encode(frame, &message);
}

void pilot_grip_sample(const loop_t *loop, uint32_t sample, struct lever_frame *frame)
{
    message_grip_sample_t message;
    message.grip_force = sent(loop, LOOP_GRIP_FORCE, sample, &message.grip_force_valid);
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

/* A lever of lanes.h, with the motor's torque, to the next sample. */
static void advance_lane(loop_t *loop)
{
    double *tau_m = &loop->signal[LOOP_TAU_M][loop->sample];
    tau_m[1] = loop->asked + ((tau_m[0] - loop->asked) * loop->motor_decay);
    lanes_advance(loop->lanes, loop->sample, tau_m[0], tau_m[1]);
}

void pilot_advance(loop_t *loop)
{
    if (loop->cabin.exists) {
        advance_cabin(loop);
    }
    if (loop->lanes != NULL) {
        advance_lane(loop);
    } else {
        plant_advance(&loop->plant, loop->sample, loop->asked + loop->torque[loop->sample]);
    }
}
