/* COMMAND frames: what each does, in which sequence it is accepted, how it is answered; and a foreign IDENTITY. */
#include "frames.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static sender_t sender;

void setUp(void)
{
    lever_config_default(&config);
    lever = lever_init(&memory, &config);
    sender = sender_typical();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_run(&sender, lever, 400u));
}

static void assert_counts(uint32_t corrupt, uint32_t late)
{
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(corrupt, rig_health(lever).corrupt, "corrupt");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(late, rig_health(lever).late, "late");
}

/* The answer, which is due at once, and nothing else is. */
static message_command_ack_t answer_to(const lever_frame_t *frame)
{
    lever_frame_t frames[FRAMES_MOST];
    message_command_ack_t ack;
    const enum lever_frame_result result = lever_on_frame(lever, frame);
    TEST_ASSERT_EQUAL_UINT32(1u, fetch_all(lever, frames));
    TEST_ASSERT_TRUE(message_command_ack_decode(&ack, &frames[0]));
    TEST_ASSERT_EQUAL_UINT8(e2e_counter(frame), ack.command_counter);
    const bool accepted = (ack.result == (uint8_t)MESSAGE_RESULT_ACCEPTED);
    TEST_ASSERT_EQUAL(accepted ? LEVER_FRAME_TAKEN : LEVER_FRAME_REFUSED, result);
    return ack;
}

static uint8_t send(const lever_command_t *command)
{
    const lever_frame_t frame = sender_command(&sender, command);
    return answer_to(&frame).result;
}

static lever_frame_t dither_frame(float rms)
{
    lever_command_t command = rig_command();
    command.dither_rms = rms;
    return sender_command(&sender, &command);
}

/* --- what it does, and the answer --------------------------------------------------------------------------------- */

TEST(a_command_is_carried_out_before_the_next_sample)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)LEVER_REQUEST_FREEZE;
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, send(&command));
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, sender_deliver(&sender, lever));
}

TEST(the_answer_has_the_choices_as_they_stand)
{
    lever_command_t command = rig_command();
    command.model = (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX;
    command.preload = (uint8_t)LEVER_PRELOAD_FIXED;
    command.estimator = (uint8_t)LEVER_ESTIMATOR_JOINT;
    command.adaptation = (uint8_t)LEVER_ADAPTATION_FORGETTING;
    command.dither_rms = 1.2f; /* more than torque_rms */
    const lever_frame_t frame = sender_command(&sender, &command);
    const message_command_ack_t ack = answer_to(&frame);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_ACCEPTED, ack.result);
    TEST_ASSERT_EQUAL_UINT8(command.model, ack.model);
    TEST_ASSERT_EQUAL_UINT8(command.preload, ack.preload);
    TEST_ASSERT_EQUAL_UINT8(command.estimator, ack.estimator);
    TEST_ASSERT_EQUAL_UINT8(command.adaptation, ack.adaptation);
    TEST_ASSERT_EQUAL_FLOAT(config.settings.torque_rms, ack.dither_rms);
}

TEST(an_unknown_command_is_refused_said_and_changes_nothing)
{
    lever_command_t command = rig_command();
    command.request = 9u;
    command.model = (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL;
    const lever_frame_t frame = sender_command(&sender, &command);
    const message_command_ack_t ack = answer_to(&frame);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_UNKNOWN_VALUE, ack.result);
    TEST_ASSERT_EQUAL_UINT8(LEVER_MODEL_LEVER, ack.model);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_deliver(&sender, lever));
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_COMMUNICATION, rig_health(lever).faults);
    assert_counts(1u, 0u);
}

TEST(a_damaged_command_is_corrupt_and_gets_no_answer)
{
    lever_frame_t frames[FRAMES_MOST];
    lever_command_t command = rig_command();
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    lever_frame_t frame = sender_command(&sender, &command);
    frame.data[2] ^= 1u;
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &frame));
    TEST_ASSERT_EQUAL_UINT32(0u, fetch_all(lever, frames));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_health(lever).mode);
    assert_counts(1u, 0u);
}

TEST(after_a_reset_a_sender_may_start_anew_with_any_counter_and_time)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, send(&command));
    sender.counter = (uint8_t)((sender.counter + 15u) & 15u); /* the last one again */
    sender.rig.time_us = 0u;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_run(&sender, lever, 310u));
    assert_counts(0u, 0u);
}

/* --- sequence ----------------------------------------------------------------------------------------------------- */

/* Whoever asks for no torque gets none, whatever his counter says; all else of such a frame is refused. */
TEST(off_is_obeyed_in_any_order)
{
    lever_command_t off = rig_command();
    const lever_frame_t on = dither_frame(0.3f);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_ACCEPTED, answer_to(&on).result);
    off.request = (uint8_t)LEVER_REQUEST_FREEZE;
    off.dither_rms = 0.0f;
    sender.command_counter = (uint8_t)(sender.command_counter + 9u); /* a sender that has started again */
    const lever_frame_t frame = sender_command(&sender, &off);
    const message_command_ack_t ack = answer_to(&frame);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_SEQUENCE, ack.result);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, ack.dither_rms);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_deliver(&sender, lever));
}

/* Once it turned the dither on again. */
TEST(an_on_that_is_sent_again_after_an_off_is_refused_however_often)
{
    const lever_frame_t on = dither_frame(0.3f);
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, answer_to(&on).result);
    const lever_frame_t keep_alive = dither_frame((float)LEVER_KEEP);
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, answer_to(&keep_alive).result);
    const lever_frame_t off = dither_frame(0.0f);
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, answer_to(&off).result);
    for (uint32_t k = 0u; k < 40u; k++) {
        const message_command_ack_t ack = answer_to(&on);
        TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_SEQUENCE, ack.result);
        TEST_ASSERT_TRUE(ack.dither_rms == 0.0f);
    }
    assert_counts(0u, 40u);
    (void)sender_run(&sender, lever, 500u);
    TEST_ASSERT_TRUE(rig_health(lever).torque == 0.0f);
}

TEST(a_command_after_three_lost_ones_is_accepted_and_after_more_is_not)
{
    const struct {
        uint8_t step;
        enum message_result result;
    } rows[] = {{0u, MESSAGE_RESULT_SEQUENCE}, {1u, MESSAGE_RESULT_ACCEPTED}, {4u, MESSAGE_RESULT_ACCEPTED},
        {5u, MESSAGE_RESULT_SEQUENCE}, {15u, MESSAGE_RESULT_SEQUENCE}};
    const lever_command_t nothing = rig_command();
    for (uint32_t k = 0u; k < (sizeof rows / sizeof rows[0]); k++) {
        setUp();
        sender.command_counter = 7u; /* the first may have any */
        TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, send(&nothing));
        sender.command_counter = (uint8_t)((7u + rows[k].step) & 15u);
        TEST_ASSERT_EQUAL(rows[k].result, send(&nothing));
    }
}

TEST(a_second_after_the_last_command_a_sender_may_start_anywhere)
{
    const lever_command_t nothing = rig_command();
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, send(&nothing));
    (void)sender_run(&sender, lever, 1000u);
    sender.command_counter = 0u;
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_SEQUENCE, send(&nothing));
    (void)sender_run(&sender, lever, 1u);
    sender.command_counter = 0u;
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, send(&nothing));
}

/* --- another estimator -------------------------------------------------------------------------------------------- */

static lever_frame_t foreign_identity(void)
{
    lever_frame_t frame;
    const message_identity_t identity = {.page = (uint8_t)MESSAGE_PAGE_VERSION, .firmware_minor = 1u};
    TEST_ASSERT_TRUE(message_identity_encode(&frame, &identity));
    e2e_protect(&frame, (uint8_t)MESSAGE_IDENTITY_DATA_ID, 9u);
    return frame;
}

TEST(an_identity_on_the_bus_is_another_estimator_for_two_seconds)
{
    const lever_frame_t frame = foreign_identity();
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    (void)sender_run(&sender, lever, 1999u);
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_DUPLICATE, rig_health(lever).faults);
    (void)sender_run(&sender, lever, 1u);
    TEST_ASSERT_BITS_LOW(LEVER_FAULT_DUPLICATE, rig_health(lever).faults);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    lever_idle(lever, 2000000u);
    TEST_ASSERT_BITS_LOW(LEVER_FAULT_DUPLICATE, rig_health(lever).faults);
}

TEST(a_damaged_identity_is_corrupt_and_nobody)
{
    lever_frame_t frame = foreign_identity();
    frame.data[3] ^= 4u;
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &frame));
    TEST_ASSERT_BITS_LOW(LEVER_FAULT_DUPLICATE, rig_health(lever).faults);
    assert_counts(1u, 0u);
}

/* Each hears the other, and says so in HEALTH. */
TEST(two_firmwares_on_one_bus_notice_each_other)
{
    lever_memory_t other_memory;
    lever_t *const both[2] = {lever, lever_init(&other_memory, &config)};
    uint32_t told[2] = {0u};
    for (uint32_t k = 0u; k < 1200u; k++) {
        lever_frame_t frames[FRAMES_MOST];
        sender_next(&sender);
        for (uint32_t who = 0u; who < 2u; who++) {
            (void)lever_on_frame(both[who], &sender.lever);
            (void)lever_on_frame(both[who], &sender.base);
            (void)lever_step(both[who]);
        }
        for (uint32_t who = 0u; who < 2u; who++) {
            const uint32_t count = fetch_all(both[who], frames);
            for (uint32_t f = 0u; f < count; f++) {
                message_health_t health = {.faults = 0u};
                (void)lever_on_frame(both[1u - who], &frames[f]);
                told[who] += (message_health_decode(&health, &frames[f]) &&
                                 ((health.faults & (uint32_t)LEVER_FAULT_DUPLICATE) != 0u))
                                 ? 1u
                                 : 0u;
            }
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT32(10u, told[0]);
    TEST_ASSERT_GREATER_THAN_UINT32(10u, told[1]);
}
