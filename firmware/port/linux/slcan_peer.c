#include "port/linux/slcan_peer.h"

#include "can/messages.h"
#include "port/linux/clock.h"

static bool put(void *self, const char *text, uint32_t length)
{
    return tty_put(self, text, length);
}

static void start(slcan_peer_t *peer)
{
    const slcan_sink_t sink = {.self = &peer->tty, .put = put};
    const slcan_identity_t identity = {.version = SLCAN_VERSION, .serial = "LCAN"};

    slcan_init(&peer->slcan, &sink, &identity);
}

bool slcan_peer_open_pty(slcan_peer_t *peer, const char *link, uint32_t identifiers, int stop)
{
    start(peer);
    peer->identifiers = identifiers;
    return tty_open_pty(&peer->tty, link, stop);
}

bool slcan_peer_open_device(slcan_peer_t *peer, const char *device, uint32_t identifiers, int stop)
{
    start(peer);
    peer->identifiers = identifiers;
    return tty_open_device(&peer->tty, device, stop);
}

void slcan_peer_close(slcan_peer_t *peer)
{
    (void)tty_flush(&peer->tty);
    tty_close(&peer->tty);
}

static enum port_result receive_frame(void *self, lever_frame_t *frame)
{
    slcan_peer_t *peer = self;
    slcan_frame_t received;
    uint8_t byte = 0u;

    for (uint32_t bytes = 0u; bytes < (uint32_t)TTY_IN_BYTES; bytes++) {
        const enum port_result result = tty_take(&peer->tty, &byte);
        if (result != PORT_DONE) {
            if (result == PORT_DOWN) {
                slcan_hang_up(&peer->slcan);
            }
            return result;
        }
        if (slcan_take(&peer->slcan, byte, &received) && slcan_is_ours(&received, peer->identifiers, frame)) {
            return PORT_DONE;
        }
    }
    return PORT_NOTHING;
}

static enum port_result send_frame(void *self, const lever_frame_t *frame)
{
    slcan_peer_t *peer = self;
    const slcan_frame_t sent = slcan_shifted(frame, peer->identifiers);

    if (PORT_GOES_STALE(frame->id) && tty_is_slow(&peer->tty)) {
        return PORT_NOTHING;
    }
    return slcan_send(&peer->slcan, &sent, clock_now_ms()) ? PORT_DONE : PORT_NOTHING;
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    slcan_peer_t *peer = self;

    return tty_wait(&peer->tty, for_frame, timeout_ms);
}

static enum port_result restore_link(void *self)
{
    slcan_peer_t *peer = self;

    return tty_restore(&peer->tty);
}

port_t slcan_peer_port(slcan_peer_t *peer)
{
    const port_t port = {.self = peer,
        .receive = receive_frame,
        .send = send_frame,
        .wait = wait_frame,
        .now_us = clock_now_us,
        .restore = restore_link};

    return port;
}
