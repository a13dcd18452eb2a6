/* Frames to send: which, in what order, how often, protected how; that they say what the estimate says, and what may
 * be used. */
#include "app/instance.h"
#include "app/link.h"
#include "frames.h"

#include <math.h>

void setUp(void)
{
    lever_config_default(&config);
    start_bus();
}

static void publish_always(void)
{
    config.settings.publish_period = 1.0e-4f;
    start_bus();
}

/* --- which, and in what order ------------------------------------------------------------------------------------- */

static void assert_ids(const uint32_t *wanted, uint32_t count, uint32_t found)
{
    TEST_ASSERT_EQUAL_UINT32(count, found);
    for (uint32_t k = 0u; k < count; k++) {
        TEST_ASSERT_EQUAL_HEX32(wanted[k], frames[k].id);
        TEST_ASSERT_EQUAL_UINT8(8u, frames[k].length);
    }
}

/* Part k of seven, of which PLATFORM_HEALTH is not sent without a report, at the first sample after k sevenths of the
 * period; the pages of IDENTITY each second. Also when time wraps. */
TEST(a_set_of_divided_messages_is_spread_over_a_publish_period)
{
    const struct {
        uint32_t sample;
        uint32_t id;
    } wanted[] = {{0u, 0x214u}, {3u, 0x211u}, {6u, 0x212u}, {9u, 0x213u}, {12u, 0x21Au}, {15u, 0x219u}};
    TEST_ASSERT_EQUAL_UINT32(0u, fetch());
    time_us = UINT32_MAX - 500000u;
    for (uint32_t k = 0u; k < 2100u; k++) {
        uint32_t next[3] = {0u};
        uint32_t count = 0u;
        for (uint32_t m = 0u; m < 6u; m++) {
            if (wanted[m].sample == (k % 20u)) {
                next[count++] = wanted[m].id;
            }
        }
        if ((k % 1000u) < 3u) {
            next[count++] = 0x217u;
        }
        next[count++] = 0x210u;
        assert_ids(next, count, answers());
        TEST_ASSERT_EQUAL_UINT32(1000u * (k % 20u), lever->link.set_us);
        TEST_ASSERT_EQUAL_UINT32(1000u * (k % 1000u), lever->link.identity_us);
    }
}

/* R22 */
TEST(when_all_are_due_state_estimate_comes_last)
{
    const uint32_t wanted[] = {0x215u, 0x218u, 0x211u, 0x212u, 0x213u, 0x21Au, 0x214u, 0x219u, 0x216u, 0x217u, 0x210u};
    const lever_platform_t report = {.faults = 0u};
    publish_always();
    lever_platform(lever, &report);
    (void)deliver_many(400u);
    lever_command_t command = command_none();
    command.dither_rms = 0.3f;
    const lever_frame_t frame = command_frame(&command);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
    assert_ids(wanted, 11u, answers());
}

/* By a fade, and at once. */
TEST_EACH(2, the_last_motor_command_is_zero_and_then_there_is_none)
{
    message_motor_command_t command = {.torque = 1.0f};
    uint32_t sent = 0u;
    config.settings.dither_fade = (test_round == 0u) ? 1.0f : 0.0f;
    config.settings.torque_slew = 1.0e5f;
    start_bus();
    (void)deliver_many(400u);
    dither(0.3f);
    (void)deliver_many(900u);
    dither(0.0f);
    for (uint32_t k = 0u; k < 2000u; k++) {
        (void)answers();
        sent += message_motor_command_decode(&command, &frames[0]) ? 1u : 0u;
    }
    TEST_ASSERT_UINT32_WITHIN(2u, (test_round == 0u) ? 1000u : 1u, sent);
    TEST_ASSERT_TRUE(command.torque == 0.0f);
}

TEST(frames_not_fetched_are_replaced_and_do_not_pile_up_and_a_late_sample_is_answered_too)
{
    message_state_estimate_t message;
    for (uint32_t k = 0u; k < 50u; k++) {
        (void)deliver();
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(8u, fetch());
    time_us -= 2000u;
    const uint32_t count = answers();
    TEST_ASSERT_EQUAL_UINT32(1u, health().late);
    TEST_ASSERT_TRUE(message_state_estimate_decode(&message, &frames[count - 1u]));
}

/* A clock that is half a turn off has not advanced. */
TEST(a_sample_that_is_not_newer_takes_a_period)
{
    (void)deliver_many(10u);
    const uint32_t before_us = lever->link.identity_us;
    lever->link.time_us = (time_us + (uint32_t)PERIOD_US) - 0x80000000u;
    (void)deliver();
    TEST_ASSERT_EQUAL_UINT32(before_us + (uint32_t)PERIOD_US, lever->link.identity_us);
}

/* Also when none is due; recoveries wrap. */
TEST(the_last_page_of_identity_and_the_lowest_byte_of_the_recoveries_are_said)
{
    lever_frame_t frame;
    message_identity_t identity;
    message_health_t message;
    lever->link.pages = 0u;
    TEST_ASSERT_TRUE(link_encode(lever, OUTPUT_IDENTITY, &frame) && message_identity_decode(&identity, &frame));
    TEST_ASSERT_EQUAL_UINT8(MESSAGE_PAGE_CHOICES, identity.page);
    lever->estimator.recoveries = 0x105u;
    TEST_ASSERT_TRUE(link_encode(lever, OUTPUT_HEALTH, &frame) && message_health_decode(&message, &frame));
    TEST_ASSERT_EQUAL_UINT8(5u, message.restarts);
}

/* Once there was no HEALTH at all then. */
TEST(publication_goes_on_while_the_sample_clock_stands)
{
    (void)deliver_many(400u);
    const uint32_t before = time_us - (uint32_t)PERIOD_US;
    uint32_t found = 0u;
    for (uint32_t k = 0u; k < 1000u; k++) {
        message_health_t message;
        time_us = before;
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            if (message_health_decode(&message, &frames[f])) {
                TEST_ASSERT_BITS_HIGH(LEVER_FAULT_CLOCK, message.faults);
                found++;
            }
        }
    }
    TEST_ASSERT_EQUAL_UINT32(50u, found);
}

TEST(every_message_has_its_own_gapless_counter_and_a_right_crc)
{
    const uint8_t data_ids[11] = {
        49u, 65u, 81u, 97u, 113u, 129u, 145u, 161u, 177u, 193u, 209u}; /* E2EDataIdBase of the DBC */
    const uint32_t expected[11] = {1000u, 50u, 50u, 50u, 50u, 700u, 50u, 3u, 1000u, 50u, 50u};
    uint32_t received[11] = {0u};
    const lever_platform_t report = {.faults = 0u};
    lever_platform(lever, &report);
    for (uint32_t k = 0u; k < 1000u; k++) {
        lever_command_t command = command_none();
        command.dither_rms = 0.3f;
        const lever_frame_t frame = command_frame(&command);
        (void)lever_on_frame(lever, &frame);
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            const uint32_t m = frames[f].id - 0x210u;
            TEST_ASSERT_LESS_THAN_UINT32(11u, m);
            const uint8_t next = (uint8_t)(received[m] & 15u);
            TEST_ASSERT_EQUAL_UINT8(next, e2e_counter(&frames[f]));
            TEST_ASSERT_EQUAL_HEX8(e2e_crc(&frames[f].data[1], 7u, (uint8_t)(data_ids[m] + next)), frames[f].data[0]);
            received[m]++;
        }
    }
    TEST_ASSERT_EQUAL_UINT32_ARRAY(expected, received, 11);
}

/* --- what they say ------------------------------------------------------------------------------------------------ */

typedef struct told {
    message_pilot_parameters_t parameters;
    message_pilot_sigma_t sigma;
    message_pilot_dynamics_t dynamics;
    message_feedthrough_t feedthrough;
    message_health_t health;
    message_link_health_t link;
    message_state_estimate_t state;
} told_t;

/* The `count` frames of a sample with which everything is published, torque and platform's aside. */
static told_t decoded(uint32_t count)
{
    told_t told;
    TEST_ASSERT_TRUE(message_pilot_parameters_decode(&told.parameters, &frames[0]));
    TEST_ASSERT_TRUE(message_pilot_sigma_decode(&told.sigma, &frames[1]));
    TEST_ASSERT_TRUE(message_pilot_dynamics_decode(&told.dynamics, &frames[2]));
    TEST_ASSERT_TRUE(message_feedthrough_decode(&told.feedthrough, &frames[3]));
    TEST_ASSERT_TRUE(message_health_decode(&told.health, &frames[4]));
    TEST_ASSERT_TRUE(message_link_health_decode(&told.link, &frames[5]));
    TEST_ASSERT_TRUE(message_state_estimate_decode(&told.state, &frames[count - 1u]));
    return told;
}

/* Valid: in RUN, COAST and FROZEN, while the sample clock advances; without measurement there is no innovation. */
/* R22 */
TEST(every_estimate_says_whether_it_may_be_used)
{
    const struct {
        bool blind;
        bool stands;
        bool valid;
        enum lever_mode mode;
    } rows[] = {{false, false, false, LEVER_MODE_ALIGN}, {false, false, true, LEVER_MODE_RUN},
        {true, false, true, LEVER_MODE_COAST}, {false, true, false, LEVER_MODE_COAST},
        {false, false, true, LEVER_MODE_RUN}};
    publish_always();
    (void)deliver_many(2u);
    for (uint32_t k = 0u; k < (uint32_t)(sizeof rows / sizeof rows[0]); k++) {
        (void)deliver_many((k == 1u) ? 400u : 0u);
        time_us -= rows[k].stands ? (uint32_t)PERIOD_US : 0u;
        next_pair();
        if (!rows[k].blind) {
            (void)lever_on_frame(lever, &lever_frame);
        }
        (void)lever_on_frame(lever, &base_frame);
        TEST_ASSERT_EQUAL(rows[k].mode, lever_step(lever));
        const told_t told = decoded(fetch());
        TEST_ASSERT_EQUAL_UINT8(rows[k].mode, told.health.mode);
        TEST_ASSERT_EQUAL(rows[k].valid, told.parameters.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, told.sigma.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, told.dynamics.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, told.feedthrough.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, told.link.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, told.state.valid);
        TEST_ASSERT_TRUE((k == 0u) || rows[k].stands || (rows[k].blind == (isnan(told.state.innovation) != 0)));
    }
}

static void assert_near(double half_count, float expected, float found)
{
    TEST_ASSERT_DOUBLE_WITHIN(half_count, (double)expected, (double)found);
}

/* Within half a count; the feedthrough at each of 2 to 8 Hz in its turn, and again from the first. */
TEST(they_say_what_estimate_and_health_say)
{
    publish_always();
    (void)deliver_many(2000u);
    uint8_t frequency = decoded(answers()).feedthrough.frequency;
    for (uint32_t k = 0u; k < 15u; k++) {
        const told_t told = decoded(answers());
        const lever_estimate_t e = estimate();
        lever_feedthrough_t feedthrough;
        frequency = (frequency == 8u) ? 2u : (uint8_t)(frequency + 1u);
        TEST_ASSERT_EQUAL_UINT8(frequency, told.feedthrough.frequency);
        lever_feedthrough(lever, (float)frequency, &feedthrough);
        assert_near(2.6e-6, feedthrough.real, told.feedthrough.real);
        assert_near(2.6e-6, feedthrough.imaginary, told.feedthrough.imaginary);
        assert_near(1.1e-3, feedthrough.gain_sigma, told.feedthrough.gain_sigma);
        assert_near(1.1e-3, feedthrough.phase_sigma, told.feedthrough.phase_sigma);
        assert_near(1.1e-4, e.theta, told.state.theta);
        assert_near(1.1e-3, e.theta_dot, told.state.theta_dot);
        assert_near(0.063, sqrtf(e.nis), told.state.innovation);
        TEST_ASSERT_EQUAL_UINT16(e.time_us & 0xFFFFu, told.state.time_low);
        assert_near(5.1e-4, e.natural_frequency, told.dynamics.natural_frequency);
        assert_near(1.1e-3, e.natural_frequency_sigma, told.dynamics.natural_frequency_sigma);
        assert_near(1.1e-4, e.damping_ratio, told.dynamics.damping_ratio);
        assert_near(5.1e-4, e.damping_ratio_sigma, told.dynamics.damping_ratio_sigma);
        TEST_ASSERT_EQUAL_UINT32(health().faults, told.health.faults);
        TEST_ASSERT_EQUAL_UINT8(0u, told.health.restarts);
        assert_near(2.6e-4, health().excitation, told.health.excitation);
    }
}

/* Sixty gaps gave four frames with the fault once. */
/* R23 */
TEST(health_has_every_fault_since_the_last_one)
{
    uint32_t told = 0u;
    (void)deliver_many(400u);
    for (uint32_t k = 0u; k < 1300u; k++) {
        message_health_t message;
        if ((k < 1200u) && ((k % 20u) == 0u)) {
            next_pair();
        }
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            const bool is_health = message_health_decode(&message, &frames[f]);
            told += (is_health && ((message.faults & (uint32_t)LEVER_FAULT_GAP) != 0u)) ? 1u : 0u;
        }
    }
    TEST_ASSERT_UINT32_WITHIN(1u, 60u, told);
}

TEST(link_health_has_the_counts)
{
    publish_always();
    (void)deliver_many(1000u);
    next_pair(); /* lost */
    next_pair(); /* its lever sample is damaged */
    lever_frame.data[3] ^= 1u;
    (void)lever_on_frame(lever, &lever_frame);
    (void)lever_on_frame(lever, &base_frame);
    (void)lever_step(lever);
    (void)lever_on_frame(lever, &base_frame); /* repeated */
    (void)fetch();
    const message_link_health_t link = decoded(answers()).link;
    TEST_ASSERT_EQUAL_UINT16(2u, link.lost);
    TEST_ASSERT_EQUAL_UINT16(1u, link.corrupt);
    TEST_ASSERT_EQUAL_UINT16(1u, link.late);
}

TEST(motor_command_says_the_torque_of_health)
{
    message_motor_command_t message;
    (void)deliver_many(400u);
    dither(0.4f);
    (void)deliver_many(900u);
    (void)answers();
    TEST_ASSERT_TRUE(message_motor_command_decode(&message, &frames[0]));
    assert_near(5.1e-4, health().torque, message.torque);
    TEST_ASSERT_TRUE((message.dither == message.torque) && (message.torque != 0.0f) && message.valid);
    TEST_ASSERT_EQUAL_UINT16(time_us & 0xFFFFu, message.time_low);
}

/* From the first report on, and as a fault of HEALTH as long as one is reported. */
TEST(platform_health_is_what_the_port_reports)
{
    lever_platform_t report = {.faults = (uint8_t)((uint8_t)LEVER_PLATFORM_CLOCK | (uint8_t)LEVER_PLATFORM_BUS_OFF),
        .transmit_errors = 255u,
        .receive_errors = 96u,
        .bus_offs = 3u,
        .overruns = 258u,
        .dropped = 1021u};
    message_platform_health_t message;
    publish_always();
    lever_platform(lever, &report);
    (void)answers();
    (void)answers();
    TEST_ASSERT_TRUE(message_platform_health_decode(&message, &frames[6]));
    TEST_ASSERT_EQUAL_UINT8(report.faults, message.faults);
    TEST_ASSERT_EQUAL_UINT8(255u, message.transmit_errors);
    TEST_ASSERT_EQUAL_UINT8(96u, message.receive_errors);
    TEST_ASSERT_EQUAL_UINT8(3u, message.bus_offs);
    TEST_ASSERT_EQUAL_UINT8(2u, message.overruns);
    TEST_ASSERT_EQUAL_UINT8(253u, message.dropped);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_PLATFORM));
    report.faults = 0u;
    lever_platform(lever, &report);
    (void)deliver_many(1u);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_PLATFORM));
}

/* --- test ratios --------------------------------------------------------------------------------------------------- */

static void check_test_ratio(uint8_t evidence, float ratio, bool present)
{
    message_test_ratio_t message;
    TEST_ASSERT_TRUE(message_test_ratio_decode(&message, &frames[0]));
    TEST_ASSERT_EQUAL_UINT8(evidence, message.evidence);
    TEST_ASSERT_FLOAT_WITHIN(0.0005f, ratio, message.ratio);
    TEST_ASSERT_EQUAL(present, message.present);
    TEST_ASSERT_EQUAL_UINT8(VERDICT_BLIND, message.verdict);
}

/* With LINK_HEALTH, where that is switched on. */
TEST_EACH(2, a_test_ratio_is_in_each_set_where_that_is_switched_on)
{
    uint32_t sent = 0u;
    config.settings.publish_test_ratios = (float)test_round;
    publish_always();
    (void)deliver_many(1u);
    const uint32_t found = answers();
    for (uint32_t k = 0u; k < found; k++) {
        if (frames[k].id == (uint32_t)MESSAGE_TEST_RATIO_ID) {
            TEST_ASSERT_EQUAL_HEX32(MESSAGE_LINK_HEALTH_ID, frames[k - 1u].id);
            sent++;
        }
    }
    TEST_ASSERT_EQUAL_UINT32(test_round, sent);
}

/* What the field cannot hold is the nearest that it can. */
TEST(test_ratios_are_sent_in_turn)
{
    float ratio[LEVER_TEST_RATIOS];
    publish_always();
    evidence_t *evidence = &lever->estimator.learning.evidence;
    lever->estimator.learning.verdict = (uint8_t)VERDICT_BLIND;
    for (uint32_t i = 0u; i < (uint32_t)LEVER_TEST_RATIOS; i++) {
        evidence->ratio[i] = 0.1f * (float)i;
    }
    evidence->ratio[EVIDENCE_MOTOR] = -1.0f;
    evidence->ratio[EVIDENCE_HANDS] = 100.0f;
    evidence->present = 1u << (uint32_t)EVIDENCE_HANDS;
    lever_test_ratios(lever, ratio);
    TEST_ASSERT_EQUAL_STRING("MOTOR", lever_test_ratio_name(0u));
    TEST_ASSERT_EQUAL_STRING("CLOCK", lever_test_ratio_name((uint32_t)LEVER_TEST_RATIOS - 1u));
    TEST_ASSERT_NULL(lever_test_ratio_name((uint32_t)LEVER_TEST_RATIOS));
    TEST_ASSERT_EQUAL_FLOAT_ARRAY(evidence->ratio, ratio, LEVER_TEST_RATIOS);
    for (uint32_t i = 0u; i <= (uint32_t)LEVER_TEST_RATIOS; i++) {
        const uint8_t which = (uint8_t)(i % (uint32_t)LEVER_TEST_RATIOS);
        TEST_ASSERT_TRUE(link_encode(lever, OUTPUT_TEST_RATIO, &frames[0]));
        check_test_ratio(which, (which == 0u) ? 0.0f : ((which == 1u) ? 65.534f : ratio[which]), which == 1u);
    }
}

/* --- what is not a number ------------------------------------------------------------------------------------------ */

static bool says_valid(enum link_output output)
{
    lever_frame_t frame;
    TEST_ASSERT_TRUE(link_encode(lever, output, &frame));
    return (output == OUTPUT_FEEDTHROUGH) ? ((frame.data[2] & 1u) != 0u) : ((frame.data[1] & 0x80u) != 0u);
}

static bool state_is_valid(void)
{
    lever_frame_t frame;
    message_state_estimate_t message;
    TEST_ASSERT_TRUE(link_encode(lever, OUTPUT_STATE_ESTIMATE, &frame));
    TEST_ASSERT_TRUE(message_state_estimate_decode(&message, &frame));
    return message.valid;
}

TEST(what_is_not_a_number_is_not_valid)
{
    (void)deliver_many(500u);
    cdkf_t *cdkf = &lever->estimator.cdkf;
    const cdkf_t before = *cdkf;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        TEST_ASSERT_TRUE(says_valid(OUTPUT_PARAMETERS) && says_valid(OUTPUT_SIGMA) && says_valid(OUTPUT_DYNAMICS));
        cdkf->p[i] = NAN;
        TEST_ASSERT_FALSE(says_valid(OUTPUT_PARAMETERS));
        *cdkf = before;
        cdkf->s[(i * (uint32_t)MODEL_PARAMETERS) + i] = NAN;
        TEST_ASSERT_FALSE(says_valid(OUTPUT_SIGMA));
        *cdkf = before;
        cdkf->considered[0].w[i] = NAN;
        TEST_ASSERT_FALSE(says_valid(OUTPUT_DYNAMICS));
        TEST_ASSERT_FALSE(says_valid(OUTPUT_FEEDTHROUGH));
        *cdkf = before;
    }
    for (uint32_t i = 0u; i < (uint32_t)MODEL_STATES; i++) {
        TEST_ASSERT_TRUE(state_is_valid());
        cdkf->x[i] = NAN;
        TEST_ASSERT_FALSE(state_is_valid());
        *cdkf = before;
    }
}
