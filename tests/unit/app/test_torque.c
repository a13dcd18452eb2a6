/* The torque of an instance: whatever closes the gate has it closed within 50 ms, and no gap adds to it. */
#include "app/instance.h"
#include "frames.h"
#include "watch.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static sender_t sender;

void setUp(void)
{
    lever_config_default(&config);
    config.settings.dither_fade = 0.1f;
    lever = lever_init(&memory, &config);
    sender = sender_typical();
}

static void command_dither(float rms)
{
    lever_command_t command = rig_command();
    command.dither_rms = rms;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

static float torque_now(void)
{
    return rig_health(lever).torque;
}

/* Dither is on, its torque not small. */
static void start_dithering(void)
{
    (void)sender_run(&sender, lever, 400u);
    command_dither(0.5f);
    (void)sender_run(&sender, lever, 300u);
    for (uint32_t k = 0u; (k < 500u) && (fabsf(torque_now()) < 0.3f); k++) {
        (void)sender_run(&sender, lever, 1u);
    }
    TEST_ASSERT_TRUE(fabsf(torque_now()) >= 0.3f);
    TEST_ASSERT_TRUE(rig_health(lever).gate_open);
    watch_start(&config.settings);
    watch.last = torque_now();
}

/* A sample with what is to be changed about it. */
typedef void change_t(lever_sample_t *sample, uint32_t k);

static lever_sample_t sample_after(change_t *change, uint32_t k)
{
    lever_sample_t sample = rig_sample(&sender.rig);
    if (change != NULL) {
        change(&sample, k);
    }
    return sample;
}

/* So many samples 1 ms apart, of which each is changed; torque is zero from 50 ms after `silence_ms` on. */
static void run_to_zero(change_t *change, uint32_t count, uint32_t silence_ms)
{
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = sample_after(change, k);
        (void)lever_update(lever, &sample);
        watch_torque(torque_now(), 1000u, rig_health(lever).gate_open);
        TEST_ASSERT_TRUE((k < (50u + silence_ms)) || (torque_now() == 0.0f));
    }
    TEST_ASSERT_FALSE(rig_health(lever).gate_open);
}

static void blind(lever_sample_t *sample, uint32_t k)
{
    (void)k;
    sample->theta_valid = false;
    sample->theta_dot_valid = false;
}

static void not_finite(lever_sample_t *sample, uint32_t k)
{
    (void)k;
    sample->theta = NAN;
    sample->theta_dot = INFINITY;
    sample->tau_m = NAN;
}

static uint32_t stopped_us;

static void clock_stands(lever_sample_t *sample, uint32_t k)
{
    stopped_us = (k == 0u) ? (sample->time_us - 1000u) : stopped_us;
    sample->time_us = stopped_us;
}

static void clock_runs_backwards(lever_sample_t *sample, uint32_t k)
{
    stopped_us = (k == 0u) ? (sample->time_us - 1000u) : stopped_us;
    sample->time_us = stopped_us - (1000u * k);
}

/* Advances, but by hardly anything: no torque may live longer by that. */
static void clock_crawls(lever_sample_t *sample, uint32_t k)
{
    stopped_us = (k == 0u) ? (sample->time_us - 1000u) : stopped_us;
    sample->time_us = stopped_us + k + 1u;
}

static void blind_and_clock_crawls(lever_sample_t *sample, uint32_t k)
{
    blind(sample, k);
    clock_crawls(sample, k);
}

/* Through COAST, and in FROZEN, which does not tell. */
TEST(torque_ends_when_no_output_is_valid_for_a_minute)
{
    start_dithering();
    run_to_zero(blind, 60000u, 20u);
    TEST_ASSERT_EQUAL(LEVER_MODE_COAST, rig_health(lever).mode);
    setUp();
    start_dithering();
    rig_request(lever, LEVER_REQUEST_FREEZE);
    run_to_zero(not_finite, 60000u, 20u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, rig_health(lever).mode);
}

TEST(torque_ends_when_the_sample_clock_stands_or_runs_backwards)
{
    start_dithering();
    run_to_zero(clock_stands, 10000u, 0u);
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_CLOCK, rig_health(lever).faults);
    setUp();
    start_dithering();
    run_to_zero(clock_runs_backwards, 10000u, 0u);
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_CLOCK, rig_health(lever).faults);
}

TEST(torque_ends_when_the_sample_clock_crawls)
{
    start_dithering();
    run_to_zero(clock_crawls, 10000u, 0u);
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_CLOCK, rig_health(lever).faults);
    setUp();
    start_dithering();
    run_to_zero(blind_and_clock_crawls, 10000u, 0u);
}

/* A sample whose clock stands counts as 5 ms: so late a port calls lever_idle(). */
TEST(torque_ends_when_the_clock_stands_and_samples_are_few)
{
    config.settings.sample_period = 1.0e-4f;
    start_dithering();
    for (uint32_t k = 0u; k < 10u; k++) {
        const lever_sample_t sample = sample_after(clock_stands, k);
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_TRUE(torque_now() == 0.0f);
}

/* Neither a reset nor a report of the port needs a sample to have its effect. */
TEST(torque_ends_within_50_ms_of_a_reset_or_report_without_a_sample)
{
    const lever_platform_t broken = {.faults = (uint8_t)LEVER_PLATFORM_ROM};
    for (uint32_t report = 0u; report < 2u; report++) {
        setUp();
        start_dithering();
        if (report == 1u) {
            lever_platform(lever, &broken);
        } else {
            rig_request(lever, LEVER_REQUEST_RESET);
        }
        TEST_ASSERT_FALSE(rig_health(lever).gate_open);
        for (uint32_t k = 0u; k < 10u; k++) {
            lever_idle(lever, 5000u);
        }
        TEST_ASSERT_TRUE(torque_now() == 0.0f);
    }
}

/* A process that was stopped, a debugger: one long time in one call, at any moment of a dither that uses its rms up. */
TEST(a_long_idle_time_ends_torque_and_never_raises_it)
{
    const uint32_t times_us[] = {100000u, 120000u, 150000u, 300000u, 0x7FFFFFFFu, UINT32_MAX};
    (void)sender_run(&sender, lever, 400u);
    command_dither(0.9f);
    (void)sender_run(&sender, lever, 300u);
    for (uint32_t k = 0u; k < 20000u; k++) {
        command_dither((float)LEVER_KEEP);
        (void)sender_run(&sender, lever, 1u);
        lever_memory_t copy = memory;
        for (uint32_t again = 0u; again < 2u; again++) {
            lever_idle((lever_t *)(void *)&copy, times_us[k % 6u]);
            TEST_ASSERT_TRUE(rig_health((lever_t *)(void *)&copy).torque == 0.0f);
        }
    }
}

/* A gap in the samples, and then silence: what was let through before it is all that may be left of it. */
TEST(a_gap_and_idle_time_after_it_never_raise_torque)
{
    (void)sender_run(&sender, lever, 400u);
    command_dither(0.9f);
    (void)sender_run(&sender, lever, 300u);
    for (uint32_t k = 0u; k < 5000u; k++) {
        command_dither((float)LEVER_KEEP);
        (void)sender_run(&sender, lever, 1u);
        lever_memory_t copy = memory;
        lever_t *other = (lever_t *)(void *)&copy;
        rig_t rig = sender.rig;
        lever_sample_t sample = rig_sample(&rig);
        sample.time_us += 100000u * (1u + (k % 5u));
        (void)lever_update(other, &sample);
        float last = fabsf(rig_health(other).torque);
        TEST_ASSERT_TRUE(last <= config.settings.torque_limit);
        for (uint32_t idle = 0u; idle < 15u; idle++) {
            lever_idle(other, 5000u);
            TEST_ASSERT_TRUE(fabsf(rig_health(other).torque) <= last);
            last = fabsf(rig_health(other).torque);
        }
        TEST_ASSERT_TRUE(last == 0.0f);
    }
}

TEST(torque_ends_a_second_after_the_last_command_and_goes_on_with_the_next)
{
    (void)sender_run(&sender, lever, 400u);
    command_dither(0.5f);
    (void)sender_run(&sender, lever, 1000u);
    TEST_ASSERT_TRUE(rig_health(lever).gate_open);
    watch_start(&config.settings);
    watch.last = torque_now();
    run_to_zero(NULL, 2000u, 0u);
    command_dither((float)LEVER_KEEP);
    (void)sender_run(&sender, lever, 300u);
    TEST_ASSERT_TRUE(torque_now() != 0.0f);
}

TEST(torque_ends_when_the_machine_is_broken_and_only_then)
{
    for (uint32_t fault = 1u; fault <= 128u; fault *= 2u) {
        const bool ends = (fault == (uint32_t)LEVER_PLATFORM_ROM) || (fault == (uint32_t)LEVER_PLATFORM_SELF_TEST) ||
                          (fault == (uint32_t)LEVER_PLATFORM_WATCHDOG);
        const lever_platform_t report = {.faults = (uint8_t)fault};
        setUp();
        start_dithering();
        lever_platform(lever, &report);
        if (ends) {
            run_to_zero(NULL, 100u, 0u);
        } else {
            (void)sender_run(&sender, lever, 100u);
            TEST_ASSERT_TRUE(rig_health(lever).gate_open);
        }
    }
}

TEST(torque_ends_with_a_reset_and_does_not_come_back)
{
    start_dithering();
    rig_request(lever, LEVER_REQUEST_RESET);
    run_to_zero(NULL, 250u, 0u);
    (void)sender_run(&sender, lever, 600u);
    TEST_ASSERT_TRUE(torque_now() == 0.0f);
}

/* No command but a reset leaves the mode, or makes torque. */
TEST(torque_ends_in_fault_and_no_command_brings_it_back)
{
    lever_command_t command = rig_command();
    command.dither_rms = 0.5f;
    start_dithering();
    lever->estimator.mode = LEVER_MODE_FAULT;
    run_to_zero(NULL, 200u, 0u);
    TEST_ASSERT_EQUAL(LEVER_MODE_FAULT, rig_health(lever).mode);
    TEST_ASSERT_FALSE(lever_command(lever, &command));
    run_to_zero(NULL, 200u, 0u);
    TEST_ASSERT_TRUE(torque_now() == 0.0f);
    rig_request(lever, LEVER_REQUEST_RESET);
    (void)sender_run(&sender, lever, 400u);
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)sender_run(&sender, lever, 400u);
    TEST_ASSERT_TRUE(torque_now() != 0.0f);
}

/* No sample comes: the port's clock alone closes the gate, and every frame on the way is sent. */
TEST(torque_ends_without_samples_by_the_clock_of_the_port)
{
    lever_frame_t frames[FRAMES_MOST];
    message_motor_command_t command = {.torque = 1.0f};
    start_dithering();
    uint32_t k = 0u;
    for (; torque_now() != 0.0f; k++) {
        lever_idle(lever, 5000u);
        TEST_ASSERT_EQUAL_UINT32(1u, fetch_all(lever, frames));
        TEST_ASSERT_TRUE(message_motor_command_decode(&command, &frames[0]));
        watch_torque(torque_now(), 5000u, rig_health(lever).gate_open);
    }
    TEST_ASSERT_TRUE(command.torque == 0.0f);
    TEST_ASSERT_TRUE((k * 5u) <= 70u); /* 20 ms of silence and 50 ms */
    lever_idle(lever, 5000u);
    TEST_ASSERT_EQUAL_UINT32(0u, fetch_all(lever, frames));
    (void)sender_run(&sender, lever, 50u); /* samples again, but the ramp starts anew */
    TEST_ASSERT_TRUE(rig_health(lever).gate_open);
}

/* --- gaps --------------------------------------------------------------------------------------------------------- */

/* `count` samples, `periods` of a millisecond apart; the greatest torque. */
static float greatest_over(uint32_t count, uint32_t periods)
{
    float greatest = 0.0f;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = rig_sample_after(&sender.rig, periods);
        if (((k * periods) % 100u) == 0u) {
            command_dither((float)LEVER_KEEP);
        }
        (void)lever_update(lever, &sample);
        watch_torque(torque_now(), 1000u * periods, rig_health(lever).gate_open);
        greatest = fmaxf(greatest, fabsf(torque_now()));
    }
    return greatest;
}

/* A dither of 0.05 N m rms asked for 1.03 N m after a gap of 20 ms, and for the limit for 103 ms after one of 0.2 s. */
TEST(a_gap_adds_nothing_to_the_torque)
{
    const uint32_t gaps[] = {2u, 19u, 20u, 21u, 200u, 2000u};
    for (uint32_t g = 0u; g < 6u; g++) {
        setUp();
        (void)sender_run(&sender, lever, 400u);
        command_dither(0.05f);
        watch_start(&config.settings);
        (void)greatest_over(1000u, 1u);
        const float after = greatest_over(1u, gaps[g]);
        TEST_ASSERT_TRUE(after <= 0.25f);
        TEST_ASSERT_TRUE((gaps[g] < 70u) || (after == 0.0f));
        TEST_ASSERT_TRUE(greatest_over(2000u, 1u) <= 0.25f);
    }
}

/* NaN for good, once. */
TEST(samples_twenty_times_as_far_apart_as_said_make_no_more_torque)
{
    config.settings.gap_limit = 1.0f;
    setUp();
    TEST_ASSERT_TRUE(rig_run(&sender.rig, lever, 400u) == LEVER_MODE_RUN);
    command_dither(0.3f);
    watch_start(&config.settings);
    const float greatest = greatest_over(3000u, 20u);
    TEST_ASSERT_TRUE((greatest > 0.1f) && (greatest <= config.settings.torque_limit));
    TEST_ASSERT_TRUE(greatest_over(5000u, 1u) > 0.1f);
}
