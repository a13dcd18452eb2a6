/* Which COMMANDs reach the estimator, with an authentication that is played here: a keyed sum in place of a MAC, and a
 * counter as freshness value. */
#include <stddef.h>
#include <string.h>

#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "port/command_guard.h"
#include "test.h"

enum { QUEUE = 8, AUTHENTICATOR_ID = 0x121 };

static lever_frame_t queue[QUEUE];
static uint32_t first;
static uint32_t last;
static lever_memory_t memory;
static lever_config_t config;
static lever_t *lever;
static command_guard_t guard;
static uint64_t newest; /* freshness value accepted last */
static uint64_t key;
static bool safe;
static uint32_t sent_samples;

static const lever_command_t nothing = {.request = LEVER_REQUEST_NONE,
    .model = LEVER_KEEP,
    .preload = LEVER_KEEP,
    .estimator = LEVER_KEEP,
    .adaptation = LEVER_KEEP,
    .mitigation = LEVER_KEEP,
    .dither_rms = 65.535f};

static enum port_result receive(void *self, lever_frame_t *frame)
{
    TEST_ASSERT_EQUAL_PTR(queue, self);
    if (first == last) {
        return PORT_NOTHING;
    }
    *frame = queue[first++ % QUEUE];
    return PORT_DONE;
}

static bool on_ground(void *self)
{
    (void)self;
    return safe;
}

static bool freshness(void *self, uint32_t low, uint64_t *value)
{
    (void)self;
    *value = (newest & ~UINT64_C(0xFFFFFF)) | low;
    return *value > newest;
}

static void keyed_sum(const uint8_t *data, uint8_t *mac)
{
    uint64_t sum = key;
    for (uint32_t i = 0u; i < (uint32_t)COMMAND_GUARD_DATA; i++) {
        sum = (sum ^ data[i]) * UINT64_C(0x100000001B3);
        sum ^= sum >> 29u;
    }
    (void)memcpy(mac, &sum, COMMAND_GUARD_MAC);
}

static bool verify(void *self, const uint8_t *data, const uint8_t *mac)
{
    uint8_t right[COMMAND_GUARD_MAC];
    (void)self;
    keyed_sum(data, right);
    return memcmp(right, mac, sizeof right) == 0;
}

static void accepted(void *self, uint64_t value)
{
    (void)self;
    newest = value;
}

static const command_authentication_t authentication = {
    .id = AUTHENTICATOR_ID, .freshness = freshness, .verify = verify, .accepted = accepted};

void setUp(void)
{
    first = 0u;
    last = 0u;
    newest = 1000u;
    key = 0xFEEDu;
    safe = true;
    sent_samples = 0u;
    lever_config_default(&config);
    lever = lever_init(&memory, &config);
    guard = (command_guard_t){.receive = receive, .self = queue, .lever = lever, .takes_commands = true};
}

/* What the last COMMAND_ACK says, if there is one. */
static int32_t answer(void)
{
    lever_frame_t frame;
    message_command_ack_t ack = {.result = UINT8_MAX};
    while (lever_next_frame(lever, &frame)) {
        if (frame.id == (uint32_t)MESSAGE_COMMAND_ACK_ID) {
            TEST_ASSERT_TRUE(message_command_ack_decode(&ack, &frame));
            TEST_ASSERT_EQUAL_UINT8(0u, ack.command_counter);
        }
    }
    return (int32_t)ack.result;
}

static uint32_t refused(void)
{
    lever_health_t health;
    lever_health(lever, &health);
    return health.corrupt;
}

static lever_frame_t command(const lever_command_t *content)
{
    lever_frame_t frame;
    TEST_ASSERT_TRUE(message_command_encode(&frame, content));
    e2e_protect(&frame, MESSAGE_COMMAND_DATA_ID, 0u);
    return frame;
}

static void arrive(lever_frame_t frame)
{
    queue[last++ % QUEUE] = frame;
}

/* Whether a frame for the estimator is handed on, of what has arrived. */
static bool passes(void)
{
    lever_frame_t frame;
    uint32_t ours = 0u;
    while (command_guard_receive(&guard, &frame) == PORT_DONE) {
        ours += ((frame.id != (uint32_t)AUTHENTICATOR_ID) && (frame.id != COMMAND_GUARD_NOBODY)) ? 1u : 0u;
    }
    TEST_ASSERT_LESS_THAN_UINT32(2u, ours);
    return ours == 1u;
}

static bool command_passes(const lever_command_t *content)
{
    arrive(command(content));
    return passes();
}

/* By a sender with a key. */
static lever_frame_t authenticator(const lever_frame_t *of, uint64_t value)
{
    lever_frame_t frame = {.id = AUTHENTICATOR_ID, .length = 8u};
    uint8_t data[COMMAND_GUARD_DATA] = {(uint8_t)(of->id >> 8u), (uint8_t)of->id};
    (void)memcpy(&data[2], of->data, 8u);
    for (uint32_t i = 0u; i < 8u; i++) {
        data[10u + i] = (uint8_t)(value >> (56u - (8u * i)));
    }
    for (uint32_t i = 0u; i < 3u; i++) {
        frame.data[i] = (uint8_t)(value >> (16u - (8u * i)));
    }
    keyed_sum(data, &frame.data[3]);
    return frame;
}

/* Samples of a lever that is moved, until torque has opened. */
static void fly(float dither)
{
    lever_command_t start = nothing;
    start.dither_rms = dither;
    for (uint32_t k = 0u; k < 3000u; k++) {
        const float theta = 0.35f + (((k % 200u) < 100u) ? 0.01f : -0.01f);
        const lever_sample_t sample = {.time_us = 1000u * sent_samples,
            .theta = theta,
            .theta_valid = true,
            .theta_dot_valid = true,
            .z_ddot_valid = true};
        if ((k % 500u) == 0u) {
            TEST_ASSERT_TRUE(lever_command(lever, &start));
        }
        (void)lever_update(lever, &sample);
        sent_samples++;
    }
}

/* S1 */
TEST(a_build_that_takes_no_commands_lets_through_what_changes_nothing_or_ends_torque)
{
    lever_command_t other = nothing;
    guard.takes_commands = false;
    TEST_ASSERT_TRUE(command_passes(&nothing));
    other.dither_rms = 0.0f;
    TEST_ASSERT_TRUE(command_passes(&other));
    other.dither_rms = 0.001f;
    TEST_ASSERT_FALSE(command_passes(&other));
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_DISABLED, answer());
    for (uint32_t i = 0u; i < 6u; i++) {
        other = nothing;
        uint8_t *const choice[] = {
            &other.request, &other.model, &other.preload, &other.estimator, &other.adaptation, &other.mitigation};
        *choice[i] = 1u;
        TEST_ASSERT_FALSE(command_passes(&other));
    }
    TEST_ASSERT_EQUAL_UINT32(7u, refused());
}

/* Each by itself and all together, in any build, whatever acts and whatever the machine says. */
/* S1 S2 R37 */
TEST_EACH(4, what_ends_torque_or_correction_always_passes)
{
    guard.takes_commands = (test_round % 2u) != 0u;
    guard.is_safe = on_ground;
    safe = false;
    if (test_round < 2u) {
        fly(0.3f);
        TEST_ASSERT_TRUE(lever_is_acting(lever));
    }
    for (uint32_t i = 1u; i < 16u; i++) {
        lever_command_t end = nothing;
        end.mitigation = ((i & 1u) != 0u) ? (uint8_t)LEVER_MITIGATION_NONE : end.mitigation;
        end.dither_rms = ((i & 2u) != 0u) ? 0.0f : end.dither_rms;
        end.request = ((i & 4u) != 0u) ? (uint8_t)LEVER_REQUEST_FREEZE : end.request;
        end.request = ((i & 8u) != 0u) ? (uint8_t)LEVER_REQUEST_RESET : end.request;
        TEST_ASSERT_TRUE(command_passes(&end));
        end.model = (uint8_t)LEVER_MODEL_HAND;
        TEST_ASSERT_FALSE(command_passes(&end));
    }
}

/* Each is answered before the next is received. */
/* R24 */
TEST(several_that_are_refused_in_a_row_are_handed_to_nobody_one_by_one)
{
    lever_command_t start = nothing;
    lever_frame_t frame;
    start.dither_rms = 0.3f;
    guard.takes_commands = false;
    for (uint32_t i = 0u; i < 3u; i++) {
        arrive(command(&start));
    }
    for (uint32_t i = 0u; i < 3u; i++) {
        TEST_ASSERT_EQUAL(PORT_DONE, command_guard_receive(&guard, &frame));
        TEST_ASSERT_EQUAL_HEX32(COMMAND_GUARD_NOBODY, frame.id);
        TEST_ASSERT_EQUAL(LEVER_FRAME_IGNORED, lever_on_frame(lever, &frame));
        TEST_ASSERT_EQUAL(MESSAGE_RESULT_DISABLED, answer());
    }
    TEST_ASSERT_EQUAL(PORT_NOTHING, command_guard_receive(&guard, &frame));
}

/* S2 */
TEST(nothing_is_changed_while_torque_acts)
{
    lever_command_t other = nothing;
    other.model = (uint8_t)LEVER_MODEL_HAND;
    TEST_ASSERT_TRUE(command_passes(&other));
    fly(0.3f);
    TEST_ASSERT_TRUE(lever_is_acting(lever));
    (void)answer();
    TEST_ASSERT_FALSE(command_passes(&other));
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_ACTING, answer());
    TEST_ASSERT_TRUE(command_passes(&nothing));
    fly(0.0f);
    TEST_ASSERT_FALSE(lever_is_acting(lever));
    TEST_ASSERT_TRUE(command_passes(&other));
}

/* S2 */
TEST(nothing_is_changed_where_the_machine_says_that_it_is_not_safe)
{
    lever_command_t start = nothing;
    start.dither_rms = 0.3f;
    guard.is_safe = on_ground;
    TEST_ASSERT_TRUE(command_passes(&start));
    safe = false;
    TEST_ASSERT_FALSE(command_passes(&start));
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_NOT_SAFE, answer());
    TEST_ASSERT_TRUE(command_passes(&nothing));
}

/* S3 */
TEST(with_authentication_only_a_new_command_of_its_sender_passes)
{
    const lever_frame_t frame = command(&nothing);
    guard.authentication = &authentication;
    arrive(frame); /* without */
    TEST_ASSERT_FALSE(passes());
    TEST_ASSERT_EQUAL(MESSAGE_RESULT_NOT_AUTHENTIC, answer());
    arrive(authenticator(&frame, 1001u));
    arrive(frame); /* right */
    TEST_ASSERT_TRUE(passes());
    arrive(frame); /* it serves once */
    TEST_ASSERT_FALSE(passes());
    arrive(authenticator(&frame, 1001u));
    arrive(frame); /* replayed */
    TEST_ASSERT_FALSE(passes());
    arrive(authenticator(&frame, 1000u));
    arrive(frame); /* recorded before */
    TEST_ASSERT_FALSE(passes());
    arrive(authenticator(&frame, 1002u));
    arrive(frame);
    TEST_ASSERT_TRUE(passes());
    TEST_ASSERT_EQUAL_UINT32(4u, refused());
}

/* S3 */
TEST_EACH(64, a_flipped_bit_of_command_or_authenticator_is_refused)
{
    const lever_frame_t right = command(&nothing);
    lever_frame_t frame = right;
    lever_frame_t code = authenticator(&right, 1001u);
    guard.authentication = &authentication;
    frame.data[test_round / 8u] ^= (uint8_t)(1u << (test_round % 8u));
    arrive(code);
    arrive(frame);
    TEST_ASSERT_FALSE(passes());
    code.data[test_round / 8u] ^= (uint8_t)(1u << (test_round % 8u));
    arrive(code);
    arrive(right);
    TEST_ASSERT_FALSE(passes());
    TEST_ASSERT_EQUAL_UINT64(1000u, newest);
}

/* S3 */
TEST(another_key_is_refused_and_a_refused_command_uses_no_freshness_up)
{
    const lever_frame_t frame = command(&nothing);
    guard.authentication = &authentication;
    key = 0xBADu;
    const lever_frame_t forged = authenticator(&frame, 0xFFFFFFu);
    key = 0xFEEDu;
    arrive(forged);
    arrive(frame);
    TEST_ASSERT_FALSE(passes());
    arrive(authenticator(&frame, 1001u));
    arrive(frame);
    TEST_ASSERT_TRUE(passes());
}

/* R24 */
TEST(a_damaged_command_that_is_refused_gets_no_answer)
{
    lever_command_t start = nothing;
    start.dither_rms = 0.3f;
    lever_frame_t frame = command(&start);
    frame.data[0] ^= 1u;
    guard.takes_commands = false;
    arrive(frame);
    TEST_ASSERT_FALSE(passes());
    TEST_ASSERT_EQUAL(UINT8_MAX, answer());
    TEST_ASSERT_EQUAL_UINT32(1u, refused());
}

TEST(other_frames_pass_and_what_is_no_command_is_left_to_the_estimator)
{
    lever_frame_t frame = command(&nothing);
    frame.length = 7u;
    arrive(frame);
    TEST_ASSERT_TRUE(passes());
    frame.id = MESSAGE_BASE_SAMPLE_ID;
    arrive(frame);
    TEST_ASSERT_TRUE(passes());
    guard.authentication = &authentication;
    frame = command(&nothing);
    arrive(authenticator(&frame, 1001u));
    frame.length = 7u;
    arrive(frame);
    TEST_ASSERT_FALSE(passes());
    TEST_ASSERT_FALSE(passes());
}
