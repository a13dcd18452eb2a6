#include "app/link.h"

#include "math/elapsed.h"

#include <math.h>
#include <stddef.h>

#define BIT(output) ((uint32_t)1u << (uint32_t)(output))
#define EVERY_PAGE ((1u << (uint32_t)MESSAGE_PAGE_COUNT) - 1u)
#define IDENTITY_US 1000000u    /* from one IDENTITY to the next */
#define DUPLICATE_US 2000000u   /* another estimator is reported for so long */
#define LONG_AGO_US 0x40000000u /* no time of this protocol is longer */
#define COUNTERS 16u            /* values of an E2E counter */

/* The divided messages, in the order in which they are sent in each publish_period. */
static const uint16_t parts[] = {(uint16_t)(BIT(OUTPUT_HEALTH) | BIT(OUTPUT_STABILITY)),
    (uint16_t)BIT(OUTPUT_PARAMETERS), (uint16_t)BIT(OUTPUT_SIGMA), (uint16_t)BIT(OUTPUT_DYNAMICS),
    (uint16_t)BIT(OUTPUT_FEEDTHROUGH), (uint16_t)(BIT(OUTPUT_LINK_HEALTH) | BIT(OUTPUT_TEST_RATIO)),
    (uint16_t)BIT(OUTPUT_PLATFORM)};
#define PARTS ((uint32_t)(sizeof(parts) / sizeof(parts[0])))

static const uint8_t data_ids[OUTPUTS] = {MESSAGE_MOTOR_COMMAND_DATA_ID, MESSAGE_CORRECTION_DATA_ID,
    MESSAGE_COMMAND_ACK_DATA_ID, MESSAGE_PILOT_PARAMETERS_DATA_ID, MESSAGE_PILOT_SIGMA_DATA_ID,
    MESSAGE_PILOT_DYNAMICS_DATA_ID, MESSAGE_FEEDTHROUGH_DATA_ID, MESSAGE_STABILITY_DATA_ID, MESSAGE_HEALTH_DATA_ID,
    MESSAGE_LINK_HEALTH_DATA_ID, MESSAGE_TEST_RATIO_DATA_ID, MESSAGE_PLATFORM_HEALTH_DATA_ID, MESSAGE_IDENTITY_DATA_ID,
    MESSAGE_STATE_ESTIMATE_DATA_ID};

/* Any number of missing samples is coasted through, so as many lost frames are tolerated as can be told from a frame
 * that is repeated or one step late (which a sample's time would tell, too). */
static const e2e_tolerance_t tolerance = {13u, 14u, 0u};

/* Of commands few may be missing, so that one that is sent again later, of the last dozen, is told from a new one. */
static const e2e_tolerance_t command_tolerance = {3u, 14u, 0u};

/* A new session of the sender: its counters may start anywhere. */
static void start_session(link_t *link)
{
    e2e_receiver_init(&link->lever_receiver, (uint8_t)MESSAGE_LEVER_SAMPLE_DATA_ID, tolerance);
    e2e_receiver_init(&link->base_receiver, (uint8_t)MESSAGE_BASE_SAMPLE_DATA_ID, tolerance);
    e2e_receiver_init(&link->grip_receiver, (uint8_t)MESSAGE_GRIP_SAMPLE_DATA_ID, tolerance);
    link->has_lever_sample = false;
    link->has_grip_sample = false;
    link->set_us = LONG_AGO_US;
    link->parts = (uint8_t)PARTS;
}

void link_init(link_t *link, const lever_settings_t *settings)
{
    link->period_us = microseconds_of(settings->sample_period);
    link->publish_us = microseconds_of(settings->publish_period);
    link->identity_us = LONG_AGO_US;
    link->frequency = (uint8_t)MESSAGE_FEEDTHROUGH_LOWEST;
    link->settings_crc = lever_settings_crc(settings);
    e2e_receiver_init(&link->command_receiver, (uint8_t)MESSAGE_COMMAND_DATA_ID, command_tolerance);
    start_session(link);
}

/* --- in -------------------------------------------------------------------------------------------------------- */

/* E2E check; counts what is refused. */
static bool accept(e2e_receiver_t *receiver, estimator_t *estimator, const lever_frame_t *frame)
{
    const e2e_status_t status = e2e_check(receiver, frame);
    const bool usable = e2e_is_usable(status);
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

static enum lever_frame_result on_grip_sample(link_t *link, const lever_frame_t *frame)
{
    link->has_grip_sample = message_grip_sample_decode(&link->grip_sample, frame);
    link->grip_counter = e2e_counter(frame);
    return LEVER_FRAME_TAKEN;
}

/* At an end of its range a sender has saturated: what it measures is beyond. */
static bool is_measured(bool valid, float value, float most)
{
    return valid && (fabsf(value) < most);
}

/* Completes the sample with the LEVER_SAMPLE and GRIP_SAMPLE of the same counter, as far as they have come. When the
 * counters have gone round since the last sample, those may be of another one. */
static enum lever_frame_result on_base_sample(link_t *link, estimator_t *estimator, const lever_frame_t *frame)
{
    message_base_sample_t base;
    (void)message_base_sample_decode(&base, frame);
    const bool gone_round =
        (estimator->mode != LEVER_MODE_INIT) && ((base.time_us - link->time_us) >= (COUNTERS * link->period_us));
    const bool paired = !gone_round && link->has_lever_sample && (link->lever_counter == e2e_counter(frame));
    const bool gripped = !gone_round && link->has_grip_sample && (link->grip_counter == e2e_counter(frame));
    const message_lever_sample_t *lever = &link->lever_sample;
    lever_sample_t *sample = &link->sample;
    sample->time_us = base.time_us;
    sample->z_ddot = base.z_ddot;
    sample->z_ddot_valid = is_measured(base.z_ddot_valid, base.z_ddot, MESSAGE_Z_DDOT_MOST);
    sample->theta = lever->theta;
    sample->theta_dot = lever->theta_dot;
    sample->tau_m = lever->tau_m;
    sample->theta_valid = paired && is_measured(lever->theta_valid, lever->theta, MESSAGE_THETA_MOST);
    sample->theta_dot_valid = paired && is_measured(lever->theta_dot_valid, lever->theta_dot, MESSAGE_THETA_DOT_MOST);
    sample->tau_m_valid = paired && is_measured(lever->tau_m_valid, lever->tau_m, MESSAGE_TAU_M_MOST);
    sample->grip_force = link->grip_sample.grip_force;
    sample->grip_force_valid = gripped && link->grip_sample.grip_force_valid;
    estimator->lost += paired ? 0u : 1u;
    link->has_lever_sample = false;
    link->has_grip_sample = false;
    link->has_sample = true;
    return LEVER_FRAME_SAMPLE;
}

/* The sequence of commands. A second after the last accepted one it goes on anywhere, but with a counter that follows that
 * of the command before, refused or not, and is not that of the last accepted one: a sender that hangs repeats its own. A
 * refused one does not advance the sequence. */
static bool is_in_sequence(lever_t *lever, const lever_frame_t *frame)
{
    e2e_receiver_t *receiver = &lever->link.command_receiver;
    const e2e_receiver_t before = *receiver;
    const uint8_t counter = e2e_counter(frame);
    const uint8_t next = (uint8_t)((lever->link.command_counter + 1u) & (COUNTERS - 1u));
    const bool resumes = torque_gate_is_abandoned(&lever->gate) && !receiver->waiting;
    const bool follows = (counter == next) && (counter != receiver->last_counter);
    if (resumes) {
        e2e_receiver_init(receiver, (uint8_t)MESSAGE_COMMAND_DATA_ID, command_tolerance);
    }
    const bool in_sequence = e2e_is_usable(e2e_check(receiver, frame)) && (follows || !resumes);
    if (!in_sequence) {
        *receiver = before;
    }
    return in_sequence;
}

/* Does what the frame asks for and says what became of it; with a correct CRC. */
static enum message_result obey(lever_t *lever, const lever_frame_t *frame)
{
    lever_command_t command = {.dither_rms = 0.0f};
    enum message_result result = MESSAGE_RESULT_SEQUENCE;
    (void)message_command_decode(&command, frame);
    if (!is_in_sequence(lever, frame)) {
        lever->estimator.late++;
        instance_end(lever, &command); /* what ends something is obeyed in any order */
    } else {
        result = instance_command(lever, &command);
        lever->estimator.corrupt += (result == MESSAGE_RESULT_ACCEPTED) ? 0u : 1u;
        if ((result == MESSAGE_RESULT_ACCEPTED) && (command.request == (uint8_t)LEVER_REQUEST_RESET)) {
            start_session(&lever->link);
        }
    }
    return result;
}

static bool is_intact(const lever_frame_t *frame, enum message_data_id data_id)
{
    e2e_receiver_t receiver;
    e2e_receiver_init(&receiver, (uint8_t)data_id, tolerance);
    return e2e_check(&receiver, frame) == E2E_INITIAL;
}

static void answer(link_t *link, const lever_frame_t *command, uint8_t result)
{
    link->command_counter = e2e_counter(command);
    link->command_result = result;
    link->due |= (uint16_t)BIT(OUTPUT_COMMAND_ACK);
}

void link_refuse(lever_t *lever, const lever_frame_t *command, uint8_t result)
{
    if (is_intact(command, MESSAGE_COMMAND_DATA_ID)) {
        answer(&lever->link, command, result);
    }
    lever->estimator.corrupt++;
    lever->estimator.communication_fault = true;
}

static enum lever_frame_result on_command(lever_t *lever, const lever_frame_t *frame)
{
    enum lever_frame_result outcome = LEVER_FRAME_REFUSED;
    if (is_intact(frame, MESSAGE_COMMAND_DATA_ID)) {
        const enum message_result result = obey(lever, frame);
        answer(&lever->link, frame, (uint8_t)result);
        outcome = (result == MESSAGE_RESULT_ACCEPTED) ? LEVER_FRAME_TAKEN : LEVER_FRAME_REFUSED;
    } else {
        lever->estimator.corrupt++;
    }
    return outcome;
}

/* Nobody but an estimator sends this, and what an instance sends it does not receive. */
static enum lever_frame_result on_identity(lever_t *lever, const lever_frame_t *frame)
{
    const bool intact = is_intact(frame, MESSAGE_IDENTITY_DATA_ID);
    if (intact) {
        lever->link.duplicate_us = DUPLICATE_US;
    } else {
        lever->estimator.corrupt++;
    }
    return intact ? LEVER_FRAME_TAKEN : LEVER_FRAME_REFUSED;
}

enum lever_frame_result link_on_frame(lever_t *lever, const lever_frame_t *frame)
{
    link_t *link = &lever->link;
    estimator_t *estimator = &lever->estimator;
    enum lever_frame_result result = LEVER_FRAME_REFUSED;
    if (frame->id == (uint32_t)MESSAGE_LEVER_SAMPLE_ID) {
        if (accept(&link->lever_receiver, estimator, frame)) {
            result = on_lever_sample(link, frame);
        }
    } else if (frame->id == (uint32_t)MESSAGE_BASE_SAMPLE_ID) {
        if (accept(&link->base_receiver, estimator, frame)) {
            result = on_base_sample(link, estimator, frame);
        }
    } else if (frame->id == (uint32_t)MESSAGE_GRIP_SAMPLE_ID) {
        if (accept(&link->grip_receiver, estimator, frame)) {
            result = on_grip_sample(link, frame);
        }
    } else if (frame->id == (uint32_t)MESSAGE_COMMAND_ID) {
        result = on_command(lever, frame);
    } else if (frame->id == (uint32_t)MESSAGE_IDENTITY_ID) {
        result = on_identity(lever, frame);
    } else {
        result = LEVER_FRAME_IGNORED;
    }
    if (result == LEVER_FRAME_REFUSED) {
        estimator->communication_fault = true;
    }
    return result;
}

/* --- step ------------------------------------------------------------------------------------------------------ */

/* The divided messages that are due, as bits. A set of them is spread evenly over publish_period, so that no sample has
 * to answer with all of them. */
static uint32_t divided_due(link_t *link)
{
    uint32_t due = 0u;
    if (link->set_us >= link->publish_us) {
        for (; link->parts < (uint8_t)PARTS; link->parts++) { /* of the set before */
            due |= parts[link->parts];
        }
        link->set_us = 0u;
        link->parts = 0u;
    }
    for (; (link->parts < (uint8_t)PARTS) && ((link->set_us * PARTS) >= (link->publish_us * link->parts));
        link->parts++) {
        due |= parts[link->parts];
    }
    return due;
}

/* Time for publication is that of the samples; while their clock stands, a sample is a sample period. */
static void pass_time(link_t *link, uint32_t time_us)
{
    const uint32_t step_us = time_us - link->time_us;
    const bool advances = (step_us != 0u) && (step_us < HALF_TURN_OF_TIME);
    const uint32_t elapsed_us = advances ? step_us : link->period_us;
    link->time_us = time_us;
    link->set_us += elapsed_us;
    link->identity_us += elapsed_us;
    link->duplicate_us = time_left(link->duplicate_us, elapsed_us);
    if (link->identity_us >= IDENTITY_US) {
        link->identity_us = 0u;
        link->pages = (uint8_t)EVERY_PAGE;
    }
}

enum lever_mode link_step(lever_t *lever)
{
    link_t *link = &lever->link;
    if (link->has_sample) {
        const bool was_driving = instance_is_driving(lever);
        const bool mitigates = lever->bounce.mitigates;
        link->has_sample = false;
        (void)instance_update(lever, &link->sample);
        pass_time(link, link->sample.time_us);
        link->latched |= instance_faults(lever);
        uint32_t due = BIT(OUTPUT_STATE_ESTIMATE) | divided_due(link);
        due |= (was_driving || instance_is_driving(lever)) ? BIT(OUTPUT_MOTOR_COMMAND) : 0u;
        due |= mitigates ? BIT(OUTPUT_CORRECTION) : 0u;
        due |= (link->pages != 0u) ? BIT(OUTPUT_IDENTITY) : 0u;
        due &= (lever->has_platform || lever->settings_changed) ? UINT32_MAX : ~BIT(OUTPUT_PLATFORM);
        due &= (lever->estimator.setup.settings->publish_test_ratios > 0.0f) ? UINT32_MAX : ~BIT(OUTPUT_TEST_RATIO);
        due &= (lever->bounce.aircraft != NULL) ? UINT32_MAX : ~BIT(OUTPUT_STABILITY);
        link->due = (uint16_t)(link->due | due);
    }
    return lever->estimator.mode;
}

void link_idle(lever_t *lever, uint32_t elapsed_us)
{
    link_t *link = &lever->link;
    link->duplicate_us = time_left(link->duplicate_us, elapsed_us);
    if (instance_is_driving(lever)) {
        link->due |= (uint16_t)BIT(OUTPUT_MOTOR_COMMAND);
    }
    if (lever->bounce.mitigation.weight > 0.0f) {
        link->due |= (uint16_t)BIT(OUTPUT_CORRECTION);
    }
}

/* --- out ------------------------------------------------------------------------------------------------------- */

/* The first message that is due, of some. */
static uint32_t first_of(uint32_t due)
{
    uint32_t output = 0u;
    if (due == BIT(OUTPUT_STATE_ESTIMATE)) {
        output = (uint32_t)OUTPUT_STATE_ESTIMATE; /* mostly */
    } else {
        for (uint32_t rest = due; (rest & 1u) == 0u; rest >>= 1u) {
            output++;
        }
    }
    return output;
}

bool link_next_frame(lever_t *lever, lever_frame_t *frame)
{
    link_t *link = &lever->link;
    bool sent = false;
    while ((link->due != 0u) && !sent) {
        const uint32_t due = link->due;
        const uint32_t output = first_of(due);
        link->due = (uint16_t)(due & (due - 1u)); /* all but the lowest bit */
        sent = link_encode(lever, (enum link_output)output, frame);
        if (sent) {
            e2e_protect(frame, data_ids[output], link->counter[output]);
            link->counter[output] = (uint8_t)((link->counter[output] + 1u) & 15u);
        }
    }
    return sent;
}
