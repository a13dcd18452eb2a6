/* The independent watchdog: resets when nobody has kicked it for 0.5 s during the start, or 50 ms in the loop. */
#ifndef LEVER_PORT_STM32F4_WATCHDOG_H
#define LEVER_PORT_STM32F4_WATCHDOG_H

/* Starts it with 0.5 s; only a reset stops it. Stands still while a debugger has halted the core. */
void watchdog_start(void);

/* From now on 50 ms. */
void watchdog_tighten(void);

/* What is to be done has been done. */
void watchdog_kick(void);

#endif
