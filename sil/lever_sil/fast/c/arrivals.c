#include "arrivals.h"

#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "pilot.h"

#include <stddef.h>
#include <string.h>

#define IDLE_US 5000u /* without a sample, after which the firmware is told so, as lever_idle() asks for */

bool arrivals_idle(loop_t *loop, lever_t *lever)
{
    loop->idle_us += loop->period_us;
    const bool is_told = loop->idle_us >= IDLE_US;
    if (is_told) {
        lever_idle(lever, loop->idle_us);
        loop->idle_us = 0u;
    }
    return is_told;
}

/* The frame as it arrives. */
static void receive(const loop_t *loop, const loop_arrival_t *arrival, lever_frame_t *frame)
{
    (void)memset(frame, 0, sizeof *frame);
    switch (arrival->content) {
    case LOOP_LEVER_SAMPLE:
        pilot_lever_sample(loop, arrival->of, frame);
        break;
    case LOOP_BASE_SAMPLE:
        pilot_base_sample(loop, arrival->of, frame);
        break;
    case LOOP_GRIP_SAMPLE:
        pilot_grip_sample(loop, arrival->of, frame);
        break;
    default:
        break; /* its data are the change */
    }
    if (arrival->content != (uint8_t)LOOP_OTHER) {
        e2e_protect(frame, arrival->data_id, arrival->counter);
    }
    frame->id = arrival->id;
    frame->length = arrival->length;
    for (uint32_t i = 0u; i < sizeof frame->data; i++) {
        frame->data[i] ^= arrival->change[i];
    }
}

/* Takes what the firmware sends; true when STATE_ESTIMATE was the last of it. */
static bool fetch(loop_t *loop, lever_t *lever)
{
    lever_frame_t frame;
    bool answered = false;
    while (lever_next_frame(lever, &frame)) {
        message_motor_command_t command;
        if (message_motor_command_decode(&command, &frame)) {
            loop->asked = (double)command.torque;
        }
        answered = (frame.id == (uint32_t)MESSAGE_STATE_ESTIMATE_ID);
    }
    return answered;
}

static void hand_on(loop_t *loop, lever_t *lever, const lever_frame_t *frame)
{
    const enum lever_frame_result result = lever_on_frame(lever, frame);
    loop->result[result]++;
    if (result == LEVER_FRAME_SAMPLE) {
        (void)lever_step(lever);
        loop->idle_us = 0u;
    }
    const bool answered = fetch(loop, lever);
    loop->unanswered += ((result == LEVER_FRAME_SAMPLE) && !answered) ? 1u : 0u;
}

void arrivals_step(loop_t *loop, lever_t *lever)
{
    const uint32_t taken = loop->result[LEVER_FRAME_SAMPLE];
    while ((loop->next_arrival < loop->arrivals) && (loop->arrival[loop->next_arrival].at == loop->sample)) {
        lever_frame_t frame;
        receive(loop, &loop->arrival[loop->next_arrival], &frame);
        loop->next_arrival++;
        hand_on(loop, lever, &frame);
    }
    if ((loop->result[LEVER_FRAME_SAMPLE] == taken) && arrivals_idle(loop, lever)) {
        (void)fetch(loop, lever);
    }
}
