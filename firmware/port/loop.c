#include "port/loop.h"

#include <stddef.h>
#include <string.h>

#include "can/messages.h"

static uint32_t now_us(const loop_t *loop)
{
    return loop->port->now_us(loop->port->self);
}

static bool is_stale(const loop_t *loop)
{
    return !loop->lock_step && PORT_GOES_STALE(loop->frame.id) &&
           ((now_us(loop) - loop->frame_us) > (1000u * (uint32_t)PORT_STALE_MS));
}

/* Sends the frame that is held or has just been fetched; PORT_NOTHING if it is held now. */
static enum port_result send_frame(loop_t *loop)
{
    enum port_result result = PORT_DONE;

    if (is_stale(loop)) {
        loop->totals.stale++;
    } else {
        result = loop->port->send(loop->port->self, &loop->frame);
        loop->totals.sent += (result == PORT_DONE) ? 1u : 0u;
        if ((result == PORT_NOTHING) && (loop->policy == LOOP_DROP)) {
            loop->totals.dropped++;
            result = PORT_DONE;
        }
    }
    loop->totals.held += ((result == PORT_NOTHING) && !loop->is_held) ? 1u : 0u;
    loop->is_held = result != PORT_DONE;
    return result;
}

/* Sends what the estimator has to say: PORT_DONE when that is all out. */
static enum port_result send_answers(loop_t *loop)
{
    enum port_result result = PORT_DONE;

    if (loop->is_held) {
        result = send_frame(loop);
    }
    while ((result == PORT_DONE) && lever_next_frame(loop->lever, &loop->frame)) {
        loop->frame_us = loop->cause_us;
        result = send_frame(loop);
    }
    return result;
}

static void take(loop_t *loop, const lever_frame_t *frame, uint32_t now)
{
    const port_t *port = loop->port;
    lever_platform_t status;

    loop->totals.received++;
    loop->cause_us = loop->empty_us;
    if (lever_on_frame(loop->lever, frame) == LEVER_FRAME_SAMPLE) {
        if (port->status != NULL) {
            port->status(port->self, &status);
            lever_platform(loop->lever, &status);
        }
        loop->totals.samples++;
        loop->sample_us = now;
        loop->mode = lever_step(loop->lever);
    }
}

/* Tells the estimator that no sample comes. */
static void supervise(loop_t *loop, uint32_t now)
{
    if (!loop->lock_step && ((now - loop->sample_us) >= (1000u * (uint32_t)LOOP_IDLE_MS))) {
        lever_idle(loop->lever, now - loop->sample_us);
        loop->sample_us = now;
        loop->cause_us = now;
    }
}

static enum port_result exchange(loop_t *loop, uint32_t now, bool *received)
{
    lever_frame_t frame;
    enum port_result result = send_answers(loop);

    if (result == PORT_DONE) {
        result = loop->port->receive(loop->port->self, &frame);
        *received = result == PORT_DONE;
        if (*received) {
            take(loop, &frame, now);
            result = send_answers(loop);
        } else {
            loop->empty_us = now;
        }
    }
    return result;
}

/* A link that has just been lost, or is to be tried again when the pause is over. */
static enum port_result restore(loop_t *loop, uint32_t now)
{
    enum port_result result = PORT_DOWN;

    if (!loop->is_down) {
        loop->totals.outages++;
        loop->tried_us = now;
        loop->pause_ms = LOOP_BACKOFF_FIRST_MS;
    } else if ((now - loop->tried_us) >= (1000u * loop->pause_ms)) {
        result = loop->port->restore(loop->port->self);
        loop->tried_us = now;
        const uint32_t doubled = 2u * loop->pause_ms;
        loop->pause_ms = (doubled < (uint32_t)LOOP_BACKOFF_LAST_MS) ? doubled : (uint32_t)LOOP_BACKOFF_LAST_MS;
    } else {
        /* not yet */
    }
    loop->is_down = result == PORT_DOWN;
    return result;
}

/* The end of a turn that has received something, or not. False: wait() asks to end. */
static bool rest(loop_t *loop, bool received)
{
    const port_t *port = loop->port;
    bool going = true;

    loop->batch = received ? (loop->batch + 1u) : (uint32_t)LOOP_BATCH;
    if (loop->is_down) {
        going = port->wait(port->self, false, LOOP_IDLE_MS);
    } else if (loop->is_held) {
        going = port->wait(port->self, false, LOOP_RETRY_MS);
    } else if (!received) {
        going = port->wait(port->self, true, loop->lock_step ? -1 : (int32_t)LOOP_IDLE_MS);
    } else if (loop->batch >= (uint32_t)LOOP_BATCH) {
        going = port->wait(port->self, true, 0);
    } else {
        /* the next frame may already be there */
    }
    loop->batch %= (uint32_t)LOOP_BATCH;
    return going;
}

void loop_init(loop_t *loop, const port_t *port, lever_t *lever, enum loop_policy policy)
{
    (void)memset(loop, 0, sizeof *loop);
    loop->port = port;
    loop->lever = lever;
    loop->policy = policy;
    loop->mode = LEVER_MODE_INIT;
    loop->empty_us = now_us(loop);
    loop->sample_us = loop->empty_us;
}

enum port_result loop_turn(loop_t *loop)
{
    const uint32_t now = now_us(loop);
    const bool was_down = loop->is_down;
    bool received = false;
    enum port_result result = PORT_DOWN;

    supervise(loop, now);
    if (!was_down) {
        result = exchange(loop, now, &received);
    }
    if ((result == PORT_DOWN) && (loop->port->restore != NULL)) {
        result = restore(loop, now);
    }
    if (loop->is_down || ((result >= PORT_NOTHING) && !was_down)) {
        result = rest(loop, received) ? PORT_DONE : PORT_NOTHING;
    }
    return result;
}
