#include "port/stm32f4/tick.h"

#include "port/stm32f4/registers.h"

static volatile uint32_t milliseconds;

void tick_start(uint32_t core_hz)
{
    systick.LOAD = (core_hz / 1000u) - 1u;
    systick.VAL = 0u;
    systick.CTRL = SYSTICK_CTRL_CLKSOURCE | SYSTICK_CTRL_TICKINT | SYSTICK_CTRL_ENABLE;
}

uint32_t tick_ms(void)
{
    return milliseconds;
}

void tick_interrupt(void)
{
    milliseconds = milliseconds + 1u;
}
