#include "app/link.h"

#include <math.h>
#include <string.h>

/* The order in which frames are fetched: the motor first, STATE_ESTIMATE last. */
enum output {
    OUTPUT_MOTOR_COMMAND,
    OUTPUT_PARAMETERS,
    OUTPUT_SIGMA,
    OUTPUT_DYNAMICS,
    OUTPUT_HEALTH,
    OUTPUT_PLATFORM,
    OUTPUT_STATE_ESTIMATE
};

#define BIT(output) (1u << (uint32_t)(output))
/* What is done one after the other in each publish_period: messages that are sent, and what DYNAMICS is to say. */
enum part {
    PART_HEALTH,
    PART_SIGMA,
    PART_PARAMETERS,
    PART_DERIVE_BEGIN,
    PART_DERIVE_END,
    PART_PLATFORM,
    PART_DYNAMICS,
    PARTS
};

static const uint8_t data_ids[LINK_OUTPUTS] = {MESSAGE_MOTOR_COMMAND_DATA_ID, MESSAGE_PILOT_PARAMETERS_DATA_ID,
    MESSAGE_PILOT_SIGMA_DATA_ID, MESSAGE_PILOT_DYNAMICS_DATA_ID, MESSAGE_HEALTH_DATA_ID,
    MESSAGE_PLATFORM_HEALTH_DATA_ID, MESSAGE_STATE_ESTIMATE_DATA_ID};

/* Any number of missing samples is coasted through, so as many lost frames are tolerated as can be told from a frame that
 * is repeated or one step late (which a sample's time would tell, too). */
static const e2e_tolerance_t tolerance = {13u, 14u, 0u};

/* A new session of the sender: its counters may start anywhere. */
static void start_session(link_t *link)
{
    e2e_receiver_init(&link->lever_receiver, (uint8_t)MESSAGE_LEVER_SAMPLE_DATA_ID, tolerance);
    e2e_receiver_init(&link->base_receiver, (uint8_t)MESSAGE_BASE_SAMPLE_DATA_ID, tolerance);
    link->has_lever_sample = false;
    link->has_published = false;
}

void link_init(link_t *link)
{
    (void)memset(link, 0, sizeof *link);
    e2e_receiver_init(&link->command_receiver, (uint8_t)MESSAGE_COMMAND_DATA_ID, tolerance);
    start_session(link);
}

/* --- in -------------------------------------------------------------------------------------------------------- */

/* E2E check; counts what is refused. An event may come in any order: its sequence is checked by nobody. */
static bool accept(e2e_receiver_t *receiver, estimator_t *estimator, const lever_frame_t *frame, bool event)
{
    const e2e_status_t status = e2e_check(receiver, frame);
    const bool usable = event ? (status != E2E_CRC_ERROR) : e2e_is_usable(status);
    if (status == E2E_CRC_ERROR) {
        estimator->corrupt++;
    } else if (!usable) {
        estimator->late++;
    } else {
        /* usable: nothing to count */
    }
    return usable;
}

static enum lever_frame_result on_lever_sample(link_t *link, const lever_frame_t *frame)
{
    link->has_lever_sample = message_lever_sample_decode(&link->lever_sample, frame);
    link->lever_counter = e2e_counter(frame);
    return LEVER_FRAME_TAKEN;
}

/* Completes the sample with the LEVER_SAMPLE of the same counter, if it has come. */
static enum lever_frame_result on_base_sample(link_t *link, estimator_t *estimator, const lever_frame_t *frame)
{
    message_base_sample_t base;
    (void)message_base_sample_decode(&base, frame);
    const bool paired = link->has_lever_sample && (link->lever_counter == e2e_counter(frame));
    const message_lever_sample_t *lever = &link->lever_sample;
    lever_sample_t *sample = &link->sample;
    sample->time_us = base.time_us;
    sample->z_ddot = base.z_ddot;
    sample->z_ddot_valid = base.z_ddot_valid;
    sample->theta = lever->theta;
    sample->theta_dot = lever->theta_dot;
    sample->tau_m = lever->tau_m;
    sample->theta_valid = paired && lever->theta_valid;
    sample->theta_dot_valid = paired && lever->theta_dot_valid;
    sample->tau_m_valid = paired && lever->tau_m_valid;
    estimator->lost += paired ? 0u : 1u;
    link->has_lever_sample = false;
    link->has_sample = true;
    return LEVER_FRAME_SAMPLE;
}

static enum lever_frame_result on_command(link_t *link, estimator_t *estimator, const lever_frame_t *frame)
{
    lever_command_t command;
    const bool done = message_command_decode(&command, frame) && estimator_command(estimator, &command);
    estimator->corrupt += done ? 0u : 1u;
    if (done && (command.request == (uint8_t)LEVER_REQUEST_RESET)) {
        start_session(link);
    }
    return done ? LEVER_FRAME_TAKEN : LEVER_FRAME_REFUSED;
}

enum lever_frame_result link_on_frame(link_t *link, estimator_t *estimator, const lever_frame_t *frame)
{
    enum lever_frame_result result = LEVER_FRAME_REFUSED;
    if (frame->id == (uint32_t)MESSAGE_LEVER_SAMPLE_ID) {
        if (accept(&link->lever_receiver, estimator, frame, false)) {
            result = on_lever_sample(link, frame);
        }
    } else if (frame->id == (uint32_t)MESSAGE_BASE_SAMPLE_ID) {
        if (accept(&link->base_receiver, estimator, frame, false)) {
            result = on_base_sample(link, estimator, frame);
        }
    } else if (frame->id == (uint32_t)MESSAGE_COMMAND_ID) {
        if (accept(&link->command_receiver, estimator, frame, true)) {
            result = on_command(link, estimator, frame);
        }
    } else {
        result = LEVER_FRAME_IGNORED;
    }
    if (result == LEVER_FRAME_REFUSED) {
        estimator->communication_fault = true;
    }
    return result;
}

/* --- step ------------------------------------------------------------------------------------------------------ */

/* Does the next part of a set; returns the message that is due by that, as a bit. */
static uint32_t go_on_publishing(link_t *link, estimator_t *estimator)
{
    uint32_t due = 0u;
    switch ((enum part)link->published) {
    case PART_HEALTH:
        due = BIT(OUTPUT_HEALTH);
        break;
    case PART_PARAMETERS:
        due = BIT(OUTPUT_PARAMETERS);
        break;
    case PART_SIGMA:
        due = BIT(OUTPUT_SIGMA);
        break;
    case PART_DERIVE_BEGIN:
        estimator_derive(estimator, &estimator->derived, true);
        break;
    case PART_DERIVE_END:
        estimator_derive(estimator, &estimator->derived, false);
        break;
    case PART_DYNAMICS:
        due = BIT(OUTPUT_DYNAMICS);
        break;
    case PART_PLATFORM:
        due = estimator->has_platform ? BIT(OUTPUT_PLATFORM) : 0u;
        break;
    case PARTS:
    default:
        break;
    }
    link->published++;
    return due;
}

/* The divided messages that are due, as bits. A set of them is spread evenly over publish_period, so that no sample has to
 * answer with all of them. */
static uint32_t divided_due(link_t *link, estimator_t *estimator)
{
    const float rounded = (estimator->setup.settings->publish_period * 1.0e6f) + 0.5f;
    const uint32_t period_us = (uint32_t)rounded;
    uint32_t due = 0u;
    if (!link->has_published || ((link->sample.time_us - link->published_us) >= period_us)) {
        while (link->has_published && (link->published < (uint32_t)PARTS)) { /* of the set before */
            due |= go_on_publishing(link, estimator);
        }
        link->has_published = true;
        link->published_us = link->sample.time_us;
        link->published = 0u;
    }
    const uint32_t elapsed_us = link->sample.time_us - link->published_us;
    while ((link->published < (uint32_t)PARTS) && ((elapsed_us * (uint32_t)PARTS) >= (period_us * link->published))) {
        due |= go_on_publishing(link, estimator);
    }
    return due;
}

enum lever_mode link_step(link_t *link, estimator_t *estimator)
{
    if (link->has_sample) {
        const bool dithers = dither_is_on(&estimator->dither); /* a step may end that, not begin it */
        link->has_sample = false;
        (void)estimator_update(estimator, &link->sample);
        uint32_t due = BIT(OUTPUT_STATE_ESTIMATE) | divided_due(link, estimator);
        if (dithers) {
            due |= BIT(OUTPUT_MOTOR_COMMAND);
        }
        link->due = (uint8_t)(link->due | due);
    }
    return estimator->mode;
}

/* --- out ------------------------------------------------------------------------------------------------------- */

static bool encode_motor_command(const estimator_t *estimator, lever_frame_t *frame)
{
    message_motor_command_t message;
    message.model = estimator->setup.model;
    message.valid = (estimator->mode >= LEVER_MODE_RUN) && (estimator->mode <= LEVER_MODE_FROZEN);
    message.torque = estimator->dither.torque;
    message.dither = estimator->dither.torque;
    message.time_low = (uint16_t)(estimator->time_us & 0xFFFFu);
    return message_motor_command_encode(frame, &message);
}

static bool encode_parameters(const estimator_t *estimator, lever_frame_t *frame)
{
    message_pilot_parameters_t message;
    message.model = estimator->setup.model;
    message.valid = (estimator->mode >= LEVER_MODE_RUN) && (estimator->mode <= LEVER_MODE_FROZEN);
    (void)memcpy(message.parameter, estimator->dual.parameters.p, sizeof message.parameter);
    return message_pilot_parameters_encode(frame, &message);
}

static bool encode_sigma(const estimator_t *estimator, lever_frame_t *frame)
{
    message_pilot_sigma_t message;
    message.model = estimator->setup.model;
    message.valid = (estimator->mode >= LEVER_MODE_RUN) && (estimator->mode <= LEVER_MODE_FROZEN);
    parameter_filter_sigma(&estimator->dual.parameters, message.sigma);
    return message_pilot_sigma_encode(frame, &message);
}

static bool encode_dynamics(const estimator_t *estimator, lever_frame_t *frame)
{
    const derived_t *derived = &estimator->derived;
    message_pilot_dynamics_t message;
    message.model = estimator->setup.model;
    message.valid = (estimator->mode >= LEVER_MODE_RUN) && (estimator->mode <= LEVER_MODE_FROZEN);
    message.natural_frequency = derived->mean.natural_frequency;
    message.natural_frequency_sigma = sqrtf(derived->variance.natural_frequency);
    message.damping_ratio = derived->mean.damping_ratio;
    message.damping_ratio_sigma = sqrtf(derived->variance.damping_ratio);
    return message_pilot_dynamics_encode(frame, &message);
}

static bool encode_health(const estimator_t *estimator, lever_frame_t *frame)
{
    message_health_t message;
    lever_health_t health;
    estimator_health(estimator, &health);
    message.mode = (uint8_t)health.mode;
    message.faults = health.faults;
    message.restarts = (uint8_t)(health.recoveries & 0xFFu);
    message.excitation = health.excitation;
    return message_health_encode(frame, &message);
}

static bool encode_platform(const estimator_t *estimator, lever_frame_t *frame)
{
    const lever_platform_t *platform = &estimator->platform;
    message_platform_health_t message;
    message.model = estimator->setup.model;
    message.valid = (estimator->mode >= LEVER_MODE_RUN) && (estimator->mode <= LEVER_MODE_FROZEN);
    message.faults = platform->faults;
    message.transmit_errors = platform->transmit_errors;
    message.receive_errors = platform->receive_errors;
    message.bus_offs = platform->bus_offs;
    message.overruns = (uint8_t)(platform->overruns & 0xFFu);
    message.dropped = (uint8_t)(platform->dropped & 0xFFu);
    return message_platform_health_encode(frame, &message);
}

static bool encode_state_estimate(const estimator_t *estimator, lever_frame_t *frame)
{
    message_state_estimate_t message;
    message.valid = (estimator->mode >= LEVER_MODE_RUN) && (estimator->mode <= LEVER_MODE_FROZEN);
    message.theta = estimator_state(estimator, 0u);
    message.theta_dot = estimator_state(estimator, 1u);
    message.innovation = (estimator->nis_size != 0u) ? sqrtf(estimator->nis) : NAN;
    message.time_low = (uint16_t)(estimator->time_us & 0xFFFFu);
    return message_state_estimate_encode(frame, &message);
}

static bool (*const encoders[LINK_OUTPUTS])(const estimator_t *, lever_frame_t *) = {encode_motor_command,
    encode_parameters, encode_sigma, encode_dynamics, encode_health, encode_platform, encode_state_estimate};

bool link_next_frame(link_t *link, const estimator_t *estimator, lever_frame_t *frame)
{
    bool sent = false;
    uint32_t output = 0u;
    uint32_t due = link->due; /* from `output` on */
    while ((due != 0u) && !sent) {
        const bool is_due = ((due & 1u) != 0u);
        due >>= 1u;
        if (is_due) {
            link->due = (uint8_t)(due << (output + 1u));
            sent = encoders[output](estimator, frame);
            if (sent) {
                e2e_protect(frame, data_ids[output], link->counter[output]);
                link->counter[output] = (uint8_t)((link->counter[output] + 1u) & 15u);
            }
        }
        output++;
    }
    return sent;
}
