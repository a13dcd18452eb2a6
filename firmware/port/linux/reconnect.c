#include "port/linux/reconnect.h"

#include <stddef.h>
#include <string.h>

static uint32_t now_us(void *self)
{
    const reconnect_t *reconnect = self;

    return reconnect->medium.now_us(reconnect->medium.self);
}

/* Until the next attempt [ms], rounded up; 0: now. */
static uint32_t remaining_ms(reconnect_t *reconnect)
{
    const uint32_t pause_us = 1000u * reconnect->pause_ms;
    const uint32_t elapsed_us = now_us(reconnect) - reconnect->tried_us;

    return (elapsed_us < pause_us) ? ((pause_us - elapsed_us + 999u) / 1000u) : 0u;
}

static void change(reconnect_t *reconnect, bool is_down)
{
    reconnect->is_down = is_down;
    if (reconnect->on_change != NULL) {
        reconnect->on_change(reconnect->context, is_down);
    }
}

/* PORT_DONE: the link is there, if need be after an attempt to restore it. */
static enum port_result restored(reconnect_t *reconnect)
{
    enum port_result result = PORT_DONE;

    if (reconnect->is_down && (remaining_ms(reconnect) > 0u)) {
        result = PORT_NOTHING;
    } else if (reconnect->is_down) {
        result = reconnect->restore(reconnect->medium.self);
        if (result == PORT_DONE) {
            change(reconnect, false);
        }
        reconnect->tried_us = now_us(reconnect);
        reconnect->pause_ms =
            (reconnect->pause_ms < (RECONNECT_LAST_MS / 2)) ? (2u * reconnect->pause_ms) : RECONNECT_LAST_MS;
        result = (result == PORT_DOWN) ? PORT_NOTHING : result;
    } else {
        /* as it was */
    }
    return result;
}

/* What the medium has said; that the link is lost begins an outage. */
static enum port_result said(reconnect_t *reconnect, enum port_result result)
{
    if (result == PORT_DOWN) {
        change(reconnect, true);
        reconnect->outages++;
        reconnect->pause_ms = RECONNECT_FIRST_MS;
        reconnect->tried_us = now_us(reconnect);
        result = PORT_NOTHING;
    }
    return result;
}

static enum port_result receive_frame(void *self, lever_frame_t *frame)
{
    reconnect_t *reconnect = self;
    const enum port_result result = restored(reconnect);

    return (result == PORT_DONE) ? said(reconnect, reconnect->medium.receive(reconnect->medium.self, frame)) : result;
}

static enum port_result send_frame(void *self, const lever_frame_t *frame)
{
    reconnect_t *reconnect = self;
    const enum port_result result = restored(reconnect);

    return (result == PORT_DONE) ? said(reconnect, reconnect->medium.send(reconnect->medium.self, frame)) : result;
}

/* A lost link has no frame to wait for. */
static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    reconnect_t *reconnect = self;
    int32_t longest_ms = timeout_ms;

    if (reconnect->is_down) {
        const int32_t pause_ms = (int32_t)remaining_ms(reconnect);
        longest_ms = ((timeout_ms < 0) || (pause_ms < timeout_ms)) ? pause_ms : timeout_ms;
    }
    return reconnect->medium.wait(reconnect->medium.self, for_frame && !reconnect->is_down, longest_ms);
}

port_t reconnect_port(reconnect_t *reconnect, const port_t *medium, enum port_result (*restore)(void *self))
{
    const port_t port = {
        .self = reconnect, .receive = receive_frame, .send = send_frame, .wait = wait_frame, .now_us = now_us};

    (void)memset(reconnect, 0, sizeof *reconnect);
    reconnect->medium = *medium;
    reconnect->restore = restore;
    return port;
}
