/* The loop of every port, against a port and a clock that are played here. */
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

enum { SAMPLES = 300, INPUTS = 2 * SAMPLES, FRAMES = 8 * SAMPLES, FOREVER = 1 << 30 };

/* A machine with its estimator. */
typedef struct machine {
    lever_memory_t memory;
    lever_config_t config;
    lever_frame_t input[INPUTS];
    lever_frame_t sent[FRAMES];
    int received;
    int sends;
    int refusals;   /* each frame finds no room so often */
    int refused;    /* the present frame */
    int turns_left; /* waits until wait() asks to end */
    int waits;
    bool waited_for_frame;
    int32_t timeout_ms;        /* of the last wait */
    enum port_result says;     /* receive and send, unless it is PORT_DONE */
    enum port_result restored; /* restore */
    int attempts;
    uint32_t clock_us;
    lever_platform_t platform;
    uint32_t answer_id; /* each frame is answered with such a one besides; 0: with none */
    int answered;       /* frames */
    uint32_t idles;
    uint32_t idle_us; /* sum of them */
    loop_t loop;
} machine_t;

static machine_t machine;
static port_t port;
static machine_t *seen; /* whose estimator is spoken to */

static void seen_idle(lever_t *lever, uint32_t elapsed_us)
{
    seen->idles++;
    seen->idle_us += elapsed_us;
    lever_idle(lever, elapsed_us);
}

static bool seen_next_frame(lever_t *lever, lever_frame_t *frame)
{
    bool is_answer = (seen->answer_id != 0u) && (seen->answered != seen->received);

    seen->answered = seen->received;
    if (is_answer) {
        *frame = (lever_frame_t){.id = seen->answer_id, .length = 8u};
    } else {
        is_answer = lever_next_frame(lever, frame);
    }
    return is_answer;
}

static enum port_result receive(void *self, lever_frame_t *frame)
{
    machine_t *it = self;

    if (it->says != PORT_DONE) {
        return it->says;
    }
    if (it->received == INPUTS) {
        return PORT_NOTHING;
    }
    *frame = it->input[it->received];
    it->received++;
    return PORT_DONE;
}

static enum port_result send(void *self, const lever_frame_t *frame)
{
    machine_t *it = self;

    if (it->says != PORT_DONE) {
        return it->says;
    }
    if (it->refused < it->refusals) {
        it->refused++;
        return PORT_NOTHING;
    }
    TEST_ASSERT_LESS_THAN_INT(FRAMES, it->sends);
    it->refused = 0;
    it->sent[it->sends] = *frame;
    it->sends++;
    return PORT_DONE;
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    machine_t *it = self;

    it->waits++;
    it->waited_for_frame = for_frame;
    it->timeout_ms = timeout_ms;
    it->clock_us += (timeout_ms > 0) ? (1000u * (uint32_t)timeout_ms) : 0u;
    it->turns_left--;
    return it->turns_left > 0;
}

static enum port_result restore_link(void *self)
{
    machine_t *it = self;

    it->attempts++;
    it->says = (it->restored == PORT_DONE) ? PORT_DONE : it->says;
    return it->restored;
}

static uint32_t machine_us(void *self)
{
    const machine_t *it = self;

    return it->clock_us;
}

static void status(void *self, lever_platform_t *now)
{
    const machine_t *it = self;

    *now = it->platform;
}

/* The pair of frames of sample k at 1 kHz, of a lever that swings at 3 Hz (triangular: no libm needed). */
static void make_sample(lever_frame_t frames[2], uint32_t k, float z_ddot)
{
    const float phase = (float)(k % 333u) / 333.0f;
    const bool rises = phase < 0.5f;
    const float swing = rises ? ((4.0f * phase) - 1.0f) : (3.0f - (4.0f * phase));
    const message_lever_sample_t lever_sample = {.theta = 0.35f + (0.02f * swing),
        .theta_dot = rises ? 0.24f : -0.24f,
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = true};
    const message_base_sample_t base_sample = {.time_us = 1000u * k, .z_ddot = z_ddot * swing, .z_ddot_valid = true};

    TEST_ASSERT_TRUE(message_lever_sample_encode(&frames[0], &lever_sample));
    TEST_ASSERT_TRUE(message_base_sample_encode(&frames[1], &base_sample));
    e2e_protect(&frames[0], MESSAGE_LEVER_SAMPLE_DATA_ID, (uint8_t)(k % 16u));
    e2e_protect(&frames[1], MESSAGE_BASE_SAMPLE_DATA_ID, (uint8_t)(k % 16u));
}

static void start(machine_t *it, port_t *its_port, enum loop_policy policy, float z_ddot)
{
    (void)memset(it, 0, sizeof *it);
    for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
        make_sample(&it->input[2u * k], k, z_ddot);
    }
    it->says = PORT_DONE;
    it->turns_left = FOREVER;
    it->clock_us = 0xFFFFFF00u; /* wraps soon */
    *its_port = (port_t){.self = it, .receive = receive, .send = send, .wait = wait_frame, .now_us = machine_us};
    lever_config_default(&it->config);
    it->config.settings.align_time = 0.05f; /* so that most of the samples are really estimated */
    loop_init(&it->loop, its_port, lever_init(&it->memory, &it->config), policy);
    seen = it;
}

void setUp(void)
{
    start(&machine, &port, LOOP_HOLD, 1.0f);
}

static enum port_result turn(machine_t *it)
{
    seen = it;
    return loop_turn(&it->loop);
}

static void turn_until_empty(machine_t *it)
{
    int longest = 100 * FRAMES;

    do {
        TEST_ASSERT_EQUAL_INT(PORT_DONE, turn(it));
        longest--;
        TEST_ASSERT_GREATER_THAN_INT(0, longest);
    } while ((it->received < INPUTS) || it->loop.is_held);
}

/* Frame for frame what the façade gives when it is called directly with the same samples. */
static void assert_all_answered(const machine_t *it)
{
    lever_memory_t memory;
    lever_frame_t expected;
    int count = 0;
    lever_t *lever = lever_init(&memory, &it->config);

    for (int i = 0; i < INPUTS; i++) {
        if (lever_on_frame(lever, &it->input[i]) == LEVER_FRAME_SAMPLE) {
            (void)lever_step(lever);
        }
        while (lever_next_frame(lever, &expected)) {
            TEST_ASSERT_LESS_THAN_INT(it->sends, count);
            TEST_ASSERT_EQUAL_HEX32(expected.id, it->sent[count].id);
            TEST_ASSERT_EQUAL_HEX8_ARRAY(expected.data, it->sent[count].data, 8);
            count++;
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(SAMPLES, count);
    TEST_ASSERT_EQUAL_INT(count, it->sends);
    TEST_ASSERT_EQUAL_UINT64(count, it->loop.totals.sent);
    TEST_ASSERT_EQUAL_UINT64(INPUTS, it->loop.totals.received);
    TEST_ASSERT_EQUAL_UINT64(SAMPLES, it->loop.totals.samples);
    TEST_ASSERT_EQUAL_UINT64(0u, it->loop.totals.dropped);
    TEST_ASSERT_EQUAL_UINT64(0u, it->loop.totals.stale);
}

TEST(a_held_frame_is_sent_before_anything_is_received)
{
    machine.refusals = 3;
    turn_until_empty(&machine);
    assert_all_answered(&machine);
    TEST_ASSERT_EQUAL_UINT64(machine.sends, machine.loop.totals.held);

    setUp();
    machine.refusals = FOREVER;
    for (int i = 0; i < 100; i++) {
        TEST_ASSERT_EQUAL_INT(PORT_DONE, turn(&machine));
    }
    TEST_ASSERT_EQUAL_INT(2, machine.received);
    TEST_ASSERT_TRUE(machine.loop.is_held);
    TEST_ASSERT_FALSE(machine.waited_for_frame);
    TEST_ASSERT_EQUAL_INT32(LOOP_RETRY_MS, machine.timeout_ms);
}

TEST(without_room_a_frame_is_dropped_and_counted)
{
    start(&machine, &port, LOOP_DROP, 1.0f);
    machine.refusals = FOREVER;
    turn_until_empty(&machine);
    TEST_ASSERT_EQUAL_INT(INPUTS, machine.received);
    TEST_ASSERT_EQUAL_UINT64(0u, machine.loop.totals.sent);
    TEST_ASSERT_EQUAL_UINT64(0u, machine.loop.totals.held);
    TEST_ASSERT_EQUAL_UINT64(machine.refused, machine.loop.totals.dropped);
    TEST_ASSERT_GREATER_THAN_UINT64(SAMPLES, machine.loop.totals.dropped);
}

/* A COMMAND_ACK belongs to no sample. */
TEST(every_frame_may_be_answered)
{
    machine.answer_id = 0x218u;
    TEST_ASSERT_EQUAL_INT(PORT_DONE, turn(&machine));
    TEST_ASSERT_EQUAL_INT(1, machine.sends);
    TEST_ASSERT_EQUAL_HEX32(0x218u, machine.sent[0].id);
    TEST_ASSERT_EQUAL_UINT64(0u, machine.loop.totals.samples);
}

/* Linux sent one that was 2,999 ms old, after an outage. */
TEST(only_a_motor_command_goes_stale)
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
        {MESSAGE_STATE_ESTIMATE_ID, 2999000u, false, true},
    };

    for (size_t i = 0u; i < (sizeof rows / sizeof rows[0]); i++) {
        setUp();
        const uint32_t received_us = machine.clock_us;
        machine.loop.lock_step = rows[i].lock_step;
        machine.answer_id = rows[i].id;
        machine.refusals = 1;
        (void)turn(&machine);
        TEST_ASSERT_TRUE(machine.loop.is_held);
        machine.clock_us = received_us + rows[i].held_us;
        machine.refusals = 0;
        machine.answer_id = 0u;
        (void)turn(&machine);
        TEST_ASSERT_EQUAL_INT(rows[i].is_sent, machine.sent[0].id == rows[i].id);
        TEST_ASSERT_EQUAL_UINT64(rows[i].is_sent ? 0u : 1u, machine.loop.totals.stale);
    }
}

/* The process was stopped for 3 s, say, and samples from then wait: no torque is asked for until one is known to be
 * new. */
TEST(a_motor_command_to_an_old_sample_is_stale)
{
    machine.received = INPUTS;
    (void)turn(&machine);
    machine.clock_us += 3000000u;
    machine.received = INPUTS - 4;
    machine.answer_id = MESSAGE_MOTOR_COMMAND_ID;
    for (int i = 0; i < 4; i++) {
        (void)turn(&machine);
    }
    TEST_ASSERT_EQUAL_UINT64(4u, machine.loop.totals.stale);
    (void)turn(&machine); /* nothing waits any more */
    machine.received = INPUTS - 1;
    (void)turn(&machine);
    TEST_ASSERT_EQUAL_UINT64(4u, machine.loop.totals.stale);
    TEST_ASSERT_EQUAL_HEX32(MESSAGE_MOTOR_COMMAND_ID, machine.sent[machine.sends - 2].id); /* before STATE_ESTIMATE */
}

TEST(without_a_sample_the_estimator_is_told_each_5_ms)
{
    const uint32_t since_us = machine.clock_us;

    machine.received = INPUTS;
    for (int i = 0; i < 100; i++) {
        (void)turn(&machine);
        TEST_ASSERT_TRUE(machine.waited_for_frame);
        TEST_ASSERT_EQUAL_INT32(LOOP_IDLE_MS, machine.timeout_ms);
    }
    TEST_ASSERT_EQUAL_UINT32(99u, machine.idles); /* not yet after the last wait */
    TEST_ASSERT_EQUAL_UINT32(machine.clock_us - since_us - 5000u, machine.idle_us);

    /* Frames that are no sample do not keep it from that; samples do. */
    for (int i = 0; i < 10; i++) {
        machine.received = 0;
        machine.clock_us += 5000u;
        (void)turn(&machine);
    }
    TEST_ASSERT_EQUAL_UINT32(109u, machine.idles);
    setUp();
    for (int i = 0; i < INPUTS; i++) {
        machine.clock_us += 500u;
        (void)turn(&machine);
    }
    TEST_ASSERT_EQUAL_UINT32(0u, machine.idles);
}

TEST(in_lock_step_time_is_that_of_the_samples)
{
    machine.loop.lock_step = true;
    machine.received = INPUTS;
    machine.clock_us += 1000000u;
    (void)turn(&machine);
    TEST_ASSERT_EQUAL_UINT32(0u, machine.idles);
    TEST_ASSERT_EQUAL_INT32(-1, machine.timeout_ms);
}

/* The torque of a dither that is on when samples cease is zero 100 ms later at the latest, and was not cut off. */
TEST(torque_fades_when_no_sample_comes)
{
    const lever_command_t dither = {.model = LEVER_KEEP,
        .preload = LEVER_KEEP,
        .estimator = LEVER_KEEP,
        .adaptation = LEVER_KEEP,
        .dither_rms = 0.3f};
    static const uint8_t zero[2] = {0u, 0u};
    int motor = 0;

    TEST_ASSERT_TRUE(lever_command(machine.loop.lever, &dither));
    turn_until_empty(&machine);
    const int answered = machine.sends;
    for (int i = 0; i < 20; i++) {
        (void)turn(&machine);
    }
    for (int i = answered; i < machine.sends; i++) {
        motor += (machine.sent[i].id == (uint32_t)MESSAGE_MOTOR_COMMAND_ID) ? 1 : 0;
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT(2, motor);
    TEST_ASSERT_EQUAL_HEX32(MESSAGE_MOTOR_COMMAND_ID, machine.sent[machine.sends - 1].id);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(zero, &machine.sent[machine.sends - 1].data[2], 2);
}

TEST(a_request_to_end_is_seen_under_full_load)
{
    machine.turns_left = 1;
    for (int i = 1; i < LOOP_BATCH; i++) {
        TEST_ASSERT_EQUAL_INT(PORT_DONE, turn(&machine));
    }
    TEST_ASSERT_EQUAL_INT(PORT_NOTHING, turn(&machine));
    TEST_ASSERT_EQUAL_INT(1, machine.waits);
    TEST_ASSERT_EQUAL_INT32(0, machine.timeout_ms);
}

/* A link that is lost while the loop receives, or holds a frame, and comes back: nothing is lost or sent twice. */
TEST(an_outage_leaves_everything_as_it_was)
{
    port.restore = restore_link;
    for (int i = 1; machine.received < INPUTS; i++) {
        (void)turn(&machine);
        if ((i % 50) == 0) {
            machine.refusals = ((i % 100) == 0) ? 1 : 0;
            machine.says = PORT_DOWN;
            machine.restored = PORT_DONE;
        }
    }
    machine.refusals = 0;
    turn_until_empty(&machine);
    assert_all_answered(&machine);
    TEST_ASSERT_GREATER_THAN_UINT64(10u, machine.loop.totals.outages);
    TEST_ASSERT_EQUAL_UINT64(machine.attempts, machine.loop.totals.outages);
}

TEST(pauses_of_an_outage_double_up_to_a_bound)
{
    static const uint32_t pauses_ms[] = {10u, 20u, 40u, 80u, 160u, 320u, 500u, 500u, 500u};
    uint32_t since_us = machine.clock_us;

    port.restore = restore_link;
    machine.says = PORT_DOWN;
    machine.restored = PORT_DOWN;
    for (int i = 0; i < (int)(sizeof pauses_ms / sizeof pauses_ms[0]); i++) {
        while (machine.attempts == i) {
            TEST_ASSERT_EQUAL_INT(PORT_DONE, turn(&machine));
            TEST_ASSERT_TRUE(machine.loop.is_down);
            TEST_ASSERT_FALSE(machine.waited_for_frame);
        }
        TEST_ASSERT_EQUAL_UINT32(pauses_ms[i], (machine.loop.tried_us - since_us) / 1000u);
        since_us = machine.loop.tried_us;
    }
    TEST_ASSERT_EQUAL_UINT64(1u, machine.loop.totals.outages);
    TEST_ASSERT_GREATER_THAN_UINT32(400u, machine.idles); /* torque fades meanwhile */
    machine.turns_left = 1;
    TEST_ASSERT_EQUAL_INT(PORT_NOTHING, turn(&machine)); /* a request to end is seen */
}

/* Whoever prints that waits for no frame first, which may never come in lock-step. */
TEST(the_turn_that_restores_a_link_ends_at_once)
{
    port.restore = restore_link;
    machine.loop.lock_step = true;
    machine.says = PORT_DOWN;
    (void)turn(&machine);
    const int waits = machine.waits;
    machine.clock_us += 10000u;
    machine.restored = PORT_DONE;
    TEST_ASSERT_EQUAL_INT(PORT_DONE, turn(&machine));
    TEST_ASSERT_FALSE(machine.loop.is_down);
    TEST_ASSERT_EQUAL_INT(waits, machine.waits);
}

TEST(what_is_beyond_repair_ends_it)
{
    machine.says = PORT_BROKEN;
    TEST_ASSERT_EQUAL_INT(PORT_BROKEN, turn(&machine));
    machine.says = PORT_DOWN; /* with nobody to restore it */
    TEST_ASSERT_EQUAL_INT(PORT_DOWN, turn(&machine));
    port.restore = restore_link;
    (void)turn(&machine);
    machine.restored = PORT_BROKEN;
    machine.clock_us += 10000u;
    TEST_ASSERT_EQUAL_INT(PORT_BROKEN, turn(&machine));
}

TEST(the_state_of_the_machine_reaches_the_bus)
{
    message_health_t health = {0};

    port.status = status;
    machine.platform.faults = LEVER_PLATFORM_BUS_OFF;
    turn_until_empty(&machine);
    for (int i = 0; i < machine.sends; i++) {
        if (machine.sent[i].id == (uint32_t)MESSAGE_HEALTH_ID) {
            TEST_ASSERT_TRUE(message_health_decode(&health, &machine.sent[i]));
        }
    }
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_PLATFORM, health.faults);
}
