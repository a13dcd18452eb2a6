/* Bits of a frame, and access to one field of an otherwise blank message: for the tests of the codec. */
#ifndef UNIT_CAN_FIELDS_H
#define UNIT_CAN_FIELDS_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "can/messages.h"
#include "unity.h"

/* What frames are before an encode that must leave them alone. */
static const lever_frame_t untouched = {0x7A5u, 3u, {1u, 2u, 3u, 4u, 5u, 6u, 7u, 8u}};

static inline void assert_untouched(const lever_frame_t *frame, const char *name)
{
    TEST_ASSERT_EQUAL_HEX32_MESSAGE(untouched.id, frame->id, name);
    TEST_ASSERT_EQUAL_UINT8_MESSAGE(untouched.length, frame->length, name);
    TEST_ASSERT_EQUAL_HEX8_ARRAY_MESSAGE(untouched.data, frame->data, 8, name);
}

/* --- bits of a frame, one at a time: bit n is bit n % 8 of byte n / 8 --------------------------------------------- */

static inline int64_t get_bits(const lever_frame_t *frame, uint32_t start, uint32_t width, bool is_signed)
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

static inline void set_bits(lever_frame_t *frame, uint32_t start, uint32_t width, int64_t raw)
{
    for (uint32_t i = 0u; i < width; i++) {
        uint32_t bit = start + i;
        if ((((uint64_t)raw >> i) & 1u) != 0u) {
            frame->data[bit / 8u] |= (uint8_t)(1u << (bit % 8u));
        }
    }
}

static inline uint32_t bits_set(const lever_frame_t *frame)
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
static const message_feedthrough_t blank_feedthrough = {0};
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

#endif
