/* The loop of every port, against a port and a clock that are played here: what is dropped or held, what goes stale,
 * what the estimator is told of time, outages. That frames are those of the estimator, and whole processes:
 * tests/vcan, tests/slcan. */
#include <string.h>

#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "test.h"

/* What the loop says to the estimator passes through here. */
static void seen_idle(lever_t *lever, uint32_t elapsed_us);
static bool seen_next_frame(lever_t *lever, lever_frame_t *frame);
#define lever_idle seen_idle
#define lever_next_frame seen_next_frame
#include "port/loop.c" /* NOLINT(bugprone-suspicious-include) */
#undef lever_idle
#undef lever_next_frame

enum { SAMPLES = 300, INPUTS = 2 * SAMPLES, FOREVER = 1 << 30 };

static lever_memory_t memory;
static lever_config_t config;
static int received; /* frames, a pair of a sample in turn */
static uint32_t first_id;
static int refusals; /* each frame finds no room so often */
static int refused;
static int turns_left; /* waits until it is asked to end */
static bool waited_for_frame;
static int32_t timeout_ms;        /* of the last wait */
static enum port_result says;     /* receive and send, unless it is PORT_DONE */
static enum port_result restored; /* restore */
static int attempts;
static uint32_t clock_us;
static uint32_t answer_id; /* each frame is answered with such a one besides; 0: with none */
static int answered;
static uint32_t idles;
static uint32_t idle_us; /* sum of them */
static port_t port;
static loop_t loop;

static void seen_idle(lever_t *lever, uint32_t elapsed_us)
{
    idles++;
    idle_us += elapsed_us;
    lever_idle(lever, elapsed_us);
}

static bool seen_next_frame(lever_t *lever, lever_frame_t *frame)
{
    const bool is_answer = (answer_id != 0u) && (answered != received);
    answered = received;
    *frame = (lever_frame_t){.id = answer_id, .length = 8u};
    return is_answer || lever_next_frame(lever, frame);
}

/* Frames of samples at 1 kHz. */
static enum port_result receive(void *self, lever_frame_t *frame)
{
    const uint32_t k = (uint32_t)received / 2u;
    const message_lever_sample_t lever_sample = {.theta = 0.35f, .theta_valid = true, .theta_dot_valid = true};
    const message_base_sample_t base_sample = {.time_us = 1000u * k, .z_ddot_valid = true};
    (void)self;
    if ((says != PORT_DONE) || (received == INPUTS)) {
        return (says != PORT_DONE) ? says : PORT_NOTHING;
    }
    if ((received % 2) == 0) {
        TEST_ASSERT_TRUE(message_lever_sample_encode(frame, &lever_sample));
        e2e_protect(frame, MESSAGE_LEVER_SAMPLE_DATA_ID, (uint8_t)(k % 16u));
    } else {
        TEST_ASSERT_TRUE(message_base_sample_encode(frame, &base_sample));
        e2e_protect(frame, MESSAGE_BASE_SAMPLE_DATA_ID, (uint8_t)(k % 16u));
    }
    received++;
    return PORT_DONE;
}

static enum port_result send(void *self, const lever_frame_t *frame)
{
    (void)self;
    if ((says == PORT_DONE) && (refused < refusals)) {
        refused++;
        return PORT_NOTHING;
    }
    refused = 0;
    first_id = (first_id == 0u) ? frame->id : first_id;
    return says;
}

static bool wait_frame(void *self, bool for_frame, int32_t for_ms)
{
    (void)self;
    waited_for_frame = for_frame;
    timeout_ms = for_ms;
    clock_us += (for_ms > 0) ? (1000u * (uint32_t)for_ms) : 0u;
    turns_left--;
    return turns_left > 0;
}

static enum port_result restore_link(void *self)
{
    (void)self;
    attempts++;
    says = (restored == PORT_DONE) ? PORT_DONE : says;
    return restored;
}

static uint32_t machine_us(void *self)
{
    (void)self;
    return clock_us;
}

static void start(enum loop_policy policy)
{
    received = 0;
    first_id = 0u;
    refusals = 0;
    refused = 0;
    turns_left = FOREVER;
    says = PORT_DONE;
    attempts = 0;
    clock_us = 0xFFFFFF00u; /* wraps soon */
    answer_id = 0u;
    answered = 0;
    idles = 0u;
    idle_us = 0u;
    port = (port_t){.receive = receive, .send = send, .wait = wait_frame, .now_us = machine_us};
    lever_config_default(&config);
    loop_init(&loop, &port, lever_init(&memory, &config), policy);
}

void setUp(void)
{
    start(LOOP_HOLD);
}

static enum port_result turn(void)
{
    return loop_turn(&loop);
}

TEST(without_room_a_frame_is_dropped_and_counted)
{
    start(LOOP_DROP);
    refusals = FOREVER;
    while (received < INPUTS) {
        TEST_ASSERT_EQUAL_INT(PORT_DONE, turn());
    }
    TEST_ASSERT_EQUAL_INT(INPUTS, received);
    TEST_ASSERT_EQUAL_UINT64(0u, loop.totals.sent);
    TEST_ASSERT_EQUAL_UINT64(0u, loop.totals.held);
    TEST_ASSERT_EQUAL_UINT64(refused, loop.totals.dropped);
    TEST_ASSERT_GREATER_THAN_UINT64(SAMPLES, loop.totals.dropped);
}

/* Linux sent one that was 2,999 ms old, after an outage. */
TEST(only_what_acts_goes_stale)
{
    static const struct {
        uint32_t id;
        uint32_t held_us;
        bool lock_step;
        bool is_sent;
    } rows[] = {
        {MESSAGE_MOTOR_COMMAND_ID, 20000u, false, true},
        {MESSAGE_MOTOR_COMMAND_ID, 20001u, false, false},
        {MESSAGE_MOTOR_COMMAND_ID, 2999000u, false, false},
        {MESSAGE_MOTOR_COMMAND_ID, 2999000u, true, true},
        {MESSAGE_CORRECTION_ID, 20000u, false, true},
        {MESSAGE_CORRECTION_ID, 20001u, false, false},
        {MESSAGE_STATE_ESTIMATE_ID, 2999000u, false, true},
    };

    for (size_t i = 0u; i < (sizeof rows / sizeof rows[0]); i++) {
        setUp();
        const uint32_t received_us = clock_us;
        loop.lock_step = rows[i].lock_step;
        answer_id = rows[i].id;
        refusals = 1;
        (void)turn();
        TEST_ASSERT_TRUE(loop.is_held);
        clock_us = received_us + rows[i].held_us;
        refusals = 0;
        answer_id = 0u;
        (void)turn();
        TEST_ASSERT_EQUAL_INT(rows[i].is_sent, first_id == rows[i].id);
        TEST_ASSERT_EQUAL_UINT64(rows[i].is_sent ? 0u : 1u, loop.totals.stale);
    }
}

TEST(without_a_sample_the_estimator_is_told_each_5_ms)
{
    const uint32_t since_us = clock_us;

    received = INPUTS;
    for (int i = 0; i < 100; i++) {
        (void)turn();
        TEST_ASSERT_TRUE(waited_for_frame);
        TEST_ASSERT_EQUAL_INT32(LOOP_IDLE_MS, timeout_ms);
    }
    TEST_ASSERT_EQUAL_UINT32(99u, idles); /* not yet after the last wait */
    TEST_ASSERT_EQUAL_UINT32(clock_us - since_us - 5000u, idle_us);

    /* Frames that are no sample do not keep it from that; samples do. */
    for (int i = 0; i < 10; i++) {
        received = 0;
        clock_us += 5000u;
        (void)turn();
    }
    TEST_ASSERT_EQUAL_UINT32(109u, idles);
    setUp();
    for (int i = 0; i < INPUTS; i++) {
        clock_us += 500u;
        (void)turn();
    }
    TEST_ASSERT_EQUAL_UINT32(0u, idles);
}

TEST(in_lock_step_time_is_that_of_the_samples)
{
    loop.lock_step = true;
    received = INPUTS;
    clock_us += 1000000u;
    (void)turn();
    TEST_ASSERT_EQUAL_UINT32(0u, idles);
    TEST_ASSERT_EQUAL_INT32(-1, timeout_ms);
}

TEST(pauses_of_an_outage_double_up_to_a_bound)
{
    static const uint32_t pauses_ms[] = {10u, 20u, 40u, 80u, 160u, 320u, 500u, 500u, 500u};
    uint32_t since_us = clock_us;

    port.restore = restore_link;
    says = PORT_DOWN;
    restored = PORT_DOWN;
    for (int i = 0; i < (int)(sizeof pauses_ms / sizeof pauses_ms[0]); i++) {
        while (attempts == i) {
            TEST_ASSERT_EQUAL_INT(PORT_DONE, turn());
            TEST_ASSERT_TRUE(loop.is_down);
            TEST_ASSERT_FALSE(waited_for_frame);
        }
        TEST_ASSERT_EQUAL_UINT32(pauses_ms[i], (loop.tried_us - since_us) / 1000u);
        since_us = loop.tried_us;
    }
    TEST_ASSERT_EQUAL_UINT64(1u, loop.totals.outages);
    TEST_ASSERT_GREATER_THAN_UINT32(400u, idles); /* torque fades meanwhile */
    turns_left = 1;
    TEST_ASSERT_EQUAL_INT(PORT_NOTHING, turn()); /* a request to end is seen */
}

TEST(what_is_beyond_repair_ends_it)
{
    says = PORT_BROKEN;
    TEST_ASSERT_EQUAL_INT(PORT_BROKEN, turn());
    says = PORT_DOWN; /* with nobody to restore it */
    TEST_ASSERT_EQUAL_INT(PORT_DOWN, turn());
    port.restore = restore_link;
    (void)turn();
    restored = PORT_BROKEN;
    clock_us += 10000u;
    TEST_ASSERT_EQUAL_INT(PORT_BROKEN, turn());
}
