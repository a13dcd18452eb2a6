/* A port over a SocketCAN interface: classic frames, through a raw socket. */
#ifndef LEVER_PORT_SOCKETCAN_H
#define LEVER_PORT_SOCKETCAN_H

#include <net/if.h>
#include <stdbool.h>
#include <stdint.h>

#include "port/port.h"

typedef struct socketcan {
    char interface[IF_NAMESIZE];
    uint32_t identifiers;        /* port/identifiers.h */
    int socket;                  /* -1: none */
    int stop;                    /* descriptor that becomes readable when the loop is to end; not owned */
    uint32_t overflow;           /* received frames that the kernel had no room for, in all */
    uint32_t overflow_of_socket; /* the part of it that the present socket has counted */
    const char *bus_state;       /* the last condition of the bus that was reported, NULL: none */
    void (*on_bus_state)(void *context, const char *words); /* bus-off and the like, once a change; may be NULL */
    void *context;
    char reason[256]; /* of the last failure, in words; never empty after one */
} socketcan_t;

/* Opens `interface` ("vcan0"), which must exist and be up. `stop` is a descriptor, see stop.h. Returns false when that
 * cannot be done; socketcan->reason then says, in one line, what is wrong and what to do. */
bool socketcan_open(socketcan_t *socketcan, const char *interface, uint32_t identifiers, int stop);

/* Releases what open has taken; also right after a failed open. */
void socketcan_close(socketcan_t *socketcan);

/* The port; it refers to `socketcan`, which must outlive it. What the kernel has taken of it can no longer be dropped:
 * a queue of ten frames on a usual CAN interface (txqueuelen). */
port_t socketcan_port(socketcan_t *socketcan);

#endif
