/* The clock of every port on Linux. It does not stand while the machine is suspended, nor jump when its date is set. */
#ifndef LEVER_PORT_LINUX_CLOCK_H
#define LEVER_PORT_LINUX_CLOCK_H

#include <stdint.h>

/* Microseconds, as now_us of port.h; milliseconds, wrapping at 2^32. */
uint32_t clock_now_us(void *self);
uint32_t clock_now_ms(void);

#endif
