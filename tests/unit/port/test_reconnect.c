/* A port whose link is lost and comes back, on a medium and a clock that are played here. */
#include <string.h>

#include "port/linux/reconnect.h"
#include "unity.h"

typedef struct medium {
    enum port_result says;     /* receive and send */
    enum port_result restored; /* restore */
    uint32_t clock_us;
    int attempts;
    int32_t timeout_ms; /* of the last wait */
    bool waited_for_frame;
} medium_t;

static medium_t medium;
static reconnect_t reconnect;
static port_t port;
static lever_frame_t frame;

static enum port_result receive(void *self, lever_frame_t *received)
{
    const medium_t *it = self;

    (void)memset(received, 0, sizeof *received);
    return it->says;
}

static enum port_result send(void *self, const lever_frame_t *sent)
{
    const medium_t *it = self;

    (void)sent;
    return it->says;
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    medium_t *it = self;

    it->waited_for_frame = for_frame;
    it->timeout_ms = timeout_ms;
    it->clock_us += 1000u * (uint32_t)timeout_ms;
    return true;
}

static uint32_t now_us(void *self)
{
    const medium_t *it = self;

    return it->clock_us;
}

static enum port_result restore(void *self)
{
    medium_t *it = self;

    it->attempts++;
    return it->restored;
}

void setUp(void)
{
    const port_t lost = {.self = &medium, .receive = receive, .send = send, .wait = wait_frame, .now_us = now_us};

    medium = (medium_t){.says = PORT_DOWN, .restored = PORT_DOWN, .clock_us = 0xFFFFFF00u};
    port = reconnect_port(&reconnect, &lost, restore);
}

void tearDown(void)
{
}

static void results_pass_while_the_link_is_there(void)
{
    static const enum port_result results[] = {PORT_DONE, PORT_NOTHING, PORT_BROKEN};

    for (size_t i = 0u; i < (sizeof results / sizeof results[0]); i++) {
        medium.says = results[i];
        TEST_ASSERT_EQUAL_INT(results[i], port.receive(port.self, &frame));
        TEST_ASSERT_EQUAL_INT(results[i], port.send(port.self, &frame));
    }
    TEST_ASSERT_TRUE(port.wait(port.self, true, 5));
    TEST_ASSERT_TRUE(medium.waited_for_frame);
    TEST_ASSERT_EQUAL_INT32(5, medium.timeout_ms);
    TEST_ASSERT_EQUAL_UINT64(0u, reconnect.outages);
}

/* Whoever waits for ever waits for the next attempt; nobody waits for a frame of a lost link. */
static void pauses_double_up_to_a_bound(void)
{
    static const int32_t pauses_ms[] = {10, 20, 40, 80, 160, 320, 500, 500, 500};

    TEST_ASSERT_EQUAL_INT(PORT_NOTHING, port.receive(port.self, &frame));
    TEST_ASSERT_TRUE(reconnect.is_down);
    for (int i = 0; i < (int)(sizeof pauses_ms / sizeof pauses_ms[0]); i++) {
        TEST_ASSERT_TRUE(port.wait(port.self, true, -1));
        TEST_ASSERT_FALSE(medium.waited_for_frame);
        TEST_ASSERT_EQUAL_INT32(pauses_ms[i], medium.timeout_ms);
        TEST_ASSERT_EQUAL_INT(PORT_NOTHING, port.receive(port.self, &frame));
        TEST_ASSERT_EQUAL_INT(i + 1, medium.attempts);
    }
    TEST_ASSERT_TRUE(port.wait(port.self, false, 5)); /* never longer than asked, and no attempt before its time */
    TEST_ASSERT_EQUAL_INT32(5, medium.timeout_ms);
    TEST_ASSERT_EQUAL_INT(PORT_NOTHING, port.send(port.self, &frame));
    TEST_ASSERT_EQUAL_INT(9, medium.attempts);
    TEST_ASSERT_EQUAL_UINT64(1u, reconnect.outages);
}

static int changes;

static void count_change(void *context, bool is_down)
{
    TEST_ASSERT_EQUAL_PTR(&medium, context);
    TEST_ASSERT_EQUAL_INT((changes % 2) == 0, is_down);
    changes++;
}

static void a_restored_link_goes_on_and_may_be_lost_anew(void)
{
    reconnect.on_change = count_change;
    reconnect.context = &medium;
    for (uint64_t outage = 1u; outage <= 3u; outage++) {
        medium.says = PORT_DOWN;
        TEST_ASSERT_EQUAL_INT(PORT_NOTHING, port.send(port.self, &frame));
        TEST_ASSERT_EQUAL_UINT64(outage, reconnect.outages);
        medium.clock_us += 10000u;
        medium.says = PORT_DONE;
        medium.restored = PORT_DONE;
        TEST_ASSERT_EQUAL_INT(PORT_DONE, port.send(port.self, &frame));
        TEST_ASSERT_FALSE(reconnect.is_down);
    }
    TEST_ASSERT_EQUAL_INT(6, changes);
}

static void a_link_beyond_repair_breaks_the_port(void)
{
    (void)port.receive(port.self, &frame);
    medium.restored = PORT_BROKEN;
    medium.clock_us += 10000u;
    TEST_ASSERT_EQUAL_INT(PORT_BROKEN, port.receive(port.self, &frame));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(results_pass_while_the_link_is_there);
    RUN_TEST(pauses_double_up_to_a_bound);
    RUN_TEST(a_restored_link_goes_on_and_may_be_lost_anew);
    RUN_TEST(a_link_beyond_repair_breaks_the_port);
    return UNITY_END();
}
