#include "channel.h"

#include "can/e2e.h"
#include "can/layout.h"
#include "can/messages.h"
#include "lever_cdkf.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define IDLE_US 5000u /* without a sample, after which a port calls lever_idle() */

/* --- what is sent ------------------------------------------------------------------------------------------------- */

static double true_value(const channel_t *channel, enum channel_signal signal, uint32_t sample)
{
    const double *const values[CHANNEL_SIGNALS] = {
        channel->lane.theta, channel->lane.theta_dot, channel->tau_m, channel->z_ddot, channel->grip_force};
    return values[signal][sample];
}

static float measured(const channel_t *channel, enum channel_signal signal, uint32_t sample, bool *valid)
{
    const channel_sensor_t *sensor = &channel->sensor[signal];
    const uint32_t source = sensor->source[sample];
    const double reading = true_value(channel, signal, source) + sensor->noise[source];
    const double value = (sensor->factor[sample] * reading) + sensor->error[sample];
    *valid = !isnan(value);
    return (float)value;
}

static void encode_lever(const channel_t *channel, uint32_t sample, lever_frame_t *frame)
{
    message_lever_sample_t message;
    message.theta = measured(channel, CHANNEL_THETA, sample, &message.theta_valid);
    message.theta_dot = measured(channel, CHANNEL_THETA_DOT, sample, &message.theta_dot_valid);
    message.tau_m = measured(channel, CHANNEL_TAU_M, sample, &message.tau_m_valid);
    (void)message_lever_sample_encode(frame, &message);
}

static void encode_base(const channel_t *channel, uint32_t sample, lever_frame_t *frame)
{
    message_base_sample_t message = {.time_us = channel->time_us[sample]};
    message.z_ddot = measured(channel, CHANNEL_Z_DDOT, sample, &message.z_ddot_valid);
    (void)message_base_sample_encode(frame, &message);
}

static void encode_grip(const channel_t *channel, uint32_t sample, lever_frame_t *frame)
{
    message_grip_sample_t message;
    message.grip_force = measured(channel, CHANNEL_GRIP_FORCE, sample, &message.grip_force_valid);
    (void)message_grip_sample_encode(frame, &message);
}

/* The frame as it arrives. */
static void receive(const channel_t *channel, const channel_frame_t *of, lever_frame_t *frame)
{
    (void)memset(frame, 0, sizeof *frame);
    switch ((enum channel_kind)of->kind) {
    case CHANNEL_LEVER:
        encode_lever(channel, of->of, frame);
        break;
    case CHANNEL_BASE:
        encode_base(channel, of->of, frame);
        break;
    case CHANNEL_GRIP:
        encode_grip(channel, of->of, frame);
        break;
    default:
        break; /* its data are the change */
    }
    if (of->kind != (uint8_t)CHANNEL_OTHER) {
        e2e_protect(frame, of->data_id, of->counter);
    }
    frame->id = of->id;
    frame->length = of->length;
    for (uint32_t i = 0u; i < sizeof frame->data; i++) {
        frame->data[i] ^= of->change[i];
    }
}

/* --- what comes of it --------------------------------------------------------------------------------------------- */

/* Takes what the firmware sends; true when STATE_ESTIMATE was the last of it. */
static bool fetch(channel_t *channel, lever_t *lever)
{
    lever_frame_t frame;
    bool answered = false;
    while (lever_next_frame(lever, &frame)) {
        message_motor_command_t command;
        if (message_motor_command_decode(&command, &frame)) {
            channel->motor = (double)command.torque;
        }
        answered = (frame.id == (uint32_t)MESSAGE_STATE_ESTIMATE_ID);
    }
    return answered;
}

static void deliver(channel_t *channel, lever_t *lever, uint32_t sample)
{
    channel->silent_us += (uint32_t)lrint(channel->step_seconds * 1.0e6);
    while ((channel->next < channel->frames) && (channel->frame[channel->next].at == sample)) {
        lever_frame_t frame;
        receive(channel, &channel->frame[channel->next], &frame);
        channel->next++;
        const enum lever_frame_result result = lever_on_frame(lever, &frame);
        channel->result[result]++;
        if (result == LEVER_FRAME_SAMPLE) {
            (void)lever_step(lever);
            channel->silent_us = 0u;
        }
        const bool answered = fetch(channel, lever);
        channel->unanswered += ((result == LEVER_FRAME_SAMPLE) && !answered) ? 1u : 0u;
    }
    if (channel->silent_us >= IDLE_US) {
        lever_idle(lever, channel->silent_us);
        (void)fetch(channel, lever);
        channel->silent_us = 0u;
    }
}

void channel_run(channel_t *channel, struct lever *lever, uint32_t first, uint32_t last)
{
    for (uint32_t i = first; i < last; i++) {
        deliver(channel, lever, i);
        channel->asked[i] = channel->motor;
        lever_health(lever, &channel->health[i]);
        if ((i % channel->stride) == 0u) {
            lever_estimate(lever, &channel->estimate[i / channel->stride]);
        }
        if ((i + 1u) < channel->lane.count) {
            const double torque = channel->tau_m[i];
            const double after = channel->motor + ((torque - channel->motor) * channel->decay);
            lanes_advance(&channel->lane, i, torque, after);
            channel->tau_m[i + 1u] = after;
        }
    }
}
