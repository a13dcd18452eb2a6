/* The independent watchdog: resets when nobody has kicked it for 0.5 s during the start, or 50 ms in the loop. */
#ifndef LEVER_PORT_STM32F4_WATCHDOG_H
#define LEVER_PORT_STM32F4_WATCHDOG_H

#include <stdbool.h>

/* Starts it with 0.5 s; only a reset stops it. Stands still while a debugger has halted the core. */
void watchdog_start(void);

/* From now on 50 ms. */
void watchdog_tighten(void);

/* The loop is alive. */
void watchdog_kick(void);

/* Whether the last reset was the watchdog's; forgets it. */
bool watchdog_has_reset(void);

#endif
