/* Why the machine has started: RM0090 7.3.21, and what fault.h and clock.h have left in memory. */
#ifndef LEVER_PORT_STM32F4_RESET_CAUSE_H
#define LEVER_PORT_STM32F4_RESET_CAUSE_H

#include <stdint.h>

#include "can/messages.h"

/* To be called once, after clock_start(): the next start shall tell of its own reset. */
enum message_cause reset_cause_read(void);

/* Resets since power-on, without it. */
uint32_t reset_cause_count(void);

#endif
