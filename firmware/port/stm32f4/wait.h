/* Waiting for hardware, never for ever. */
#ifndef LEVER_PORT_STM32F4_WAIT_H
#define LEVER_PORT_STM32F4_WAIT_H

#include <stdbool.h>
#include <stdint.h>

#include "port/stm32f4/registers.h"

/* Reads `reg` until the bits of `mask` are `value`, at most `polls` times (each at least 4 cycles). False: they never
 * were. */
static inline bool wait_for(const reg_t *reg, uint32_t mask, uint32_t value, uint32_t polls)
{
    bool reached = false;

    for (uint32_t poll = 0u; (poll < polls) && !reached; poll++) {
        reached = (*reg & mask) == value;
    }
    return reached;
}

#endif
