#include "port/linux/slcan_host.h"

#include <string.h>

#include "can/messages.h"
#include "port/linux/clock.h"

/* Ends what the adapter may have had of a line, and goes on the bus at 1 Mbit/s. The first C is refused if the channel
 * was closed, which is as good. */
static const char opening[] = "\r\rC\rS8\rO\r";
static const char closing[] = "C\r";

bool slcan_host_open(slcan_host_t *host, const char *device, uint32_t identifiers, int stop)
{
    (void)memset(host, 0, sizeof *host);
    host->identifiers = identifiers;
    return tty_open_device(&host->tty, device, stop) && tty_put(&host->tty, opening, (sizeof opening) - 1u);
}

void slcan_host_close(slcan_host_t *host)
{
    if (host->tty.file >= 0) {
        (void)tty_put(&host->tty, closing, (sizeof closing) - 1u);
        (void)tty_flush(&host->tty);
    }
    tty_close(&host->tty);
}

static enum port_result receive_frame(void *self, lever_frame_t *frame)
{
    slcan_host_t *host = self;
    slcan_frame_t received;
    uint8_t byte = 0u;

    for (uint32_t bytes = 0u; bytes < (uint32_t)TTY_IN_BYTES; bytes++) {
        const enum port_result result = tty_take(&host->tty, &byte);
        if (result != PORT_DONE) {
            return result;
        }
        const enum slcan_end end = slcan_line_take(&host->line, byte);
        if ((end == SLCAN_BEL) && host->has_sent) {
            host->refused++;
        }
        if ((end == SLCAN_CR) && slcan_read_frame(&host->line, true, &received) &&
            slcan_is_ours(&received, host->identifiers, frame)) {
            return PORT_DONE;
        }
    }
    return PORT_NOTHING;
}

static enum port_result send_frame(void *self, const lever_frame_t *frame)
{
    slcan_host_t *host = self;
    const slcan_frame_t sent = slcan_shifted(frame, host->identifiers);
    char text[SLCAN_LINE_BYTES];
    const uint32_t length = slcan_write_frame(&sent, SLCAN_NO_TIME, text);

    if ((PORT_GOES_STALE(frame->id) && tty_is_slow(&host->tty)) || !tty_put(&host->tty, text, length)) {
        return PORT_NOTHING;
    }
    host->has_sent = true;
    return PORT_DONE;
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    slcan_host_t *host = self;

    return tty_wait(&host->tty, for_frame, timeout_ms);
}

static enum port_result restore_link(void *self)
{
    slcan_host_t *host = self;
    const enum port_result result = tty_restore(&host->tty);

    if (result == PORT_DONE) {
        (void)memset(&host->line, 0, sizeof host->line);
        (void)tty_put(&host->tty, opening, (sizeof opening) - 1u);
    }
    return result;
}

port_t slcan_host_port(slcan_host_t *host)
{
    const port_t port = {.self = host,
        .receive = receive_frame,
        .send = send_frame,
        .wait = wait_frame,
        .now_us = clock_now_us,
        .restore = restore_link};

    return port;
}
