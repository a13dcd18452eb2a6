/* What each message to send says of an instance. */
#include "app/link.h"
#include "math/bounds.h"

#include <math.h>

/* --- shared by the messages --------------------------------------------------------------------------------------- */

static bool are_finite(const float value[LEVER_PARAMETERS])
{
    return is_finite(value[0]) && is_finite(value[1]) && is_finite(value[2]);
}

static uint16_t low_16(uint32_t value)
{
    return (uint16_t)(value & 0xFFFFu);
}

/* --- messages ----------------------------------------------------------------------------------------------------- */

static bool encode_motor_command(lever_t *lever, lever_frame_t *frame)
{
    const float torque = lever->gate.torque;
    const message_motor_command_t message = {.torque = torque,
        .dither = torque - (lever->gate.gain * lever->bounce.mitigation.damping),
        .time_low = low_16(lever->estimator.time_us),
        .model = lever->estimator.setup.model,
        .valid = lever->gate.open};
    return message_motor_command_encode(frame, &message);
}

static bool encode_correction(lever_t *lever, lever_frame_t *frame)
{
    lever_correction_t correction;
    lever_correction(lever, &correction);
    const message_correction_t message = {.correction = correction.angle,
        .weight = correction.weight,
        .time_low = low_16(lever->estimator.time_us),
        .mitigation = lever->bounce.chosen,
        .valid = lever->bounce.mitigation.open};
    return message_correction_encode(frame, &message);
}

static bool encode_command_ack(lever_t *lever, lever_frame_t *frame)
{
    const setup_t *setup = &lever->estimator.setup;
    const message_command_ack_t message = {.command_counter = lever->link.command_counter,
        .result = lever->link.command_result,
        .model = setup->model,
        .preload = setup->preload,
        .estimator = setup->estimator,
        .adaptation = setup->adaptation,
        .mitigation = lever->bounce.chosen,
        .dither_rms = lever->dither.target};
    return message_command_ack_encode(frame, &message);
}

static bool encode_parameters(lever_t *lever, lever_frame_t *frame)
{
    message_pilot_parameters_t message;
    estimator_parameters(&lever->estimator, message.parameter);
    message.model = lever->estimator.setup.model;
    message.valid = instance_is_estimating(lever) && are_finite(message.parameter);
    return message_pilot_parameters_encode(frame, &message);
}

static bool encode_sigma(lever_t *lever, lever_frame_t *frame)
{
    message_pilot_sigma_t message;
    estimator_parameter_sigma(&lever->estimator, message.sigma);
    message.model = lever->estimator.setup.model;
    message.valid = instance_is_estimating(lever) && are_finite(message.sigma);
    return message_pilot_sigma_encode(frame, &message);
}

static bool encode_dynamics(lever_t *lever, lever_frame_t *frame)
{
    const derived_dynamics_t dynamics = estimator_dynamics(&lever->estimator);
    const message_pilot_dynamics_t message = {.natural_frequency = dynamics.natural_frequency,
        .natural_frequency_sigma = dynamics.natural_frequency_sigma,
        .damping_ratio = dynamics.damping_ratio,
        .damping_ratio_sigma = dynamics.damping_ratio_sigma,
        .model = lever->estimator.setup.model,
        .valid = instance_is_estimating(lever) &&
                 is_finite(dynamics.natural_frequency_sigma + dynamics.damping_ratio_sigma)};
    return message_pilot_dynamics_encode(frame, &message);
}

/* One frequency after the other, each time the next. */
static bool encode_feedthrough(lever_t *lever, lever_frame_t *frame)
{
    link_t *link = &lever->link;
    const derived_feedthrough_t feedthrough = estimator_feedthrough(&lever->estimator, (float)link->frequency);
    const message_feedthrough_t message = {.real = feedthrough.real,
        .imaginary = feedthrough.imaginary,
        .gain_sigma = feedthrough.gain_sigma,
        .phase_sigma = feedthrough.phase_sigma,
        .frequency = link->frequency,
        .valid = instance_is_estimating(lever) && is_finite(feedthrough.gain_sigma + feedthrough.phase_sigma)};
    const bool is_last = (link->frequency == (uint8_t)MESSAGE_FEEDTHROUGH_HIGHEST);
    link->frequency = is_last ? (uint8_t)MESSAGE_FEEDTHROUGH_LOWEST : (uint8_t)(link->frequency + 1u);
    return message_feedthrough_encode(frame, &message);
}

static bool encode_stability(lever_t *lever, lever_frame_t *frame)
{
    lever_stability_t stability;
    lever_stability(lever, &stability);
    const message_stability_t message = {.gain_margin = stability.gain_margin,
        .gain_margin_sigma = stability.gain_margin_sigma,
        .modulus = stability.modulus,
        .modulus_sigma = stability.modulus_sigma,
        .frequency = stability.frequency,
        .bounce = stability.state,
        .valid = stability.valid};
    return message_stability_encode(frame, &message);
}

static bool encode_health(lever_t *lever, lever_frame_t *frame)
{
    lever_health_t health;
    lever_health(lever, &health);
    const message_health_t message = {.excitation = health.excitation,
        .faults = lever->link.latched,
        .mode = (uint8_t)health.mode,
        .restarts = (uint8_t)(health.recoveries & 0xFFu)};
    lever->link.latched = 0u;
    return message_health_encode(frame, &message);
}

static bool encode_link_health(lever_t *lever, lever_frame_t *frame)
{
    const estimator_t *estimator = &lever->estimator;
    const message_link_health_t message = {.lost = low_16(estimator->lost),
        .corrupt = low_16(estimator->corrupt),
        .late = low_16(estimator->late),
        .model = estimator->setup.model,
        .valid = instance_is_estimating(lever)};
    return message_link_health_encode(frame, &message);
}

/* One statistic after the other, each time the next. */
static bool encode_test_ratio(lever_t *lever, lever_frame_t *frame)
{
    const learning_t *learning = &lever->estimator.learning;
    const uint8_t which = (uint8_t)(lever->link.evidence % (uint32_t)LEVER_TEST_RATIOS);
    const float ratio = learning->evidence.ratio[which];
    const message_test_ratio_t message = {.ratio = greater(lesser(ratio, MESSAGE_TEST_RATIO_MOST), 0.0f),
        .evidence = which,
        .verdict = learning->verdict,
        .present = evidence_has(&learning->evidence, (enum evidence_id)which)};
    lever->link.evidence = (uint8_t)(which + 1u);
    return message_test_ratio_encode(frame, &message);
}

static bool encode_platform(lever_t *lever, lever_frame_t *frame)
{
    const lever_platform_t *platform = &lever->platform;
    const uint32_t settings = lever->settings_changed ? (uint32_t)LEVER_PLATFORM_SELF_TEST : 0u;
    const message_platform_health_t message = {.faults = (uint8_t)(platform->faults | settings),
        .transmit_errors = platform->transmit_errors,
        .receive_errors = platform->receive_errors,
        .bus_offs = platform->bus_offs,
        .overruns = (uint8_t)(platform->overruns & 0xFFu),
        .dropped = (uint8_t)(platform->dropped & 0xFFu),
        .model = lever->estimator.setup.model,
        .valid = instance_is_estimating(lever)};
    return message_platform_health_encode(frame, &message);
}

/* The first page that is still to be sent. */
static bool encode_identity(lever_t *lever, lever_frame_t *frame)
{
    link_t *link = &lever->link;
    const setup_t *setup = &lever->estimator.setup;
    uint8_t page = 0u;
    while ((page < ((uint8_t)MESSAGE_PAGE_COUNT - 1u)) && ((link->pages & (1u << page)) == 0u)) {
        page++;
    }
    link->pages &= (uint8_t)~(1u << page);
    const message_identity_t message = {.page = page,
        .firmware_major = (uint8_t)LEVER_VERSION_MAJOR,
        .firmware_minor = (uint8_t)LEVER_VERSION_MINOR,
        .firmware_patch = (uint8_t)LEVER_VERSION_PATCH,
        .contract = (uint8_t)MESSAGE_CONTRACT,
        .settings_crc = link->settings_crc,
        .model = setup->model,
        .preload = setup->preload,
        .estimator = setup->estimator,
        .adaptation = setup->adaptation,
        .mitigation = lever->bounce.chosen,
        .dither_rms = lever->dither.target};
    return message_identity_encode(frame, &message);
}

static bool encode_state_estimate(lever_t *lever, lever_frame_t *frame)
{
    const estimator_t *estimator = &lever->estimator;
    message_state_estimate_t message;
    message.theta = estimator_state(estimator, 0u);
    message.theta_dot = estimator_state(estimator, 1u);
    message.innovation = (estimator->nis_size != 0u) ? sqrtf(estimator->nis) : NAN;
    message.time_low = low_16(estimator->time_us);
    message.valid = instance_is_estimating(lever) && is_finite(message.theta) && is_finite(message.theta_dot);
    return message_state_estimate_encode(frame, &message);
}

/* In the order of enum link_output. */
static bool (*const encoders[OUTPUTS])(lever_t *lever, lever_frame_t *frame) = {encode_motor_command, encode_correction,
    encode_command_ack, encode_parameters, encode_sigma, encode_dynamics, encode_feedthrough, encode_stability,
    encode_health, encode_link_health, encode_test_ratio, encode_platform, encode_identity, encode_state_estimate};

bool link_encode(lever_t *lever, enum link_output output, lever_frame_t *frame)
{
    return encoders[output](lever, frame);
}
