/* The independent watchdog: resets when the loop has not come round for 50 ms. */
#ifndef LEVER_PORT_STM32F4_WATCHDOG_H
#define LEVER_PORT_STM32F4_WATCHDOG_H

#include <stdbool.h>

/* Starts it; only a reset stops it. Stands still while a debugger has halted the core. */
void watchdog_start(void);

/* The loop is alive. */
void watchdog_kick(void);

/* Whether the last reset was the watchdog's; forgets it. */
bool watchdog_has_reset(void);

#endif
