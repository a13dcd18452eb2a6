/* Frames of the lever, as an inceptor would send them, and what the instance answers. */
#ifndef UNIT_APP_FRAMES_H
#define UNIT_APP_FRAMES_H

#include "can/e2e.h"
#include "can/messages.h"
#include "rig.h"

enum { FRAMES_MOST = 16 };

static uint8_t counter;         /* of the next pair */
static uint8_t command_counter; /* and COMMAND */
static lever_frame_t lever_frame;
static lever_frame_t base_frame;
static lever_frame_t frames[FRAMES_MOST]; /* the last answers */

/* Makes the frames of the next sample. */
static inline void next_pair(void)
{
    const lever_sample_t s = sample_after(1u);
    const message_lever_sample_t lever_sample = {.theta = s.theta,
        .theta_dot = s.theta_dot,
        .tau_m = s.tau_m,
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = true};
    const message_base_sample_t base_sample = {.time_us = s.time_us, .z_ddot = s.z_ddot, .z_ddot_valid = true};
    TEST_ASSERT_TRUE(message_lever_sample_encode(&lever_frame, &lever_sample));
    TEST_ASSERT_TRUE(message_base_sample_encode(&base_frame, &base_sample));
    e2e_protect(&lever_frame, (uint8_t)MESSAGE_LEVER_SAMPLE_DATA_ID, counter);
    e2e_protect(&base_frame, (uint8_t)MESSAGE_BASE_SAMPLE_DATA_ID, counter);
    counter = (uint8_t)((counter + 1u) & 15u);
}

/* The answers that are due, in frames[]; their number. */
static inline uint32_t fetch(void)
{
    uint32_t count = 0u;
    while (lever_next_frame(lever, &frames[count])) {
        count++;
        TEST_ASSERT_LESS_THAN_UINT32(FRAMES_MOST, count);
    }
    return count;
}

/* Takes the present pair, and steps. */
static inline enum lever_mode take_pair(void)
{
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &lever_frame));
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &base_frame));
    return lever_step(lever);
}

static inline enum lever_mode deliver(void)
{
    next_pair();
    return take_pair();
}

/* Answers to the next sample. */
static inline uint32_t answers(void)
{
    (void)deliver();
    return fetch();
}

/* As many samples, whose answers are thrown away. */
static inline enum lever_mode deliver_many(uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        mode = deliver();
        (void)fetch();
    }
    return mode;
}

static inline lever_frame_t command_frame(const lever_command_t *command)
{
    lever_frame_t frame;
    TEST_ASSERT_TRUE(message_command_encode(&frame, command));
    e2e_protect(&frame, (uint8_t)MESSAGE_COMMAND_DATA_ID, command_counter);
    command_counter = (uint8_t)((command_counter + 1u) & 15u);
    return frame;
}

static inline void start_bus(void)
{
    counter = 0u;
    command_counter = 0u;
    start();
}

#endif
