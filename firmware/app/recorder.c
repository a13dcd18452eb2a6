/* Snapshots for recorders: the state of an instance once a period, spread over the frames until the next. */
#include "app/instance.h"
#include "can/e2e.h"
#include "can/messages.h"
#include "math/bounds.h"
#include "math/crc32.h"
#include "math/elapsed.h"

#include <string.h>

#define FRAME_DATA 6u /* bytes of the state in a frame */
#define FRAMES (2u + ((((uint32_t)LEVER_STATE_BYTES + FRAME_DATA) - 1u) / FRAME_DATA)) /* with begin and end */
#define PERIOD_LEAST_US FRAMES

void lever_recorder_init(lever_recorder_t *recorder, uint32_t period_us)
{
    (void)memset(recorder, 0, sizeof *recorder);
    recorder->period_us = greater_count(period_us, PERIOD_LEAST_US);
    recorder->elapsed_us = recorder->period_us;
    recorder->sent = (uint16_t)FRAMES;
    recorder->layout = lever_state_layout();
}

void lever_recorder_step(lever_recorder_t *recorder, const lever_t *lever)
{
    const uint32_t time_us = lever->link.time_us;
    const uint32_t step_us = time_us - recorder->time_us;
    const bool is_new = (lever->estimator.mode != LEVER_MODE_INIT) && (step_us != 0u);
    if (is_new) {
        recorder->time_us = time_us;
        recorder->elapsed_us += (step_us < HALF_TURN_OF_TIME) ? step_us : 0u;
        if ((recorder->sent >= (uint16_t)FRAMES) && (recorder->elapsed_us >= recorder->period_us)) {
            recorder->sent = 0u;
            recorder->elapsed_us = 0u;
            recorder->taken_us = time_us;
            recorder->crc = CRC32_START;
            lever_state_save(lever, recorder->state);
        }
    }
}

/* The next six bytes of the state, which count for the digest, and 0 behind its end. */
static void add_data(lever_recorder_t *recorder, message_snapshot_t *message)
{
    const uint32_t begin = ((uint32_t)recorder->sent - 1u) * FRAME_DATA;
    const uint32_t bytes = lesser_count((uint32_t)LEVER_STATE_BYTES - begin, FRAME_DATA);
    uint64_t data = 0u;
    for (uint32_t i = 0u; i < bytes; i++) {
        const uint8_t byte = recorder->state[begin + i];
        recorder->crc = crc32_shift(recorder->crc ^ byte, 8u);
        const uint32_t place = 8u * i;
        data |= (uint64_t)byte << place;
    }
    message->data_low = (uint32_t)(data & UINT32_MAX);
    message->data_high = (uint16_t)(data >> 32u);
}

bool lever_recorder_next_frame(lever_recorder_t *recorder, lever_frame_t *frame)
{
    const uint32_t due = 1u + (recorder->elapsed_us / (recorder->period_us / FRAMES));
    const bool sends = (recorder->sent < (uint16_t)FRAMES) && (recorder->sent < due);
    if (sends) {
        message_snapshot_t message = {.part = (uint8_t)MESSAGE_PART_DATA};
        if (recorder->sent == 0u) {
            message.part = (uint8_t)MESSAGE_PART_BEGIN;
            message.time_us = recorder->taken_us;
            message.layout = recorder->layout;
        } else if (recorder->sent == (FRAMES - 1u)) {
            message.part = (uint8_t)MESSAGE_PART_END;
            message.digest = ~recorder->crc;
            message.length = (uint16_t)LEVER_STATE_BYTES;
        } else {
            add_data(recorder, &message);
        }
        (void)message_snapshot_encode(frame, &message);
        e2e_protect(frame, (uint8_t)MESSAGE_SNAPSHOT_DATA_ID, recorder->counter);
        recorder->counter = (uint8_t)((recorder->counter + 1u) & 15u);
        recorder->sent++;
    }
    return sends;
}
