/* What happens before main(): the vectors of the processor (RM0090 12.2, table 62; those of the devices follow them,
 * from transport.h), the FPU, initial values of memory. */
#include <stdint.h>

#include "port/stm32f4/clock.h"
#include "port/stm32f4/fault.h"
#include "port/stm32f4/processor.h"
#include "port/stm32f4/registers.h"
#include "port/stm32f4/tick.h"

extern uint32_t image_stack_top[]; /* of image.ld, all of them */
extern uint32_t image_data[];
extern uint32_t image_data_end[];
extern const uint32_t image_data_in_flash[];
extern uint32_t image_bss[];
extern uint32_t image_bss_end[];
extern const uint32_t image_start[];

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

__attribute__((section(".vectors"), used)) static const vectors_t vectors = {
    .stack = image_stack_top,
    .reset = reset_interrupt,
    .non_maskable = clock_failure_interrupt,
    .hard_fault = fault_interrupt,
    .other = {[SYSTEM_TICK - FIRST_OTHER] = tick_interrupt},
};

void reset_interrupt(void)
{
    const uint32_t *from = image_data_in_flash;

    scb.CPACR |= SCB_CPACR_FPU;
    synchronise();
    scb.VTOR = (uint32_t)(uintptr_t)image_start;
    for (uint32_t *to = image_data; to < image_data_end; to++) {
        *to = *from;
        from++;
    }
    for (uint32_t *to = image_bss; to < image_bss_end; to++) {
        *to = 0u;
    }
    (void)main();
    for (;;) {
        /* main() does not return; if it did, the watchdog would reset */
    }
}
