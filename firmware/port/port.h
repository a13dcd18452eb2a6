/* What the loop (loop.h) needs of a machine: a way to receive and to send CAN frames, a way to wait, a clock.
 *
 * A port is this struct, filled in by whoever knows the machine. Every callback gets `self`, so that an image may have
 * as many ports, loops and estimators as there is memory for. All are called from loop_turn() only, never from an
 * interrupt, and none may block but wait(). Frames are copied; nothing is kept.
 *
 * Results. Positive: done. Zero: nothing was done, which is no error; try again later. Negative: an error, see below.
 */
#ifndef LEVER_PORT_PORT_H
#define LEVER_PORT_PORT_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"

enum port_result {
    PORT_DONE = 1,
    PORT_NOTHING = 0, /* receive: no frame waits; send: no room for the moment, and the frame is still the caller's */
    PORT_DOWN = -1,   /* the link is lost and may come back: the loop tries restore() from time to time */
    PORT_BROKEN = -2  /* cannot go on: the loop ends */
};

typedef struct port {
    void *self; /* first argument of every callback; may be NULL */

    /* Takes the next received frame, in the order of reception; frames that this port has sent are not among them. May
     * leave out frames with identifiers that the estimator does not take (PORT_INPUTS). PORT_NOTHING says that no frame
     * waits: those to come are newer than this call. */
    enum port_result (*receive)(void *self, lever_frame_t *frame);

    /* Queues a frame behind all before it, whole or not at all. PORT_NOTHING: what then happens to the frame is the
     * policy of the loop. A port whose queue may hold a MOTOR_COMMAND or CORRECTION back for longer than
     * PORT_STALE_MS drops it there. */
    enum port_result (*send)(void *self, const lever_frame_t *frame);

    /* Waits until timeout_ms [ms] have passed (negative: for ever) or, if for_frame, receive() may have something; it
     * may return earlier at any time, and with 0 must at once. Called at least every LOOP_BATCH frames. Returns false
     * when the loop is to end; a request to end is never missed and stays. */
    bool (*wait)(void *self, bool for_frame, int32_t timeout_ms);

    /* A clock that never stands or jumps [us]; wraps at 2^32. A resolution of 1 ms is enough. */
    uint32_t (*now_us)(void *self);

    /* Reports the state of the machine, before each sample is stepped; NULL: it has nothing to report. */
    void (*status)(void *self, lever_platform_t *status);

    /* After PORT_DOWN, one attempt to bring the link back: PORT_DONE, PORT_DOWN (still lost) or PORT_BROKEN. NULL: a
     * link that is never down. */
    enum port_result (*restore)(void *self);
} port_t;

enum port_limits {
    PORT_STALE_MS = 20 /* no MOTOR_COMMAND or CORRECTION is sent whose sample was received longer ago [ms] */
};

/* Of an identifier (can/messages.h), whether such a frame is worthless then: what acts on lever or rotor. */
#define PORT_GOES_STALE(id) (((id) == (uint32_t)MESSAGE_MOTOR_COMMAND_ID) || ((id) == (uint32_t)MESSAGE_CORRECTION_ID))

/* Identifiers that a receive filter must let through: the inputs, and IDENTITY, by which the estimator
 * notices another one on its bus. */
#define PORT_INPUTS                                                                                                    \
    {MESSAGE_LEVER_SAMPLE_ID, MESSAGE_BASE_SAMPLE_ID, MESSAGE_GRIP_SAMPLE_ID, MESSAGE_COMMAND_ID, MESSAGE_IDENTITY_ID}

#endif
