#include "port/command_guard.h"

#include <stddef.h>
#include <string.h>

#include "can/messages.h"

enum { FRAME_BYTES = 8, FRESHNESS_BYTES = 3 };

/* Nothing changes but that something ends: dither, mitigation, learning, or the estimate with all of them. */
static bool is_harmless(const lever_command_t *command)
{
    const uint8_t keep = (uint8_t)LEVER_KEEP;

    return (command->request != (uint8_t)LEVER_REQUEST_RUN) && (command->request <= (uint8_t)LEVER_REQUEST_RESET) &&
           (command->model == keep) && (command->preload == keep) && (command->estimator == keep) &&
           (command->adaptation == keep) &&
           ((command->mitigation == keep) || (command->mitigation == (uint8_t)LEVER_MITIGATION_NONE)) &&
           ((command->dither_rms >= (float)LEVER_KEEP) || (command->dither_rms <= 0.0f));
}

/* Writes a number into so many bytes, most significant first. */
static void put(uint8_t *bytes, uint32_t count, uint64_t value)
{
    uint64_t rest = value;

    for (uint32_t i = count; i > 0u; i--) {
        bytes[i - 1u] = (uint8_t)rest;
        rest >>= 8u;
    }
}

/* With the authenticator that came before it, which serves once. */
static bool is_authentic(command_guard_t *guard, const lever_frame_t *frame)
{
    const command_authentication_t *const by = guard->authentication;
    const uint8_t *const code = guard->authenticator;
    const uint32_t low = ((uint32_t)code[0] << 16u) | ((uint32_t)code[1] << 8u) | (uint32_t)code[2];
    uint8_t data[COMMAND_GUARD_DATA];
    uint64_t freshness = 0u;
    bool authentic = false;

    if (guard->has_authenticator && (frame->length == (uint8_t)FRAME_BYTES) &&
        by->freshness(by->self, low, &freshness)) {
        put(data, 2u, frame->id);
        (void)memcpy(&data[2], frame->data, FRAME_BYTES);
        put(&data[10], 8u, freshness);
        authentic = by->verify(by->self, data, &code[FRESHNESS_BYTES]);
    }
    guard->has_authenticator = false;
    if (authentic) {
        by->accepted(by->self, freshness);
    }
    return authentic;
}

/* Whether a COMMAND may change something now. */
static enum message_result judge_change(const command_guard_t *guard)
{
    enum message_result result = MESSAGE_RESULT_ACCEPTED;

    if (!guard->takes_commands) {
        result = MESSAGE_RESULT_DISABLED;
    } else if (lever_is_acting(guard->lever)) {
        result = MESSAGE_RESULT_ACTING;
    } else if ((guard->is_safe != NULL) && !guard->is_safe(guard->self)) {
        result = MESSAGE_RESULT_NOT_SAFE;
    } else {
        /* it may */
    }
    return result;
}

static bool may_pass(command_guard_t *guard, const lever_frame_t *frame)
{
    lever_command_t command;
    enum message_result result = MESSAGE_RESULT_ACCEPTED;

    if ((guard->authentication != NULL) && !is_authentic(guard, frame)) {
        result = MESSAGE_RESULT_NOT_AUTHENTIC;
    } else if (message_command_decode(&command, frame) && !is_harmless(&command)) {
        result = judge_change(guard);
    } else {
        /* what is no COMMAND is refused by the estimator */
    }
    if (result != MESSAGE_RESULT_ACCEPTED) {
        lever_refuse(guard->lever, frame, (uint8_t)result);
    }
    return result == MESSAGE_RESULT_ACCEPTED;
}

static bool is_authenticator(command_guard_t *guard, const lever_frame_t *frame)
{
    const bool is = (guard->authentication != NULL) && (frame->id == guard->authentication->id);

    if (is) {
        guard->has_authenticator = (frame->length == (uint8_t)FRAME_BYTES);
        (void)memcpy(guard->authenticator, frame->data, FRAME_BYTES);
    }
    return is;
}

enum port_result command_guard_receive(void *self, lever_frame_t *frame)
{
    command_guard_t *const guard = self; /* cppcheck-suppress misra-c2012-11.5 ; D11 */

    const enum port_result result = guard->receive(guard->self, frame);

    if ((result == PORT_DONE) && !is_authenticator(guard, frame) && (frame->id == (uint32_t)MESSAGE_COMMAND_ID) &&
        !may_pass(guard, frame)) {
        frame->id = COMMAND_GUARD_NOBODY;
    }
    return result;
}
