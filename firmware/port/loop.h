/* The loop of every port: frames from a port (port.h) into the estimator, its answers back. No operating system, no
 * globals.
 *
 *     port_t port = ...;                       // the machine's, see port.h
 *     loop_t loop;
 *     loop_init(&loop, &port, lever, LOOP_DROP);
 *     while (loop_turn(&loop) == PORT_DONE) {
 *         // feed the watchdog if loop.sample_us has changed: a turn by itself has finished nothing
 *     }
 *
 * Guarantees, given a port that keeps its contract:
 *  - what a frame is answered with goes out, in order, once, before the next frame is received;
 *  - without room a frame is held and nothing is received, so that the medium holds the samples back, or it is dropped
 *    and counted: the policy;
 *  - a MOTOR_COMMAND or CORRECTION whose sample was, or may have been, received more than PORT_STALE_MS ago is dropped
 *    and counted, whatever the policy;
 *  - when no sample comes the estimator is told each LOOP_IDLE_MS, so that its torque fades;
 *  - a lost link is tried again with a bounded back-off, and leaves the estimator as it was;
 *  - wait() is called within LOOP_BATCH frames, also under full load.
 */
#ifndef LEVER_PORT_LOOP_H
#define LEVER_PORT_LOOP_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/port.h"

enum loop_limits {
    LOOP_BATCH = 8,             /* frames received between two calls of wait() */
    LOOP_RETRY_MS = 1,          /* pause before a frame that found no room is sent again [ms] */
    LOOP_IDLE_MS = 5,           /* without a sample, until lever_idle() is called [ms] */
    LOOP_BACKOFF_FIRST_MS = 10, /* pauses between attempts to restore a link double from the first ... */
    LOOP_BACKOFF_LAST_MS = 500  /* ... to the last [ms] */
};

/* What is done with a frame that finds no room. */
enum loop_policy {
    LOOP_HOLD = 0, /* kept, and sent before anything else */
    LOOP_DROP = 1  /* forgotten */
};

typedef struct loop_totals {
    uint64_t received; /* frames taken from the port */
    uint64_t sent;     /* frames handed to the port */
    uint64_t samples;  /* samples completed, each of which was one estimator step */
    uint64_t held;     /* frames that found no room at first and were kept */
    uint64_t dropped;  /* frames that found no room and were dropped */
    uint64_t stale;    /* MOTOR_COMMANDs and CORRECTIONs that were too old to be sent */
    uint64_t outages;  /* times that the link was lost */
} loop_totals_t;

typedef struct loop {
    const port_t *port;
    lever_t *lever;
    enum loop_policy policy;
    bool
        lock_step; /* time is that of the samples alone, nothing is ever stale: for simulations, never beside a motor */
    enum lever_mode mode; /* after the last sample */
    loop_totals_t totals;
    bool is_held;        /* `frame` waits for room */
    lever_frame_t frame; /* fetched from the estimator */
    uint32_t frame_us;   /* what it answers was received, or happened, at this time or later */
    uint32_t cause_us;   /* the same for what the estimator has to say now */
    uint32_t empty_us;   /* when no frame waited last: what is received now came later */
    uint32_t sample_us;  /* last step, or call of lever_idle() */
    uint32_t batch;      /* frames since the last call of wait() */
    bool is_down;        /* the link is lost */
    uint32_t tried_us;   /* when that was, or the last attempt to restore it */
    uint32_t pause_ms;   /* until the next one */
} loop_t;

/* Prepares a loop between `port` and `lever`; both must outlive it. Supervised: set lock_step afterwards where it must
 * be. */
void loop_init(loop_t *loop, const port_t *port, lever_t *lever, enum loop_policy policy);

/* One turn: sends what is held, takes at most one frame, steps if it completes a sample, sends every answer; waits when
 * there is nothing to do. PORT_DONE: call again. PORT_NOTHING: wait() has asked to end. Negative: the port's error. */
enum port_result loop_turn(loop_t *loop);

#endif
