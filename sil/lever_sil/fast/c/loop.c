#include "loop.h"

#include "arrivals.h"
#include "can/e2e.h"
#include "can/layout.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "pilot.h"

#include <stddef.h>
#include <string.h>

static bool has_command(const loop_t *loop)
{
    return (loop->next_command < loop->commands) && (loop->command_sample[loop->next_command] == loop->sample);
}

/* --- by structs -------------------------------------------------------------------------------------------------- */

/* Not rounded as in a frame; but what does not fit into one is not available. */
static float reading_of(const loop_t *loop, enum loop_signal which, bool *valid)
{
    const double value = pilot_reading(loop, which, loop->sample);
    *valid = pilot_fits(&loop->sensor[which].field, value);
    return *valid ? (float)value : 0.0f;
}

static void step_by_struct(loop_t *loop, lever_t *lever)
{
    if (has_command(loop)) {
        loop->refused += lever_command(lever, &loop->command[loop->next_command]) ? 0u : 1u;
        loop->next_command++;
    }
    if (loop->no_base[loop->sample] == 0u) {
        lever_sample_t sample = {.time_us = pilot_time_us(loop, loop->sample)};
        if (loop->no_lever[loop->sample] == 0u) {
            sample.theta = reading_of(loop, LOOP_THETA, &sample.theta_valid);
            sample.theta_dot = reading_of(loop, LOOP_THETA_DOT, &sample.theta_dot_valid);
            sample.tau_m = reading_of(loop, LOOP_TAU_M, &sample.tau_m_valid);
        }
        sample.z_ddot = reading_of(loop, LOOP_Z_DDOT, &sample.z_ddot_valid);
        if (loop->has_grip) {
            sample.grip_force = reading_of(loop, LOOP_GRIP_FORCE, &sample.grip_force_valid);
        }
        (void)lever_update(lever, &sample);
        loop->idle_us = 0u;
    } else {
        (void)arrivals_idle(loop, lever);
    }
    lever_health_t health;
    lever_health(lever, &health);
    loop->asked = (double)health.torque;
    lever_correction_t correction;
    lever_correction(lever, &correction);
    loop->correction = (double)correction.angle;
}

/* --- by frames --------------------------------------------------------------------------------------------------- */

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

static void send_protected(loop_t *loop, lever_t *lever, lever_frame_t *frame, enum message_data_id data_id)
{
    e2e_protect(frame, (uint8_t)data_id, (uint8_t)(loop->sample & 15u));
    send(loop, lever, frame);
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
    const uint16_t time_low = (uint16_t)((loop->sample * loop->period_us) & 0xFFFFu);
    double torque = 0.0;
    double correction = 0.0;
    uint32_t count = 0u;
    bool answered = false;
    while ((count < loop->pending) && !answered) {
        lever_frame_t frame = {.id = loop->pending_id[count], .length = (uint8_t)FRAME_BYTES};
        (void)memcpy(frame.data, loop->pending_data[count], sizeof frame.data);
        message_motor_command_t motor;
        message_correction_t corrected;
        message_state_estimate_t estimate;
        if (message_motor_command_decode(&motor, &frame) && (motor.time_low == time_low)) {
            torque = pilot_rounded(&loop->torque_field, (double)motor.torque);
        } else if (message_correction_decode(&corrected, &frame) && (corrected.time_low == time_low)) {
            correction = pilot_rounded(&loop->correction_field, (double)corrected.correction);
        } else if (message_state_estimate_decode(&estimate, &frame)) {
            answered = (estimate.time_low == time_low);
            loop->misplaced += answered ? 0u : 1u;
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
    lever_frame_t frame;
    if (loop->no_lever[loop->sample] == 0u) {
        pilot_lever_sample(loop, loop->sample, &frame);
        send_protected(loop, lever, &frame, MESSAGE_LEVER_SAMPLE_DATA_ID);
    }
    if (loop->has_grip) {
        pilot_grip_sample(loop, loop->sample, &frame);
        send_protected(loop, lever, &frame, MESSAGE_GRIP_SAMPLE_DATA_ID);
    }
    if (loop->no_base[loop->sample] == 0u) {
        pilot_base_sample(loop, loop->sample, &frame);
        send_protected(loop, lever, &frame, MESSAGE_BASE_SAMPLE_DATA_ID);
        take_answer(loop);
        if (loop->recorder != NULL) {
            take_snapshots(loop, lever);
        }
    }
}

/* ----------------------------------------------------------------------------------------------------------------- */

static bool may_go_on(const loop_t *loop)
{
    const bool has_room = (loop->frame_room == 0u) || ((loop->frame_room - loop->frames) >= (uint32_t)LOOP_FRAMES);
    return has_room && (loop->refused == 0u) && (loop->unanswered_in_a_row < loop->most_unanswered);
}

static void keep(loop_t *loop, const lever_t *lever)
{
    const uint32_t sample = loop->sample;
    if ((sample % loop->stride) == 0u) {
        lever_estimate(lever, &loop->estimate[sample / loop->stride]);
        if (loop->stability != NULL) {
            lever_stability(lever, &loop->stability[sample / loop->stride]);
        }
    }
    if ((sample % loop->health_stride) == 0u) {
        lever_health(lever, &loop->health[sample / loop->health_stride]);
    }
    if (loop->asked_of_motor != NULL) {
        loop->asked_of_motor[sample] = loop->asked;
    }
}

uint32_t loop_advance(loop_t *loop, lever_t *lever, uint32_t until)
{
    while ((loop->sample < until) && may_go_on(loop)) {
        pilot_note(loop);
        if (loop->arrival != NULL) {
            arrivals_step(loop, lever);
        } else if (loop->by_frames) {
            step_by_frames(loop, lever);
        } else {
            step_by_struct(loop, lever);
        }
        pilot_age_correction(loop);
        keep(loop, lever);
        if ((loop->sample + 1u) < loop->count) {
            pilot_advance(loop);
        }
        loop->sample++;
    }
    return loop->sample;
}
