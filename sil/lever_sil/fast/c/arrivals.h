/* The frames that arrive at the firmware of a loop.h, where they are not those that are sent. */
#ifndef ARRIVALS_H
#define ARRIVALS_H

#include "loop.h"

/* Hands the firmware the frames of this sample, and takes its MOTOR_COMMAND. */
void arrivals_step(loop_t *loop, struct lever *lever);

/* There is no sample: tells the firmware now and then, as a port does. Returns whether it did. */
bool arrivals_idle(loop_t *loop, struct lever *lever);

#endif
