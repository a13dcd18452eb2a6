/* USART1 on PA9 (transmit) and PA10 (receive), 8 bits, no parity, 1 stop bit: RM0090 30. Rings between interrupt and
 * loop. */
#ifndef LEVER_PORT_STM32F4_USART_H
#define LEVER_PORT_STM32F4_USART_H

#include <stdbool.h>
#include <stdint.h>

#include "port/stm32f4/clock.h"

/* [bit/s]. 1 kHz of samples as SLCAN need 0.9 Mbit/s out and 0.5 in. */
#ifndef LEVER_STM32_BAUD
#define LEVER_STM32_BAUD 1000000
#endif

void usart_start(const clock_rates_t *rates);

/* What no interrupt tells. To be called in each wait of the loop. */
void usart_poll(void);

/* Whether, at the last usart_poll(), nothing waited to be sent, or some of it had left since the call before. What is
 * received needs no interrupt. */
bool usart_is_served(void);

/* Takes the next received byte; false when there is none. */
bool usart_read(uint8_t *byte);

/* Whether usart_read() has a byte. */
bool usart_has_received(void);

/* Queues `length` bytes whole, or none of them (false) when there is no room; never waits. */
bool usart_write(const void *bytes, uint32_t length);

/* How long what is queued takes to leave [ms]. */
uint32_t usart_waiting_ms(void);

/* Received bytes that were lost since the start; one that the hardware lost counts one each time. */
uint32_t usart_overruns(void);

/* Interrupt. */
void usart_interrupt(void);

#endif
