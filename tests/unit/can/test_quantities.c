/* Every physical value of every message through the codec, against its place and step as the DBC has them, which
 * tests/python/can checks: limits, beyond, NaN, every count, ties. */
#include "fields.h"

void setUp(void)
{
}

void tearDown(void)
{
}

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
QUANTITY(feedthrough, real)
QUANTITY(feedthrough, imaginary)
QUANTITY(feedthrough, gain_sigma)
QUANTITY(feedthrough, phase_sigma)
QUANTITY(health, excitation)
QUANTITY(motor_command, torque)
QUANTITY(motor_command, dither)
QUANTITY(command_ack, dither_rms)
PAGE(choices, dither_rms, float, float)

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
    ROW(feedthrough, real, 0x21Au, 0.000005, 17u, 15u, true),
    ROW(feedthrough, imaginary, 0x21Au, 0.000005, 32u, 15u, true),
    ROW(feedthrough, gain_sigma, 0x21Au, 0.004, 47u, 8u, false),
    ROW(feedthrough, phase_sigma, 0x21Au, 0.004, 55u, 8u, false),
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
static void test_ties_go_to_the_even_count(void)
{
    assert_sent(&quantities[0], 312, 0.03125f); /* theta, 312.5 counts */
    assert_sent(&quantities[0], -312, -0.03125f);
    assert_sent(&quantities[1], 188, 0.09375f);  /* theta_dot, 187.5 */
    assert_sent(&quantities[1], -62, -0.03125f); /* 62.5 */
    assert_sent(&quantities[3], 62, 0.0625f);    /* z_ddot, 62.5 */
    assert_sent(&quantities[3], -188, -0.1875f); /* 187.5 */
    assert_sent(&quantities[9], 12, 0.125f);     /* c_p, 12.5 */
    assert_sent(&quantities[10], 2, 0.25f);      /* k_p, 2.5 */
    assert_sent(&quantities[15], 312, 0.0625f);  /* damping_ratio, 312.5 */
    assert_sent(&quantities[7], 0, 0.0625f);     /* innovation, 0.5 */
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
    RUN_TEST(test_ties_go_to_the_even_count);
    RUN_TEST(test_just_below_half_is_zero);
    RUN_TEST(test_value_without_flag_is_not_read);
    return UNITY_END();
}
