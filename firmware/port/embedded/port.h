/* What a microcontroller, or a task of an RTOS, must supply so that loop.h runs the estimator on it: four functions.
 *
 * All of them are called from the loop only, never from an interrupt. Only port_idle() may wait. A frame that is lost or
 * dropped is no error of the loop's: it is counted, reported by port_status(), and so seen by everybody on the bus.
 */
#ifndef LEVER_PORT_EMBEDDED_PORT_H
#define LEVER_PORT_EMBEDDED_PORT_H

#include <stdbool.h>

#include "lever_cdkf.h"

/* Takes the next received frame, in the order of reception; false when none waits. Frames that this machine has sent are
 * not among them. May leave out frames with other identifiers than the inputs' (can/messages.h). */
bool port_receive(lever_frame_t *frame);

/* Sends a frame after all that were sent before, or drops and counts it when there is no room. */
void port_send(const lever_frame_t *frame);

/* Fills in the state of the machine; called once a sample. */
void port_status(lever_platform_t *status);

/* Called in each turn of the loop: tells a watchdog that the loop is alive, and sleeps while no frame waits. It may return at
 * any time, and must before the watchdog's time is up. */
void port_idle(void);

#endif
