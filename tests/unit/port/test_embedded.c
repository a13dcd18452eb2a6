/* The embedded loop over a port that is played here, the self test as the host passes it, and the CRC against its check value. */
#include <string.h>

#include "can/e2e.h"
#include "can/messages.h"
#include "port/embedded/crc32.h"
#include "port/embedded/loop.h"
#include "port/embedded/port.h"
#include "port/embedded/self_test.h"
#include "unity.h"

enum { SAMPLES = 120, FRAMES = 8 * SAMPLES };

static lever_memory_t memory;
static lever_t *lever;
static lever_frame_t input[2 * SAMPLES];
static uint32_t received;
static lever_frame_t sent[FRAMES];
static uint32_t sends;
static uint32_t sends_at_receive[2 * SAMPLES]; /* how many answers were out when a frame was asked for */
static uint32_t idles;
static uint32_t reports;
static lever_platform_t platform;

bool port_receive(lever_frame_t *frame)
{
    if (received == (uint32_t)(2 * SAMPLES)) {
        return false;
    }
    sends_at_receive[received] = sends;
    *frame = input[received];
    received++;
    return true;
}

void port_send(const lever_frame_t *frame)
{
    TEST_ASSERT_LESS_THAN_UINT32(FRAMES, sends);
    sent[sends] = *frame;
    sends++;
}

void port_status(lever_platform_t *status)
{
    reports++;
    *status = platform;
}

void port_idle(void)
{
    idles++;
}

void setUp(void)
{
    static lever_config_t config;

    lever_config_default(&config);
    lever = lever_init(&memory, &config);
    received = 0u;
    sends = 0u;
    idles = 0u;
    reports = 0u;
    platform = (lever_platform_t){0};
    for (uint32_t i = 0u; i < (uint32_t)SAMPLES; i++) {
        const message_lever_sample_t sample = {.theta = 0.35f, .theta_valid = true, .theta_dot_valid = true};
        const message_base_sample_t base = {.time_us = 1000u * i, .z_ddot_valid = true};
        (void)message_lever_sample_encode(&input[2u * i], &sample);
        (void)message_base_sample_encode(&input[(2u * i) + 1u], &base);
        e2e_protect(&input[2u * i], MESSAGE_LEVER_SAMPLE_DATA_ID, (uint8_t)(i % 16u));
        e2e_protect(&input[(2u * i) + 1u], MESSAGE_BASE_SAMPLE_DATA_ID, (uint8_t)(i % 16u));
    }
}

void tearDown(void)
{
}

static void turn(uint32_t times)
{
    for (uint32_t i = 0u; i < times; i++) {
        embedded_turn(lever);
    }
}

static void each_turn_idles_and_takes_one_frame(void)
{
    turn(5u);
    TEST_ASSERT_EQUAL_UINT32(5u, idles);
    TEST_ASSERT_EQUAL_UINT32(5u, received);
    TEST_ASSERT_EQUAL_UINT32(2u, reports); /* two samples are complete */
}

/* STATE_ESTIMATE is the last answer of a step, and it is out before the next frame is asked for. */
static void answers_are_out_before_the_next_frame(void)
{
    turn(2u * (uint32_t)SAMPLES);
    uint32_t states = 0u;
    for (uint32_t i = 0u; i < sends; i++) {
        states += (sent[i].id == (uint32_t)MESSAGE_STATE_ESTIMATE_ID) ? 1u : 0u;
    }
    TEST_ASSERT_EQUAL_UINT32(SAMPLES, states);
    for (uint32_t i = 2u; i < (uint32_t)(2 * SAMPLES); i += 2u) {
        TEST_ASSERT_EQUAL_HEX32(MESSAGE_STATE_ESTIMATE_ID, sent[sends_at_receive[i] - 1u].id);
        TEST_ASSERT_EQUAL_UINT32(sends_at_receive[i], sends_at_receive[i + 1u]);
    }
}

static void status_reaches_the_bus(void)
{
    message_health_t health = {0};

    platform.faults = LEVER_PLATFORM_ROM;
    turn(2u * (uint32_t)SAMPLES);
    for (uint32_t i = 0u; i < sends; i++) {
        if (sent[i].id == (uint32_t)MESSAGE_HEALTH_ID) {
            TEST_ASSERT_TRUE(message_health_decode(&health, &sent[i]));
        }
    }
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_PLATFORM, health.faults);
}

static void nothing_received_is_nothing_done(void)
{
    received = 2u * (uint32_t)SAMPLES;
    turn(3u);
    TEST_ASSERT_EQUAL_UINT32(3u, idles);
    TEST_ASSERT_EQUAL_UINT32(0u, sends);
    TEST_ASSERT_EQUAL_UINT32(0u, reports);
}

/* Check value of CRC-32/ISO-HDLC in the catalogue of parametrised CRC algorithms; in one piece or two. */
static void crc_has_its_check_value(void)
{
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc32_update(0u, "123456789", 9u));
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc32_update(crc32_update(0u, "1234", 4u), "56789", 5u));
    TEST_ASSERT_EQUAL_HEX32(0u, crc32_update(0u, "", 0u));
}

static void self_test_passes_here(void)
{
    lever_memory_t other;

    TEST_ASSERT_TRUE(self_test(&other));
    TEST_ASSERT_TRUE(self_test(&other)); /* whatever the memory holds */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(each_turn_idles_and_takes_one_frame);
    RUN_TEST(answers_are_out_before_the_next_frame);
    RUN_TEST(status_reaches_the_bus);
    RUN_TEST(nothing_received_is_nothing_done);
    RUN_TEST(crc_has_its_check_value);
    RUN_TEST(self_test_passes_here);
    return UNITY_END();
}
