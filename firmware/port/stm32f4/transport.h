/* What frames travel over: CAN (transport_can.c) or text (transport_slcan.c). An image is linked with one of them, which also
 * supplies port_receive() and port_send(). */
#ifndef LEVER_PORT_STM32F4_TRANSPORT_H
#define LEVER_PORT_STM32F4_TRANSPORT_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/stm32f4/clock.h"

/* Counts since the start, and the state of the bus now. */
typedef struct transport_status {
    uint32_t overruns;
    uint32_t dropped;
    uint32_t bus_offs;
    uint8_t transmit_errors;
    uint8_t receive_errors;
    bool bus_off;
} transport_status_t;

void transport_start(const clock_rates_t *rates);

/* Whether something has been received that port_receive() has not yet looked at. */
bool transport_has_received(void);

/* Called in each turn of the loop. */
void transport_poll(uint32_t now_ms);

transport_status_t transport_status(void);

#endif
