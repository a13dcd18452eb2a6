/* Every code, flag and count of every message through the codec, against its place as the DBC has it. */
#include "fields.h"

void setUp(void)
{
}

void tearDown(void)
{
}

FLAG(lever_sample, theta_valid)
FLAG(lever_sample, theta_dot_valid)
FLAG(lever_sample, tau_m_valid)
FLAG(base_sample, z_ddot_valid)
CODE(base_sample, time_us, uint32_t)
CODE(command, request, uint8_t)
CODE(command, model, uint8_t)
CODE(command, preload, uint8_t)
CODE(command, estimator, uint8_t)
CODE(command, adaptation, uint8_t)
FLAG(state_estimate, valid)
CODE(state_estimate, time_low, uint16_t)
FLAG(pilot_parameters, valid)
FLAG(pilot_sigma, valid)
CODE(pilot_dynamics, model, uint8_t)
FLAG(pilot_dynamics, valid)
CODE(feedthrough, frequency, uint8_t)
FLAG(feedthrough, valid)
CODE(health, mode, uint8_t)
CODE(health, faults, uint32_t)
CODE(health, restarts, uint8_t)
CODE(motor_command, model, uint8_t)
FLAG(motor_command, valid)
CODE(motor_command, time_low, uint16_t)
CODE(platform_health, model, uint8_t)
FLAG(platform_health, valid)
CODE(platform_health, faults, uint8_t)
CODE(platform_health, transmit_errors, uint8_t)
CODE(platform_health, receive_errors, uint8_t)
CODE(platform_health, bus_offs, uint8_t)
CODE(platform_health, overruns, uint8_t)
CODE(platform_health, dropped, uint8_t)
PAGE(version, firmware_major, uint32_t, uint8_t)
PAGE(version, firmware_minor, uint32_t, uint8_t)
PAGE(version, firmware_patch, uint32_t, uint8_t)
PAGE(version, contract, uint32_t, uint8_t)
PAGE(settings, settings_crc, uint32_t, uint32_t)
PAGE(choices, model, uint32_t, uint8_t)
PAGE(choices, preload, uint32_t, uint8_t)
PAGE(choices, estimator, uint32_t, uint8_t)
PAGE(choices, adaptation, uint32_t, uint8_t)
CODE(command_ack, command_counter, uint8_t)
CODE(command_ack, result, uint8_t)
CODE(command_ack, model, uint8_t)
CODE(command_ack, preload, uint8_t)
CODE(command_ack, estimator, uint8_t)
CODE(command_ack, adaptation, uint8_t)
CODE(link_health, model, uint8_t)
FLAG(link_health, valid)
CODE(link_health, lost, uint16_t)
CODE(link_health, corrupt, uint16_t)
CODE(link_health, late, uint16_t)

typedef struct code {
    const char *name;
    bool (*encode)(lever_frame_t *frame, uint32_t value);
    bool (*decode)(uint32_t *value, const lever_frame_t *frame);
    uint32_t id;
    uint32_t start;
    uint32_t width;
    uint32_t type_greatest; /* of the struct's member */
} code_t;

#define CODE_ROW(kind, label, id, start, width, type_greatest)                                                         \
    {#kind " " #label, encode_##kind##_##label, decode_##kind##_##label, (id), (start), (width), (type_greatest)}

static const code_t codes[] = {
    CODE_ROW(lever_sample, theta_valid, 0x110u, 12u, 1u, 1u),
    CODE_ROW(lever_sample, theta_dot_valid, 0x110u, 13u, 1u, 1u),
    CODE_ROW(lever_sample, tau_m_valid, 0x110u, 14u, 1u, 1u),
    CODE_ROW(base_sample, z_ddot_valid, 0x111u, 12u, 1u, 1u),
    CODE_ROW(base_sample, time_us, 0x111u, 32u, 32u, UINT32_MAX),
    CODE_ROW(command, request, 0x120u, 16u, 4u, UINT8_MAX),
    CODE_ROW(command, model, 0x120u, 20u, 4u, UINT8_MAX),
    CODE_ROW(command, preload, 0x120u, 24u, 4u, UINT8_MAX),
    CODE_ROW(command, estimator, 0x120u, 28u, 4u, UINT8_MAX),
    CODE_ROW(command, adaptation, 0x120u, 32u, 4u, UINT8_MAX),
    CODE_ROW(state_estimate, valid, 0x210u, 12u, 1u, 1u),
    CODE_ROW(state_estimate, time_low, 0x210u, 48u, 16u, UINT16_MAX),
    CODE_ROW(pilot_parameters, valid, 0x211u, 15u, 1u, 1u),
    CODE_ROW(pilot_sigma, valid, 0x212u, 15u, 1u, 1u),
    CODE_ROW(pilot_dynamics, model, 0x213u, 12u, 3u, UINT8_MAX),
    CODE_ROW(pilot_dynamics, valid, 0x213u, 15u, 1u, 1u),
    CODE_ROW(health, mode, 0x214u, 12u, 4u, UINT8_MAX),
    CODE_ROW(health, faults, 0x214u, 16u, 24u, 0x1010000u),
    CODE_ROW(health, restarts, 0x214u, 40u, 8u, UINT8_MAX),
    CODE_ROW(motor_command, model, 0x215u, 12u, 3u, UINT8_MAX),
    CODE_ROW(motor_command, valid, 0x215u, 15u, 1u, 1u),
    CODE_ROW(motor_command, time_low, 0x215u, 48u, 16u, UINT16_MAX),
    CODE_ROW(platform_health, model, 0x216u, 12u, 3u, UINT8_MAX),
    CODE_ROW(platform_health, valid, 0x216u, 15u, 1u, 1u),
    CODE_ROW(platform_health, faults, 0x216u, 16u, 8u, UINT8_MAX),
    CODE_ROW(platform_health, transmit_errors, 0x216u, 24u, 8u, UINT8_MAX),
    CODE_ROW(platform_health, receive_errors, 0x216u, 32u, 8u, UINT8_MAX),
    CODE_ROW(platform_health, bus_offs, 0x216u, 40u, 8u, UINT8_MAX),
    CODE_ROW(platform_health, overruns, 0x216u, 48u, 8u, UINT8_MAX),
    CODE_ROW(platform_health, dropped, 0x216u, 56u, 8u, UINT8_MAX),
    CODE_ROW(identity, firmware_major, 0x217u, 16u, 8u, UINT8_MAX),
    CODE_ROW(identity, firmware_minor, 0x217u, 24u, 8u, UINT8_MAX),
    CODE_ROW(identity, firmware_patch, 0x217u, 32u, 8u, UINT8_MAX),
    CODE_ROW(identity, contract, 0x217u, 40u, 8u, UINT8_MAX),
    CODE_ROW(identity, settings_crc, 0x217u, 16u, 32u, UINT32_MAX),
    CODE_ROW(identity, model, 0x217u, 16u, 4u, UINT8_MAX),
    CODE_ROW(identity, preload, 0x217u, 20u, 4u, UINT8_MAX),
    CODE_ROW(identity, estimator, 0x217u, 24u, 4u, UINT8_MAX),
    CODE_ROW(identity, adaptation, 0x217u, 28u, 4u, UINT8_MAX),
    CODE_ROW(command_ack, command_counter, 0x218u, 12u, 4u, UINT8_MAX),
    CODE_ROW(command_ack, result, 0x218u, 16u, 4u, UINT8_MAX),
    CODE_ROW(command_ack, model, 0x218u, 20u, 4u, UINT8_MAX),
    CODE_ROW(command_ack, preload, 0x218u, 24u, 4u, UINT8_MAX),
    CODE_ROW(command_ack, estimator, 0x218u, 28u, 4u, UINT8_MAX),
    CODE_ROW(command_ack, adaptation, 0x218u, 32u, 4u, UINT8_MAX),
    CODE_ROW(link_health, model, 0x219u, 12u, 3u, UINT8_MAX),
    CODE_ROW(link_health, valid, 0x219u, 15u, 1u, 1u),
    CODE_ROW(link_health, lost, 0x219u, 16u, 16u, UINT16_MAX),
    CODE_ROW(link_health, corrupt, 0x219u, 32u, 16u, UINT16_MAX),
    CODE_ROW(link_health, late, 0x219u, 48u, 16u, UINT16_MAX),
    CODE_ROW(feedthrough, frequency, 0x21Au, 12u, 4u, UINT8_MAX),
    CODE_ROW(feedthrough, valid, 0x21Au, 16u, 1u, 1u),
};
enum { CODES = (int)(sizeof codes / sizeof codes[0]) };

static void assert_code_is_exact(const code_t *field, uint32_t value)
{
    lever_frame_t frame = untouched;
    TEST_ASSERT_TRUE_MESSAGE(field->encode(&frame, value), field->name);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(field->id, frame.id, field->name);
    lever_frame_t expected = untouched;
    TEST_ASSERT_TRUE_MESSAGE(field->encode(&expected, 0u), field->name);
    set_bits(&expected, field->start, field->width, (int64_t)value);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(expected.data, frame.data, 8, field->name);
    uint32_t back = ~value;
    TEST_ASSERT_TRUE_MESSAGE(field->decode(&back, &frame), field->name);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(value, back, field->name);
}

static void test_codes_are_exact_up_to_their_limit(void)
{
    for (int i = 0; i < CODES; i++) {
        uint32_t greatest = UINT32_MAX >> (32u - codes[i].width);
        for (uint32_t value = 0u; (value <= greatest) && (value < 5000u); value++) {
            assert_code_is_exact(&codes[i], value);
        }
        assert_code_is_exact(&codes[i], greatest);
    }
    assert_code_is_exact(&codes[4], 16777217u); /* time_us that a float cannot hold */
    assert_code_is_exact(&codes[4], 4294967294u);
}

static void test_codes_beyond_their_limit_are_refused(void)
{
    for (int i = 0; i < CODES; i++) {
        uint32_t greatest = UINT32_MAX >> (32u - codes[i].width);
        for (uint32_t value = greatest; value < codes[i].type_greatest; value++) {
            lever_frame_t frame = untouched;
            TEST_ASSERT_FALSE_MESSAGE(codes[i].encode(&frame, value + 1u), codes[i].name);
            assert_untouched(&frame, codes[i].name);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_codes_are_exact_up_to_their_limit);
    RUN_TEST(test_codes_beyond_their_limit_are_refused);
    return UNITY_END();
}
