/* What frames travel over: CAN (transport_can.c) or text (transport_slcan.c). An image is linked with one of them. */
#ifndef LEVER_PORT_STM32F4_TRANSPORT_H
#define LEVER_PORT_STM32F4_TRANSPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/port.h"
#include "port/stm32f4/clock.h"

/* Vectors of the devices' interrupts, from number 0 on: image.ld puts them behind those of the processor. Each
 * transport defines them with the handlers that it needs, as DEVICE_VECTORS = {[INTERRUPT_...] = ...}. */
typedef void (*interrupt_t)(void);
enum { INTERRUPTS = 82 };
#define DEVICE_VECTORS __attribute__((section(".vectors.devices"), used)) static const interrupt_t vectors[INTERRUPTS]

void transport_start(const clock_rates_t *rates);

/* receive and send of port.h. */
enum port_result transport_receive(void *self, lever_frame_t *frame);
enum port_result transport_send(void *self, const lever_frame_t *frame);

/* Whether something has been received that transport_receive() has not yet looked at. */
bool transport_has_received(void);

/* What no interrupt tells. To be called each millisecond or more often. */
void transport_poll(uint32_t now_ms);

/* Whether what its interrupts are for is done, as of the last transport_poll(). False now and then says nothing: it
 * has just become due; false for long says that they come no more. */
bool transport_is_served(void);

/* Whether COMMANDs may change anything: port/command_guard.h. */
bool transport_takes_commands(void);

/* Fills in the state of the bus, and what has been lost since the start. */
void transport_status(lever_platform_t *status);

#endif
