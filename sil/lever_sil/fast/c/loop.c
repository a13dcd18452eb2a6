#include "loop.h"

#include "can/e2e.h"
#include "can/layout.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "plants.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define CORRECTION_HOLDS_US 100000u
#define IDLE_US 5000u      /* without a sample, after which the firmware is told so, as lever_idle() asks for */
#define TIME_LOW_START 48u /* of the messages of an estimator that belong to a sample */
#define TIME_LOW_MASK 0xFFFFu

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

/* What a sensor says; NaN: it is marked invalid. */
static double measured(const loop_t *loop, enum loop_signal which)
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

static void note_signals(loop_t *loop)
{
    const plant_t *plant = &loop->plant;
    loop->signal[LOOP_THETA][loop->sample] = plant->theta;
    loop->signal[LOOP_THETA_DOT][loop->sample] = plant->theta_dot;
    loop->signal[LOOP_TAU_M][loop->sample] = plant->tau_m;
    if (loop->has_grip) {
        loop->signal[LOOP_GRIP_FORCE][loop->sample] = plant->grip_force;
    }
}

static double measured_base(const loop_t *loop)
{
    return loop->cabin.exists ? measured(loop, LOOP_Z_DDOT) : loop->base[loop->sample];
}

static bool has_command(const loop_t *loop)
{
    return (loop->next_command < loop->commands) && (loop->command_sample[loop->next_command] == loop->sample);
}

/* Whether a frame can carry a value of so many steps of its field, as in the codec of host_tools; NaN does not fit. */
static bool fits(const loop_field_t *field, double steps)
{
    const double most = (double)(field->mask >> 1u);
    return (steps > (-most - 0.5)) && (steps < (most + 0.5));
}

/* --- by structs -------------------------------------------------------------------------------------------------- */

/* Not rounded as in a frame; but what does not fit into one is not available. */
static float single(const loop_field_t *field, double value, bool *valid)
{
    *valid = fits(field, value / field->scale);
    return *valid ? (float)value : 0.0f;
}

/* There is no sample: as a port does. */
static void idle(loop_t *loop, lever_t *lever)
{
    loop->idle_us += loop->period_us;
    if (loop->idle_us >= IDLE_US) {
        lever_idle(lever, loop->idle_us);
        loop->idle_us = 0u;
    }
}

static float reading_of(const loop_t *loop, enum loop_signal which, bool *valid)
{
    return single(&loop->sensor[which].field, measured(loop, which), valid);
}

static void step_by_struct(loop_t *loop, lever_t *lever)
{
    if (has_command(loop)) {
        loop->refused += lever_command(lever, &loop->command[loop->next_command]) ? 0u : 1u;
        loop->next_command++;
    }
    if (loop->no_base[loop->sample] == 0u) {
        lever_sample_t sample = {.time_us = loop->sample * loop->period_us};
        if (loop->time_us != NULL) {
            sample.time_us = loop->time_us[loop->sample];
        }
        if (loop->no_lever[loop->sample] == 0u) {
            sample.theta = reading_of(loop, LOOP_THETA, &sample.theta_valid);
            sample.theta_dot = reading_of(loop, LOOP_THETA_DOT, &sample.theta_dot_valid);
            sample.tau_m = reading_of(loop, LOOP_TAU_M, &sample.tau_m_valid);
        }
        sample.z_ddot = single(&loop->base_field, measured_base(loop), &sample.z_ddot_valid);
        if (loop->has_grip) {
            sample.grip_force = reading_of(loop, LOOP_GRIP_FORCE, &sample.grip_force_valid);
        }
        (void)lever_update(lever, &sample);
        loop->idle_us = 0u;
    } else {
        idle(loop, lever);
    }
    lever_health_t health;
    lever_health(lever, &health);
    loop->asked = (double)health.torque;
    lever_correction_t correction;
    lever_correction(lever, &correction);
    loop->correction = (double)correction.angle;
}

/* --- by frames --------------------------------------------------------------------------------------------------- */

/* Bits of a value at their place, with the bit that says that it is valid. As the codec of host_tools: rounded in double
 * precision, half to even; what does not fit is not available. */
static uint64_t bits_of(const loop_field_t *field, double value)
{
    const double steps = value / field->scale;
    uint64_t bits = 0u;
    if (fits(field, steps)) {
        const uint32_t count = (uint32_t)(int32_t)rint(steps) & field->mask;
        bits = ((uint64_t)count << field->start) | ((uint64_t)1u << field->valid);
    } else if (!isnan(value)) {
        bits = (uint64_t)(field->mask ^ (field->mask >> 1u)) << field->start;
    } else {
        /* all 0 */
    }
    return bits;
}

static double value_of(const loop_field_t *field, uint64_t payload)
{
    const uint32_t sign = field->mask ^ (field->mask >> 1u);
    const uint32_t flipped = ((uint32_t)(payload >> field->start) & field->mask) ^ sign;
    return (double)((int32_t)flipped - (int32_t)sign) * field->scale;
}

static void record(loop_t *loop, uint16_t id, const uint8_t data[8])
{
    if (loop->frame_room > 0u) {
        loop->frame_id[loop->frames] = id;
        loop->frame_sample[loop->frames] = loop->sample;
        (void)memcpy(loop->frame_data[loop->frames], data, sizeof loop->frame_data[0]);
        loop->frames++;
    }
}

/* Sends a frame and keeps the answers to it. */
static void send(loop_t *loop, lever_t *lever, const lever_frame_t *frame)
{
    record(loop, (uint16_t)frame->id, frame->data);
    if (lever_on_frame(lever, frame) == LEVER_FRAME_SAMPLE) {
        (void)lever_step(lever);
    }
    lever_frame_t answer;
    while (lever_next_frame(lever, &answer)) {
        if (loop->pending < (uint32_t)LOOP_PENDING) {
            loop->pending_id[loop->pending] = (uint16_t)answer.id;
            (void)memcpy(loop->pending_data[loop->pending], answer.data, sizeof answer.data);
            loop->pending++;
        }
    }
}

static void send_payload(loop_t *loop, lever_t *lever, uint32_t id, uint8_t data_id, uint64_t payload)
{
    lever_frame_t frame;
    layout_write(&frame, id, payload);
    e2e_protect(&frame, data_id, (uint8_t)(loop->sample & 15u));
    send(loop, lever, &frame);
}

/* Takes the first `count` of the frames that wait. */
static void take(loop_t *loop, uint32_t count)
{
    for (uint32_t i = 0u; i < count; i++) {
        record(loop, loop->pending_id[i], loop->pending_data[i]);
    }
    loop->pending -= count;
    (void)memmove(loop->pending_id, &loop->pending_id[count], loop->pending * sizeof loop->pending_id[0]);
    (void)memmove(loop->pending_data, loop->pending_data[count], loop->pending * sizeof loop->pending_data[0]);
}

/* Sends the command of this sample and takes what comes until it is acknowledged. */
static void send_command(loop_t *loop, lever_t *lever)
{
    const lever_frame_t *frame = &loop->command_frame[loop->next_command];
    loop->next_command++;
    send(loop, lever, frame);
    uint32_t count = 0u;
    bool acknowledged = false;
    while ((count < loop->pending) && !acknowledged) {
        lever_frame_t answer = {.id = loop->pending_id[count], .length = (uint8_t)FRAME_BYTES};
        message_command_ack_t ack;
        (void)memcpy(answer.data, loop->pending_data[count], sizeof answer.data);
        if (message_command_ack_decode(&ack, &answer) && (ack.command_counter == e2e_counter(frame))) {
            acknowledged = true;
            loop->refused += (ack.result == (uint8_t)MESSAGE_RESULT_ACCEPTED) ? 0u : 1u;
        }
        count++;
    }
    take(loop, count);
}

/* Takes what the estimator has sent for this sample, up to its STATE_ESTIMATE. */
static void take_answer(loop_t *loop)
{
    const uint32_t time_low = (loop->sample * loop->period_us) & TIME_LOW_MASK;
    double torque = 0.0;
    double correction = 0.0;
    uint32_t count = 0u;
    bool answered = false;
    while ((count < loop->pending) && !answered) {
        lever_frame_t answer = {.length = (uint8_t)FRAME_BYTES};
        (void)memcpy(answer.data, loop->pending_data[count], sizeof answer.data);
        const uint64_t payload = layout_read(&answer);
        const bool is_own = ((uint32_t)(payload >> TIME_LOW_START) == time_low);
        const uint32_t id = loop->pending_id[count];
        if ((id == (uint32_t)MESSAGE_MOTOR_COMMAND_ID) && is_own) {
            torque = value_of(&loop->torque_field, payload);
        } else if ((id == (uint32_t)MESSAGE_CORRECTION_ID) && is_own) {
            correction = value_of(&loop->correction_field, payload);
        } else if (id == (uint32_t)MESSAGE_STATE_ESTIMATE_ID) {
            answered = is_own;
            loop->misplaced += is_own ? 0u : 1u;
        } else {
            /* of no interest here */
        }
        count++;
    }
    take(loop, count);
    loop->asked = torque;
    loop->correction = correction;
    loop->unanswered += answered ? 0u : 1u;
    loop->unanswered_in_a_row = answered ? 0u : (loop->unanswered_in_a_row + 1u);
}

/* What does not follow this sample follows the next. */
static void take_snapshots(loop_t *loop, const lever_t *lever)
{
    lever_frame_t frame;
    uint32_t count = 0u;
    lever_recorder_step(loop->recorder, lever);
    while ((count < (uint32_t)LOOP_SNAPSHOTS) && lever_recorder_next_frame(loop->recorder, &frame)) {
        record(loop, (uint16_t)frame.id, frame.data);
        count++;
    }
}

static void step_by_frames(loop_t *loop, lever_t *lever)
{
    if (has_command(loop)) {
        send_command(loop, lever);
    }
    if (loop->no_lever[loop->sample] == 0u) {
        uint64_t payload = 0u;
        for (uint32_t i = 0u; i < (uint32_t)LOOP_GRIP_FORCE; i++) {
            payload |= bits_of(&loop->sensor[i].field, measured(loop, (enum loop_signal)i));
        }
        send_payload(loop, lever, (uint32_t)MESSAGE_LEVER_SAMPLE_ID, (uint8_t)MESSAGE_LEVER_SAMPLE_DATA_ID, payload);
    }
    if (loop->has_grip) {
        const uint64_t payload = bits_of(&loop->sensor[LOOP_GRIP_FORCE].field, measured(loop, LOOP_GRIP_FORCE));
        send_payload(loop, lever, (uint32_t)MESSAGE_GRIP_SAMPLE_ID, (uint8_t)MESSAGE_GRIP_SAMPLE_DATA_ID, payload);
    }
    if (loop->no_base[loop->sample] == 0u) {
        const uint64_t time_us = (uint64_t)(loop->sample * loop->period_us) << 32u;
        const uint64_t payload = bits_of(&loop->base_field, measured_base(loop)) | time_us;
        send_payload(loop, lever, (uint32_t)MESSAGE_BASE_SAMPLE_ID, (uint8_t)MESSAGE_BASE_SAMPLE_DATA_ID, payload);
        take_answer(loop);
        if (loop->recorder != NULL) {
            take_snapshots(loop, lever);
        }
    }
}

/* A correction that is too old counts as none. */
static void age_correction(loop_t *loop)
{
    loop->silent_us = (loop->no_base[loop->sample] == 0u) ? 0u : (loop->silent_us + loop->period_us);
    if (loop->silent_us > CORRECTION_HOLDS_US) {
        loop->correction = 0.0;
    }
}

/* ----------------------------------------------------------------------------------------------------------------- */

static bool may_go_on(const loop_t *loop)
{
    const bool has_room = (loop->frame_room == 0u) || ((loop->frame_room - loop->frames) >= (uint32_t)LOOP_FRAMES);
    return has_room && (loop->refused == 0u) && (loop->unanswered_in_a_row < loop->most_unanswered);
}

/* The cabin, to the next sample. */
static void advance_cabin(loop_t *loop)
{
    loop_cabin_t *cabin = &loop->cabin;
    double *z_ddot = loop->signal[LOOP_Z_DDOT];
    const uint32_t now = loop->sample;
    const double delta = loop->plant.theta - cabin->rest;
    z_ddot[now + 1u] = aircraft_advance(&cabin->aircraft, now, delta, loop->correction);
    cabin->speed += 0.5 * cabin->period * (z_ddot[now + 1u] + z_ddot[now]);
    cabin->felt[now + 1u] = z_ddot[now + 1u] + (cabin->outside * cabin->speed);
}

uint32_t loop_advance(loop_t *loop, lever_t *lever, uint32_t until)
{
    while ((loop->sample < until) && may_go_on(loop)) {
        note_signals(loop);
        if (loop->by_frames) {
            step_by_frames(loop, lever);
        } else {
            step_by_struct(loop, lever);
        }
        age_correction(loop);
        if ((loop->sample % loop->stride) == 0u) {
            lever_estimate(lever, &loop->estimate[loop->sample / loop->stride]);
            lever_health(lever, &loop->health[loop->sample / loop->stride]);
            if (loop->stability != NULL) {
                lever_stability(lever, &loop->stability[loop->sample / loop->stride]);
            }
        }
        if ((loop->sample + 1u) < loop->count) {
            if (loop->cabin.exists) {
                advance_cabin(loop);
            }
            plant_advance(&loop->plant, loop->sample, loop->asked + loop->torque[loop->sample]);
        }
        loop->sample++;
    }
    return loop->sample;
}
