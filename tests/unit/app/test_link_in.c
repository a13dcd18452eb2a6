/* Received frames: samples paired by counter; frames that are lost, corrupt, repeated, out of order or not for us. */
#include "app/instance.h"
#include "frames.h"

void setUp(void)
{
    lever_config_default(&config);
    start_bus();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver_many(400u));
}

static void assert_counts(uint32_t lost, uint32_t corrupt, uint32_t late)
{
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(lost, health().lost, "lost");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(corrupt, health().corrupt, "corrupt");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(late, health().late, "late");
}

static void assert_refused(const lever_frame_t *frame)
{
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, frame));
}

/* --- pairing ------------------------------------------------------------------------------------------------------ */

TEST(a_base_sample_without_its_lever_sample_coasts_and_counts_it_lost)
{
    next_pair();
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &base_frame));
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_THETA) && has_fault(LEVER_FAULT_THETA_DOT) && has_fault(LEVER_FAULT_TORQUE));
    assert_counts(1u, 0u, 0u);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &lever_frame)); /* too late to be used */
    const lever_memory_t before = memory;
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever)); /* nothing to step with */
    TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver());
}

TEST(a_lever_sample_serves_the_one_base_sample_with_its_counter)
{
    next_pair();
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &lever_frame));
    next_pair();
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &base_frame));
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
    assert_counts(2u, 0u, 0u); /* this lever sample, and a sample by time */
    (void)deliver();
    for (uint32_t k = 0u; k < 16u; k++) { /* until the counter comes round again */
        next_pair();
        (void)lever_on_frame(lever, &base_frame);
        TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
    }
    assert_counts(18u, 0u, 0u);
}

/* And for nothing else of its turn; nor does one from before a reset. */
TEST(a_grip_sample_serves_the_one_base_sample_with_its_counter)
{
    const message_grip_sample_t grip = {.grip_force = 12.5f, .grip_force_valid = true};
    const lever_sample_t *sample = &lever->link.sample;
    lever_command_t reset = command_none();
    lever_frame_t frame;
    TEST_ASSERT_TRUE(message_grip_sample_encode(&frame, &grip));
    next_pair();
    e2e_protect(&frame, (uint8_t)MESSAGE_GRIP_SAMPLE_DATA_ID, e2e_counter(&base_frame));
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    (void)take_pair();
    TEST_ASSERT_TRUE(sample->grip_force_valid && (sample->grip_force == 12.5f));
    for (uint32_t k = 0u; k < 17u; k++) {
        (void)deliver();
        TEST_ASSERT_FALSE(sample->grip_force_valid);
    }
    next_pair();
    e2e_protect(&frame, (uint8_t)MESSAGE_GRIP_SAMPLE_DATA_ID, e2e_counter(&base_frame));
    (void)lever_on_frame(lever, &frame);
    (void)lever_on_frame(lever, &lever_frame);
    reset.request = (uint8_t)LEVER_REQUEST_RESET;
    frame = command_frame(&reset);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &base_frame));
    TEST_ASSERT_FALSE(sample->grip_force_valid || sample->theta_valid);
}

/* A LEVER_SAMPLE whose pair, and then fifteen more, were lost: the next BASE_SAMPLE has its counter. */
/* R19 */
TEST(a_lever_sample_is_not_paired_with_a_base_sample_sixteen_later)
{
    const message_grip_sample_t grip = {.grip_force = 12.5f, .grip_force_valid = true};
    lever_frame_t frame;
    for (uint32_t round = 1u; round < 4u; round++) {
        next_pair();
        TEST_ASSERT_TRUE(message_grip_sample_encode(&frame, &grip));
        e2e_protect(&frame, (uint8_t)MESSAGE_GRIP_SAMPLE_DATA_ID, e2e_counter(&base_frame));
        TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
        TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &lever_frame));
        for (uint32_t k = 0u; k < (16u * round); k++) {
            next_pair();
        }
        TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &base_frame));
        TEST_ASSERT_FALSE(lever->link.sample.theta_valid || lever->link.sample.theta_dot_valid);
        TEST_ASSERT_FALSE(lever->link.sample.tau_m_valid || lever->link.sample.grip_force_valid);
        TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver_many(20u));
    }
}

/* A sample comes fifteen periods after the last: within them the counters tell one from another. */
TEST(a_pair_after_a_shorter_gap_is_one)
{
    for (uint32_t k = 0u; k < 12u; k++) {
        next_pair();
    }
    (void)sample_after(2u);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver());
}

/* By the validity bits of each value; and a code for "not available", or an end of the range, is no measurement,
 * whatever its flag says. */
/* R31 */
TEST(values_that_are_not_valid_not_available_or_saturated_are_missing)
{
    const uint32_t code[3] = {0x8000u, 0x8001u, 0x7FFFu};
    const uint32_t fault[4] = {LEVER_FAULT_THETA, LEVER_FAULT_THETA_DOT, LEVER_FAULT_TORQUE, LEVER_FAULT_BASE};
    (void)deliver_many(3000u);
    TEST_ASSERT_EQUAL_UINT32(0u, health().faults);
    for (uint32_t k = 0u; k < 16u; k++) {
        const uint32_t which = k % 4u;
        next_pair();
        lever_frame_t *const frame = (which < 3u) ? &lever_frame : &base_frame;
        const uint32_t place = (which < 3u) ? which : 0u;
        if (k < 4u) {
            frame->data[1] &= (uint8_t)(0xFFu - (0x10u << place));
        } else {
            frame->data[2u + (2u * place)] = (uint8_t)code[(k / 4u) - 1u];
            frame->data[3u + (2u * place)] = (uint8_t)(code[(k / 4u) - 1u] >> 8u);
        }
        e2e_protect(frame, (uint8_t)((which < 3u) ? 1u : 17u), e2e_counter(frame)); /* E2EDataIdBase of the DBC */
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, take_pair());
        TEST_ASSERT_EQUAL_UINT32(fault[which], health().faults);
    }
    assert_counts(0u, 0u, 0u);
}

TEST(one_step_from_the_ends_of_the_range_is_measured)
{
    const uint8_t code[2][2] = {{0xFEu, 0x7Fu}, {0x02u, 0x80u}};
    for (uint32_t k = 0u; k < 2u; k++) {
        next_pair();
        for (uint32_t i = 0u; i < 2u; i++) {
            base_frame.data[2u + i] = code[k][i];
            for (uint32_t place = 2u; place < 8u; place += 2u) {
                lever_frame.data[place + i] = code[k][i];
            }
        }
        e2e_protect(&lever_frame, 1u, e2e_counter(&lever_frame));
        e2e_protect(&base_frame, 17u, e2e_counter(&base_frame));
        (void)lever_on_frame(lever, &lever_frame);
        TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &base_frame));
        const lever_sample_t *const sample = &lever->link.sample;
        TEST_ASSERT_TRUE(sample->theta_valid && sample->theta_dot_valid && sample->tau_m_valid && sample->z_ddot_valid);
    }
}

/* An outage may end at any counter: those that look like a repetition or a step back cost a few frames more. */
/* R21 */
TEST(after_an_outage_of_any_length_samples_are_taken_again_within_three)
{
    const lever_memory_t before = memory;
    for (uint32_t outage = 1u; outage < 70u; outage++) {
        enum lever_frame_result result = LEVER_FRAME_REFUSED;
        memory = before;
        time_us = 400u * (uint32_t)PERIOD_US;
        counter = 0u;
        for (uint32_t k = 0u; k < outage; k++) {
            next_pair();
        }
        for (uint32_t k = 0u; (k < 3u) && (result != LEVER_FRAME_SAMPLE); k++) {
            next_pair();
            (void)lever_on_frame(lever, &lever_frame);
            result = lever_on_frame(lever, &base_frame);
        }
        TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, result);
        (void)lever_step(lever);
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_GAP) && (health().lost >= outage));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver());
    }
}

/* --- corrupt and repeated ----------------------------------------------------------------------------------------- */

/* R18 */
TEST(every_single_bit_error_wrong_length_or_identifier_is_refused_counted_and_said)
{
    next_pair();
    for (uint32_t k = 0u; k < 67u; k++) {
        lever_frame_t damaged[2] = {lever_frame, base_frame};
        for (uint32_t f = 0u; f < 2u; f++) {
            if (k < 64u) {
                damaged[f].data[k / 8u] ^= (uint8_t)(1u << (k % 8u));
            } else if (k < 66u) {
                damaged[f].length = (uint8_t)(7u * (k - 64u));
            } else {
                damaged[f].id ^= 1u; /* that of the other */
            }
            assert_refused(&damaged[f]);
        }
    }
    assert_counts(0u, 134u, 0u);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, take_pair());
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_COMMUNICATION));
    (void)deliver();
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_COMMUNICATION));
}

/* R19 */
TEST_EACH(2, a_pair_that_is_repeated_or_was_overtaken_is_refused_as_late)
{
    next_pair();
    const lever_frame_t overtaken[2] = {lever_frame, base_frame};
    (void)deliver();
    assert_refused((test_round == 0u) ? &lever_frame : &overtaken[0]);
    assert_refused((test_round == 0u) ? &base_frame : &overtaken[1]);
    assert_counts(1u, 0u, 2u);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver());
}

/* R20 */
TEST(foreign_frames_are_ignored_without_a_trace)
{
    const lever_memory_t before = memory;
    for (uint32_t id = 0u; id <= 0x7FFu; id++) {
        const lever_frame_t frame = {.id = id, .length = 8u};
        const bool ours = ((id >= 0x110u) && (id <= 0x112u)) || (id == 0x120u) || (id == 0x217u); /* of the DBC */
        if (!ours) {
            TEST_ASSERT_EQUAL(LEVER_FRAME_IGNORED, lever_on_frame(lever, &frame));
        }
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
}

/* --- COMMAND ------------------------------------------------------------------------------------------------------ */

/* The answer, which is due at once, and nothing else is. */
static message_command_ack_t answer_to(const lever_frame_t *frame)
{
    message_command_ack_t ack;
    const enum lever_frame_result result = lever_on_frame(lever, frame);
    TEST_ASSERT_EQUAL_UINT32(1u, fetch());
    TEST_ASSERT_TRUE(message_command_ack_decode(&ack, &frames[0]));
    TEST_ASSERT_EQUAL_UINT8(e2e_counter(frame), ack.command_counter);
    const bool accepted = (ack.result == (uint8_t)MESSAGE_RESULT_ACCEPTED);
    TEST_ASSERT_EQUAL(accepted ? LEVER_FRAME_TAKEN : LEVER_FRAME_REFUSED, result);
    return ack;
}

static uint8_t send(const lever_command_t *command)
{
    const lever_frame_t frame = command_frame(command);
    return answer_to(&frame).result;
}

static lever_frame_t dither_frame(float rms)
{
    lever_command_t command = command_none();
    command.dither_rms = rms;
    return command_frame(&command);
}

TEST(a_command_is_carried_out_before_the_next_sample_and_answered_with_the_choices_as_they_stand)
{
    lever_command_t command = {.request = LEVER_REQUEST_FREEZE,
        .model = LEVER_MODEL_LINEAR_BLACK_BOX,
        .preload = LEVER_PRELOAD_FIXED,
        .estimator = LEVER_ESTIMATOR_JOINT,
        .adaptation = LEVER_ADAPTATION_FORGETTING,
        .dither_rms = 1.2f}; /* more than torque_rms */
    const lever_frame_t frame = command_frame(&command);
    const message_command_ack_t ack = answer_to(&frame);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_ACCEPTED, ack.result);
    TEST_ASSERT_EQUAL_UINT8(command.model, ack.model);
    TEST_ASSERT_EQUAL_UINT8(command.preload, ack.preload);
    TEST_ASSERT_EQUAL_UINT8(command.estimator, ack.estimator);
    TEST_ASSERT_EQUAL_UINT8(command.adaptation, ack.adaptation);
    TEST_ASSERT_EQUAL_FLOAT(config.settings.torque_rms, ack.dither_rms);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, deliver_many(400u));
}

/* R24 */
TEST(an_unknown_command_is_refused_said_and_changes_nothing_and_a_damaged_one_gets_no_answer)
{
    lever_command_t command = command_none();
    command.request = 9u;
    command.model = (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL;
    lever_frame_t frame = command_frame(&command);
    const message_command_ack_t ack = answer_to(&frame);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_UNKNOWN_VALUE, ack.result);
    TEST_ASSERT_EQUAL_UINT8(LEVER_MODEL_LEVER, ack.model);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver());
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_COMMUNICATION));
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    frame = command_frame(&command);
    frame.data[2] ^= 1u;
    (void)fetch();
    assert_refused(&frame);
    TEST_ASSERT_EQUAL_UINT32(0u, fetch());
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, health().mode);
    assert_counts(0u, 2u, 0u);
}

TEST(a_command_that_the_port_refuses_is_counted_and_said)
{
    const lever_command_t command = command_none();
    const lever_frame_t frame = command_frame(&command);
    lever_refuse(lever, &frame, (uint8_t)MESSAGE_RESULT_NOT_SAFE);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver());
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_COMMUNICATION));
    assert_counts(0u, 1u, 0u);
}

TEST(after_a_reset_a_sender_may_start_anew_with_any_counter_and_time)
{
    lever_command_t command = command_none();
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, send(&command));
    counter = (uint8_t)((counter + 15u) & 15u); /* the last one again */
    time_us = 0u;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver_many(310u));
    assert_counts(0u, 0u, 0u);
}

/* Whoever asks for no torque gets none, whatever his counter says; all else of such a frame is refused. */
/* R25 */
TEST(off_is_obeyed_in_any_order)
{
    lever_command_t off = command_none();
    const lever_frame_t on = dither_frame(0.3f);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_ACCEPTED, answer_to(&on).result);
    command_counter = (uint8_t)(command_counter + 9u); /* a sender that has started again */
    const lever_frame_t more = dither_frame(0.5f);
    TEST_ASSERT_EQUAL_FLOAT(0.3f, answer_to(&more).dither_rms);
    off.request = (uint8_t)LEVER_REQUEST_FREEZE;
    off.dither_rms = 0.0f;
    const lever_frame_t frame = command_frame(&off);
    const message_command_ack_t ack = answer_to(&frame);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_SEQUENCE, ack.result);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, ack.dither_rms);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, deliver());
}

/* Once it turned the dither on again. */
/* R25 */
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
    assert_counts(0u, 0u, 40u);
    (void)deliver_many(500u);
    TEST_ASSERT_TRUE(health().torque == 0.0f);
}

/* Up to three may be lost; and a second after the last one, a sender may start anywhere but there, with its second one. */
TEST(a_command_is_accepted_by_its_place_in_the_sequence)
{
    const struct {
        uint8_t counter;
        uint32_t after_ms;
        enum message_result result;
    } rows[] = {{7u, 1u, MESSAGE_RESULT_ACCEPTED}, {7u, 1u, MESSAGE_RESULT_SEQUENCE}, {8u, 1u, MESSAGE_RESULT_ACCEPTED},
        {12u, 1u, MESSAGE_RESULT_ACCEPTED}, {1u, 1u, MESSAGE_RESULT_SEQUENCE}, {11u, 1u, MESSAGE_RESULT_SEQUENCE},
        {0u, 1u, MESSAGE_RESULT_ACCEPTED}, {9u, 1000u, MESSAGE_RESULT_SEQUENCE}, {9u, 1u, MESSAGE_RESULT_SEQUENCE},
        {11u, 1u, MESSAGE_RESULT_SEQUENCE}, {12u, 1u, MESSAGE_RESULT_ACCEPTED}, {13u, 1000u, MESSAGE_RESULT_ACCEPTED},
        {13u, 1001u, MESSAGE_RESULT_SEQUENCE}, {12u, 1u, MESSAGE_RESULT_SEQUENCE}, {13u, 1u, MESSAGE_RESULT_SEQUENCE},
        {14u, 1u, MESSAGE_RESULT_ACCEPTED}};
    const lever_command_t nothing = command_none();
    for (uint32_t k = 0u; k < (sizeof rows / sizeof rows[0]); k++) {
        (void)deliver_many(rows[k].after_ms);
        command_counter = rows[k].counter;
        TEST_ASSERT_EQUAL(rows[k].result, send(&nothing));
    }
}

/* A sender that hangs: a mailbox is sent again and again. Its counter is right once in 16 for one that starts anew. */
/* R39 */
TEST(a_counter_that_stands_keeps_torque_for_a_second_and_never_starts_it_again)
{
    const lever_frame_t on = dither_frame(0.3f);
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, answer_to(&on).result);
    for (uint32_t k = 0u; k < 50u; k++) {
        (void)deliver_many(100u);
        TEST_ASSERT_EQUAL((k < 10u) || (health().torque == 0.0f), true);
        TEST_ASSERT_EQUAL(MESSAGE_RESULT_SEQUENCE, answer_to(&on).result);
    }
    const lever_frame_t anew = dither_frame(0.3f); /* with the counter after it */
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, answer_to(&anew).result);
    (void)deliver_many(900u);
    TEST_ASSERT_TRUE(health().torque != 0.0f);
}

/* Two that hang, one after the other, with whatever counters: together, too, they keep torque for two seconds at most. */
/* R39 */
TEST_EACH(16, two_counters_that_stand_do_not_keep_torque)
{
    uint32_t driven = 0u;
    for (uint32_t k = 0u; k < 300u; k++) {
        command_counter = (uint8_t)(3u + (((k % 2u) == 0u) ? 0u : test_round));
        const lever_frame_t on = dither_frame(0.3f);
        (void)answer_to(&on);
        for (uint32_t ms = 0u; ms < 100u; ms++) {
            (void)deliver_many(1u);
            driven += (health().torque != 0.0f) ? 1u : 0u;
        }
    }
    TEST_ASSERT_LESS_THAN_UINT32(2200u, driven);
}

/* R25 */
TEST(no_mitigation_is_obeyed_in_any_order)
{
    lever_command_t command = command_none();
    command.mitigation = (uint8_t)LEVER_MITIGATION_NOTCH_AND_DAMPING;
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACCEPTED, send(&command));
    command_counter = (uint8_t)(command_counter + 9u);
    command.mitigation = (uint8_t)LEVER_MITIGATION_DAMPING;
    lever_frame_t frame = command_frame(&command);
    TEST_ASSERT_EQUAL_UINT8(LEVER_MITIGATION_NOTCH_AND_DAMPING, answer_to(&frame).mitigation);
    command.mitigation = (uint8_t)LEVER_MITIGATION_NONE;
    frame = command_frame(&command);
    const message_command_ack_t ack = answer_to(&frame);
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_RESULT_SEQUENCE, ack.result);
    TEST_ASSERT_EQUAL_UINT8(LEVER_MITIGATION_NONE, ack.mitigation);
}

/* --- another estimator -------------------------------------------------------------------------------------------- */

/* R27 */
TEST(an_identity_on_the_bus_is_another_estimator_for_two_seconds_unless_it_is_damaged)
{
    const message_identity_t identity = {.page = (uint8_t)MESSAGE_PAGE_VERSION, .firmware_minor = 1u};
    lever_frame_t frame;
    TEST_ASSERT_TRUE(message_identity_encode(&frame, &identity));
    e2e_protect(&frame, (uint8_t)MESSAGE_IDENTITY_DATA_ID, 9u);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    (void)deliver_many(1999u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_DUPLICATE));
    (void)deliver_many(1u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_DUPLICATE));
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    lever_idle(lever, 1999999u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_DUPLICATE));
    lever_idle(lever, 1u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_DUPLICATE));
    frame.data[3] ^= 4u;
    assert_refused(&frame);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_DUPLICATE));
    assert_counts(0u, 1u, 0u);
}
