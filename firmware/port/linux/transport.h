/* What the loop (loop.h) needs of the outside world: a way to receive and send CAN frames, and a way to wait.
 *
 * A transport is this struct, filled in by whoever knows the medium (socketcan.c; a fake in tests/unit/port). No
 * callback blocks except wait(). "Nothing yet", "no room yet", "link lost" and "broken" are different results.
 */
#ifndef LEVER_PORT_TRANSPORT_H
#define LEVER_PORT_TRANSPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"

enum transport_result {
    TRANSPORT_OK = 0,     /* done */
    TRANSPORT_EMPTY = 1,  /* receive: no frame for the moment */
    TRANSPORT_FULL = 2,   /* send: no room for the moment; the frame is still the caller's */
    TRANSPORT_DOWN = 3,   /* the link is lost and may come back: try restore() from time to time */
    TRANSPORT_BROKEN = 4, /* cannot go on; reason() says why */
};

typedef struct transport {
    void *self; /* first argument of every callback */

    /* Takes the next received frame: OK, EMPTY, DOWN or BROKEN. Frames that this port has sent are not among them. */
    enum transport_result (*receive)(void *self, lever_frame_t *frame);

    /* Hands one frame over, whole or not at all: OK, FULL, DOWN or BROKEN. */
    enum transport_result (*send)(void *self, const lever_frame_t *frame);

    /* Tries once to bring a lost link back: OK, DOWN (still lost) or BROKEN. */
    enum transport_result (*restore)(void *self);

    /* Waits for at most timeout_ms [ms] (forever if negative), and if for_frame, no longer than until receive() has
     * something to say. Returns false when the loop is to end; a request to end is never missed and stays. */
    bool (*wait)(void *self, bool for_frame, int32_t timeout_ms);

    /* The last DOWN or BROKEN in words, without a full stop; valid until the next call of any callback. */
    const char *(*reason)(void *self);
} transport_t;

#endif
