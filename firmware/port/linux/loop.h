/* The loop of a port: frames from a transport into the estimator, its answers back. No operating system, no clock.
 *
 * Guarantees, given a transport that keeps its contract (transport.h):
 *  - every answer of the estimator is sent, in order, once: while there is no room, or no link, the frame is kept and
 *    nothing is received, so that the medium holds the samples back;
 *  - a lost link is reported once, retried with a bounded back-off, and leaves the estimator as it was;
 *  - a request to end is seen within LOOP_BATCH frames, also under full load and during an outage.
 */
#ifndef LEVER_PORT_LOOP_H
#define LEVER_PORT_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/linux/transport.h"

enum loop_limits {
    LOOP_BATCH = 64,            /* frames received between two looks at a request to end */
    LOOP_RETRY_MS = 1,          /* pause before a frame that found no room is sent again [ms] */
    LOOP_BACKOFF_FIRST_MS = 10, /* pauses between attempts to restore a link double from the first ... */
    LOOP_BACKOFF_LAST_MS = 500, /* ... to the last [ms] */
};

enum loop_event {
    LOOP_EVENT_DOWN = 0, /* link lost; transport->reason() says how */
    LOOP_EVENT_UP = 1,   /* link restored */
    LOOP_EVENT_MODE = 2, /* the estimator's mode has changed, see loop->mode */
};

typedef struct loop_totals {
    uint64_t received; /* frames taken from the transport */
    uint64_t sent;     /* frames handed to the transport */
    uint64_t samples;  /* samples completed, each of which was one estimator step */
    uint64_t retries;  /* times that a frame found no room and was kept */
    uint64_t outages;  /* times that the link was lost */
} loop_totals_t;

typedef struct loop {
    const transport_t *transport;
    lever_t *lever;
    void (*on_event)(void *context, enum loop_event event); /* NULL: nobody listens */
    void *context;
    enum lever_mode mode;
    loop_totals_t totals;
    lever_frame_t unsent; /* fetched from the estimator, not yet taken by the transport */
    bool has_unsent;
} loop_t;

/* Prepares a loop between `transport` and `lever`; both must outlive it. Set on_event and context afterwards. */
void loop_init(loop_t *loop, const transport_t *transport, lever_t *lever);

/* Runs until the transport's wait() asks to end (true), or the transport breaks (false). */
bool loop_run(loop_t *loop);

#endif
