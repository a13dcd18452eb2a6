/* A port on which this program is the host of an SLCAN adapter: a USB-serial one, say, with a real CAN bus behind it.
 *
 * It closes the adapter's channel, sets 1 Mbit/s, opens it, and closes it at the end. It does not wait for the
 * adapter's answers, because not every adapter gives them; it counts those that refuse.
 */
#ifndef LEVER_PORT_SLCAN_HOST_H
#define LEVER_PORT_SLCAN_HOST_H

#include <stdbool.h>
#include <stdint.h>

#include "port/linux/tty.h"
#include "port/port.h"
#include "port/slcan/slcan.h"

typedef struct slcan_host {
    uint32_t identifiers; /* port/identifiers.h */
    tty_t tty;
    slcan_line_t line;
    bool has_sent;    /* a frame, at least */
    uint32_t refused; /* answers of the adapter that refuse (BEL), since the first frame was sent */
} slcan_host_t;

/* Opens `device` as tty_open_device() does, and the channel of the adapter there; host->tty.reason says what is
 * wrong. */
bool slcan_host_open(slcan_host_t *host, const char *device, uint32_t identifiers, int stop);

/* Closes the channel and releases what open has taken; also right after a failed open. */
void slcan_host_close(slcan_host_t *host);

/* The port; it refers to `host`, which must outlive it. */
port_t slcan_host_port(slcan_host_t *host);

#endif
