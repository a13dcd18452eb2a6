/* What no frame can hold, and frames that are not of a message. tests/python/can compares the codec with cantools. */
#include "can/messages.h"

#include <math.h>
#include <string.h>

#include "test.h"

TEST(a_message_that_does_not_fit_is_not_encoded)
{
    lever_frame_t frame;
    const message_identity_t page = {.page = (uint8_t)MESSAGE_PAGE_COUNT};
    const message_identity_t identity = {.page = (uint8_t)MESSAGE_PAGE_CHOICES, .model = 16u};
    const message_pilot_sigma_t sigma = {.model = (uint8_t)LEVER_MODEL_COUNT};
    const message_health_t health = {.mode = 0xFFu};
    const message_snapshot_t snapshot = {.part = (uint8_t)MESSAGE_PART_COUNT};
    const message_motor_command_t motor = {.model = 8u};
    const message_correction_t correction = {.mitigation = 8u};
    message_command_t command = {.request = 255u};
    TEST_ASSERT_FALSE(message_identity_encode(&frame, &page));
    TEST_ASSERT_FALSE(message_identity_encode(&frame, &identity));
    TEST_ASSERT_FALSE(message_pilot_sigma_encode(&frame, &sigma));
    TEST_ASSERT_FALSE(message_health_encode(&frame, &health));
    TEST_ASSERT_FALSE(message_snapshot_encode(&frame, &snapshot));
    TEST_ASSERT_FALSE(message_motor_command_encode(&frame, &motor));
    TEST_ASSERT_FALSE(message_correction_encode(&frame, &correction));
    TEST_ASSERT_FALSE(message_command_encode(&frame, &command));
    command = (message_command_t){.dither_rms = NAN};
    TEST_ASSERT_FALSE(message_command_encode(&frame, &command));
}

/* With another length, or another identifier; and nothing is read. */
#define ASSERT_REFUSED(message, identifier)                                                                            \
    do {                                                                                                               \
        for (uint32_t k = 0u; k < 2u; k++) {                                                                           \
            const lever_frame_t frame = {.id = (identifier) - k, .length = (k == 0u) ? 7u : 8u};                       \
            message_##message##_t read;                                                                                \
            message_##message##_t before;                                                                              \
            (void)memset(&read, 0, sizeof read);                                                                       \
            (void)memset(&before, 0, sizeof before);                                                                   \
            TEST_ASSERT_FALSE(message_##message##_decode(&read, &frame));                                              \
            TEST_ASSERT_EQUAL_MEMORY(&before, &read, sizeof before);                                                   \
        }                                                                                                              \
    } while (false)

TEST(a_frame_of_another_length_or_identifier_is_refused)
{
    ASSERT_REFUSED(lever_sample, MESSAGE_LEVER_SAMPLE_ID);
    ASSERT_REFUSED(base_sample, MESSAGE_BASE_SAMPLE_ID);
    ASSERT_REFUSED(grip_sample, MESSAGE_GRIP_SAMPLE_ID);
    ASSERT_REFUSED(command, MESSAGE_COMMAND_ID);
    ASSERT_REFUSED(state_estimate, MESSAGE_STATE_ESTIMATE_ID);
    ASSERT_REFUSED(pilot_parameters, MESSAGE_PILOT_PARAMETERS_ID);
    ASSERT_REFUSED(pilot_sigma, MESSAGE_PILOT_SIGMA_ID);
    ASSERT_REFUSED(pilot_dynamics, MESSAGE_PILOT_DYNAMICS_ID);
    ASSERT_REFUSED(feedthrough, MESSAGE_FEEDTHROUGH_ID);
    ASSERT_REFUSED(test_ratio, MESSAGE_TEST_RATIO_ID);
    ASSERT_REFUSED(stability, MESSAGE_STABILITY_ID);
    ASSERT_REFUSED(correction, MESSAGE_CORRECTION_ID);
    ASSERT_REFUSED(health, MESSAGE_HEALTH_ID);
    ASSERT_REFUSED(motor_command, MESSAGE_MOTOR_COMMAND_ID);
    ASSERT_REFUSED(platform_health, MESSAGE_PLATFORM_HEALTH_ID);
    ASSERT_REFUSED(platform_reset, MESSAGE_PLATFORM_RESET_ID);
    ASSERT_REFUSED(identity, MESSAGE_IDENTITY_ID);
    ASSERT_REFUSED(command_ack, MESSAGE_COMMAND_ACK_ID);
    ASSERT_REFUSED(link_health, MESSAGE_LINK_HEALTH_ID);
    ASSERT_REFUSED(snapshot, MESSAGE_SNAPSHOT_ID);
}

TEST(a_part_page_or_model_that_is_not_known_is_refused)
{
    const uint8_t all[] = {0u, 0xF0u, 0xFFu, 0xFFu, 0xFFu, 0xFFu, 0xFFu, 0xFFu};
    lever_frame_t frame = {.id = MESSAGE_SNAPSHOT_ID, .length = 8u};
    (void)memcpy(frame.data, all, sizeof all);
    message_snapshot_t snapshot;
    message_identity_t identity;
    message_pilot_parameters_t parameters;
    TEST_ASSERT_FALSE(message_snapshot_decode(&snapshot, &frame));
    frame.id = MESSAGE_IDENTITY_ID;
    TEST_ASSERT_FALSE(message_identity_decode(&identity, &frame));
    frame.id = MESSAGE_PILOT_PARAMETERS_ID;
    TEST_ASSERT_FALSE(message_pilot_parameters_decode(&parameters, &frame));
}

/* The greatest count of a signal is 65534, and 65535 is not available, as everything beyond. */
TEST(a_value_that_does_not_fit_is_not_available)
{
    static const float value[] = {65.534f, 65.535f, 65.536f, -0.001f, 1.0e9f, NAN};
    for (uint32_t i = 0u; i < 6u; i++) {
        const message_pilot_parameters_t parameters = {.parameter = {value[i], 1.0f, 1.0f}};
        message_pilot_parameters_t read;
        lever_frame_t frame;
        TEST_ASSERT_TRUE(
            message_pilot_parameters_encode(&frame, &parameters) && message_pilot_parameters_decode(&read, &frame));
        TEST_ASSERT_EQUAL(i == 0u, isfinite(read.parameter[0]));
    }
}

TEST(what_a_port_says_of_its_reset_comes_as_it_went)
{
    const message_platform_reset_t said = {.fault_address = 0x0800ABCDu, .cause = 3u, .resets = 250u, .failed = 5u};
    message_platform_reset_t read = {.fault_address = 0u};
    lever_frame_t frame;
    TEST_ASSERT_TRUE(message_platform_reset_encode(&frame, &said) && message_platform_reset_decode(&read, &frame));
    TEST_ASSERT_TRUE((read.fault_address == said.fault_address) && (read.cause == said.cause));
    TEST_ASSERT_TRUE((read.resets == said.resets) && (read.failed == said.failed));
}
