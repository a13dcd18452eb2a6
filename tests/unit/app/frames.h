/* Frames of the simulated lever, as an inceptor would send them, and what an instance sends back. */
#ifndef UNIT_APP_FRAMES_H
#define UNIT_APP_FRAMES_H

#include "can/e2e.h"
#include "can/messages.h"
#include "rig.h"

enum { FRAMES_MOST = 16 };

typedef struct sender {
    rig_t rig;
    uint8_t counter; /* of the next pair */
    uint8_t command_counter;
    lever_sample_t sample; /* the last one, before the codec */
    lever_frame_t lever;   /* and its two frames */
    lever_frame_t base;
} sender_t;

static inline sender_t sender_typical(void)
{
    const sender_t sender = {.rig = rig_typical()};
    return sender;
}

/* Makes the frames of the next sample. */
static inline void sender_next(sender_t *sender)
{
    sender->sample = rig_sample(&sender->rig);
    const lever_sample_t *s = &sender->sample;
    const message_lever_sample_t lever = {.theta = s->theta,
        .theta_dot = s->theta_dot,
        .tau_m = s->tau_m,
        .theta_valid = s->theta_valid,
        .theta_dot_valid = s->theta_dot_valid,
        .tau_m_valid = s->tau_m_valid};
    const message_base_sample_t base = {.time_us = s->time_us, .z_ddot = s->z_ddot, .z_ddot_valid = s->z_ddot_valid};
    TEST_ASSERT_TRUE(message_lever_sample_encode(&sender->lever, &lever));
    TEST_ASSERT_TRUE(message_base_sample_encode(&sender->base, &base));
    e2e_protect(&sender->lever, (uint8_t)MESSAGE_LEVER_SAMPLE_DATA_ID, sender->counter);
    e2e_protect(&sender->base, (uint8_t)MESSAGE_BASE_SAMPLE_DATA_ID, sender->counter);
    sender->counter = (uint8_t)((sender->counter + 1u) & 15u);
}

static inline lever_frame_t sender_command(sender_t *sender, const lever_command_t *command)
{
    lever_frame_t frame;
    TEST_ASSERT_TRUE(message_command_encode(&frame, command));
    e2e_protect(&frame, (uint8_t)MESSAGE_COMMAND_DATA_ID, sender->command_counter);
    sender->command_counter = (uint8_t)((sender->command_counter + 1u) & 15u);
    return frame;
}

/* Makes and delivers the next pair, steps. Returns the mode; leaves the answers with the instance. */
static inline enum lever_mode sender_deliver(sender_t *sender, lever_t *lever)
{
    sender_next(sender);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &sender->lever));
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &sender->base));
    return lever_step(lever);
}

/* Fetches every frame that is due; their number. */
static inline uint32_t fetch_all(lever_t *lever, lever_frame_t frames[FRAMES_MOST])
{
    uint32_t count = 0u;
    while (lever_next_frame(lever, &frames[count])) {
        count++;
        TEST_ASSERT_LESS_THAN_UINT32(FRAMES_MOST, count);
    }
    return count;
}

/* As many samples, answers thrown away. */
static inline enum lever_mode sender_run(sender_t *sender, lever_t *lever, uint32_t count)
{
    lever_frame_t frames[FRAMES_MOST];
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        mode = sender_deliver(sender, lever);
        (void)fetch_all(lever, frames);
    }
    return mode;
}

#endif
