/* Whole frames through the codec: round trips, and frames that are refused. */
#include "fields.h"

void setUp(void)
{
}

void tearDown(void)
{
}

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
AGAIN(feedthrough)
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
    {feedthrough_again, 0x21Au, 0u, 0xF0u, {[7] = 0x80u}},
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
    RUN_TEST(test_round_trip_of_random_frames);
    RUN_TEST(test_other_identifiers_and_lengths_are_refused);
    RUN_TEST(test_parameters_of_an_unknown_model_are_refused);
    RUN_TEST(test_an_unknown_page_is_refused);
    RUN_TEST(test_a_frame_by_hand);
    return UNITY_END();
}
