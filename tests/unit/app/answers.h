/* An instance on a bus, and what it answers: for the tests of what is sent. */
#ifndef UNIT_APP_ANSWERS_H
#define UNIT_APP_ANSWERS_H

#include "frames.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static sender_t sender;
static lever_frame_t frames[FRAMES_MOST];

static inline void start(void)
{
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    sender = sender_typical();
}

static inline void dither(float rms)
{
    lever_command_t command = rig_command();
    command.dither_rms = rms;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

/* The next sample; its answers in frames[]. */
static inline uint32_t answers(void)
{
    (void)sender_deliver(&sender, lever);
    return fetch_all(lever, frames);
}

static inline void publish_always(void)
{
    config.settings.publish_period = 1.0e-4f;
    start();
}

#endif
