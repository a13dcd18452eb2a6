/* Received frames: pairing by counter, frames that are lost, corrupt, repeated, out of order or not for us. */
#include "frames.h"

static lever_memory_t memory;
static lever_t *lever;
static sender_t sender;

void setUp(void)
{
    static lever_config_t config;
    lever_config_default(&config);
    lever = lever_init(&memory, &config);
    sender = sender_typical();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_run(&sender, lever, 400u));
}

static uint32_t faults(void)
{
    return rig_health(lever).faults;
}

static void assert_counts(uint32_t lost, uint32_t corrupt, uint32_t late)
{
    const lever_health_t health = rig_health(lever);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(lost, health.lost, "lost");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(corrupt, health.corrupt, "corrupt");
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(late, health.late, "late");
}

/* --- pairing ------------------------------------------------------------------------------------------------------ */

TEST(a_pair_is_a_sample_without_fault)
{
    (void)sender_run(&sender, lever, 3000u);
    TEST_ASSERT_EQUAL_UINT32(0u, faults());
    assert_counts(0u, 0u, 0u);
    TEST_ASSERT_EQUAL_UINT32(3400u, rig_health(lever).samples);
}

TEST(estimates_over_can_are_those_of_the_decoded_samples)
{
    lever_memory_t other_memory;
    static lever_config_t config;
    lever_config_default(&config);
    lever_t *other = lever_init(&other_memory, &config);
    setUp();
    sender = sender_typical();
    lever = lever_init(&memory, &config);
    for (uint32_t k = 0u; k < 2000u; k++) {
        message_lever_sample_t decoded;
        message_base_sample_t base;
        (void)sender_deliver(&sender, lever);
        TEST_ASSERT_TRUE(message_lever_sample_decode(&decoded, &sender.lever));
        TEST_ASSERT_TRUE(message_base_sample_decode(&base, &sender.base));
        lever_sample_t sample = sender.sample;
        sample.theta = decoded.theta;
        sample.theta_dot = decoded.theta_dot;
        sample.tau_m = decoded.tau_m;
        sample.z_ddot = base.z_ddot;
        (void)lever_update(other, &sample);
        rig_assert_same_estimates(lever, other);
    }
}

TEST(a_base_sample_without_its_lever_sample_coasts_and_counts_it_lost)
{
    sender_next(&sender);
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &sender.base));
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
    const uint32_t missing =
        (uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_THETA_DOT | (uint32_t)LEVER_FAULT_TORQUE;
    TEST_ASSERT_EQUAL_UINT32(missing, faults() & missing);
    assert_counts(1u, 0u, 0u);
}

TEST(a_lever_sample_of_another_counter_is_not_paired)
{
    sender_next(&sender);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &sender.lever));
    sender_next(&sender);
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &sender.base));
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
    assert_counts(2u, 0u, 0u); /* this lever sample, and a sample by time */
}

TEST(a_lever_sample_serves_one_base_sample_only)
{
    (void)sender_run(&sender, lever, 1u);
    for (uint32_t k = 0u; k < 16u; k++) { /* until the counter comes round again */
        sender_next(&sender);
        (void)lever_on_frame(lever, &sender.base);
        TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
    }
    assert_counts(16u, 0u, 0u);
}

TEST(a_lever_sample_that_comes_after_its_base_sample_is_not_used)
{
    sender_next(&sender);
    (void)lever_on_frame(lever, &sender.base);
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever));
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &sender.lever));
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, lever_step(lever)); /* nothing to step with */
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_deliver(&sender, lever));
}

TEST(step_without_a_sample_does_nothing)
{
    lever_frame_t frames[FRAMES_MOST];
    (void)fetch_all(lever, frames);
    const lever_memory_t before = memory;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_step(lever));
    TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
    TEST_ASSERT_EQUAL_UINT32(0u, fetch_all(lever, frames));
}

TEST(validity_bits_are_those_of_each_value)
{
    const uint32_t fault[4] = {(uint32_t)LEVER_FAULT_THETA, (uint32_t)LEVER_FAULT_THETA_DOT,
        (uint32_t)LEVER_FAULT_TORQUE, (uint32_t)LEVER_FAULT_BASE};
    (void)sender_run(&sender, lever, 3000u);
    for (uint32_t which = 0u; which < 4u; which++) {
        sender_next(&sender);
        const uint8_t bit = (uint8_t)(0x10u << ((which < 3u) ? which : 0u));
        lever_frame_t *const frame = (which < 3u) ? &sender.lever : &sender.base;
        frame->data[1] &= (uint8_t)(0xFFu - bit);
        e2e_protect(frame, (uint8_t)((which < 3u) ? 1u : 17u), e2e_counter(frame));
        (void)lever_on_frame(lever, &sender.lever);
        (void)lever_on_frame(lever, &sender.base);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_step(lever));
        TEST_ASSERT_EQUAL_UINT32(fault[which], faults());
    }
}

/* --- lost --------------------------------------------------------------------------------------------------------- */

TEST(lost_pairs_are_counted_by_time)
{
    sender_next(&sender);
    sender_next(&sender);
    sender_next(&sender);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_deliver(&sender, lever));
    assert_counts(3u, 0u, 0u);
    TEST_ASSERT_TRUE((faults() & (uint32_t)LEVER_FAULT_GAP) != 0u);
}

/* An outage may end at any counter: those that look like a repetition or a step back cost a few frames more. */
TEST(after_an_outage_of_any_length_samples_are_taken_again_within_three)
{
    for (uint32_t outage = 1u; outage < 70u; outage++) {
        setUp();
        for (uint32_t k = 0u; k < outage; k++) {
            sender_next(&sender);
        }
        enum lever_frame_result result = LEVER_FRAME_REFUSED;
        for (uint32_t k = 0u; (k < 3u) && (result != LEVER_FRAME_SAMPLE); k++) {
            sender_next(&sender);
            (void)lever_on_frame(lever, &sender.lever);
            result = lever_on_frame(lever, &sender.base);
        }
        TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, result);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_step(lever));
    }
}

/* --- corrupt and repeated ----------------------------------------------------------------------------------------- */

TEST(every_single_bit_error_is_refused_counted_and_said)
{
    sender_next(&sender);
    for (uint32_t bit = 0u; bit < 64u; bit++) {
        lever_frame_t damaged = sender.lever;
        damaged.data[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &damaged));
        damaged = sender.base;
        damaged.data[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &damaged));
    }
    assert_counts(0u, 128u, 0u);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &sender.lever));
    TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &sender.base));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_step(lever));
    TEST_ASSERT_TRUE((faults() & (uint32_t)LEVER_FAULT_COMMUNICATION) != 0u);
    (void)sender_deliver(&sender, lever);
    TEST_ASSERT_EQUAL_UINT32(0u, faults() & (uint32_t)LEVER_FAULT_COMMUNICATION);
}

TEST(a_wrong_length_is_corrupt)
{
    sender_next(&sender);
    sender.lever.length = 7u;
    sender.base.length = 0u;
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &sender.lever));
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &sender.base));
    assert_counts(0u, 2u, 0u);
}

TEST(a_repeated_pair_is_refused_as_late)
{
    (void)sender_deliver(&sender, lever);
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &sender.lever));
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &sender.base));
    assert_counts(0u, 0u, 2u);
}

TEST(a_pair_that_was_overtaken_is_refused_as_late)
{
    sender_next(&sender);
    const sender_t overtaken = sender;
    (void)sender_deliver(&sender, lever);
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &overtaken.lever));
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &overtaken.base));
    assert_counts(1u, 0u, 2u);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_deliver(&sender, lever));
}

TEST(a_frame_under_the_identifier_of_the_other_is_corrupt)
{
    sender_next(&sender);
    sender.lever.id = (uint32_t)MESSAGE_BASE_SAMPLE_ID;
    TEST_ASSERT_EQUAL(LEVER_FRAME_REFUSED, lever_on_frame(lever, &sender.lever));
    assert_counts(0u, 1u, 0u);
}

TEST(foreign_frames_are_ignored_without_a_trace)
{
    const lever_memory_t before = memory;
    for (uint32_t id = 0u; id <= 0x7FFu; id++) {
        const lever_frame_t frame = {.id = id, .length = 8u};
        if ((id != (uint32_t)MESSAGE_LEVER_SAMPLE_ID) && (id != (uint32_t)MESSAGE_BASE_SAMPLE_ID) &&
            (id != (uint32_t)MESSAGE_GRIP_SAMPLE_ID) && (id != (uint32_t)MESSAGE_COMMAND_ID) &&
            (id != (uint32_t)MESSAGE_IDENTITY_ID)) {
            TEST_ASSERT_EQUAL(LEVER_FRAME_IGNORED, lever_on_frame(lever, &frame));
        }
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
}

/* A code for "not available" is no measurement, whatever its flag says. */
TEST(a_value_that_is_not_available_is_missing)
{
    (void)sender_run(&sender, lever, 3000u);
    sender_next(&sender);
    sender.lever.data[2] = 0x00u;
    sender.lever.data[3] = 0x80u;
    sender.base.data[2] = 0x00u;
    sender.base.data[3] = 0x80u;
    e2e_protect(&sender.lever, (uint8_t)MESSAGE_LEVER_SAMPLE_DATA_ID, e2e_counter(&sender.lever));
    e2e_protect(&sender.base, (uint8_t)MESSAGE_BASE_SAMPLE_DATA_ID, e2e_counter(&sender.base));
    (void)lever_on_frame(lever, &sender.lever);
    (void)lever_on_frame(lever, &sender.base);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_step(lever));
    TEST_ASSERT_EQUAL_UINT32((uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_BASE, faults());
    assert_counts(0u, 0u, 0u);
}
