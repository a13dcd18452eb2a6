#include "can/messages.h"
#include "can/layout.h"

/* The messages that are not of every sample. Their layouts are those of lever.dbc; tests/python/can compares them. */

#define MODEL CODE(12u, 7u)
#define VALID CODE(15u, 1u)

static const float no_quantity[1] = {0.0f};

static uint32_t bit_of(bool flag)
{
    return flag ? 1u : 0u;
}

/* --- COMMAND ------------------------------------------------------------------------------------------------------ */

static const place_t command_code[] = {
    CODE(16u, 15u), CODE(20u, 15u), CODE(24u, 15u), CODE(28u, 15u), CODE(32u, 15u), CODE(36u, 15u)};
static const quantity_t command_quantity[] = {UNSIGNED(48u, 65535u, 1000.0f)};
static const layout_t command = LAYOUT(MESSAGE_COMMAND_ID, command_code, command_quantity);

bool message_command_encode(lever_frame_t *frame, const message_command_t *message)
{
    const uint32_t code[] = {message->request, message->model, message->preload, message->estimator,
        message->adaptation, message->mitigation};
    return (message->dither_rms >= 0.0f) && layout_encode(frame, &command, code, &message->dither_rms);
}

bool message_command_decode(message_command_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(command_code)];
    float value[COUNT(command_quantity)];
    const bool fits = layout_decode(code, value, &command, frame);
    if (fits) {
        message->request = (uint8_t)code[0];
        message->model = (uint8_t)code[1];
        message->preload = (uint8_t)code[2];
        message->estimator = (uint8_t)code[3];
        message->adaptation = (uint8_t)code[4];
        message->mitigation = (uint8_t)code[5];
        message->dither_rms = (value[0] >= 0.0f) ? value[0] : 65.535f; /* not available: keep */
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
    {SIGNED(16u, 65535u, 10.0f), SIGNED(32u, 65535u, 100.0f), SIGNED(48u, 65535u, 1000.0f)},
    {UNSIGNED(16u, 65535u, 10.0f), UNSIGNED(32u, 65535u, 100.0f), UNSIGNED(48u, 65535u, 100.0f)},
};
static const quantity_t sigma_quantity[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {
    PHYSICAL_SIGMA,
    PHYSICAL_SIGMA,
    {UNSIGNED(16u, 65535u, 50.0f), UNSIGNED(32u, 65535u, 500.0f), UNSIGNED(48u, 65535u, 5000.0f)},
    {UNSIGNED(16u, 65535u, 20.0f), UNSIGNED(32u, 65535u, 500.0f), UNSIGNED(48u, 65535u, 500.0f)},
};

static const place_t model_code[] = {MODEL, VALID};
static const layout_t pilot_parameters[LEVER_MODEL_COUNT] = {
    LAYOUT(MESSAGE_PILOT_PARAMETERS_ID, model_code, parameter_quantity[0]),
    LAYOUT(MESSAGE_PILOT_PARAMETERS_ID, model_code, parameter_quantity[1]),
    LAYOUT(MESSAGE_PILOT_PARAMETERS_ID, model_code, parameter_quantity[2]),
    LAYOUT(MESSAGE_PILOT_PARAMETERS_ID, model_code, parameter_quantity[3]),
};
static const layout_t pilot_sigma[LEVER_MODEL_COUNT] = {
    LAYOUT(MESSAGE_PILOT_SIGMA_ID, model_code, sigma_quantity[0]),
    LAYOUT(MESSAGE_PILOT_SIGMA_ID, model_code, sigma_quantity[1]),
    LAYOUT(MESSAGE_PILOT_SIGMA_ID, model_code, sigma_quantity[2]),
    LAYOUT(MESSAGE_PILOT_SIGMA_ID, model_code, sigma_quantity[3]),
};

static bool encode_by_model(lever_frame_t *frame, const layout_t layout[LEVER_MODEL_COUNT], uint8_t model, bool valid,
    const float value[LEVER_PARAMETERS])
{
    const uint32_t code[] = {model, bit_of(valid)};
    return (model < (uint8_t)LEVER_MODEL_COUNT) && layout_encode(frame, &layout[model], code, value);
}

/* Returns the model, or LEVER_MODEL_COUNT when the frame is refused. */
static uint32_t decode_by_model(
    float value[LEVER_PARAMETERS], bool *valid, const layout_t layout[LEVER_MODEL_COUNT], const lever_frame_t *frame)
{
    uint32_t code[COUNT(model_code)];
    float as_lever[LEVER_PARAMETERS];
    uint32_t model = (uint32_t)LEVER_MODEL_COUNT;
    if (layout_decode(code, as_lever, &layout[0], frame) && (code[0] < (uint32_t)LEVER_MODEL_COUNT)) {
        model = code[0];
        (void)layout_decode(code, value, &layout[model], frame);
        *valid = (code[1] != 0u);
    }
    return model;
}

bool message_pilot_parameters_encode(lever_frame_t *frame, const message_pilot_parameters_t *message)
{
    return encode_by_model(frame, pilot_parameters, message->model, message->valid, message->parameter);
}

bool message_pilot_parameters_decode(message_pilot_parameters_t *message, const lever_frame_t *frame)
{
    const uint32_t model = decode_by_model(message->parameter, &message->valid, pilot_parameters, frame);
    const bool fits = (model < (uint32_t)LEVER_MODEL_COUNT);
    message->model = fits ? (uint8_t)model : message->model;
    return fits;
}

bool message_pilot_sigma_encode(lever_frame_t *frame, const message_pilot_sigma_t *message)
{
    return encode_by_model(frame, pilot_sigma, message->model, message->valid, message->sigma);
}

bool message_pilot_sigma_decode(message_pilot_sigma_t *message, const lever_frame_t *frame)
{
    const uint32_t model = decode_by_model(message->sigma, &message->valid, pilot_sigma, frame);
    const bool fits = (model < (uint32_t)LEVER_MODEL_COUNT);
    message->model = fits ? (uint8_t)model : message->model;
    return fits;
}

/* --- PILOT_DYNAMICS ----------------------------------------------------------------------------------------------- */

static const place_t pilot_dynamics_code[] = {MODEL, VALID};
static const quantity_t pilot_dynamics_quantity[] = {UNSIGNED(16u, 16383u, 1000.0f), UNSIGNED(44u, 1023u, 500.0f),
    UNSIGNED(30u, 16383u, 5000.0f), UNSIGNED(54u, 1023u, 1000.0f)};
static const layout_t pilot_dynamics = LAYOUT(MESSAGE_PILOT_DYNAMICS_ID, pilot_dynamics_code, pilot_dynamics_quantity);

bool message_pilot_dynamics_encode(lever_frame_t *frame, const message_pilot_dynamics_t *message)
{
    const uint32_t code[] = {message->model, bit_of(message->valid)};
    const float value[] = {message->natural_frequency, message->natural_frequency_sigma, message->damping_ratio,
        message->damping_ratio_sigma};
    return layout_encode(frame, &pilot_dynamics, code, value);
}

bool message_pilot_dynamics_decode(message_pilot_dynamics_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(pilot_dynamics_code)];
    float value[COUNT(pilot_dynamics_quantity)];
    const bool fits = layout_decode(code, value, &pilot_dynamics, frame);
    if (fits) {
        message->model = (uint8_t)code[0];
        message->valid = (code[1] != 0u);
        message->natural_frequency = value[0];
        message->natural_frequency_sigma = value[1];
        message->damping_ratio = value[2];
        message->damping_ratio_sigma = value[3];
    }
    return fits;
}

/* --- FEEDTHROUGH -------------------------------------------------------------------------------------------------- */

static const place_t feedthrough_code[] = {CODE(12u, 15u), CODE(16u, 1u)};
static const quantity_t feedthrough_quantity[] = {SIGNED(17u, 32767u, 200000.0f), SIGNED(32u, 32767u, 200000.0f),
    UNSIGNED(47u, 511u, 500.0f), UNSIGNED(56u, 255u, 500.0f)};
static const layout_t feedthrough = LAYOUT(MESSAGE_FEEDTHROUGH_ID, feedthrough_code, feedthrough_quantity);

bool message_feedthrough_encode(lever_frame_t *frame, const message_feedthrough_t *message)
{
    const uint32_t code[] = {message->frequency, bit_of(message->valid)};
    const float value[] = {message->real, message->imaginary, message->gain_sigma, message->phase_sigma};
    return layout_encode(frame, &feedthrough, code, value);
}

bool message_feedthrough_decode(message_feedthrough_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(feedthrough_code)];
    float value[COUNT(feedthrough_quantity)];
    const bool fits = layout_decode(code, value, &feedthrough, frame);
    if (fits) {
        message->frequency = (uint8_t)code[0];
        message->valid = (code[1] != 0u);
        message->real = value[0];
        message->imaginary = value[1];
        message->gain_sigma = value[2];
        message->phase_sigma = value[3];
    }
    return fits;
}

/* --- TEST_RATIO --------------------------------------------------------------------------------------------------- */

static const place_t test_ratio_code[] = {CODE(12u, 15u), CODE(16u, 15u), CODE(20u, 1u)};
static const quantity_t test_ratio_quantity[] = {UNSIGNED(24u, 65535u, 1000.0f)};
static const layout_t test_ratio = LAYOUT(MESSAGE_TEST_RATIO_ID, test_ratio_code, test_ratio_quantity);

bool message_test_ratio_encode(lever_frame_t *frame, const message_test_ratio_t *message)
{
    const uint32_t code[] = {message->evidence, message->verdict, bit_of(message->present)};
    return layout_encode(frame, &test_ratio, code, &message->ratio);
}

bool message_test_ratio_decode(message_test_ratio_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(test_ratio_code)];
    const bool fits = layout_decode(code, &message->ratio, &test_ratio, frame);
    if (fits) {
        message->evidence = (uint8_t)code[0];
        message->verdict = (uint8_t)code[1];
        message->present = (code[2] != 0u);
    }
    return fits;
}

/* --- STABILITY ---------------------------------------------------------------------------------------------------- */

static const place_t stability_code[] = {CODE(12u, 3u), CODE(14u, 1u)};
static const quantity_t stability_quantity[] = {SIGNED(15u, 4095u, 50.0f), UNSIGNED(27u, 255u, 25.0f),
    SIGNED(35u, 1023u, 100.0f), UNSIGNED(45u, 255u, 100.0f), UNSIGNED(53u, 2047u, 100.0f)};
static const layout_t stability = LAYOUT(MESSAGE_STABILITY_ID, stability_code, stability_quantity);

bool message_stability_encode(lever_frame_t *frame, const message_stability_t *message)
{
    const uint32_t code[] = {message->bounce, bit_of(message->valid)};
    const float value[] = {
        message->gain_margin, message->gain_margin_sigma, message->modulus, message->modulus_sigma, message->frequency};
    return layout_encode(frame, &stability, code, value);
}

bool message_stability_decode(message_stability_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(stability_code)];
    float value[COUNT(stability_quantity)];
    const bool fits = layout_decode(code, value, &stability, frame);
    if (fits) {
        message->bounce = (uint8_t)code[0];
        message->valid = (code[1] != 0u);
        message->gain_margin = value[0];
        message->gain_margin_sigma = value[1];
        message->modulus = value[2];
        message->modulus_sigma = value[3];
        message->frequency = value[4];
    }
    return fits;
}

/* --- HEALTH ------------------------------------------------------------------------------------------------------- */

static const place_t health_code[] = {CODE(12u, 15u), CODE(16u, 0xFFFFFFu), CODE(40u, 255u)};
static const quantity_t health_quantity[] = {UNSIGNED(48u, 65535u, 2000.0f)};
static const layout_t health = LAYOUT(MESSAGE_HEALTH_ID, health_code, health_quantity);

bool message_health_encode(lever_frame_t *frame, const message_health_t *message)
{
    const uint32_t code[] = {message->mode, message->faults, message->restarts};
    const float value[] = {message->excitation};
    return layout_encode(frame, &health, code, value);
}

bool message_health_decode(message_health_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(health_code)];
    float value[COUNT(health_quantity)];
    const bool fits = layout_decode(code, value, &health, frame);
    if (fits) {
        message->mode = (uint8_t)code[0];
        message->faults = code[1];
        message->restarts = (uint8_t)code[2];
        message->excitation = value[0];
    }
    return fits;
}

/* --- PLATFORM_HEALTH ---------------------------------------------------------------------------------------------- */

static const place_t platform_health_code[] = {
    MODEL, VALID, CODE(16u, 255u), CODE(24u, 255u), CODE(32u, 255u), CODE(40u, 255u), CODE(48u, 255u), CODE(56u, 255u)};
static const layout_t platform_health = CODES_ONLY(MESSAGE_PLATFORM_HEALTH_ID, platform_health_code);

bool message_platform_health_encode(lever_frame_t *frame, const message_platform_health_t *message)
{
    const uint32_t code[] = {message->model, bit_of(message->valid), message->faults, message->transmit_errors,
        message->receive_errors, message->bus_offs, message->overruns, message->dropped};
    return layout_encode(frame, &platform_health, code, no_quantity);
}

bool message_platform_health_decode(message_platform_health_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(platform_health_code)];
    float value[1];
    const bool fits = layout_decode(code, value, &platform_health, frame);
    if (fits) {
        message->model = (uint8_t)code[0];
        message->valid = (code[1] != 0u);
        message->faults = (uint8_t)code[2];
        message->transmit_errors = (uint8_t)code[3];
        message->receive_errors = (uint8_t)code[4];
        message->bus_offs = (uint8_t)code[5];
        message->overruns = (uint8_t)code[6];
        message->dropped = (uint8_t)code[7];
    }
    return fits;
}

/* --- PLATFORM_RESET ----------------------------------------------------------------------------------------------- */

static const place_t platform_reset_code[] = {CODE(12u, 15u), CODE(16u, 255u), CODE(24u, 255u), CODE(32u, UINT32_MAX)};
static const layout_t platform_reset = CODES_ONLY(MESSAGE_PLATFORM_RESET_ID, platform_reset_code);

bool message_platform_reset_encode(lever_frame_t *frame, const message_platform_reset_t *message)
{
    const uint32_t code[] = {message->cause, message->resets, message->failed, message->fault_address};
    return layout_encode(frame, &platform_reset, code, no_quantity);
}

bool message_platform_reset_decode(message_platform_reset_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(platform_reset_code)];
    float value[1];
    const bool fits = layout_decode(code, value, &platform_reset, frame);
    if (fits) {
        message->cause = (uint8_t)code[0];
        message->resets = (uint8_t)code[1];
        message->failed = (uint8_t)code[2];
        message->fault_address = code[3];
    }
    return fits;
}

/* --- IDENTITY, multiplexed by page -------------------------------------------------------------------------------- */

enum { PAGE_CODES = 6 }; /* of the page that has most */

/* Code 0 is the page. */
static const place_t version_code[] = {
    CODE(12u, 15u), CODE(16u, 255u), CODE(24u, 255u), CODE(32u, 255u), CODE(40u, 255u)};
static const place_t settings_code[] = {CODE(12u, 15u), CODE(16u, UINT32_MAX)};
static const place_t choices_code[PAGE_CODES] = {
    CODE(12u, 15u), CODE(16u, 15u), CODE(20u, 15u), CODE(24u, 15u), CODE(28u, 15u), CODE(48u, 15u)};
static const quantity_t choices_quantity[] = {UNSIGNED(32u, 65535u, 1000.0f)};
static const layout_t identity[MESSAGE_PAGE_COUNT] = {
    CODES_ONLY(MESSAGE_IDENTITY_ID, version_code),
    CODES_ONLY(MESSAGE_IDENTITY_ID, settings_code),
    LAYOUT(MESSAGE_IDENTITY_ID, choices_code, choices_quantity),
};

bool message_identity_encode(lever_frame_t *frame, const message_identity_t *message)
{
    const uint32_t code[MESSAGE_PAGE_COUNT][PAGE_CODES] = {
        {message->page, message->firmware_major, message->firmware_minor, message->firmware_patch, message->contract,
            0u},
        {message->page, message->settings_crc, 0u, 0u, 0u, 0u},
        {message->page, message->model, message->preload, message->estimator, message->adaptation, message->mitigation},
    };
    const uint8_t page = message->page;
    return (page < (uint8_t)MESSAGE_PAGE_COUNT) &&
           layout_encode(frame, &identity[page], code[page], &message->dither_rms);
}

bool message_identity_decode(message_identity_t *message, const lever_frame_t *frame)
{
    uint32_t code[PAGE_CODES] = {0u, 0u, 0u, 0u, 0u, 0u};
    float value[1] = {0.0f};
    const bool fits =
        layout_decode(code, value, &identity[MESSAGE_PAGE_SETTINGS], frame) && (code[0] < (uint32_t)MESSAGE_PAGE_COUNT);
    if (fits) {
        const uint32_t page = code[0];
        (void)layout_decode(code, value, &identity[page], frame);
        *message = (message_identity_t){.page = (uint8_t)page};
        if (page == (uint32_t)MESSAGE_PAGE_VERSION) {
            message->firmware_major = (uint8_t)code[1];
            message->firmware_minor = (uint8_t)code[2];
            message->firmware_patch = (uint8_t)code[3];
            message->contract = (uint8_t)code[4];
        } else if (page == (uint32_t)MESSAGE_PAGE_SETTINGS) {
            message->settings_crc = code[1];
        } else {
            message->model = (uint8_t)code[1];
            message->preload = (uint8_t)code[2];
            message->estimator = (uint8_t)code[3];
            message->adaptation = (uint8_t)code[4];
            message->mitigation = (uint8_t)code[5];
            message->dither_rms = value[0];
        }
    }
    return fits;
}

/* --- COMMAND_ACK -------------------------------------------------------------------------------------------------- */

static const place_t command_ack_code[] = {
    CODE(12u, 15u), CODE(16u, 15u), CODE(20u, 15u), CODE(24u, 15u), CODE(28u, 15u), CODE(32u, 15u), CODE(36u, 15u)};
static const quantity_t command_ack_quantity[] = {UNSIGNED(48u, 65535u, 1000.0f)};
static const layout_t command_ack = LAYOUT(MESSAGE_COMMAND_ACK_ID, command_ack_code, command_ack_quantity);

bool message_command_ack_encode(lever_frame_t *frame, const message_command_ack_t *message)
{
    const uint32_t code[] = {message->command_counter, message->result, message->model, message->preload,
        message->estimator, message->adaptation, message->mitigation};
    const float value[] = {message->dither_rms};
    return layout_encode(frame, &command_ack, code, value);
}

bool message_command_ack_decode(message_command_ack_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(command_ack_code)];
    float value[COUNT(command_ack_quantity)];
    const bool fits = layout_decode(code, value, &command_ack, frame);
    if (fits) {
        message->command_counter = (uint8_t)code[0];
        message->result = (uint8_t)code[1];
        message->model = (uint8_t)code[2];
        message->preload = (uint8_t)code[3];
        message->estimator = (uint8_t)code[4];
        message->adaptation = (uint8_t)code[5];
        message->mitigation = (uint8_t)code[6];
        message->dither_rms = value[0];
    }
    return fits;
}

/* --- LINK_HEALTH -------------------------------------------------------------------------------------------------- */

static const place_t link_health_code[] = {MODEL, VALID, CODE(16u, 65535u), CODE(32u, 65535u), CODE(48u, 65535u)};
static const layout_t link_health = CODES_ONLY(MESSAGE_LINK_HEALTH_ID, link_health_code);

bool message_link_health_encode(lever_frame_t *frame, const message_link_health_t *message)
{
    const uint32_t code[] = {message->model, bit_of(message->valid), message->lost, message->corrupt, message->late};
    return layout_encode(frame, &link_health, code, no_quantity);
}

bool message_link_health_decode(message_link_health_t *message, const lever_frame_t *frame)
{
    uint32_t code[COUNT(link_health_code)];
    float value[1];
    const bool fits = layout_decode(code, value, &link_health, frame);
    if (fits) {
        message->model = (uint8_t)code[0];
        message->valid = (code[1] != 0u);
        message->lost = (uint16_t)code[2];
        message->corrupt = (uint16_t)code[3];
        message->late = (uint16_t)code[4];
    }
    return fits;
}
