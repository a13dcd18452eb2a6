#include "can/layout.h"
#include "can/messages.h"

/* The messages of every sample, each by code of its own, which is faster than by a table. Their layouts are those of
 * lever.dbc; tests/python/can compares them. */

static uint64_t bit_at(bool flag, uint32_t place)
{
    return (uint64_t)(flag ? 1u : 0u) << place;
}

static bool has_bit(uint64_t payload, uint32_t place)
{
    return ((payload >> place) & 1u) != 0u;
}

static bool is_available(float value)
{
    return value == value; /* only NaN is not */
}

/* --- LEVER_SAMPLE ------------------------------------------------------------------------------------------------ */

static const quantity_t sample_theta = SIGNED(16u, 65535u, 10000.0f);
static const quantity_t sample_theta_dot = SIGNED(32u, 65535u, 2000.0f);
static const quantity_t sample_tau_m = SIGNED(48u, 65535u, 1000.0f);

bool message_lever_sample_encode(lever_frame_t *frame, const message_lever_sample_t *message)
{
    uint64_t payload =
        bit_at(message->theta_valid, 12u) | bit_at(message->theta_dot_valid, 13u) | bit_at(message->tau_m_valid, 14u);
    payload |= message->theta_valid ? layout_bits(&sample_theta, message->theta) : 0u;
    payload |= message->theta_dot_valid ? layout_bits(&sample_theta_dot, message->theta_dot) : 0u;
    payload |= message->tau_m_valid ? layout_bits(&sample_tau_m, message->tau_m) : 0u;
    layout_write(frame, (uint32_t)MESSAGE_LEVER_SAMPLE_ID, payload);
    return true;
}

bool message_lever_sample_decode(message_lever_sample_t *message, const lever_frame_t *frame)
{
    const bool fits = layout_is(frame, (uint32_t)MESSAGE_LEVER_SAMPLE_ID);
    if (fits) {
        const uint64_t payload = layout_read(frame);
        message->theta = layout_value(payload, &sample_theta);
        message->theta_dot = layout_value(payload, &sample_theta_dot);
        message->tau_m = layout_value(payload, &sample_tau_m);
        message->theta_valid = has_bit(payload, 12u) && is_available(message->theta);
        message->theta_dot_valid = has_bit(payload, 13u) && is_available(message->theta_dot);
        message->tau_m_valid = has_bit(payload, 14u) && is_available(message->tau_m);
    }
    return fits;
}

/* --- BASE_SAMPLE ------------------------------------------------------------------------------------------------- */

static const quantity_t sample_z_ddot = SIGNED(16u, 65535u, 1000.0f);

bool message_base_sample_encode(lever_frame_t *frame, const message_base_sample_t *message)
{
    uint64_t payload = bit_at(message->z_ddot_valid, 12u) | ((uint64_t)message->time_us << 32u);
    payload |= message->z_ddot_valid ? layout_bits(&sample_z_ddot, message->z_ddot) : 0u;
    layout_write(frame, (uint32_t)MESSAGE_BASE_SAMPLE_ID, payload);
    return true;
}

bool message_base_sample_decode(message_base_sample_t *message, const lever_frame_t *frame)
{
    const bool fits = layout_is(frame, (uint32_t)MESSAGE_BASE_SAMPLE_ID);
    if (fits) {
        const uint64_t payload = layout_read(frame);
        message->time_us = (uint32_t)(payload >> 32u);
        message->z_ddot = layout_value(payload, &sample_z_ddot);
        message->z_ddot_valid = has_bit(payload, 12u) && is_available(message->z_ddot);
    }
    return fits;
}

/* --- GRIP_SAMPLE ------------------------------------------------------------------------------------------------- */

static const quantity_t sample_grip_force = SIGNED(16u, 65535u, 50.0f);

bool message_grip_sample_encode(lever_frame_t *frame, const message_grip_sample_t *message)
{
    uint64_t payload = bit_at(message->grip_force_valid, 12u);
    payload |= message->grip_force_valid ? layout_bits(&sample_grip_force, message->grip_force) : 0u;
    layout_write(frame, (uint32_t)MESSAGE_GRIP_SAMPLE_ID, payload);
    return true;
}

bool message_grip_sample_decode(message_grip_sample_t *message, const lever_frame_t *frame)
{
    const bool fits = layout_is(frame, (uint32_t)MESSAGE_GRIP_SAMPLE_ID);
    if (fits) {
        const uint64_t payload = layout_read(frame);
        message->grip_force = layout_value(payload, &sample_grip_force);
        message->grip_force_valid = has_bit(payload, 12u) && is_available(message->grip_force);
    }
    return fits;
}

/* --- STATE_ESTIMATE ---------------------------------------------------------------------------------------------- */

static const quantity_t state_innovation = UNSIGNED(13u, 255u, 8.0f);
static const quantity_t state_theta_dot = SIGNED(21u, 8191u, 500.0f);
static const quantity_t state_theta = SIGNED(34u, 16383u, 5000.0f);

bool message_state_estimate_encode(lever_frame_t *frame, const message_state_estimate_t *message)
{
    const uint64_t payload = bit_at(message->valid, 12u) | layout_bits(&state_innovation, message->innovation) |
                             layout_bits(&state_theta_dot, message->theta_dot) |
                             layout_bits(&state_theta, message->theta) | ((uint64_t)message->time_low << 48u);
    layout_write(frame, (uint32_t)MESSAGE_STATE_ESTIMATE_ID, payload);
    return true;
}

bool message_state_estimate_decode(message_state_estimate_t *message, const lever_frame_t *frame)
{
    const bool fits = layout_is(frame, (uint32_t)MESSAGE_STATE_ESTIMATE_ID);
    if (fits) {
        const uint64_t payload = layout_read(frame);
        message->innovation = layout_value(payload, &state_innovation);
        message->theta_dot = layout_value(payload, &state_theta_dot);
        message->theta = layout_value(payload, &state_theta);
        message->time_low = (uint16_t)(payload >> 48u);
        message->valid = has_bit(payload, 12u);
    }
    return fits;
}

/* --- MOTOR_COMMAND ----------------------------------------------------------------------------------------------- */

static const quantity_t motor_torque = SIGNED(16u, 65535u, 1000.0f);
static const quantity_t motor_dither = SIGNED(32u, 65535u, 1000.0f);
static const place_t motor_model = CODE(12u, 7u);

bool message_motor_command_encode(lever_frame_t *frame, const message_motor_command_t *message)
{
    const uint64_t payload = ((uint64_t)message->model << motor_model.start) | bit_at(message->valid, 15u) |
                             layout_bits(&motor_torque, message->torque) | layout_bits(&motor_dither, message->dither) |
                             ((uint64_t)message->time_low << 48u);
    const bool fits = (message->model <= motor_model.mask);
    if (fits) {
        layout_write(frame, (uint32_t)MESSAGE_MOTOR_COMMAND_ID, payload);
    }
    return fits;
}

bool message_motor_command_decode(message_motor_command_t *message, const lever_frame_t *frame)
{
    const bool fits = layout_is(frame, (uint32_t)MESSAGE_MOTOR_COMMAND_ID);
    if (fits) {
        const uint64_t payload = layout_read(frame);
        message->torque = layout_value(payload, &motor_torque);
        message->dither = layout_value(payload, &motor_dither);
        message->time_low = (uint16_t)(payload >> 48u);
        message->model = (uint8_t)layout_code(payload, motor_model);
        message->valid = has_bit(payload, 15u);
    }
    return fits;
}

/* --- CORRECTION -------------------------------------------------------------------------------------------------- */

static const quantity_t correction_angle = SIGNED(16u, 65535u, 50000.0f);
static const quantity_t correction_weight = UNSIGNED(32u, 255u, 200.0f);
static const place_t correction_mitigation = CODE(12u, 7u);

bool message_correction_encode(lever_frame_t *frame, const message_correction_t *message)
{
    const uint64_t payload = ((uint64_t)message->mitigation << correction_mitigation.start) |
                             bit_at(message->valid, 15u) | layout_bits(&correction_angle, message->correction) |
                             layout_bits(&correction_weight, message->weight) | ((uint64_t)message->time_low << 48u);
    const bool fits = (message->mitigation <= correction_mitigation.mask);
    if (fits) {
        layout_write(frame, (uint32_t)MESSAGE_CORRECTION_ID, payload);
    }
    return fits;
}

bool message_correction_decode(message_correction_t *message, const lever_frame_t *frame)
{
    const bool fits = layout_is(frame, (uint32_t)MESSAGE_CORRECTION_ID);
    if (fits) {
        const uint64_t payload = layout_read(frame);
        message->correction = layout_value(payload, &correction_angle);
        message->weight = layout_value(payload, &correction_weight);
        message->time_low = (uint16_t)(payload >> 48u);
        message->mitigation = (uint8_t)layout_code(payload, correction_mitigation);
        message->valid = has_bit(payload, 15u);
    }
    return fits;
}
