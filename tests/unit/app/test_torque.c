/* The torque of an instance: whatever closes the gate has it closed within 50 ms, and no gap adds to it. */
#include "app/instance.h"
#include "frames.h"
#include "watch.h"

void setUp(void)
{
    lever_config_default(&config);
    config.settings.dither_fade = 0.1f;
    start_bus();
}

static float torque_now(void)
{
    return health().torque;
}

/* Dither is on, its torque not small. */
static void start_dithering(void)
{
    start_bus();
    (void)deliver_many(400u);
    dither(0.5f);
    (void)deliver_many(300u);
    for (uint32_t k = 0u; (k < 500u) && (fabsf(torque_now()) < 0.3f); k++) {
        (void)deliver_many(1u);
    }
    TEST_ASSERT_TRUE((fabsf(torque_now()) >= 0.3f) && health().gate_open);
    watch_start(&config.settings);
    watch.last = torque_now();
}

/* --- what ends it ------------------------------------------------------------------------------------------------- */

typedef struct cause {
    bool blind;
    bool not_finite;
    bool frozen; /* which does not tell */
    bool clock;  /* advances by clock_us a sample */
    int32_t clock_us;
    uint8_t platform; /* faults that the port reports */
    bool fault;       /* mode */
    bool reset;
    uint32_t period_us; /* sample_period; 0: 1 ms */
    uint32_t silence_ms;
    enum lever_mode mode;
} cause_t;

static void begin(const cause_t *cause)
{
    const lever_platform_t report = {.faults = cause->platform};
    if (cause->frozen) {
        request(LEVER_REQUEST_FREEZE);
    }
    if (cause->platform != 0u) {
        lever_platform(lever, &report);
    }
    if (cause->fault) {
        lever->estimator.mode = LEVER_MODE_FAULT;
    }
    if (cause->reset) {
        request(LEVER_REQUEST_RESET);
    }
}

static lever_sample_t sample_with(const cause_t *cause, uint32_t clock_us)
{
    lever_sample_t sample = cause->blind ? sample_blind() : sample_after(1u);
    if (cause->not_finite) {
        sample.theta = NAN;
        sample.theta_dot = INFINITY;
        sample.tau_m = NAN;
    }
    sample.time_us = cause->clock ? clock_us : sample.time_us;
    return sample;
}

static const cause_t causes[] = {{.blind = true, .silence_ms = 20u, .mode = LEVER_MODE_COAST},
    {.not_finite = true, .frozen = true, .silence_ms = 20u, .mode = LEVER_MODE_FROZEN},
    {.clock = true, .mode = LEVER_MODE_RUN}, {.clock = true, .clock_us = -1000, .mode = LEVER_MODE_RUN},
    {.clock = true, .clock_us = 1, .mode = LEVER_MODE_RUN},
    {.blind = true, .clock = true, .clock_us = 1, .mode = LEVER_MODE_COAST},
    {.platform = LEVER_PLATFORM_ROM, .mode = LEVER_MODE_RUN},
    {.platform = LEVER_PLATFORM_SELF_TEST, .mode = LEVER_MODE_RUN},
    {.platform = LEVER_PLATFORM_WATCHDOG, .mode = LEVER_MODE_RUN},
    {.platform = LEVER_PLATFORM_HARD_FAULT, .mode = LEVER_MODE_RUN}, {.fault = true, .mode = LEVER_MODE_FAULT},
    {.reset = true, .mode = LEVER_MODE_RUN}};

/* Torque is zero from 50 ms after the cause, or the silence that it is, on; never above its limits on the way. A
 * clock that stands counts as 5 ms a sample: so late a port calls lever_idle(). */
/* R37 */
TEST_EACH(sizeof causes / sizeof causes[0], torque_ends_within_50_ms_of_every_cause)
{
    const cause_t *cause = &causes[test_round];
    start_dithering();
    uint32_t clock_us = time_us;
    begin(cause);
    for (uint32_t k = 0u; k < 1000u; k++) {
        clock_us += (uint32_t)cause->clock_us;
        const lever_sample_t sample = sample_with(cause, clock_us);
        (void)lever_update(lever, &sample);
        watch_torque(torque_now(), 1000u, health().gate_open);
        TEST_ASSERT_TRUE((k < (50u + cause->silence_ms)) || (torque_now() == 0.0f));
    }
    TEST_ASSERT_EQUAL(cause->reset, health().gate_open); /* for what may be asked for then */
    TEST_ASSERT_EQUAL(cause->mode, health().mode);
    TEST_ASSERT_EQUAL(cause->clock, has_fault(LEVER_FAULT_CLOCK));
}

TEST(what_the_port_reports_without_breaking_anything_ends_no_torque)
{
    for (uint32_t fault = 1u; fault <= 128u; fault *= 2u) {
        const uint32_t ends = (uint32_t)LEVER_PLATFORM_ROM | (uint32_t)LEVER_PLATFORM_SELF_TEST |
                              (uint32_t)LEVER_PLATFORM_WATCHDOG | (uint32_t)LEVER_PLATFORM_HARD_FAULT;
        const lever_platform_t report = {.faults = (uint8_t)fault};
        start_dithering();
        lever_platform(lever, &report);
        (void)deliver_many(100u);
        TEST_ASSERT_EQUAL((fault & ends) == 0u, health().gate_open);
    }
}

/* A reset, a report of the port, or silence: each without a sample, by the port's clock alone. Every frame is sent. */
/* R38 */
TEST_EACH(3, torque_ends_without_samples_by_the_clock_of_the_port)
{
    const lever_platform_t broken = {.faults = (uint8_t)LEVER_PLATFORM_ROM};
    message_motor_command_t command = {.torque = 1.0f};
    uint32_t ms = 0u;
    start_dithering();
    if (test_round == 1u) {
        lever_platform(lever, &broken);
    } else if (test_round == 2u) {
        request(LEVER_REQUEST_RESET);
    } else {
        /* silence */
    }
    TEST_ASSERT_EQUAL(test_round == 0u, health().gate_open);
    for (; torque_now() != 0.0f; ms += 5u) {
        lever_idle(lever, 5000u);
        TEST_ASSERT_EQUAL_UINT32(1u, fetch());
        TEST_ASSERT_TRUE(message_motor_command_decode(&command, &frames[0]));
        watch_torque(torque_now(), 5000u, health().gate_open);
    }
    TEST_ASSERT_TRUE(command.torque == 0.0f);
    TEST_ASSERT_TRUE(ms <= ((test_round == 0u) ? 70u : 50u)); /* 20 ms of silence and 50 ms */
    lever_idle(lever, 5000u);
    TEST_ASSERT_EQUAL_UINT32(0u, fetch());
    (void)deliver_many(50u); /* samples again, but the ramp starts anew */
    TEST_ASSERT_EQUAL(test_round == 0u, health().gate_open);
}

TEST(torque_ends_when_the_clock_stands_and_samples_are_few)
{
    start_dithering();
    const lever_sample_t standing = sample_after(0u);
    for (uint32_t k = 0u; k < 10u; k++) {
        (void)lever_update(lever, &standing);
    }
    TEST_ASSERT_TRUE(torque_now() == 0.0f);
}

/* R39 */
TEST(torque_ends_a_second_after_the_last_command_and_goes_on_with_the_next)
{
    (void)deliver_many(400u);
    dither(0.5f);
    (void)deliver_many(1000u);
    TEST_ASSERT_TRUE(health().gate_open);
    (void)deliver_many(51u);
    TEST_ASSERT_TRUE(!health().gate_open && (torque_now() == 0.0f));
    dither((float)LEVER_KEEP);
    (void)deliver_many(300u);
    TEST_ASSERT_TRUE(torque_now() != 0.0f);
}

/* So small that no float is left of a fortieth of a millionth of it: it once stayed for ever, and with it all that is
 * refused while torque acts. */
/* R37 */
TEST_EACH(2, torque_that_is_hardly_any_ends_too)
{
    const float tiny[] = {1.0e-40f, 1.0e-44f};
    start_dithering();
    dither(tiny[test_round]);
    (void)deliver_many(400u);
    lever->gate.torque = tiny[test_round];
    dither(0.0f);
    (void)deliver_many(200u);
    TEST_ASSERT_FALSE(lever_is_acting(lever));
    dither(0.3f);
    (void)deliver_many(400u);
    lever->gate.torque = tiny[test_round];
    lever_idle(lever, 1050000u);
    for (uint32_t k = 0u; k < 10u; k++) {
        lever_idle(lever, 5000u);
    }
    TEST_ASSERT_FALSE(lever_is_acting(lever));
}

/* No command but a reset leaves the mode, or makes torque; and after a reset it must be asked for again. */
TEST(no_command_brings_torque_back_in_fault)
{
    lever_command_t command = command_none();
    command.dither_rms = 0.5f;
    start_dithering();
    lever->estimator.mode = LEVER_MODE_FAULT;
    (void)deliver_many(100u);
    TEST_ASSERT_FALSE(lever_command(lever, &command));
    (void)deliver_many(200u);
    TEST_ASSERT_TRUE(torque_now() == 0.0f);
    request(LEVER_REQUEST_RESET);
    (void)deliver_many(600u);
    TEST_ASSERT_TRUE(torque_now() == 0.0f);
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)deliver_many(400u);
    TEST_ASSERT_TRUE(torque_now() != 0.0f);
}

/* --- evidence that it does harm ------------------------------------------------------------------------------------ */

/* Samples with a motor that does so many times what it is asked, and a sensor that says so many times what it does,
 * kept alive; until the gate is as it is to be. Returns how many. */
static uint32_t fly_sensed_motor(float gain, float sensed, bool valid, bool open, uint32_t most)
{
    uint32_t k = 0u;
    for (; (k < most) && (health().gate_open != open); k++) {
        const float driven = gain * torque_now();
        simulation.theta_dot += 1.0e-6 * (double)PERIOD_US * simulation.plant.torque * (double)driven;
        lever_sample_t sample = sample_after(1u);
        sample.tau_m = sensed * driven;
        sample.tau_m_valid = valid;
        if ((k % 250u) == 0u) {
            dither((float)LEVER_KEEP);
        }
        (void)lever_update(lever, &sample);
        watch_torque(torque_now(), 1000u, health().gate_open);
    }
    return k;
}

static uint32_t fly_motor(float gain, bool valid, bool open, uint32_t most)
{
    return fly_sensed_motor(gain, 1.0f, valid, open, most);
}

static void start_motor(float gain)
{
    start_bus();
    simulation.torque_rms = 0.0;
    watch_start(&config.settings);
    (void)fly_motor(gain, true, true, 400u);
    dither(0.3f);
    TEST_ASSERT_LESS_THAN_UINT32(10u, fly_motor(gain, true, true, 10u));
}

/* Reversed, or dead: found within two seconds, off within 50 ms, and off for as long as nobody asks for torque again,
 * though the evidence ends with the torque. */
/* R37 */
TEST_EACH(2, a_motor_that_does_other_than_it_is_asked_is_not_driven)
{
    const float gain = (test_round == 0u) ? -1.0f : 0.0f;
    start_motor(gain);
    TEST_ASSERT_LESS_THAN_UINT32(2000u, fly_motor(gain, true, false, 2000u));
    for (uint32_t k = 0u; k < 20000u; k++) {
        TEST_ASSERT_TRUE((k < 50u) || (torque_now() == 0.0f));
        (void)fly_motor(gain, true, true, 1u);
    }
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_TORQUE) || health().gate_open);
    dither(0.3f);
    TEST_ASSERT_LESS_THAN_UINT32(10u, fly_motor(gain, true, true, 10u));
}

/* Right, and missing. */
TEST_EACH(2, a_motor_of_which_nothing_bad_is_known_is_driven)
{
    const bool valid = (test_round == 0u);
    start_motor(1.0f);
    TEST_ASSERT_EQUAL_UINT32(5000u, fly_motor(1.0f, valid, false, 5000u));
    TEST_ASSERT_EQUAL(!valid, has_fault(LEVER_FAULT_TORQUE));
}

static void damp(void)
{
    lever_command_t command = command_none();
    command.mitigation = (uint8_t)LEVER_MITIGATION_DAMPING;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

/* From power-on, and a sensor that cannot tell: it takes the current of the motor for the torque, or there is none.
 * Damping would drive the lever on its way. Nothing shows it but that no arm explains the motion, of which no more is
 * known then than at the start. */
/* R37 */
TEST_EACH(2, a_motor_that_does_the_reverse_does_not_damp_though_no_sensor_tells)
{
    const bool valid = (test_round == 0u);
    lever_estimate_t estimate;
    start_motor(-1.0f);
    damp();
    TEST_ASSERT_LESS_THAN_UINT32(30000u, fly_sensed_motor(-1.0f, -1.0f, valid, false, 30000u));
    lever_estimate(lever, &estimate);
    TEST_ASSERT_TRUE(estimate.parameter_sigma[0] > (0.3f * estimate.parameter[0]));
    for (uint32_t k = 0u; k < 10000u; k++) {
        TEST_ASSERT_TRUE((k < 50u) || (torque_now() == 0.0f));
        (void)fly_sensed_motor(-1.0f, -1.0f, valid, true, 1u);
    }
    dither((float)LEVER_KEEP);
    damp();
    TEST_ASSERT_LESS_THAN_UINT32(10u, fly_sensed_motor(-1.0f, -1.0f, valid, true, 10u));
}

TEST(a_motor_that_does_what_it_is_asked_damps)
{
    start_motor(1.0f);
    damp();
    TEST_ASSERT_EQUAL_UINT32(30000u, fly_motor(1.0f, true, false, 30000u));
}

/* A command may ask for it meanwhile, and the pilot take the lever again: only both in this order bring torque back. */
/* R37 */
TEST(a_lever_that_nobody_holds_is_not_driven)
{
    start_motor(1.0f);
    TEST_ASSERT_EQUAL_UINT32(3000u, fly_motor(1.0f, true, false, 3000u));
    const plant_t held = simulation.plant;
    simulation.plant = plant_of_lever(0.0, 0.0, 0.0);
    TEST_ASSERT_LESS_THAN_UINT32(2000u, fly_motor(1.0f, true, false, 2000u));
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_HANDS_OFF));
    for (uint32_t k = 0u; k < 3000u; k++) {
        TEST_ASSERT_TRUE((k < 50u) || (torque_now() == 0.0f));
        if (((k % 100u) == 0u) && has_fault(LEVER_FAULT_HANDS_OFF)) {
            dither(0.3f);
        }
        (void)fly_motor(1.0f, true, true, 1u);
    }
    simulation.plant = held;
    TEST_ASSERT_EQUAL_UINT32(4000u, fly_motor(1.0f, true, true, 4000u));
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_HANDS_OFF));
    dither(0.3f);
    TEST_ASSERT_LESS_THAN_UINT32(10u, fly_motor(1.0f, true, true, 10u));
}

/* Neither a reset, silence, a gap, a clock that stands, a blind sample nor a change of mode is one of them. */
/* R37 */
TEST_EACH(8, what_bars_torque_lasts_in_every_mode_until_it_is_asked_for)
{
    const enum lever_request requests[] = {
        LEVER_REQUEST_NONE, LEVER_REQUEST_FREEZE, LEVER_REQUEST_RUN, LEVER_REQUEST_RESET};
    uint8_t *verdict = &lever->estimator.learning.verdict;
    start_dithering();
    request(requests[test_round % 2u]);
    for (uint32_t k = 0u; k < 3u; k++) { /* one of them may end a block, whose verdict is another */
        *verdict = (uint8_t)((test_round < 4u) ? VERDICT_MOTOR_WRONG : VERDICT_HANDS_OFF);
        (void)deliver_many(1u);
    }
    *verdict = (uint8_t)VERDICT_LEARNING;
    TEST_ASSERT_FALSE(health().gate_open);
    (void)run_blind(30u);
    lever_idle(lever, 5000u);
    const lever_sample_t standing = sample_after(0u);
    (void)lever_update(lever, &standing);
    (void)sample_after(100u);
    (void)run(50u);
    TEST_ASSERT_TRUE(torque_now() == 0.0f);
    (void)sample_after(1000u);
    for (uint32_t k = 0u; k < 8u; k++) {
        request(requests[(test_round + k) % 4u]);
        (void)run(400u);
        TEST_ASSERT_FALSE(health().gate_open);
    }
    dither(0.3f);
    (void)run(50u);
    TEST_ASSERT_TRUE(health().gate_open);
}

/* --- settings ------------------------------------------------------------------------------------------------------ */

/* Any bit of them that flips is found within a second, whatever the others say; it is reported for good, though it is
 * flipped back, and ends torque. */
/* R37 R45 */
TEST(settings_that_change_in_memory_end_torque_and_are_reported)
{
    uint8_t *const bytes = (uint8_t *)&config.settings;
    for (uint32_t bit = 0u; bit < (8u * sizeof config.settings); bit += 37u) {
        start_dithering();
        dither((float)LEVER_KEEP);
        const lever_settings_t right = config.settings;
        bytes[bit / 8u] ^= (uint8_t)(1u << (bit % 8u));
        lever->settings_us = time_us - 999999u;
        const lever_sample_t sample = sample_after(1u);
        (void)lever_update(lever, &sample);
        config.settings = right;
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_PLATFORM) && !health().gate_open);
        (void)deliver_many(100u);
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_PLATFORM) && (torque_now() == 0.0f));
    }
}

/* R45 */
TEST(settings_are_looked_at_each_second_and_said_to_be_wrong_on_the_bus)
{
    uint32_t said = 0u;
    start_bus();
    (void)deliver_many(400u);
    config.settings.torque_slew *= 2.0f;
    for (uint32_t k = 0u; k < 1100u; k++) {
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            message_platform_health_t message;
            if (message_platform_health_decode(&message, &frames[f])) {
                TEST_ASSERT_EQUAL_UINT8(LEVER_PLATFORM_SELF_TEST, message.faults);
                said++;
            }
        }
    }
    TEST_ASSERT_TRUE(said > 0u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_PLATFORM));
    config.settings.torque_slew *= 0.5f; /* right again, and looked at again */
    (void)deliver_many(2100u);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_PLATFORM));
}

/* --- gaps --------------------------------------------------------------------------------------------------------- */

/* At any moment of a dither that uses its rms up: a process that was stopped, for one long time in one call; or a
 * gap in the samples and then silence, of which what was let through before is all that may be left. */
TEST(a_long_idle_time_or_gap_ends_torque_and_never_raises_it)
{
    const uint32_t times_us[] = {100000u, 120000u, 150000u, 300000u, 0x7FFFFFFFu, UINT32_MAX};
    (void)deliver_many(400u);
    dither(0.9f);
    (void)deliver_many(300u);
    for (uint32_t k = 0u; k < 3000u; k++) {
        dither((float)LEVER_KEEP);
        (void)deliver_many(1u);
        const lever_memory_t before = memory;
        lever_idle(lever, times_us[k % 6u]);
        TEST_ASSERT_TRUE(torque_now() == 0.0f);
        lever_idle(lever, times_us[k % 6u]);
        TEST_ASSERT_TRUE(torque_now() == 0.0f);
        memory = before;
        lever_sample_t sample = sample_after(0u);
        sample.time_us += 1000u + (100000u * (1u + (k % 5u)));
        (void)lever_update(lever, &sample);
        float last = fabsf(torque_now());
        TEST_ASSERT_TRUE(last <= config.settings.torque_limit);
        for (uint32_t idle = 0u; idle < 15u; idle++) {
            lever_idle(lever, 5000u);
            TEST_ASSERT_TRUE(fabsf(torque_now()) <= last);
            last = fabsf(torque_now());
        }
        TEST_ASSERT_TRUE(last == 0.0f);
        memory = before;
    }
}

/* `count` samples, `periods` of a millisecond apart; the greatest torque. */
static float greatest_over(uint32_t count, uint32_t periods)
{
    float greatest = 0.0f;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = sample_after(periods);
        if (((k * periods) % 100u) == 0u) {
            dither((float)LEVER_KEEP);
        }
        (void)lever_update(lever, &sample);
        watch_torque(torque_now(), 1000u * periods, health().gate_open);
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
        (void)deliver_many(400u);
        dither(0.05f);
        watch_start(&config.settings);
        (void)greatest_over(500u, 1u);
        const float after = greatest_over(1u, gaps[g]);
        TEST_ASSERT_TRUE(after <= 0.25f);
        TEST_ASSERT_TRUE((gaps[g] < 70u) || (after == 0.0f));
        TEST_ASSERT_TRUE(greatest_over(500u, 1u) <= 0.25f);
    }
}

/* NaN for good, once. */
TEST(samples_twenty_times_as_far_apart_as_said_make_no_more_torque)
{
    config.settings.gap_limit = 1.0f;
    start_bus();
    (void)run(400u);
    dither(0.3f);
    watch_start(&config.settings);
    const float greatest = greatest_over(1000u, 20u);
    TEST_ASSERT_TRUE((greatest > 0.1f) && (greatest <= config.settings.torque_limit));
    TEST_ASSERT_TRUE(greatest_over(1000u, 1u) > 0.1f);
}
