/* CAN1 as a bxCAN at 1 Mbit/s on PB8 (receive) and PB9 (transmit): RM0090 32.
 *
 * Received: only data frames with the identifiers of PORT_INPUTS, through a ring that the interrupt fills. When the
 * FIFO or the ring is full the newest frame is lost, so that what is there stays in order, and counted.
 *
 * Sent: in the order of the calls, through a ring that the interrupt empties into the three mailboxes. They are sent by
 * order of request (TXFP), not by identifier: STATE_ESTIMATE, the end of a step, has a lower identifier than what
 * precedes it. A frame that could not be sent for PORT_STALE_MS, and all that wait when the bus goes off, are dropped
 * and counted: a MOTOR_COMMAND must not come out long after its sample.
 *
 * Bus-off: the controller comes back by itself after 128 times 11 recessive bits (ABOM), as ISO 11898-1 has it.
 */
#ifndef LEVER_PORT_STM32F4_CAN_H
#define LEVER_PORT_STM32F4_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/stm32f4/clock.h"

/* Since the start; each wraps at 2^32. */
typedef struct can_counts {
    uint32_t overruns; /* received frames for which there was no room; a FIFO that overruns counts one each time */
    uint32_t dropped;  /* frames that were not sent */
    uint32_t bus_offs; /* times that the controller went off the bus */
} can_counts_t;

/* What stands in the error counters now. */
typedef struct can_errors {
    uint8_t transmit;
    uint8_t receive;
    bool bus_off;
} can_errors_t;

/* Starts CAN1 on the bus, with the bit timing that belongs to `rates`. Does not wait for the bus to be idle. */
void can_start(const clock_rates_t *rates);

/* Takes the next received frame; false when there is none. */
bool can_receive(lever_frame_t *frame);

/* Whether can_receive() has a frame. */
bool can_has_received(void);

/* Queues a frame for transmission; false, counting it as dropped, when there is no room or no bus. */
bool can_send(const lever_frame_t *frame);

/* What no interrupt tells: the time, by which frames that wait too long are dropped. To be called each millisecond or
 * more often. */
void can_poll(uint32_t now_ms);

/* Whether, at the last can_poll(), nothing waited for an interrupt, or one had come since the call before. */
bool can_is_served(void);

can_counts_t can_counts(void);
can_errors_t can_errors(void);

/* Interrupts. */
void can_transmit_interrupt(void);
void can_receive_interrupt(void);
void can_error_interrupt(void);

#endif
