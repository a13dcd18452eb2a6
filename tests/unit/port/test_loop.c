/* The loop of a port against a transport that fails on purpose. What it sends must be, frame for frame, what the façade
 * gives when it is called directly with the same samples. */
#include <string.h>

#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "port/linux/loop.h"
#include "unity.h"

enum { SAMPLES = 300, FRAMES = 8 * SAMPLES, PAUSES = 64, NEVER = -1 };

/* A medium whose faults are told beforehand. Counts are of calls that would have succeeded. */
typedef struct fake {
    const lever_frame_t *input;
    int inputs;
    int received;
    lever_frame_t sent[FRAMES];
    int sends;
    int full_times;       /* each frame is refused as FULL so often before it is taken; NEVER: for ever */
    int refusals;         /* of the present frame */
    int down_at_receive;  /* this frame is preceded by a lost link */
    int down_at_send;     /* so is this one */
    int restore_failures; /* attempts to restore that fail */
    int restores;
    enum transport_result restored; /* result of the attempt after these */
    bool endless;                   /* the last input frame is received again and again */
    int stop_after;                 /* waits; NEVER: until the input is used up */
    int waits;
    int32_t pauses[PAUSES]; /* the first timeouts of waits that were not for a frame [ms] */
    int pauses_taken;
    int events[3];
} fake_t;

static fake_t fake;
static transport_t transport;
static lever_memory_t memory;
static loop_t loop;
static lever_frame_t input[2 * SAMPLES];
static lever_frame_t expected[FRAMES];
static int expected_count;

static enum transport_result fake_receive(void *self, lever_frame_t *frame)
{
    fake_t *medium = self;

    if (medium->received == medium->down_at_receive) {
        medium->down_at_receive = NEVER;
        return TRANSPORT_DOWN;
    }
    if (medium->received >= medium->inputs) {
        if (!medium->endless) {
            return TRANSPORT_EMPTY;
        }
        medium->received = medium->inputs - 1;
    }
    *frame = medium->input[medium->received];
    medium->received++;
    return TRANSPORT_OK;
}

static enum transport_result fake_send(void *self, const lever_frame_t *frame)
{
    fake_t *medium = self;

    if (medium->sends == medium->down_at_send) {
        medium->down_at_send = NEVER;
        return TRANSPORT_DOWN;
    }
    if ((medium->full_times == NEVER) || (medium->refusals < medium->full_times)) {
        medium->refusals++;
        return TRANSPORT_FULL;
    }
    medium->refusals = 0;
    TEST_ASSERT_LESS_THAN_INT(FRAMES, medium->sends);
    medium->sent[medium->sends] = *frame;
    medium->sends++;
    return TRANSPORT_OK;
}

static enum transport_result fake_restore(void *self)
{
    fake_t *medium = self;

    medium->restores++;
    return (medium->restores <= medium->restore_failures) ? TRANSPORT_DOWN : medium->restored;
}

static bool fake_wait(void *self, bool for_frame, int32_t timeout_ms)
{
    fake_t *medium = self;

    medium->waits++;
    if (!for_frame && (medium->pauses_taken < PAUSES)) {
        medium->pauses[medium->pauses_taken] = timeout_ms;
        medium->pauses_taken++;
    }
    if (medium->stop_after != NEVER) {
        return medium->waits < medium->stop_after;
    }
    return !(for_frame && (medium->received >= medium->inputs));
}

static const char *fake_reason(void *self)
{
    (void)self;
    return "as told";
}

static void count_event(void *context, enum loop_event event)
{
    fake_t *medium = context;

    medium->events[event]++;
}

/* The pair of frames of sample k at 1 kHz, of a lever that swings at 3 Hz (triangular: no libm needed). */
static void make_sample(lever_frame_t frames[2], uint32_t k)
{
    const uint32_t period = 333u;
    const float phase = (float)(k % period) / (float)period;
    const float swing = (phase < 0.5f) ? ((4.0f * phase) - 1.0f) : (3.0f - (4.0f * phase));
    const message_lever_sample_t lever_sample = {.theta = 0.35f + (0.02f * swing),
        .theta_dot = (phase < 0.5f) ? 0.24f : -0.24f,
        .tau_m = 0.0f,
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = true};
    const message_base_sample_t base_sample = {.time_us = 1000u * k, .z_ddot = swing, .z_ddot_valid = true};

    TEST_ASSERT_TRUE(message_lever_sample_encode(&frames[0], &lever_sample));
    TEST_ASSERT_TRUE(message_base_sample_encode(&frames[1], &base_sample));
    e2e_protect(&frames[0], MESSAGE_LEVER_SAMPLE_DATA_ID, (uint8_t)(k % 16u));
    e2e_protect(&frames[1], MESSAGE_BASE_SAMPLE_DATA_ID, (uint8_t)(k % 16u));
}

/* The answers to `input`, from the façade alone. */
static void compute_expected(const lever_config_t *config)
{
    lever_t *lever = lever_init(&memory, config);

    expected_count = 0;
    for (int i = 0; i < (2 * SAMPLES); i++) {
        if (lever_on_frame(lever, &input[i]) == LEVER_FRAME_SAMPLE) {
            (void)lever_step(lever);
            while (lever_next_frame(lever, &expected[expected_count])) {
                expected_count++;
                TEST_ASSERT_LESS_THAN_INT(FRAMES, expected_count);
            }
        }
    }
}

void setUp(void)
{
    static lever_config_t config;

    lever_config_default(&config);
    config.settings.align_time = 0.05f; /* so that most of the samples are really estimated */
    for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
        make_sample(&input[2u * k], k);
    }
    compute_expected(&config);
    (void)memset(&fake, 0, sizeof fake);
    fake.input = input;
    fake.inputs = 2 * SAMPLES;
    fake.down_at_receive = NEVER;
    fake.down_at_send = NEVER;
    fake.restored = TRANSPORT_OK;
    fake.stop_after = NEVER;
    transport = (transport_t){.self = &fake,
        .receive = fake_receive,
        .send = fake_send,
        .restore = fake_restore,
        .wait = fake_wait,
        .reason = fake_reason};
    loop_init(&loop, &transport, lever_init(&memory, &config));
    loop.on_event = count_event;
    loop.context = &fake;
}

void tearDown(void)
{
}

/* Everything was answered, in order, once, as if nothing had happened. */
static void assert_all_answered(void)
{
    lever_health_t health;

    lever_health(loop.lever, &health);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(SAMPLES, expected_count);
    TEST_ASSERT_EQUAL_INT(expected_count, fake.sends);
    for (int i = 0; i < expected_count; i++) {
        TEST_ASSERT_EQUAL_HEX32(expected[i].id, fake.sent[i].id);
        TEST_ASSERT_EQUAL_UINT8(expected[i].length, fake.sent[i].length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected[i].data, fake.sent[i].data, 8);
    }
    TEST_ASSERT_EQUAL_UINT64(2 * SAMPLES, loop.totals.received);
    TEST_ASSERT_EQUAL_UINT64(expected_count, loop.totals.sent);
    TEST_ASSERT_EQUAL_UINT64(SAMPLES, loop.totals.samples);
    TEST_ASSERT_EQUAL_UINT32(SAMPLES, health.samples);
    TEST_ASSERT_EQUAL_UINT32(0u, health.lost);
    TEST_ASSERT_FALSE(loop.has_unsent);
}

static void test_it_answers_as_the_facade_does(void)
{
    TEST_ASSERT_TRUE(loop_run(&loop));
    assert_all_answered();
    TEST_ASSERT_EQUAL_UINT64(0u, loop.totals.retries);
    TEST_ASSERT_EQUAL_UINT64(0u, loop.totals.outages);
}

static void test_no_answer_is_dropped_when_there_is_no_room(void)
{
    fake.full_times = 3;
    TEST_ASSERT_TRUE(loop_run(&loop));
    assert_all_answered();
    TEST_ASSERT_EQUAL_UINT64(3 * expected_count, loop.totals.retries);
    TEST_ASSERT_EQUAL_INT32(LOOP_RETRY_MS, fake.pauses[0]);
}

static void test_nothing_is_received_while_an_answer_waits_for_room(void)
{
    fake.full_times = NEVER;
    fake.stop_after = 1000;
    TEST_ASSERT_TRUE(loop_run(&loop));
    TEST_ASSERT_EQUAL_INT(2, fake.received);
    TEST_ASSERT_EQUAL_INT(0, fake.sends);
    TEST_ASSERT_TRUE(loop.has_unsent);
}

static void test_it_goes_on_after_a_link_lost_while_receiving(void)
{
    fake.down_at_receive = 101;
    fake.restore_failures = 3;
    TEST_ASSERT_TRUE(loop_run(&loop));
    assert_all_answered();
    TEST_ASSERT_EQUAL_UINT64(1u, loop.totals.outages);
    TEST_ASSERT_EQUAL_INT(1, fake.events[LOOP_EVENT_DOWN]);
    TEST_ASSERT_EQUAL_INT(1, fake.events[LOOP_EVENT_UP]);
}

static void test_an_answer_outlives_a_link_lost_while_sending(void)
{
    fake.down_at_send = 57;
    fake.restore_failures = 1;
    TEST_ASSERT_TRUE(loop_run(&loop));
    assert_all_answered();
    TEST_ASSERT_EQUAL_UINT64(1u, loop.totals.outages);
    TEST_ASSERT_EQUAL_INT(2, fake.restores);
}

static void test_the_pauses_of_an_outage_double_up_to_a_bound(void)
{
    static const int32_t pauses_ms[] = {10, 20, 40, 80, 160, 320, 500, 500, 500};

    fake.down_at_receive = 0;
    fake.restore_failures = 8;
    TEST_ASSERT_TRUE(loop_run(&loop));
    TEST_ASSERT_EQUAL_INT(9, fake.pauses_taken);
    TEST_ASSERT_EQUAL_INT32_ARRAY(pauses_ms, fake.pauses, 9);
    assert_all_answered();
}

static void test_a_request_to_end_is_seen_during_an_outage(void)
{
    fake.down_at_receive = 10;
    fake.restore_failures = 1000000;
    fake.stop_after = 20;
    TEST_ASSERT_TRUE(loop_run(&loop));
    TEST_ASSERT_EQUAL_INT(20, fake.waits);
    TEST_ASSERT_EQUAL_INT(0, fake.events[LOOP_EVENT_UP]);
}

static void test_a_request_to_end_is_seen_under_full_load(void)
{
    const lever_frame_t foreign = {.id = 0x7FFu, .length = 8u};

    fake.input = &foreign;
    fake.inputs = 1;
    fake.endless = true;
    fake.stop_after = 1;
    TEST_ASSERT_TRUE(loop_run(&loop));
    TEST_ASSERT_EQUAL_UINT64(LOOP_BATCH, loop.totals.received);
    TEST_ASSERT_EQUAL_UINT64(0u, loop.totals.samples);
    TEST_ASSERT_EQUAL_INT(0, fake.sends);
}

static void test_it_ends_when_the_transport_is_broken(void)
{
    fake.down_at_send = 5;
    fake.restored = TRANSPORT_BROKEN;
    TEST_ASSERT_FALSE(loop_run(&loop));
    TEST_ASSERT_EQUAL_INT(5, fake.sends);
    TEST_ASSERT_EQUAL_INT(1, fake.restores);
}

static enum transport_result broken_receive(void *self, lever_frame_t *frame)
{
    (void)self;
    (void)frame;
    return TRANSPORT_BROKEN;
}

static void test_it_ends_at_once_when_receiving_is_broken(void)
{
    transport.receive = broken_receive;
    TEST_ASSERT_FALSE(loop_run(&loop));
    TEST_ASSERT_EQUAL_INT(0, fake.waits);
}

static void test_it_tells_of_each_change_of_mode(void)
{
    TEST_ASSERT_TRUE(loop_run(&loop));
    TEST_ASSERT_EQUAL_INT(2, fake.events[LOOP_EVENT_MODE]); /* init to align to run */
    TEST_ASSERT_EQUAL_INT(LEVER_MODE_RUN, loop.mode);
}

static void test_nobody_needs_to_listen(void)
{
    loop.on_event = NULL;
    fake.down_at_receive = 3;
    TEST_ASSERT_TRUE(loop_run(&loop));
    assert_all_answered();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_answers_as_the_facade_does);
    RUN_TEST(test_no_answer_is_dropped_when_there_is_no_room);
    RUN_TEST(test_nothing_is_received_while_an_answer_waits_for_room);
    RUN_TEST(test_it_goes_on_after_a_link_lost_while_receiving);
    RUN_TEST(test_an_answer_outlives_a_link_lost_while_sending);
    RUN_TEST(test_the_pauses_of_an_outage_double_up_to_a_bound);
    RUN_TEST(test_a_request_to_end_is_seen_during_an_outage);
    RUN_TEST(test_a_request_to_end_is_seen_under_full_load);
    RUN_TEST(test_it_ends_when_the_transport_is_broken);
    RUN_TEST(test_it_ends_at_once_when_receiving_is_broken);
    RUN_TEST(test_it_tells_of_each_change_of_mode);
    RUN_TEST(test_nobody_needs_to_listen);
    return UNITY_END();
}
