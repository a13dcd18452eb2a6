/* Frames to send: that they say what the estimate says, within half a count, and what may be used. */
#include "answers.h"

void setUp(void)
{
    lever_config_default(&config);
    start();
}

/* Answers until one has this identifier, which is returned. */
static lever_frame_t next_with(uint32_t id)
{
    for (uint32_t k = 0u; k < 100u; k++) {
        const uint32_t count = answers();
        for (uint32_t f = 0u; f < count; f++) {
            if (frames[f].id == id) {
                return frames[f];
            }
        }
    }
    TEST_FAIL_MESSAGE("was not sent");
    return frames[0];
}

TEST(state_estimate_says_what_the_estimate_says)
{
    message_state_estimate_t message;
    (void)sender_run(&sender, lever, 2000u);
    const uint32_t count = answers();
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_TRUE(message_state_estimate_decode(&message, &frames[count - 1u]));
    TEST_ASSERT_DOUBLE_WITHIN(1.1e-4, (double)estimate.theta, (double)message.theta);
    TEST_ASSERT_DOUBLE_WITHIN(1.1e-3, (double)estimate.theta_dot, (double)message.theta_dot);
    TEST_ASSERT_DOUBLE_WITHIN(0.063, sqrt((double)estimate.nis), (double)message.innovation);
    TEST_ASSERT_EQUAL_UINT16(estimate.time_us & 0xFFFFu, message.time_low);
}

/* Valid: in RUN, COAST and FROZEN, while the sample clock advances; without measurement there is no innovation. */
TEST(every_estimate_says_whether_it_may_be_used)
{
    const struct {
        bool blind;
        bool stands;
        bool valid;
        enum lever_mode mode;
    } rows[] = {{false, false, true, LEVER_MODE_RUN}, {true, false, true, LEVER_MODE_COAST},
        {false, true, false, LEVER_MODE_COAST}, {false, false, true, LEVER_MODE_RUN}};
    message_state_estimate_t state;
    message_pilot_dynamics_t dynamics;
    publish_always();
    (void)answers();
    (void)answers();
    TEST_ASSERT_TRUE(message_pilot_dynamics_decode(&dynamics, &frames[2]));
    TEST_ASSERT_FALSE(dynamics.valid); /* aligning */
    (void)sender_run(&sender, lever, 400u);
    for (uint32_t k = 0u; k < 4u; k++) {
        sender.rig.time_us -= rows[k].stands ? (uint32_t)RIG_PERIOD_US : 0u;
        sender_next(&sender);
        if (!rows[k].blind) {
            (void)lever_on_frame(lever, &sender.lever);
        }
        (void)lever_on_frame(lever, &sender.base);
        TEST_ASSERT_EQUAL(rows[k].mode, lever_step(lever));
        const uint32_t count = fetch_all(lever, frames);
        message_pilot_parameters_t parameters;
        message_pilot_sigma_t sigma;
        message_feedthrough_t feedthrough;
        message_link_health_t link;
        TEST_ASSERT_TRUE(message_pilot_parameters_decode(&parameters, &frames[0]));
        TEST_ASSERT_TRUE(message_pilot_sigma_decode(&sigma, &frames[1]));
        TEST_ASSERT_TRUE(message_pilot_dynamics_decode(&dynamics, &frames[2]));
        TEST_ASSERT_TRUE(message_feedthrough_decode(&feedthrough, &frames[3]));
        TEST_ASSERT_TRUE(message_link_health_decode(&link, &frames[5]));
        TEST_ASSERT_TRUE(message_state_estimate_decode(&state, &frames[count - 1u]));
        TEST_ASSERT_EQUAL(rows[k].valid, parameters.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, sigma.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, dynamics.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, feedthrough.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, link.valid);
        TEST_ASSERT_EQUAL(rows[k].valid, state.valid);
        TEST_ASSERT_TRUE(rows[k].blind == (isnan(state.innovation) != 0) || rows[k].stands);
    }
}

TEST(dynamics_say_what_the_estimate_says)
{
    message_pilot_dynamics_t message;
    publish_always();
    (void)sender_run(&sender, lever, 2000u);
    (void)answers();
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_TRUE(message_pilot_dynamics_decode(&message, &frames[2]));
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-4, (double)estimate.natural_frequency, (double)message.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(
        1.1e-3, (double)estimate.natural_frequency_sigma, (double)message.natural_frequency_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(1.1e-4, (double)estimate.damping_ratio, (double)message.damping_ratio);
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-4, (double)estimate.damping_ratio_sigma, (double)message.damping_ratio_sigma);
}

/* Each of 2 to 8 Hz in its turn, and again from the first. */
TEST(feedthrough_says_one_frequency_after_the_other)
{
    publish_always();
    (void)sender_run(&sender, lever, 2000u);
    (void)answers();
    message_feedthrough_t message;
    TEST_ASSERT_TRUE(message_feedthrough_decode(&message, &frames[3]));
    for (uint32_t k = 0u; k < 15u; k++) {
        const uint8_t next = (message.frequency == 8u) ? 2u : (uint8_t)(message.frequency + 1u);
        lever_feedthrough_t feedthrough;
        (void)answers();
        TEST_ASSERT_TRUE(message_feedthrough_decode(&message, &frames[3]));
        TEST_ASSERT_EQUAL_UINT8(next, message.frequency);
        lever_feedthrough(lever, (float)message.frequency, &feedthrough);
        TEST_ASSERT_DOUBLE_WITHIN(2.6e-6, (double)feedthrough.real, (double)message.real);
        TEST_ASSERT_DOUBLE_WITHIN(2.6e-6, (double)feedthrough.imaginary, (double)message.imaginary);
        TEST_ASSERT_DOUBLE_WITHIN(1.1e-3, (double)feedthrough.gain_sigma, (double)message.gain_sigma);
        TEST_ASSERT_DOUBLE_WITHIN(1.1e-3, (double)feedthrough.phase_sigma, (double)message.phase_sigma);
    }
}

TEST(health_says_mode_faults_and_excitation)
{
    message_health_t message;
    publish_always();
    (void)sender_run(&sender, lever, 1000u);
    (void)answers();
    const lever_health_t health = rig_health(lever);
    TEST_ASSERT_TRUE(message_health_decode(&message, &frames[4]));
    TEST_ASSERT_EQUAL_UINT8(LEVER_MODE_RUN, message.mode);
    TEST_ASSERT_EQUAL_UINT32(health.faults, message.faults);
    TEST_ASSERT_EQUAL_UINT8(0u, message.restarts);
    TEST_ASSERT_DOUBLE_WITHIN(2.6e-4, (double)health.excitation, (double)message.excitation);
}

/* Sixty gaps gave four frames with the fault once. */
TEST(health_has_every_fault_since_the_last_one)
{
    uint32_t told = 0u;
    (void)sender_run(&sender, lever, 400u);
    for (uint32_t gap = 0u; gap < 60u; gap++) {
        sender_next(&sender);
        for (uint32_t k = 0u; k < 20u; k++) {
            message_health_t health = {.faults = 0u};
            const uint32_t count = answers();
            for (uint32_t f = 0u; f < count; f++) {
                told +=
                    (message_health_decode(&health, &frames[f]) && ((health.faults & (uint32_t)LEVER_FAULT_GAP) != 0u))
                        ? 1u
                        : 0u;
            }
        }
    }
    TEST_ASSERT_UINT32_WITHIN(1u, 60u, told);
    (void)sender_run(&sender, lever, 20u);
    message_health_t health;
    const lever_frame_t frame = next_with(0x214u);
    TEST_ASSERT_TRUE(message_health_decode(&health, &frame));
    TEST_ASSERT_BITS_LOW(LEVER_FAULT_GAP, health.faults);
}

TEST(link_health_has_the_counts)
{
    message_link_health_t message;
    (void)sender_run(&sender, lever, 1000u);
    sender_next(&sender); /* lost */
    sender_next(&sender); /* its lever sample is damaged */
    sender.lever.data[3] ^= 1u;
    (void)lever_on_frame(lever, &sender.lever);
    (void)lever_on_frame(lever, &sender.base);
    (void)lever_step(lever);
    (void)lever_on_frame(lever, &sender.base); /* repeated */
    const lever_frame_t frame = next_with(0x219u);
    TEST_ASSERT_TRUE(message_link_health_decode(&message, &frame));
    TEST_ASSERT_EQUAL_UINT16(2u, message.lost);
    TEST_ASSERT_EQUAL_UINT16(1u, message.corrupt);
    TEST_ASSERT_EQUAL_UINT16(1u, message.late);
}

TEST(motor_command_says_the_torque_of_health)
{
    message_motor_command_t message;
    (void)sender_run(&sender, lever, 400u);
    dither(0.4f);
    (void)sender_run(&sender, lever, 900u);
    (void)answers();
    TEST_ASSERT_TRUE(message_motor_command_decode(&message, &frames[0]));
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-4, (double)rig_health(lever).torque, (double)message.torque);
    TEST_ASSERT_TRUE(message.dither == message.torque);
    TEST_ASSERT_TRUE(message.torque != 0.0f);
    TEST_ASSERT_TRUE(message.valid);
    TEST_ASSERT_EQUAL_UINT16(sender.rig.time_us & 0xFFFFu, message.time_low);
}

/* --- what the port reports ---------------------------------------------------------------------------------------- */

TEST(platform_health_is_sent_from_the_first_report_on)
{
    const lever_platform_t report = {
        .faults = (uint8_t)((uint8_t)LEVER_PLATFORM_CLOCK | (uint8_t)LEVER_PLATFORM_BUS_OFF),
        .transmit_errors = 255u,
        .receive_errors = 96u,
        .bus_offs = 3u,
        .overruns = 258u,
        .dropped = 1021u};
    message_platform_health_t message;
    lever_platform(lever, &report);
    const lever_frame_t frame = next_with(0x216u);
    TEST_ASSERT_TRUE(message_platform_health_decode(&message, &frame));
    TEST_ASSERT_EQUAL_UINT8(report.faults, message.faults);
    TEST_ASSERT_EQUAL_UINT8(255u, message.transmit_errors);
    TEST_ASSERT_EQUAL_UINT8(96u, message.receive_errors);
    TEST_ASSERT_EQUAL_UINT8(3u, message.bus_offs);
    TEST_ASSERT_EQUAL_UINT8(2u, message.overruns);
    TEST_ASSERT_EQUAL_UINT8(253u, message.dropped);
}

TEST(a_fault_of_the_platform_is_one_of_health_as_long_as_it_is_reported)
{
    lever_platform_t report = {.faults = (uint8_t)LEVER_PLATFORM_WATCHDOG};
    lever_platform(lever, &report);
    (void)sender_run(&sender, lever, 10u);
    TEST_ASSERT_BITS_HIGH(LEVER_FAULT_PLATFORM, rig_health(lever).faults);
    report.faults = 0u;
    lever_platform(lever, &report);
    (void)sender_run(&sender, lever, 1u);
    TEST_ASSERT_BITS_LOW(LEVER_FAULT_PLATFORM, rig_health(lever).faults);
}
