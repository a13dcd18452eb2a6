/* What happens before main(): the vectors of the processor (RM0090 12.2, table 62; those of the devices follow them,
 * from transport.h), the FPU, initial values of memory. */
#include <stdint.h>

#include "port/stm32f4/clock.h"
#include "port/stm32f4/fault.h"
#include "port/stm32f4/image.h"
#include "port/stm32f4/processor.h"
#include "port/stm32f4/registers.h"
#include "port/stm32f4/tick.h"

int main(void);
/* NOLINTNEXTLINE(misc-use-internal-linkage): image.ld makes it the entry point */
__attribute__((noreturn)) void reset_interrupt(void);

/* Exceptions are numbered from 1 on. */
enum { FIRST_OTHER = 4, SYSTEM_TICK = 15, EXCEPTIONS = 16 };

typedef struct vectors {
    uint32_t *stack;
    void (*reset)(void);
    void (*non_maskable)(void);
    void (*hard_fault)(void);
    void (*other[EXCEPTIONS - FIRST_OTHER])(void); /* an entry that is 0 faults, and so is recorded */
} vectors_t;

/* cppcheck-suppress misra-c2012-9.2 ; D10 */
__attribute__((section(".vectors"), used)) static const vectors_t vectors = {
    .stack = image_stack_top,
    .reset = reset_interrupt,
    .non_maskable = clock_failure_interrupt,
    .hard_fault = fault_interrupt,
    .other = {[SYSTEM_TICK - FIRST_OTHER] = tick_interrupt},
};

/* Between two symbols. */
static uint32_t words(const uint32_t *begin, const uint32_t *end)
{
    return (
        uint32_t)(((uintptr_t)end - (uintptr_t)begin) / sizeof *begin); /* cppcheck-suppress misra-c2012-11.4 ; D8 */
}

void reset_interrupt(void)
{
    const uint32_t initialised = words(image_data, image_data_end);
    const uint32_t cleared = words(image_bss, image_bss_end);

    scb.CPACR |= SCB_CPACR_FPU;
    synchronise();
    scb.VTOR = (uint32_t)(uintptr_t)image_start; /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    for (uint32_t i = 0u; i < initialised; i++) {
        image_data[i] = image_data_in_flash[i];
    }
    for (uint32_t i = 0u; i < cleared; i++) {
        image_bss[i] = 0u;
    }
    (void)main();
    for (;;) {
        /* main() does not return; if it did, the watchdog would reset */
    }
}
