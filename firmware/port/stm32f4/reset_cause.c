#include "port/stm32f4/reset_cause.h"

#include <stdbool.h>

#include "port/stm32f4/clock.h"
#include "port/stm32f4/fault.h"
#include "port/stm32f4/registers.h"

/* Survives a reset; after power-on memory holds anything. */
static struct {
    uint32_t count;
    uint32_t inverted;
} resets __attribute__((section(".noinit")));

static void count_reset(bool powered_on)
{
    const bool is_first = powered_on || (resets.inverted != ~resets.count);

    resets.count = is_first ? 0u : (resets.count + 1u);
    resets.inverted = ~resets.count;
}

/* Every reset pulls the pin, too, so that flag comes last. */
static enum message_cause cause_of(uint32_t flags)
{
    enum message_cause cause = MESSAGE_CAUSE_UNKNOWN;

    if ((flags & RCC_CSR_PORRSTF) != 0u) {
        cause = MESSAGE_CAUSE_POWER_ON;
    } else if ((flags & RCC_CSR_IWDGRSTF) != 0u) {
        cause = MESSAGE_CAUSE_WATCHDOG;
    } else if ((flags & RCC_CSR_SFTRSTF) != 0u) {
        cause = MESSAGE_CAUSE_SOFTWARE;
    } else if ((flags & RCC_CSR_BORRSTF) != 0u) {
        cause = MESSAGE_CAUSE_BROWN_OUT;
    } else if ((flags & RCC_CSR_PINRSTF) != 0u) {
        cause = MESSAGE_CAUSE_PIN;
    } else {
        /* not known */
    }
    return cause;
}

static enum message_cause fault_cause(void)
{
    return fault_lost_stack() ? MESSAGE_CAUSE_STACK_OVERFLOW : MESSAGE_CAUSE_HARD_FAULT;
}

enum message_cause reset_cause_read(void)
{
    const uint32_t flags = rcc.CSR;
    const bool faulted = fault_has_reset();
    const bool clock_failed = clock_has_reset();
    enum message_cause cause = cause_of(flags);

    rcc.CSR |= RCC_CSR_RMVF;
    count_reset(cause == MESSAGE_CAUSE_POWER_ON);
    if (cause != MESSAGE_CAUSE_POWER_ON) { /* after which nothing in memory is to be believed */
        cause = clock_failed ? MESSAGE_CAUSE_CLOCK_FAILURE : cause;
        cause = faulted ? fault_cause() : cause;
    }
    return cause;
}

uint32_t reset_cause_count(void)
{
    return resets.count;
}
