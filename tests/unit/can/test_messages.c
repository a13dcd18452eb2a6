/* Every field of every message through the codec, against its place and step as the DBC has them (tests/python/can
 * checks both against the DBC itself): limits, beyond, NaN, every count, ties; then what belongs to whole frames. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "can/messages.h"
#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* What frames are before an encode that must leave them alone. */
static const lever_frame_t untouched = {0x7A5u, 3u, {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}};

static void assert_untouched(const lever_frame_t *frame, const char *name)
{
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(untouched.id, frame->id, name);
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(untouched.length, frame->length, name);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(untouched.data, frame->data, 8, name);
}

/* --- bits of a frame, one at a time: bit n is bit n % 8 of byte n / 8 --------------------------------------------- */

static int64_t get_bits(const lever_frame_t *frame, uint32_t start, uint32_t width, bool is_signed)
{
    int64_t raw = 0;
    for (uint32_t i = 0u; i < width; i++) {
        uint32_t bit = start + i;
        int64_t weight = (int64_t)1 << i;
        if (((uint32_t)frame->data[bit / 8u] & (1u << (bit % 8u))) != 0u) {
            raw += (is_signed && (i == (width - 1u))) ? -weight : weight;
        }
    }
    return raw;
}

static void set_bits(lever_frame_t *frame, uint32_t start, uint32_t width, int64_t raw)
{
    for (uint32_t i = 0u; i < width; i++) {
        uint32_t bit = start + i;
        if ((((uint64_t)raw >> i) & 1u) != 0u) {
            frame->data[bit / 8u] |= (uint8_t)(1u << (bit % 8u));
        }
    }
}

static uint32_t bits_set(const lever_frame_t *frame)
{
    uint32_t count = 0u;
    for (uint32_t bit = 0u; bit < 64u; bit++) {
        count += (uint32_t)get_bits(frame, bit, 1u, false);
    }
    return count;
}

/* --- access to one field of an otherwise blank message ------------------------------------------------------------ */

static const message_lever_sample_t blank_lever_sample = {0};
static const message_base_sample_t blank_base_sample = {0};
static const message_lever_sample_t valid_lever_sample = {
    .theta_valid = true, .theta_dot_valid = true, .tau_m_valid = true};
static const message_base_sample_t valid_base_sample = {.z_ddot_valid = true};
static const message_command_t blank_command = {0};
static const message_state_estimate_t blank_state_estimate = {0};
static const message_pilot_parameters_t blank_pilot_parameters = {0};
static const message_pilot_sigma_t blank_pilot_sigma = {0};
static const message_pilot_dynamics_t blank_pilot_dynamics = {0};
static const message_health_t blank_health = {0};
static const message_platform_health_t blank_platform_health = {0};
static const message_motor_command_t blank_motor_command = {0};
static const message_command_ack_t blank_command_ack = {0};
static const message_link_health_t blank_link_health = {0};
static const message_identity_t version_identity = {.page = (uint8_t)MESSAGE_PAGE_VERSION};
static const message_identity_t settings_identity = {.page = (uint8_t)MESSAGE_PAGE_SETTINGS};
static const message_identity_t choices_identity = {.page = (uint8_t)MESSAGE_PAGE_CHOICES};

/* A pair of functions of a field, in a message that is otherwise `base`. */
#define ACCESS(kind, label, type, member_type, member, base)                                                           \
    static bool encode_##kind##_##label(lever_frame_t *frame, type value)                                              \
    {                                                                                                                  \
        message_##kind##_t message = (base);                                                                           \
        message.member = (member_type)(value);                                                                         \
        return message_##kind##_encode(frame, &message);                                                               \
    }                                                                                                                  \
    static bool decode_##kind##_##label(type value[1], const lever_frame_t *frame)                                     \
    {                                                                                                                  \
        message_##kind##_t message;                                                                                    \
        bool done = message_##kind##_decode(&message, frame);                                                          \
        *value = done ? (type)message.member : (type)0;                                                                \
        return done;                                                                                                   \
    }

#define QUANTITY(kind, member) ACCESS(kind, member, float, float, member, blank_##kind)
#define FLAGGED(kind, member) ACCESS(kind, member, float, float, member, valid_##kind)
#define CODE(kind, member, type) ACCESS(kind, member, uint32_t, type, member, blank_##kind)
#define PAGE(page, member, type, member_type) ACCESS(identity, member, type, member_type, member, page##_identity)
#define FLAG(kind, member) ACCESS(kind, member, uint32_t, bool, member, blank_##kind)

FLAGGED(lever_sample, theta)
FLAGGED(lever_sample, theta_dot)
FLAGGED(lever_sample, tau_m)
FLAGGED(base_sample, z_ddot)
QUANTITY(command, dither_rms)
QUANTITY(state_estimate, theta)
QUANTITY(state_estimate, theta_dot)
QUANTITY(state_estimate, innovation)
ACCESS(pilot_parameters, 0, float, float, parameter[0], blank_pilot_parameters)
ACCESS(pilot_parameters, 1, float, float, parameter[1], blank_pilot_parameters)
ACCESS(pilot_parameters, 2, float, float, parameter[2], blank_pilot_parameters)
ACCESS(pilot_sigma, 0, float, float, sigma[0], blank_pilot_sigma)
ACCESS(pilot_sigma, 1, float, float, sigma[1], blank_pilot_sigma)
ACCESS(pilot_sigma, 2, float, float, sigma[2], blank_pilot_sigma)
QUANTITY(pilot_dynamics, natural_frequency)
QUANTITY(pilot_dynamics, damping_ratio)
QUANTITY(pilot_dynamics, natural_frequency_sigma)
QUANTITY(pilot_dynamics, damping_ratio_sigma)
QUANTITY(health, excitation)
QUANTITY(motor_command, torque)
QUANTITY(motor_command, dither)
QUANTITY(command_ack, dither_rms)
PAGE(choices, dither_rms, float, float)

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

/* --- physical values -------------------------------------------------------------------------------------------- */

typedef struct quantity {
    const char *name;
    bool (*encode)(lever_frame_t *frame, float value);
    bool (*decode)(float *value, const lever_frame_t *frame);
    double step;
    uint32_t id;
    uint32_t start;
    uint32_t width;
    bool is_signed;
} quantity_t;

#define ROW(kind, label, id, step, start, width, is_signed)                                                            \
    {#kind " " #label, encode_##kind##_##label, decode_##kind##_##label, (step), (id), (start), (width), (is_signed)}

static const quantity_t quantities[] = {
    ROW(lever_sample, theta, 0x110u, 0.0001, 16u, 16u, true),
    ROW(lever_sample, theta_dot, 0x110u, 0.0005, 32u, 16u, true),
    ROW(lever_sample, tau_m, 0x110u, 0.001, 48u, 16u, true),
    ROW(base_sample, z_ddot, 0x111u, 0.001, 16u, 16u, true),
    ROW(command, dither_rms, 0x120u, 0.001, 48u, 16u, false),
    ROW(state_estimate, theta, 0x210u, 0.0002, 34u, 14u, true),
    ROW(state_estimate, theta_dot, 0x210u, 0.002, 21u, 13u, true),
    ROW(state_estimate, innovation, 0x210u, 0.125, 13u, 8u, false),
    ROW(pilot_parameters, 0, 0x211u, 0.001, 16u, 16u, false),
    ROW(pilot_parameters, 1, 0x211u, 0.01, 32u, 16u, false),
    ROW(pilot_parameters, 2, 0x211u, 0.1, 48u, 16u, false),
    ROW(pilot_sigma, 0, 0x212u, 0.0001, 16u, 16u, false),
    ROW(pilot_sigma, 1, 0x212u, 0.002, 32u, 16u, false),
    ROW(pilot_sigma, 2, 0x212u, 0.05, 48u, 16u, false),
    ROW(pilot_dynamics, natural_frequency, 0x213u, 0.001, 16u, 14u, false),
    ROW(pilot_dynamics, damping_ratio, 0x213u, 0.0002, 30u, 14u, false),
    ROW(pilot_dynamics, natural_frequency_sigma, 0x213u, 0.002, 44u, 10u, false),
    ROW(pilot_dynamics, damping_ratio_sigma, 0x213u, 0.001, 54u, 10u, false),
    ROW(health, excitation, 0x214u, 0.0005, 48u, 16u, false),
    ROW(motor_command, torque, 0x215u, 0.001, 16u, 16u, true),
    ROW(motor_command, dither, 0x215u, 0.001, 32u, 16u, true),
    ROW(command_ack, dither_rms, 0x218u, 0.001, 48u, 16u, false),
    ROW(identity, dither_rms, 0x217u, 0.001, 32u, 16u, false),
};
enum { QUANTITIES = (int)(sizeof quantities / sizeof quantities[0]) };

static int64_t least_of(const quantity_t *field)
{
    return field->is_signed ? (1 - ((int64_t)1 << (field->width - 1u))) : 0;
}

static int64_t greatest_of(const quantity_t *field)
{
    return least_of(field) + ((int64_t)1 << field->width) - 2;
}

/* "Not available": the most negative count of a signed field, the greatest of another. */
static int64_t not_available(const quantity_t *field)
{
    return field->is_signed ? (least_of(field) - 1) : (greatest_of(field) + 1);
}

/* The count that a value is sent as. */
static int64_t sent(const quantity_t *field, float value)
{
    lever_frame_t frame = untouched;
    TEST_ASSERT_TRUE_MESSAGE(field->encode(&frame, value), field->name);
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(field->id, frame.id, field->name);
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(8u, frame.length, field->name);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0u, frame.data[0], field->name);
    TEST_ASSERT_EQUAL_HEX8_MESSAGE(0u, frame.data[1] & 0x0Fu, field->name);
    return get_bits(&frame, field->start, field->width, field->is_signed);
}

static void assert_sent(const quantity_t *field, int64_t expected, float value)
{
    TEST_ASSERT_EQUAL_INT64_MESSAGE(expected, sent(field, value), field->name);
}

static void test_limits(void)
{
    for (int i = 0; i < QUANTITIES; i++) {
        const quantity_t *field = &quantities[i];
        assert_sent(field, least_of(field), (float)((double)least_of(field) * field->step));
        assert_sent(field, greatest_of(field), (float)((double)greatest_of(field) * field->step));
        assert_sent(field, least_of(field) + 1, (float)((double)(least_of(field) + 1) * field->step));
        assert_sent(field, greatest_of(field) - 1, (float)((double)(greatest_of(field) - 1) * field->step));
        assert_sent(field, 0, 0.0f);
        assert_sent(field, 0, -0.0f);
    }
}

static bool is_command(const quantity_t *field)
{
    return field->id == (uint32_t)MESSAGE_COMMAND_ID;
}

/* A standard deviation of 200 was sent as 131 once. */
static void test_what_does_not_fit_is_not_available(void)
{
    static const float beyond[] = {1.0e5f, 1.0e10f, 3.0e38f, INFINITY};
    for (int i = 0; i < QUANTITIES; i++) {
        const quantity_t *field = &quantities[i];
        const int64_t expected = not_available(field);
        assert_sent(field, expected, (float)((double)(greatest_of(field) + 1) * field->step));
        for (size_t j = 0u; j < (sizeof beyond / sizeof beyond[0]); j++) {
            assert_sent(field, expected, beyond[j]);
            if (!is_command(field)) {
                assert_sent(field, expected, -beyond[j]);
            }
        }
        if (!is_command(field)) {
            assert_sent(field, expected, (float)((double)(least_of(field) - 1) * field->step));
            assert_sent(field, expected, NAN);
            assert_sent(field, expected, -NAN);
        }
    }
}

static void test_not_available_decodes_to_nan(void)
{
    for (int i = 0; i < QUANTITIES; i++) {
        const quantity_t *field = &quantities[i];
        lever_frame_t frame = untouched;
        TEST_ASSERT_TRUE(field->encode(&frame, 1.0e10f));
        float value = 0.0f;
        TEST_ASSERT_TRUE(field->decode(&value, &frame));
        TEST_ASSERT_TRUE_MESSAGE(is_command(field) ? (value == 65.535f) : (value != value), field->name);
    }
}

static void test_a_command_for_no_rms_is_refused(void)
{
    static const float bad[] = {NAN, -0.001f, -INFINITY};
    for (size_t j = 0u; j < (sizeof bad / sizeof bad[0]); j++) {
        lever_frame_t frame = untouched;
        TEST_ASSERT_FALSE(encode_command_dither_rms(&frame, bad[j]));
        assert_untouched(&frame, "dither_rms");
    }
}

/* The flags say so, too: in what is sent, and in what comes. */
static void test_an_input_that_is_not_available_is_not_valid(void)
{
    lever_frame_t frame = untouched;
    message_lever_sample_t lever = {NAN, 17.0f, -40.0f, true, true, true};
    TEST_ASSERT_TRUE(message_lever_sample_encode(&frame, &lever));
    static const uint8_t not_there[8] = {0x00u, 0x70u, 0x00u, 0x80u, 0x00u, 0x80u, 0x00u, 0x80u};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(not_there, frame.data, 8);
    TEST_ASSERT_TRUE(message_lever_sample_decode(&lever, &frame));
    TEST_ASSERT_FALSE(lever.theta_valid || lever.theta_dot_valid || lever.tau_m_valid);
    message_base_sample_t base = {.z_ddot = 1.0e9f, .z_ddot_valid = true};
    TEST_ASSERT_TRUE(message_base_sample_encode(&frame, &base));
    TEST_ASSERT_TRUE(message_base_sample_decode(&base, &frame));
    TEST_ASSERT_FALSE(base.z_ddot_valid);
}

/* Every count decodes to the float nearest to count * step, and that is sent as the same count again; no other bit of
 * the frame is touched by the field. */
static void test_every_count(void)
{
    for (int i = 0; i < QUANTITIES; i++) {
        const quantity_t *field = &quantities[i];
        for (int64_t raw = least_of(field); raw <= greatest_of(field); raw++) {
            lever_frame_t frame = untouched;
            TEST_ASSERT_TRUE_MESSAGE(field->encode(&frame, 0.0f), field->name);
            set_bits(&frame, field->start, field->width, raw);
            float value = 0.0f;
            TEST_ASSERT_TRUE_MESSAGE(field->decode(&value, &frame), field->name);
            TEST_ASSERT_TRUE_MESSAGE(value == (float)((double)raw * field->step), field->name);
            lever_frame_t again = untouched;
            TEST_ASSERT_TRUE_MESSAGE(field->encode(&again, value), field->name);
            TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(frame.data, again.data, 8, field->name);
        }
    }
}

/* Around every tie the count is a nearest one: to 0.004 counts, what one rounding of value / step in float leaves. */
static void test_rounds_to_the_nearest_count(void)
{
    for (int i = 0; i < QUANTITIES; i++) {
        const quantity_t *field = &quantities[i];
        double per_unit = nearbyint(1.0 / field->step);
        for (int64_t raw = least_of(field); raw < greatest_of(field); raw++) {
            float tie = (float)(((double)raw + 0.5) / per_unit);
            const float near[3] = {nextafterf(tie, -1.0e9f), tie, nextafterf(tie, 1.0e9f)};
            for (int j = 0; j < 3; j++) {
                double distance = fabs((double)sent(field, near[j]) - ((double)near[j] * per_unit));
                TEST_ASSERT_TRUE_MESSAGE(distance <= 0.504, field->name);
            }
        }
    }
}

/* Values that are exactly half way, so that nothing but the rule decides. */
static void test_ties_go_away_from_zero(void)
{
    assert_sent(&quantities[0], 313, 0.03125f); /* theta, 312.5 counts */
    assert_sent(&quantities[0], -313, -0.03125f);
    assert_sent(&quantities[1], 125 + 63, 0.09375f); /* theta_dot, 187.5 */
    assert_sent(&quantities[1], -63, -0.03125f);     /* 62.5 */
    assert_sent(&quantities[3], 63, 0.0625f);        /* z_ddot, 62.5 */
    assert_sent(&quantities[3], -188, -0.1875f);     /* 187.5 */
    assert_sent(&quantities[9], 13, 0.125f);         /* c_p, 12.5 */
    assert_sent(&quantities[10], 3, 0.25f);          /* k_p, 2.5 */
    assert_sent(&quantities[15], 313, 0.0625f);      /* damping_ratio, 312.5 */
    assert_sent(&quantities[7], 1, 0.0625f);         /* innovation, 0.5 */
}

/* Adding 0.5 and cutting off would send these, 0.49999997 counts in float, as 1. */
static void test_just_below_half_is_zero(void)
{
    assert_sent(&quantities[1], 0, 0x1.0624DCp-12f);
    assert_sent(&quantities[1], 0, -0x1.0624DCp-12f);
    assert_sent(&quantities[3], 0, 0x1.0624DCp-11f);
    assert_sent(&quantities[10], 0, 0x1.999998p-5f);
}

static void test_value_without_flag_is_not_read(void)
{
    lever_frame_t frame = untouched;
    message_lever_sample_t lever = {.theta = NAN, .theta_dot = 1.0f, .tau_m = -1.0e30f};
    TEST_ASSERT_TRUE(message_lever_sample_encode(&frame, &lever));
    TEST_ASSERT_EQUAL_UINT32(0u, bits_set(&frame));
    frame = untouched;
    message_base_sample_t base = {.z_ddot = NAN};
    TEST_ASSERT_TRUE(message_base_sample_encode(&frame, &base));
    TEST_ASSERT_EQUAL_UINT32(0u, bits_set(&frame));
}

/* --- codes, flags and counts -------------------------------------------------------------------------------------- */

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

/* --- whole frames ------------------------------------------------------------------------------------------------- */

/* Decodes and encodes what came out; false when decode refused, which must leave the message as it was. */
#define AGAIN(kind)                                                                                                    \
    static bool kind##_again(lever_frame_t *frame, const lever_frame_t *received)                                      \
    {                                                                                                                  \
        message_##kind##_t message;                                                                                    \
        message_##kind##_t before;                                                                                     \
        memset(&message, 0x5A, sizeof message);                                                                        \
        memset(&before, 0x5A, sizeof before);                                                                          \
        if (!message_##kind##_decode(&message, received)) {                                                            \
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&before, &message, sizeof before, #kind);                                 \
            return false;                                                                                              \
        }                                                                                                              \
        TEST_ASSERT_TRUE(message_##kind##_encode(frame, &message));                                                    \
        return true;                                                                                                   \
    }
AGAIN(lever_sample)
AGAIN(base_sample)
AGAIN(command)
AGAIN(state_estimate)
AGAIN(pilot_parameters)
AGAIN(pilot_sigma)
AGAIN(pilot_dynamics)
AGAIN(health)
AGAIN(platform_health)
AGAIN(motor_command)
AGAIN(identity)
AGAIN(command_ack)
AGAIN(link_health)

typedef struct kind {
    bool (*again)(lever_frame_t *frame, const lever_frame_t *received);
    uint32_t id;
    uint8_t set;       /* bits of byte 1 that are set, */
    uint8_t random;    /* and those that may be anything */
    uint8_t unused[8]; /* bits that no signal has */
} kind_t;

static const kind_t kinds[] = {
    {lever_sample_again, 0x110u, 0x70u, 0u, {[1] = 0x80u}},
    {base_sample_again, 0x111u, 0x10u, 0u, {[1] = 0xE0u}},
    {command_again, 0x120u, 0u, 0u, {[1] = 0xF0u, [4] = 0xF0u, [5] = 0xFFu}},
    {state_estimate_again, 0x210u, 0u, 0xF0u, {0u}},
    {pilot_parameters_again, 0x211u, 0u, 0x80u, {0u}},
    {pilot_sigma_again, 0x212u, 0u, 0x80u, {0u}},
    {pilot_dynamics_again, 0x213u, 0u, 0xF0u, {0u}},
    {health_again, 0x214u, 0u, 0xF0u, {0u}},
    {motor_command_again, 0x215u, 0u, 0xF0u, {0u}},
    {platform_health_again, 0x216u, 0u, 0xF0u, {0u}},
    {identity_again, 0x217u, 0x00u, 0u, {[6] = 0xFFu, [7] = 0xFFu}},
    {identity_again, 0x217u, 0x10u, 0u, {[6] = 0xFFu, [7] = 0xFFu}},
    {identity_again, 0x217u, 0x20u, 0u, {[6] = 0xFFu, [7] = 0xFFu}},
    {command_ack_again, 0x218u, 0u, 0xF0u, {[4] = 0xF0u, [5] = 0xFFu}},
    {link_health_again, 0x219u, 0u, 0xF0u, {0u}},
};
enum { KINDS = (int)(sizeof kinds / sizeof kinds[0]) };

static uint8_t random_byte(uint32_t *seed)
{
    *seed = (*seed * 1664525u) + 1013904223u;
    return (uint8_t)(*seed >> 24u);
}

static void test_round_trip_of_random_frames(void)
{
    uint32_t seed = 1u;
    for (int i = 0; i < (KINDS * 20000); i++) {
        const kind_t *kind = &kinds[i % KINDS];
        lever_frame_t frame = {kind->id, 8u, {0u}};
        frame.data[1] = (uint8_t)(kind->set | (random_byte(&seed) & kind->random));
        for (uint32_t j = 2u; j < 8u; j++) {
            frame.data[j] = (uint8_t)(random_byte(&seed) & (uint8_t)~kind->unused[j]);
            if (((j % 2u) == 0u) && (kind->id < 0x120u)) {
                frame.data[j] |= 1u; /* an input that is not available would lose its flag */
            }
        }
        /* CRC, counter and unused bits are not the codec's. */
        lever_frame_t received = frame;
        received.data[0] = random_byte(&seed);
        received.data[1] |= (uint8_t)(random_byte(&seed) & (0x0Fu | kind->unused[1]));
        for (uint32_t j = 2u; j < 8u; j++) {
            received.data[j] |= (uint8_t)(random_byte(&seed) & kind->unused[j]);
        }
        lever_frame_t again = untouched;
        TEST_ASSERT_TRUE(kind->again(&again, &received));
        TEST_ASSERT_EQUAL_HEX32(kind->id, again.id);
        TEST_ASSERT_EQUAL_UINT8(8u, again.length);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, again.data, 8);
    }
}

static void test_other_identifiers_and_lengths_are_refused(void)
{
    lever_frame_t again = untouched;
    for (int i = 0; i < KINDS; i++) {
        for (uint32_t id = 0u; id < 0x800u; id++) {
            const lever_frame_t frame = {id, 8u, {0u}};
            TEST_ASSERT_EQUAL_INT(id == kinds[i].id, kinds[i].again(&again, &frame));
        }
        for (uint32_t length = 0u; length < 256u; length++) {
            const lever_frame_t frame = {kinds[i].id, (uint8_t)length, {0u}};
            TEST_ASSERT_EQUAL_INT(length == 8u, kinds[i].again(&again, &frame));
        }
    }
}

static void test_parameters_of_an_unknown_model_are_refused(void)
{
    for (uint32_t model = (uint32_t)LEVER_MODEL_COUNT; model < 256u; model++) {
        lever_frame_t frame = untouched;
        message_pilot_parameters_t parameters = {{1.0f, 2.0f, 3.0f}, (uint8_t)model, true};
        TEST_ASSERT_FALSE(message_pilot_parameters_encode(&frame, &parameters));
        message_pilot_sigma_t sigma = {{1.0f, 2.0f, 3.0f}, (uint8_t)model, true};
        TEST_ASSERT_FALSE(message_pilot_sigma_encode(&frame, &sigma));
        assert_untouched(&frame, "model");
    }
    for (uint32_t model = (uint32_t)LEVER_MODEL_COUNT; model < 8u; model++) {
        lever_frame_t frame = {MESSAGE_PILOT_PARAMETERS_ID, 8u, {0u, (uint8_t)(model << 4u)}};
        lever_frame_t again = untouched;
        TEST_ASSERT_FALSE(pilot_parameters_again(&again, &frame));
        frame.id = MESSAGE_PILOT_SIGMA_ID;
        TEST_ASSERT_FALSE(pilot_sigma_again(&again, &frame));
    }
}

static void test_an_unknown_page_is_refused(void)
{
    for (uint32_t page = (uint32_t)MESSAGE_PAGE_COUNT; page < 256u; page++) {
        lever_frame_t frame = untouched;
        const message_identity_t identity = {.page = (uint8_t)page};
        TEST_ASSERT_FALSE(message_identity_encode(&frame, &identity));
        assert_untouched(&frame, "page");
    }
    for (uint32_t page = (uint32_t)MESSAGE_PAGE_COUNT; page < 16u; page++) {
        const lever_frame_t frame = {MESSAGE_IDENTITY_ID, 8u, {0u, (uint8_t)(page << 4u)}};
        lever_frame_t again = untouched;
        TEST_ASSERT_FALSE(identity_again(&again, &frame));
    }
}

/* One frame by hand: theta 0.3491 rad = 3491 = 0x0DA3, theta_dot -0.25 rad/s = -500 = 0xFE0C, tau_m invalid. */
static void test_a_frame_by_hand(void)
{
    lever_frame_t frame = untouched;
    message_lever_sample_t sample = {
        .theta = 0.3491f, .theta_dot = -0.25f, .tau_m = 7.0f, .theta_valid = true, .theta_dot_valid = true};
    TEST_ASSERT_TRUE(message_lever_sample_encode(&frame, &sample));
    static const uint8_t expected[8] = {0x00u, 0x30u, 0xA3u, 0x0Du, 0x0Cu, 0xFEu, 0x00u, 0x00u};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, frame.data, 8);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_limits);
    RUN_TEST(test_what_does_not_fit_is_not_available);
    RUN_TEST(test_not_available_decodes_to_nan);
    RUN_TEST(test_a_command_for_no_rms_is_refused);
    RUN_TEST(test_an_input_that_is_not_available_is_not_valid);
    RUN_TEST(test_every_count);
    RUN_TEST(test_rounds_to_the_nearest_count);
    RUN_TEST(test_ties_go_away_from_zero);
    RUN_TEST(test_just_below_half_is_zero);
    RUN_TEST(test_value_without_flag_is_not_read);
    RUN_TEST(test_codes_are_exact_up_to_their_limit);
    RUN_TEST(test_codes_beyond_their_limit_are_refused);
    RUN_TEST(test_round_trip_of_random_frames);
    RUN_TEST(test_other_identifiers_and_lengths_are_refused);
    RUN_TEST(test_parameters_of_an_unknown_model_are_refused);
    RUN_TEST(test_an_unknown_page_is_refused);
    RUN_TEST(test_a_frame_by_hand);
    return UNITY_END();
}
