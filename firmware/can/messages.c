#include "can/messages.h"

#include <stddef.h>

enum { FRAME_BYTES = 8 };

/* Every message is codes (integers) and quantities (physical values) at places of a payload of 64 bits, byte 0 lowest (Intel
 * bit order). Both are tables of a message's layout: one function encodes every message, which is smaller than a function
 * each; decoders pick out what they need, which is faster where a frame is decoded for every sample. */

typedef struct place {
    uint32_t greatest; /* 2^width - 1 */
    uint8_t start;     /* the lowest bit */
} place_t;

/* The resolution is given as counts per unit because that, unlike the DBC's decimal step, is exact in a float: then value *
 * per_unit and count / per_unit are each rounded only once. */
typedef struct quantity {
    place_t place;
    float per_unit;
    float least; /* counts, all bits used: 0 and 2^width - 1, or -2^(width-1) and 2^(width-1) - 1 */
    float greatest;
} quantity_t;

typedef struct layout {
    uint32_t id;
    const place_t *code;
    const quantity_t *quantity;
    uint8_t codes; /* how many */
    uint8_t quantities;
} layout_t;

/* --- the payload of a frame --------------------------------------------------------------------------------------- */

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

static uint64_t read_payload(const lever_frame_t *frame)
{
    return read_word(&frame->data[0]) | ((uint64_t)read_word(&frame->data[4]) << 32u);
}

static uint32_t get_code(uint64_t payload, place_t place)
{
    return (uint32_t)(payload >> place.start) & place.greatest;
}

/* --- whole messages ----------------------------------------------------------------------------------------------- */

/* Nearest count, half away from zero, saturating. */
static int32_t nearest_count(const quantity_t *quantity, float scaled)
{
    /* The float below 0.5: it rounds 0.5 up like 0.5 would, but not 0.49999997. */
    const float half = (scaled < 0.0f) ? -0.49999997f : 0.49999997f;
    const float above = (scaled > quantity->least) ? scaled : quantity->least;
    const float rounded = ((above < quantity->greatest) ? above : quantity->greatest) + half;
    return (int32_t)rounded;
}

static bool encode(lever_frame_t *frame, const layout_t *layout, const uint32_t code[], const float value[])
{
    uint64_t payload = 0u;
    uint32_t wrong = 0u; /* bits that have no place; NaN */
    for (uint32_t i = 0u; i < layout->codes; i++) {
        const place_t place = layout->code[i];
        wrong |= code[i] & ~place.greatest;
        payload |= (uint64_t)code[i] << place.start;
    }
    for (uint32_t i = 0u; i < layout->quantities; i++) {
        const quantity_t *quantity = &layout->quantity[i];
        const float scaled = value[i] * quantity->per_unit;
        wrong |= (scaled == scaled) ? 0u : 1u; /* only NaN is not */
        const uint32_t bits = (uint32_t)nearest_count(quantity, scaled) & quantity->place.greatest;
        payload |= (uint64_t)bits << quantity->place.start;
    }
    if (wrong == 0u) {
        frame->id = layout->id;
        frame->length = (uint8_t)FRAME_BYTES;
        write_word(&frame->data[0], (uint32_t)(payload & UINT32_MAX));
        write_word(&frame->data[4], (uint32_t)(payload >> 32u));
    }
    return wrong == 0u;
}

static bool is_message(const lever_frame_t *frame, enum message_id id)
{
    return (frame->id == (uint32_t)id) && (frame->length == (uint8_t)FRAME_BYTES);
}

static float get_quantity(uint64_t payload, const quantity_t *quantity)
{
    float count = (float)get_code(payload, quantity->place);
    if (count > quantity->greatest) { /* the sign bit is set */
        count -= (quantity->greatest - quantity->least) + 1.0f;
    }
    return count / quantity->per_unit;
}

/* --- layout: lever.dbc, checked against it by tests/python/can ---------------------------------------------------- */

#define CODE(start_bit, greatest_code) {(greatest_code), (start_bit)}
#define UNSIGNED(start_bit, greatest_count, counts_per_unit)                                                           \
    {CODE(start_bit, greatest_count), (counts_per_unit), 0.0f, (float)(greatest_count)}
#define SIGNED_16(start_bit, counts_per_unit) {CODE(start_bit, 65535u), (counts_per_unit), -32768.0f, 32767.0f}
#define COUNT(array) ((uint8_t)(sizeof(array) / sizeof((array)[0])))
#define LAYOUT(id, code, quantity) {(uint32_t)(id), (code), (quantity), COUNT(code), COUNT(quantity)}

#define THETA SIGNED_16(16u, 10000.0f)
#define THETA_DOT SIGNED_16(32u, 2000.0f)
#define MODEL CODE(12u, 15u) /* of every message from the estimator */

/* --- LEVER_SAMPLE ------------------------------------------------------------------------------------------------ */

static const place_t lever_sample_code[] = {CODE(12u, 1u), CODE(13u, 1u), CODE(14u, 1u)};
static const quantity_t lever_sample_quantity[] = {THETA, THETA_DOT, SIGNED_16(48u, 1000.0f)};
static const layout_t lever_sample = LAYOUT(MESSAGE_LEVER_SAMPLE_ID, lever_sample_code, lever_sample_quantity);

bool message_lever_sample_encode(lever_frame_t *frame, const message_lever_sample_t *message)
{
    const uint32_t code[] = {
        message->theta_valid ? 1u : 0u, message->theta_dot_valid ? 1u : 0u, message->tau_m_valid ? 1u : 0u};
    const float value[] = {message->theta_valid ? message->theta : 0.0f,
        message->theta_dot_valid ? message->theta_dot : 0.0f, message->tau_m_valid ? message->tau_m : 0.0f};
    return encode(frame, &lever_sample, code, value);
}

bool message_lever_sample_decode(message_lever_sample_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_LEVER_SAMPLE_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->theta = get_quantity(payload, &lever_sample_quantity[0]);
        message->theta_dot = get_quantity(payload, &lever_sample_quantity[1]);
        message->tau_m = get_quantity(payload, &lever_sample_quantity[2]);
        message->theta_valid = (get_code(payload, lever_sample_code[0]) != 0u);
        message->theta_dot_valid = (get_code(payload, lever_sample_code[1]) != 0u);
        message->tau_m_valid = (get_code(payload, lever_sample_code[2]) != 0u);
    }
    return fits;
}

/* --- BASE_SAMPLE ------------------------------------------------------------------------------------------------- */

static const place_t base_sample_code[] = {CODE(12u, 1u), CODE(32u, UINT32_MAX)};
static const quantity_t base_sample_quantity[] = {SIGNED_16(16u, 1000.0f)};
static const layout_t base_sample = LAYOUT(MESSAGE_BASE_SAMPLE_ID, base_sample_code, base_sample_quantity);

bool message_base_sample_encode(lever_frame_t *frame, const message_base_sample_t *message)
{
    const uint32_t code[] = {message->z_ddot_valid ? 1u : 0u, message->time_us};
    const float value[] = {message->z_ddot_valid ? message->z_ddot : 0.0f};
    return encode(frame, &base_sample, code, value);
}

bool message_base_sample_decode(message_base_sample_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_BASE_SAMPLE_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->z_ddot = get_quantity(payload, &base_sample_quantity[0]);
        message->z_ddot_valid = (get_code(payload, base_sample_code[0]) != 0u);
        message->time_us = get_code(payload, base_sample_code[1]);
    }
    return fits;
}

/* --- COMMAND ----------------------------------------------------------------------------------------------------- */

static const place_t command_code[] = {CODE(16u, 15u), CODE(20u, 15u), CODE(24u, 15u), CODE(28u, 15u), CODE(32u, 15u)};
static const quantity_t command_quantity[] = {UNSIGNED(48u, 65535u, 1000.0f)};
static const layout_t command = LAYOUT(MESSAGE_COMMAND_ID, command_code, command_quantity);

bool message_command_encode(lever_frame_t *frame, const message_command_t *message)
{
    const uint32_t code[] = {
        message->request, message->model, message->preload, message->estimator, message->adaptation};
    return encode(frame, &command, code, &message->dither_rms);
}

bool message_command_decode(message_command_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_COMMAND_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->request = (uint8_t)get_code(payload, command_code[0]);
        message->model = (uint8_t)get_code(payload, command_code[1]);
        message->preload = (uint8_t)get_code(payload, command_code[2]);
        message->estimator = (uint8_t)get_code(payload, command_code[3]);
        message->adaptation = (uint8_t)get_code(payload, command_code[4]);
        message->dither_rms = get_quantity(payload, &command_quantity[0]);
    }
    return fits;
}

/* --- STATE_ESTIMATE ---------------------------------------------------------------------------------------------- */

static const place_t model_code[] = {MODEL};
static const quantity_t state_estimate_quantity[] = {THETA, THETA_DOT, UNSIGNED(48u, 65535u, 1000.0f)};
static const layout_t state_estimate = LAYOUT(MESSAGE_STATE_ESTIMATE_ID, model_code, state_estimate_quantity);

bool message_state_estimate_encode(lever_frame_t *frame, const message_state_estimate_t *message)
{
    const uint32_t model = message->model;
    const float value[] = {message->theta, message->theta_dot, message->nis};
    return encode(frame, &state_estimate, &model, value);
}

bool message_state_estimate_decode(message_state_estimate_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_STATE_ESTIMATE_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->model = (uint8_t)get_code(payload, model_code[0]);
        message->theta = get_quantity(payload, &state_estimate_quantity[0]);
        message->theta_dot = get_quantity(payload, &state_estimate_quantity[1]);
        message->nis = get_quantity(payload, &state_estimate_quantity[2]);
    }
    return fits;
}

/* --- PILOT_PARAMETERS and PILOT_SIGMA, multiplexed by model ------------------------------------------------------- */

#define PHYSICAL_PARAMETERS                                                                                            \
    {UNSIGNED(16u, 65535u, 1000.0f), UNSIGNED(32u, 65535u, 100.0f), UNSIGNED(48u, 65535u, 10.0f)}
#define PHYSICAL_SIGMA {UNSIGNED(16u, 65535u, 10000.0f), UNSIGNED(32u, 65535u, 500.0f), UNSIGNED(48u, 65535u, 20.0f)}

/* One row a model, in the order of enum lever_model. */
static const quantity_t parameter_quantity[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {
    PHYSICAL_PARAMETERS,
    PHYSICAL_PARAMETERS,
    {SIGNED_16(16u, 10.0f), SIGNED_16(32u, 100.0f), SIGNED_16(48u, 1000.0f)},
};
static const quantity_t sigma_quantity[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {
    PHYSICAL_SIGMA,
    PHYSICAL_SIGMA,
    {UNSIGNED(16u, 65535u, 50.0f), UNSIGNED(32u, 65535u, 500.0f), UNSIGNED(48u, 65535u, 5000.0f)},
};

static const layout_t pilot_parameters[LEVER_MODEL_COUNT] = {
    LAYOUT(MESSAGE_PILOT_PARAMETERS_ID, model_code, parameter_quantity[0]),
    LAYOUT(MESSAGE_PILOT_PARAMETERS_ID, model_code, parameter_quantity[1]),
    LAYOUT(MESSAGE_PILOT_PARAMETERS_ID, model_code, parameter_quantity[2]),
};
static const layout_t pilot_sigma[LEVER_MODEL_COUNT] = {
    LAYOUT(MESSAGE_PILOT_SIGMA_ID, model_code, sigma_quantity[0]),
    LAYOUT(MESSAGE_PILOT_SIGMA_ID, model_code, sigma_quantity[1]),
    LAYOUT(MESSAGE_PILOT_SIGMA_ID, model_code, sigma_quantity[2]),
};

static bool encode_by_model(
    lever_frame_t *frame, const layout_t layout[LEVER_MODEL_COUNT], uint8_t model, const float value[LEVER_PARAMETERS])
{
    const uint32_t code = model;
    return (model < (uint8_t)LEVER_MODEL_COUNT) && encode(frame, &layout[model], &code, value);
}

static bool decode_by_model(uint8_t *model, float value[LEVER_PARAMETERS], const layout_t layout[LEVER_MODEL_COUNT],
    const lever_frame_t *frame, enum message_id id)
{
    const uint64_t payload = read_payload(frame);
    const uint32_t sent_model = get_code(payload, model_code[0]);
    const bool fits = is_message(frame, id) && (sent_model < (uint32_t)LEVER_MODEL_COUNT);
    if (fits) {
        *model = (uint8_t)sent_model;
        for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
            value[i] = get_quantity(payload, &layout[sent_model].quantity[i]);
        }
    }
    return fits;
}

bool message_pilot_parameters_encode(lever_frame_t *frame, const message_pilot_parameters_t *message)
{
    return encode_by_model(frame, pilot_parameters, message->model, message->parameter);
}

bool message_pilot_parameters_decode(message_pilot_parameters_t *message, const lever_frame_t *frame)
{
    return decode_by_model(&message->model, message->parameter, pilot_parameters, frame, MESSAGE_PILOT_PARAMETERS_ID);
}

bool message_pilot_sigma_encode(lever_frame_t *frame, const message_pilot_sigma_t *message)
{
    return encode_by_model(frame, pilot_sigma, message->model, message->sigma);
}

bool message_pilot_sigma_decode(message_pilot_sigma_t *message, const lever_frame_t *frame)
{
    return decode_by_model(&message->model, message->sigma, pilot_sigma, frame, MESSAGE_PILOT_SIGMA_ID);
}

/* --- PILOT_DYNAMICS ---------------------------------------------------------------------------------------------- */

static const quantity_t pilot_dynamics_quantity[] = {UNSIGNED(16u, 16383u, 1000.0f), UNSIGNED(44u, 1023u, 500.0f),
    UNSIGNED(30u, 16383u, 5000.0f), UNSIGNED(54u, 1023u, 1000.0f)};
static const layout_t pilot_dynamics = LAYOUT(MESSAGE_PILOT_DYNAMICS_ID, model_code, pilot_dynamics_quantity);

bool message_pilot_dynamics_encode(lever_frame_t *frame, const message_pilot_dynamics_t *message)
{
    const uint32_t model = message->model;
    const float value[] = {message->natural_frequency, message->natural_frequency_sigma, message->damping_ratio,
        message->damping_ratio_sigma};
    return encode(frame, &pilot_dynamics, &model, value);
}

bool message_pilot_dynamics_decode(message_pilot_dynamics_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_PILOT_DYNAMICS_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->model = (uint8_t)get_code(payload, model_code[0]);
        message->natural_frequency = get_quantity(payload, &pilot_dynamics_quantity[0]);
        message->natural_frequency_sigma = get_quantity(payload, &pilot_dynamics_quantity[1]);
        message->damping_ratio = get_quantity(payload, &pilot_dynamics_quantity[2]);
        message->damping_ratio_sigma = get_quantity(payload, &pilot_dynamics_quantity[3]);
    }
    return fits;
}

/* --- HEALTH ------------------------------------------------------------------------------------------------------ */

static const place_t health_code[] = {
    MODEL, CODE(16u, 15u), CODE(20u, 4095u), CODE(32u, 255u), CODE(40u, 255u), CODE(48u, 255u)};
static const quantity_t health_quantity[] = {UNSIGNED(56u, 255u, 200.0f)};
static const layout_t health = LAYOUT(MESSAGE_HEALTH_ID, health_code, health_quantity);

bool message_health_encode(lever_frame_t *frame, const message_health_t *message)
{
    const uint32_t code[] = {
        message->model, message->mode, message->faults, message->lost, message->corrupt, message->late};
    return encode(frame, &health, code, &message->excitation);
}

bool message_health_decode(message_health_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_HEALTH_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->model = (uint8_t)get_code(payload, health_code[0]);
        message->mode = (uint8_t)get_code(payload, health_code[1]);
        message->faults = (uint16_t)get_code(payload, health_code[2]);
        message->lost = (uint8_t)get_code(payload, health_code[3]);
        message->corrupt = (uint8_t)get_code(payload, health_code[4]);
        message->late = (uint8_t)get_code(payload, health_code[5]);
        message->excitation = get_quantity(payload, &health_quantity[0]);
    }
    return fits;
}

/* --- MOTOR_COMMAND ----------------------------------------------------------------------------------------------- */

static const quantity_t motor_command_quantity[] = {SIGNED_16(16u, 1000.0f), SIGNED_16(32u, 1000.0f)};
static const layout_t motor_command = LAYOUT(MESSAGE_MOTOR_COMMAND_ID, model_code, motor_command_quantity);

bool message_motor_command_encode(lever_frame_t *frame, const message_motor_command_t *message)
{
    const uint32_t model = message->model;
    const float value[] = {message->torque, message->dither};
    return encode(frame, &motor_command, &model, value);
}

bool message_motor_command_decode(message_motor_command_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_MOTOR_COMMAND_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->model = (uint8_t)get_code(payload, model_code[0]);
        message->torque = get_quantity(payload, &motor_command_quantity[0]);
        message->dither = get_quantity(payload, &motor_command_quantity[1]);
    }
    return fits;
}

/* --- PLATFORM_HEALTH --------------------------------------------------------------------------------------------- */

static const place_t platform_health_code[] = {
    MODEL, CODE(16u, 255u), CODE(24u, 255u), CODE(32u, 255u), CODE(40u, 255u), CODE(48u, 255u), CODE(56u, 255u)};
static const layout_t platform_health = {
    (uint32_t)MESSAGE_PLATFORM_HEALTH_ID, platform_health_code, NULL, COUNT(platform_health_code), 0u};

bool message_platform_health_encode(lever_frame_t *frame, const message_platform_health_t *message)
{
    const uint32_t code[] = {message->model, message->faults, message->transmit_errors, message->receive_errors,
        message->bus_offs, message->overruns, message->dropped};
    const float none = 0.0f;
    return encode(frame, &platform_health, code, &none);
}

bool message_platform_health_decode(message_platform_health_t *message, const lever_frame_t *frame)
{
    const bool fits = is_message(frame, MESSAGE_PLATFORM_HEALTH_ID);
    if (fits) {
        const uint64_t payload = read_payload(frame);
        message->model = (uint8_t)get_code(payload, platform_health_code[0]);
        message->faults = (uint8_t)get_code(payload, platform_health_code[1]);
        message->transmit_errors = (uint8_t)get_code(payload, platform_health_code[2]);
        message->receive_errors = (uint8_t)get_code(payload, platform_health_code[3]);
        message->bus_offs = (uint8_t)get_code(payload, platform_health_code[4]);
        message->overruns = (uint8_t)get_code(payload, platform_health_code[5]);
        message->dropped = (uint8_t)get_code(payload, platform_health_code[6]);
    }
    return fits;
}
