/* A port on which this program is an SLCAN adapter (port/slcan/slcan.h): its host, such as python-can's slcan or
 * slcand, is at the other end of a pseudo-terminal or serial line, and hears and feeds the estimator as if that were on
 * a bus.
 *
 * What the host does not read finds no room, and is counted in peer->slcan.counts: for a loop that drops it
 * (LOOP_DROP).
 */
#ifndef LEVER_PORT_SLCAN_PEER_H
#define LEVER_PORT_SLCAN_PEER_H

#include <stdbool.h>

#include "port/linux/tty.h"
#include "port/port.h"
#include "port/slcan/slcan.h"

typedef struct slcan_peer {
    uint32_t identifiers; /* port/identifiers.h */
    tty_t tty;
    slcan_t slcan;
} slcan_peer_t;

/* Open as tty_open_pty() and tty_open_device() do; peer->tty.reason says what is wrong. */
bool slcan_peer_open_pty(slcan_peer_t *peer, const char *link, uint32_t identifiers, int stop);
bool slcan_peer_open_device(slcan_peer_t *peer, const char *device, uint32_t identifiers, int stop);

/* Releases what open has taken; also right after a failed open. */
void slcan_peer_close(slcan_peer_t *peer);

/* The port; it refers to `peer`, which must outlive it and stay where it is since it was opened. */
port_t slcan_peer_port(slcan_peer_t *peer);

#endif
