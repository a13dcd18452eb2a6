#include "port/linux/loop.h"

#include <string.h>

static void tell(const loop_t *loop, enum loop_event event)
{
    if (loop->on_event != NULL) {
        loop->on_event(loop->context, event);
    }
}

/* Sends what the estimator has to say, until it has no more (OK) or the transport cannot. */
static enum transport_result send_answers(loop_t *loop)
{
    const transport_t *transport = loop->transport;

    while (loop->has_unsent || lever_next_frame(loop->lever, &loop->unsent)) {
        loop->has_unsent = true;
        const enum transport_result result = transport->send(transport->self, &loop->unsent);
        if (result != TRANSPORT_OK) {
            return result;
        }
        loop->has_unsent = false;
        loop->totals.sent++;
    }
    return TRANSPORT_OK;
}

static void take(loop_t *loop, const lever_frame_t *frame)
{
    loop->totals.received++;
    if (lever_on_frame(loop->lever, frame) == LEVER_FRAME_SAMPLE) {
        loop->totals.samples++;
        const enum lever_mode mode = lever_step(loop->lever);
        if (mode != loop->mode) {
            loop->mode = mode;
            tell(loop, LOOP_EVENT_MODE);
        }
    }
}

/* Answers come before anything new, because the next step would replace them. */
static enum transport_result pump(loop_t *loop)
{
    lever_frame_t frame;
    enum transport_result result = send_answers(loop);

    if (result == TRANSPORT_OK) {
        result = loop->transport->receive(loop->transport->self, &frame);
        if (result == TRANSPORT_OK) {
            take(loop, &frame);
        }
    }
    return result;
}

/* Waits for a lost link: OK when it is back, DOWN when the loop is to end meanwhile, BROKEN when it never will be. */
static enum transport_result outlast(loop_t *loop)
{
    const transport_t *transport = loop->transport;
    enum transport_result result = TRANSPORT_DOWN;

    loop->totals.outages++;
    tell(loop, LOOP_EVENT_DOWN);
    int32_t pause_ms = LOOP_BACKOFF_FIRST_MS;
    while ((result == TRANSPORT_DOWN) && transport->wait(transport->self, false, pause_ms)) {
        result = transport->restore(transport->self);
        pause_ms = (pause_ms < (LOOP_BACKOFF_LAST_MS / 2)) ? (2 * pause_ms) : LOOP_BACKOFF_LAST_MS;
    }
    if (result == TRANSPORT_OK) {
        tell(loop, LOOP_EVENT_UP);
    }
    return result;
}

void loop_init(loop_t *loop, const transport_t *transport, lever_t *lever)
{
    (void)memset(loop, 0, sizeof *loop);
    loop->transport = transport;
    loop->lever = lever;
    loop->mode = LEVER_MODE_INIT;
}

bool loop_run(loop_t *loop)
{
    const transport_t *transport = loop->transport;
    enum transport_result result = TRANSPORT_OK;
    uint32_t batch = 0u;
    bool going = true;

    while (going && (result != TRANSPORT_BROKEN)) {
        result = pump(loop);
        switch (result) {
        case TRANSPORT_OK:
            batch = (batch + 1u) % (uint32_t)LOOP_BATCH;
            going = (batch != 0u) || transport->wait(transport->self, true, 0);
            break;
        case TRANSPORT_EMPTY:
            going = transport->wait(transport->self, true, -1);
            break;
        case TRANSPORT_FULL:
            loop->totals.retries++;
            going = transport->wait(transport->self, false, LOOP_RETRY_MS);
            break;
        case TRANSPORT_DOWN:
            result = outlast(loop);
            going = (result == TRANSPORT_OK);
            break;
        case TRANSPORT_BROKEN:
        default:
            going = false;
            break;
        }
    }
    return result != TRANSPORT_BROKEN;
}
