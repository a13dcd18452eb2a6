/* A port that also sends snapshots of the estimator (lever_recorder_t in lever_cdkf.h): put between loop and machine.
 *
 *     const port_t machine = ...;
 *     recording_t recording;
 *     const port_t port = recording_port(&recording, &machine, lever, 500000u);
 *     loop_init(&loop, &port, lever, LOOP_DROP);
 *
 * The loop asks for a frame when all its answers are out: that is between two samples, and then snapshots are sent. One
 * that finds no room waits for the next time; samples and answers do not wait for it. */
#ifndef LEVER_PORT_RECORDING_H
#define LEVER_PORT_RECORDING_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/port.h"

typedef struct recording {
    const port_t *machine;
    const lever_t *lever;
    lever_recorder_t recorder;
    bool is_held; /* `frame` waits for room */
    lever_frame_t frame;
} recording_t;

/* `machine` and `lever` must outlive it. A snapshot each period_us of sample time. */
port_t recording_port(recording_t *recording, const port_t *machine, const lever_t *lever, uint32_t period_us);

#endif
