#include "port/linux/slcan_host.h"

#include <string.h>

/* Ends what the adapter may have had of a line, and goes on the bus at 1 Mbit/s. The first C is refused if the channel was
 * closed, which is as good. */
static const char opening[] = "\r\rC\rS8\rO\r";
static const char closing[] = "C\r";

bool slcan_host_open(slcan_host_t *host, const char *device, int stop)
{
    (void)memset(host, 0, sizeof *host);
    return tty_open_device(&host->tty, device, stop) && tty_put(&host->tty, opening, sizeof opening - 1u);
}

void slcan_host_close(slcan_host_t *host)
{
    if (host->tty.file >= 0) {
        (void)tty_put(&host->tty, closing, sizeof closing - 1u);
        (void)tty_flush(&host->tty);
    }
    tty_close(&host->tty);
}

/* --- callbacks --------------------------------------------------------------------------------------------------- */

static enum transport_result receive_frame(void *self, lever_frame_t *frame)
{
    slcan_host_t *host = self;
    slcan_frame_t received;
    uint8_t byte = 0u;

    for (uint32_t bytes = 0u; bytes < (uint32_t)TTY_IN_BYTES; bytes++) {
        const enum transport_result result = tty_take(&host->tty, &byte);
        if (result != TRANSPORT_OK) {
            return result;
        }
        const enum slcan_end end = slcan_line_take(&host->line, byte);
        if ((end == SLCAN_BEL) && host->has_sent) {
            host->refused++;
        }
        if ((end == SLCAN_CR) && slcan_read_frame(&host->line, true, &received) && !received.extended &&
            !received.remote) {
            *frame = received.frame;
            return TRANSPORT_OK;
        }
    }
    return TRANSPORT_EMPTY;
}

static enum transport_result send_frame(void *self, const lever_frame_t *frame)
{
    slcan_host_t *host = self;
    const slcan_frame_t sent = {.frame = *frame};
    char text[SLCAN_LINE_BYTES];

    if (!tty_put(&host->tty, text, slcan_write_frame(&sent, SLCAN_NO_TIME, text))) {
        return TRANSPORT_FULL;
    }
    host->has_sent = true;
    return TRANSPORT_OK;
}

static enum transport_result restore_link(void *self)
{
    slcan_host_t *host = self;
    const enum transport_result result = tty_restore(&host->tty);

    if (result == TRANSPORT_OK) {
        (void)memset(&host->line, 0, sizeof host->line);
        (void)tty_put(&host->tty, opening, sizeof opening - 1u);
    }
    return result;
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    slcan_host_t *host = self;

    return tty_wait(&host->tty, for_frame, timeout_ms);
}

static const char *last_reason(void *self)
{
    const slcan_host_t *host = self;

    return host->tty.reason;
}

transport_t slcan_host_transport(slcan_host_t *host)
{
    const transport_t transport = {
        .self = host,
        .receive = receive_frame,
        .send = send_frame,
        .restore = restore_link,
        .wait = wait_frame,
        .reason = last_reason,
    };

    return transport;
}
