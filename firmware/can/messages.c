#include "can/messages.h"

enum { FRAME_BYTES = 8 };

/* --- fields of the payload: a 64-bit word, byte 0 lowest (Intel bit order) --------------------------------------- */

/* An integer. */
typedef struct code {
    uint8_t start;     /* its lowest bit */
    uint32_t greatest; /* 2^width - 1 */
} code_t;

/* A physical value. Its resolution is given as counts per unit because that, unlike the DBC's decimal step, is exact in
 * a float: then value * per_unit and raw / per_unit are each rounded only once. */
typedef struct quantity {
    float per_unit;
    int32_t least; /* raw limits, all bits used: 0 and 2^width - 1, or -2^(width-1) and 2^(width-1) - 1 */
    int32_t greatest;
    uint8_t start;
} quantity_t;

/* A payload being written; `refused` once a value does not fit. */
typedef struct writer {
    uint64_t payload;
    bool refused;
} writer_t;

static void put_code(writer_t *writer, code_t field, uint32_t value)
{
    if (value > field.greatest) {
        writer->refused = true;
    }
    writer->payload |= (uint64_t)value << field.start;
}

static uint32_t get_code(uint64_t payload, code_t field)
{
    return (uint32_t)(payload >> field.start) & field.greatest;
}

/* Nearest count, half away from zero, saturating. `scaled` is not NaN. */
static int32_t round_to_count(float scaled, int32_t least, int32_t greatest)
{
    /* The float below 0.5: it rounds 0.5 up like 0.5 would, but not 0.49999997. */
    const float below_half = 0.49999997f;
    if (scaled <= (float)least) {
        return least;
    }
    if (scaled >= (float)greatest) {
        return greatest;
    }
    float rounded = (scaled < 0.0f) ? (scaled - below_half) : (scaled + below_half);
    return (int32_t)rounded;
}

static uint32_t mask_of(const quantity_t *field)
{
    int32_t mask = field->greatest - field->least;
    return (uint32_t)mask;
}

static inline void put_quantity(writer_t *writer, const quantity_t *field, float value)
{
    float scaled = value * field->per_unit;
    if (!(scaled == scaled)) { /* only NaN is not */
        writer->refused = true;
        return;
    }
    uint32_t raw = (uint32_t)round_to_count(scaled, field->least, field->greatest);
    writer->payload |= (uint64_t)(raw & mask_of(field)) << field->start;
}

static float get_quantity(uint64_t payload, const quantity_t *field)
{
    uint32_t mask = mask_of(field);
    uint32_t bits = (uint32_t)(payload >> field->start) & mask;
    int32_t raw = (int32_t)bits;
    if (raw > field->greatest) {
        raw -= (int32_t)mask + 1;
    }
    return (float)raw / field->per_unit;
}

/* Four bytes, lowest first, whatever the byte order and alignment of the machine. */
static void write_word(uint8_t bytes[4], uint32_t word)
{
    bytes[0] = (uint8_t)(word & 0xFFu);
    bytes[1] = (uint8_t)((word >> 8u) & 0xFFu);
    bytes[2] = (uint8_t)((word >> 16u) & 0xFFu);
    bytes[3] = (uint8_t)(word >> 24u);
}

static uint32_t read_word(const uint8_t bytes[4])
{
    return (uint32_t)bytes[0] | ((uint32_t)bytes[1] << 8u) | ((uint32_t)bytes[2] << 16u) | ((uint32_t)bytes[3] << 24u);
}

static bool write_frame(lever_frame_t *frame, enum message_id id, const writer_t *writer)
{
    if (writer->refused) {
        return false;
    }
    frame->id = (uint32_t)id;
    frame->length = (uint8_t)FRAME_BYTES;
    write_word(&frame->data[0], (uint32_t)(writer->payload & UINT32_MAX));
    write_word(&frame->data[4], (uint32_t)(writer->payload >> 32u));
    return true;
}

static bool is_message(const lever_frame_t *frame, enum message_id id)
{
    return (frame->id == (uint32_t)id) && (frame->length == (uint8_t)FRAME_BYTES);
}

static uint64_t read_payload(const lever_frame_t *frame)
{
    return read_word(&frame->data[0]) | ((uint64_t)read_word(&frame->data[4]) << 32u);
}

/* --- layout: lever.dbc, checked against it by tests/python/can ---------------------------------------------------- */

#define SIGNED_16(start_bit, counts_per_unit) {(counts_per_unit), -32768, 32767, (start_bit)}
#define UNSIGNED(start_bit, greatest_count, counts_per_unit) {(counts_per_unit), 0, (greatest_count), (start_bit)}

static const quantity_t theta_field = SIGNED_16(16u, 10000.0f);
static const quantity_t theta_dot_field = SIGNED_16(32u, 2000.0f);
static const code_t model_field = {12u, 15u}; /* of every message from the estimator */

/* --- LEVER_SAMPLE ------------------------------------------------------------------------------------------------ */

static const code_t theta_valid_field = {12u, 1u};
static const code_t theta_dot_valid_field = {13u, 1u};
static const code_t tau_m_valid_field = {14u, 1u};
static const quantity_t tau_m_field = SIGNED_16(48u, 1000.0f);

static void put_if_valid(writer_t *writer, code_t valid_field, bool valid, const quantity_t *field, float value)
{
    if (valid) {
        put_code(writer, valid_field, 1u);
        put_quantity(writer, field, value);
    }
}

static bool get_flag(uint64_t payload, code_t field)
{
    return get_code(payload, field) != 0u;
}

bool message_lever_sample_encode(lever_frame_t *frame, const message_lever_sample_t *message)
{
    writer_t writer = {0u, false};
    put_if_valid(&writer, theta_valid_field, message->theta_valid, &theta_field, message->theta);
    put_if_valid(&writer, theta_dot_valid_field, message->theta_dot_valid, &theta_dot_field, message->theta_dot);
    put_if_valid(&writer, tau_m_valid_field, message->tau_m_valid, &tau_m_field, message->tau_m);
    return write_frame(frame, MESSAGE_LEVER_SAMPLE_ID, &writer);
}

bool message_lever_sample_decode(message_lever_sample_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_LEVER_SAMPLE_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->theta = get_quantity(payload, &theta_field);
    message->theta_dot = get_quantity(payload, &theta_dot_field);
    message->tau_m = get_quantity(payload, &tau_m_field);
    message->theta_valid = get_flag(payload, theta_valid_field);
    message->theta_dot_valid = get_flag(payload, theta_dot_valid_field);
    message->tau_m_valid = get_flag(payload, tau_m_valid_field);
    return true;
}

/* --- BASE_SAMPLE ------------------------------------------------------------------------------------------------- */

static const code_t z_ddot_valid_field = {12u, 1u};
static const quantity_t z_ddot_field = SIGNED_16(16u, 1000.0f);
static const code_t time_us_field = {32u, UINT32_MAX};

bool message_base_sample_encode(lever_frame_t *frame, const message_base_sample_t *message)
{
    writer_t writer = {0u, false};
    put_if_valid(&writer, z_ddot_valid_field, message->z_ddot_valid, &z_ddot_field, message->z_ddot);
    put_code(&writer, time_us_field, message->time_us);
    return write_frame(frame, MESSAGE_BASE_SAMPLE_ID, &writer);
}

bool message_base_sample_decode(message_base_sample_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_BASE_SAMPLE_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->z_ddot = get_quantity(payload, &z_ddot_field);
    message->z_ddot_valid = get_flag(payload, z_ddot_valid_field);
    message->time_us = get_code(payload, time_us_field);
    return true;
}

/* --- COMMAND ----------------------------------------------------------------------------------------------------- */

static const code_t request_field = {16u, 15u};
static const code_t model_choice_field = {20u, 15u};
static const code_t preload_field = {24u, 15u};
static const code_t estimator_field = {28u, 15u};
static const code_t adaptation_field = {32u, 15u};
static const quantity_t dither_rms_field = UNSIGNED(48u, 65535, 1000.0f);

bool message_command_encode(lever_frame_t *frame, const message_command_t *message)
{
    writer_t writer = {0u, false};
    put_code(&writer, request_field, message->request);
    put_code(&writer, model_choice_field, message->model);
    put_code(&writer, preload_field, message->preload);
    put_code(&writer, estimator_field, message->estimator);
    put_code(&writer, adaptation_field, message->adaptation);
    put_quantity(&writer, &dither_rms_field, message->dither_rms);
    return write_frame(frame, MESSAGE_COMMAND_ID, &writer);
}

bool message_command_decode(message_command_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_COMMAND_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->request = (uint8_t)get_code(payload, request_field);
    message->model = (uint8_t)get_code(payload, model_choice_field);
    message->preload = (uint8_t)get_code(payload, preload_field);
    message->estimator = (uint8_t)get_code(payload, estimator_field);
    message->adaptation = (uint8_t)get_code(payload, adaptation_field);
    message->dither_rms = get_quantity(payload, &dither_rms_field);
    return true;
}

/* --- STATE_ESTIMATE ---------------------------------------------------------------------------------------------- */

static const quantity_t nis_field = UNSIGNED(48u, 65535, 1000.0f);

bool message_state_estimate_encode(lever_frame_t *frame, const message_state_estimate_t *message)
{
    writer_t writer = {0u, false};
    put_code(&writer, model_field, message->model);
    put_quantity(&writer, &theta_field, message->theta);
    put_quantity(&writer, &theta_dot_field, message->theta_dot);
    put_quantity(&writer, &nis_field, message->nis);
    return write_frame(frame, MESSAGE_STATE_ESTIMATE_ID, &writer);
}

bool message_state_estimate_decode(message_state_estimate_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_STATE_ESTIMATE_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->model = (uint8_t)get_code(payload, model_field);
    message->theta = get_quantity(payload, &theta_field);
    message->theta_dot = get_quantity(payload, &theta_dot_field);
    message->nis = get_quantity(payload, &nis_field);
    return true;
}

/* --- PILOT_PARAMETERS and PILOT_SIGMA, multiplexed by model ------------------------------------------------------- */

/* One row a model, in the order of enum lever_model. */
static const quantity_t parameter_field[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {
    {UNSIGNED(16u, 65535, 1000.0f), UNSIGNED(32u, 65535, 100.0f), UNSIGNED(48u, 65535, 10.0f)},
    {UNSIGNED(16u, 65535, 1000.0f), UNSIGNED(32u, 65535, 100.0f), UNSIGNED(48u, 65535, 10.0f)},
    {SIGNED_16(16u, 10.0f), SIGNED_16(32u, 100.0f), SIGNED_16(48u, 1000.0f)},
};
static const quantity_t sigma_field[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {
    {UNSIGNED(16u, 65535, 10000.0f), UNSIGNED(32u, 65535, 500.0f), UNSIGNED(48u, 65535, 20.0f)},
    {UNSIGNED(16u, 65535, 10000.0f), UNSIGNED(32u, 65535, 500.0f), UNSIGNED(48u, 65535, 20.0f)},
    {UNSIGNED(16u, 65535, 50.0f), UNSIGNED(32u, 65535, 500.0f), UNSIGNED(48u, 65535, 5000.0f)},
};

static bool encode_by_model(lever_frame_t *frame, enum message_id id, uint8_t model,
    const quantity_t field[LEVER_MODEL_COUNT][LEVER_PARAMETERS], const float value[LEVER_PARAMETERS])
{
    if (model >= (uint8_t)LEVER_MODEL_COUNT) {
        return false;
    }
    writer_t writer = {0u, false};
    put_code(&writer, model_field, model);
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        put_quantity(&writer, &field[model][i], value[i]);
    }
    return write_frame(frame, id, &writer);
}

static bool decode_by_model(uint8_t *model, float value[LEVER_PARAMETERS],
    const quantity_t field[LEVER_MODEL_COUNT][LEVER_PARAMETERS], const lever_frame_t *frame, enum message_id id)
{
    if (!is_message(frame, id)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    uint8_t sent_model = (uint8_t)get_code(payload, model_field);
    if (sent_model >= (uint8_t)LEVER_MODEL_COUNT) {
        return false;
    }
    *model = sent_model;
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        value[i] = get_quantity(payload, &field[sent_model][i]);
    }
    return true;
}

bool message_pilot_parameters_encode(lever_frame_t *frame, const message_pilot_parameters_t *message)
{
    return encode_by_model(frame, MESSAGE_PILOT_PARAMETERS_ID, message->model, parameter_field, message->parameter);
}

bool message_pilot_parameters_decode(message_pilot_parameters_t *message, const lever_frame_t *frame)
{
    return decode_by_model(&message->model, message->parameter, parameter_field, frame, MESSAGE_PILOT_PARAMETERS_ID);
}

bool message_pilot_sigma_encode(lever_frame_t *frame, const message_pilot_sigma_t *message)
{
    return encode_by_model(frame, MESSAGE_PILOT_SIGMA_ID, message->model, sigma_field, message->sigma);
}

bool message_pilot_sigma_decode(message_pilot_sigma_t *message, const lever_frame_t *frame)
{
    return decode_by_model(&message->model, message->sigma, sigma_field, frame, MESSAGE_PILOT_SIGMA_ID);
}

/* --- PILOT_DYNAMICS ---------------------------------------------------------------------------------------------- */

static const quantity_t natural_frequency_field = UNSIGNED(16u, 16383, 1000.0f);
static const quantity_t damping_ratio_field = UNSIGNED(30u, 16383, 5000.0f);
static const quantity_t natural_frequency_sigma_field = UNSIGNED(44u, 1023, 500.0f);
static const quantity_t damping_ratio_sigma_field = UNSIGNED(54u, 1023, 1000.0f);

bool message_pilot_dynamics_encode(lever_frame_t *frame, const message_pilot_dynamics_t *message)
{
    writer_t writer = {0u, false};
    put_code(&writer, model_field, message->model);
    put_quantity(&writer, &natural_frequency_field, message->natural_frequency);
    put_quantity(&writer, &damping_ratio_field, message->damping_ratio);
    put_quantity(&writer, &natural_frequency_sigma_field, message->natural_frequency_sigma);
    put_quantity(&writer, &damping_ratio_sigma_field, message->damping_ratio_sigma);
    return write_frame(frame, MESSAGE_PILOT_DYNAMICS_ID, &writer);
}

bool message_pilot_dynamics_decode(message_pilot_dynamics_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_PILOT_DYNAMICS_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->model = (uint8_t)get_code(payload, model_field);
    message->natural_frequency = get_quantity(payload, &natural_frequency_field);
    message->damping_ratio = get_quantity(payload, &damping_ratio_field);
    message->natural_frequency_sigma = get_quantity(payload, &natural_frequency_sigma_field);
    message->damping_ratio_sigma = get_quantity(payload, &damping_ratio_sigma_field);
    return true;
}

/* --- HEALTH ------------------------------------------------------------------------------------------------------ */

static const code_t mode_field = {16u, 15u};
static const code_t faults_field = {20u, 4095u};
static const code_t lost_field = {32u, 255u};
static const code_t corrupt_field = {40u, 255u};
static const code_t late_field = {48u, 255u};
static const quantity_t excitation_field = UNSIGNED(56u, 255, 200.0f);

bool message_health_encode(lever_frame_t *frame, const message_health_t *message)
{
    writer_t writer = {0u, false};
    put_code(&writer, model_field, message->model);
    put_code(&writer, mode_field, message->mode);
    put_code(&writer, faults_field, message->faults);
    put_code(&writer, lost_field, message->lost);
    put_code(&writer, corrupt_field, message->corrupt);
    put_code(&writer, late_field, message->late);
    put_quantity(&writer, &excitation_field, message->excitation);
    return write_frame(frame, MESSAGE_HEALTH_ID, &writer);
}

bool message_health_decode(message_health_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_HEALTH_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->model = (uint8_t)get_code(payload, model_field);
    message->mode = (uint8_t)get_code(payload, mode_field);
    message->faults = (uint16_t)get_code(payload, faults_field);
    message->lost = (uint8_t)get_code(payload, lost_field);
    message->corrupt = (uint8_t)get_code(payload, corrupt_field);
    message->late = (uint8_t)get_code(payload, late_field);
    message->excitation = get_quantity(payload, &excitation_field);
    return true;
}

/* --- MOTOR_COMMAND ----------------------------------------------------------------------------------------------- */

static const quantity_t torque_field = SIGNED_16(16u, 1000.0f);
static const quantity_t dither_field = SIGNED_16(32u, 1000.0f);

bool message_motor_command_encode(lever_frame_t *frame, const message_motor_command_t *message)
{
    writer_t writer = {0u, false};
    put_code(&writer, model_field, message->model);
    put_quantity(&writer, &torque_field, message->torque);
    put_quantity(&writer, &dither_field, message->dither);
    return write_frame(frame, MESSAGE_MOTOR_COMMAND_ID, &writer);
}

bool message_motor_command_decode(message_motor_command_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_MOTOR_COMMAND_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->model = (uint8_t)get_code(payload, model_field);
    message->torque = get_quantity(payload, &torque_field);
    message->dither = get_quantity(payload, &dither_field);
    return true;
}

/* --- PLATFORM_HEALTH --------------------------------------------------------------------------------------------- */

static const code_t platform_faults_field = {16u, 255u};
static const code_t transmit_errors_field = {24u, 255u};
static const code_t receive_errors_field = {32u, 255u};
static const code_t bus_offs_field = {40u, 255u};
static const code_t overruns_field = {48u, 255u};
static const code_t dropped_field = {56u, 255u};

bool message_platform_health_encode(lever_frame_t *frame, const message_platform_health_t *message)
{
    writer_t writer = {0u, false};
    put_code(&writer, model_field, message->model);
    put_code(&writer, platform_faults_field, message->faults);
    put_code(&writer, transmit_errors_field, message->transmit_errors);
    put_code(&writer, receive_errors_field, message->receive_errors);
    put_code(&writer, bus_offs_field, message->bus_offs);
    put_code(&writer, overruns_field, message->overruns);
    put_code(&writer, dropped_field, message->dropped);
    return write_frame(frame, MESSAGE_PLATFORM_HEALTH_ID, &writer);
}

bool message_platform_health_decode(message_platform_health_t *message, const lever_frame_t *frame)
{
    if (!is_message(frame, MESSAGE_PLATFORM_HEALTH_ID)) {
        return false;
    }
    uint64_t payload = read_payload(frame);
    message->model = (uint8_t)get_code(payload, model_field);
    message->faults = (uint8_t)get_code(payload, platform_faults_field);
    message->transmit_errors = (uint8_t)get_code(payload, transmit_errors_field);
    message->receive_errors = (uint8_t)get_code(payload, receive_errors_field);
    message->bus_offs = (uint8_t)get_code(payload, bus_offs_field);
    message->overruns = (uint8_t)get_code(payload, overruns_field);
    message->dropped = (uint8_t)get_code(payload, dropped_field);
    return true;
}
