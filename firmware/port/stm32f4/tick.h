/* Milliseconds since the start, from SysTick (PM0214 4.5). Nothing that is estimated depends on them. */
#ifndef LEVER_PORT_STM32F4_TICK_H
#define LEVER_PORT_STM32F4_TICK_H

#include <stdint.h>

void tick_start(uint32_t core_hz);
uint32_t tick_ms(void); /* wraps at 2^32 */
void tick_interrupt(void);

#endif
