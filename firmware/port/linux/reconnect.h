/* A port whose link may be lost: it says PORT_NOTHING meanwhile, and tries from time to time to restore the link. The
 * estimator behind it only sees that no sample comes. */
#ifndef LEVER_PORT_RECONNECT_H
#define LEVER_PORT_RECONNECT_H

#include <stdbool.h>
#include <stdint.h>

#include "port/port.h"

enum reconnect_limits {
    RECONNECT_FIRST_MS = 10, /* pauses between attempts double from the first ... */
    RECONNECT_LAST_MS = 500  /* ... to the last [ms] */
};

typedef struct reconnect {
    port_t medium; /* whose receive() and send() may say PORT_DOWN */
    enum port_result (*restore)(
        void *self); /* of the medium, one attempt: PORT_DONE, PORT_DOWN (still lost) or PORT_BROKEN */
    void (*on_change)(void *context, bool is_down); /* the link was lost or restored; NULL: nobody listens */
    void *context;
    bool is_down;
    uint32_t pause_ms;
    uint32_t tried_us; /* last attempt, or when the link was lost */
    uint64_t outages;
} reconnect_t;

/* The port that restores `medium`; it refers to `reconnect`, which must outlive it. Set on_change and context
 * afterwards. */
port_t reconnect_port(reconnect_t *reconnect, const port_t *medium, enum port_result (*restore)(void *self));

#endif
