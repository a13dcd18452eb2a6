/* The loop of an embedded port, over the four functions of port.h. */
#ifndef LEVER_PORT_EMBEDDED_LOOP_H
#define LEVER_PORT_EMBEDDED_LOOP_H

#include "lever_cdkf.h"

/* One turn: idles, then takes at most one frame and, if it completes a sample, steps and sends every answer, so that the
 * answers of a sample are sent before the next frame is looked at. A port does this for ever. */
void embedded_turn(lever_t *lever);

#endif
