#define _POSIX_C_SOURCE 200809L

#include "port/linux/slcan_peer.h"

#include <string.h>
#include <time.h>

static bool put(void *self, const char *text, uint32_t length)
{
    return tty_put(self, text, length);
}

static void start(slcan_peer_t *peer)
{
    const slcan_sink_t sink = {.self = &peer->tty, .put = put};
    const slcan_identity_t identity = {.version = LEVER_SLCAN_VERSION, .serial = "LCAN"};

    slcan_init(&peer->slcan, &sink, &identity);
}

bool slcan_peer_open_pty(slcan_peer_t *peer, const char *link, int stop)
{
    start(peer);
    return tty_open_pty(&peer->tty, link, stop);
}

bool slcan_peer_open_device(slcan_peer_t *peer, const char *device, int stop)
{
    start(peer);
    return tty_open_device(&peer->tty, device, stop);
}

void slcan_peer_close(slcan_peer_t *peer)
{
    (void)tty_flush(&peer->tty);
    tty_close(&peer->tty);
}

/* --- callbacks --------------------------------------------------------------------------------------------------- */

static enum transport_result receive_frame(void *self, lever_frame_t *frame)
{
    slcan_peer_t *peer = self;
    slcan_frame_t received;
    uint8_t byte = 0u;

    for (uint32_t bytes = 0u; bytes < (uint32_t)TTY_IN_BYTES; bytes++) {
        const enum transport_result result = tty_take(&peer->tty, &byte);
        if (result != TRANSPORT_OK) {
            if (result == TRANSPORT_DOWN) {
                slcan_hang_up(&peer->slcan);
            }
            return result;
        }
        if (slcan_take(&peer->slcan, byte, &received) && !received.extended && !received.remote) {
            *frame = received.frame;
            return TRANSPORT_OK;
        }
    }
    return TRANSPORT_EMPTY;
}

static enum transport_result send_frame(void *self, const lever_frame_t *frame)
{
    slcan_peer_t *peer = self;
    const slcan_frame_t sent = {.frame = *frame};
    struct timespec now = {.tv_sec = 0};

    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    const uint32_t time_ms = (1000u * (uint32_t)(now.tv_sec % 60)) + (uint32_t)(now.tv_nsec / 1000000);
    (void)slcan_send(&peer->slcan, &sent, time_ms); /* what is dropped is counted there */
    return TRANSPORT_OK;
}

static enum transport_result restore_link(void *self)
{
    slcan_peer_t *peer = self;

    return tty_restore(&peer->tty);
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    slcan_peer_t *peer = self;

    return tty_wait(&peer->tty, for_frame, timeout_ms);
}

static const char *last_reason(void *self)
{
    const slcan_peer_t *peer = self;

    return peer->tty.reason;
}

transport_t slcan_peer_transport(slcan_peer_t *peer)
{
    const transport_t transport = {
        .self = peer,
        .receive = receive_frame,
        .send = send_frame,
        .restore = restore_link,
        .wait = wait_frame,
        .reason = last_reason,
    };

    return transport;
}
