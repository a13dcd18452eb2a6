#include "port/stm32f4/fault.h"

#include <string.h>

#include "port/stm32f4/image.h"
#include "port/stm32f4/processor.h"
#include "port/stm32f4/registers.h"

fault_record_t fault_last __attribute__((section(".noinit")));

enum { FRAME_LR = 5, FRAME_PC = 6, FRAME_PSR = 7, FRAME_WORDS = 8 }; /* PM0214 2.3.7: what an exception stacks */

bool fault_has_reset(void)
{
    const bool has = fault_last.mark == FAULT_MARK;

    if (has) {
        fault_last.mark = FAULT_SEEN;
    } else if (fault_last.mark != FAULT_SEEN) {
        (void)memset(&fault_last, 0, sizeof fault_last); /* power-on: memory holds anything */
    } else {
        /* reported already, and kept for a debugger */
    }
    return has;
}

bool fault_lost_stack(void)
{
    return (fault_last.pc | fault_last.lr | fault_last.psr) == 0u;
}

/* The stack of the interrupted code is read only if it is in memory: one that has overflowed is not. */
__attribute__((used, noreturn)) static void fault_record(const uint32_t *frame)
{
    /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    const uintptr_t stack = (uintptr_t)frame;
    const uintptr_t first = (uintptr_t)image_ram;   /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    const uintptr_t end = (uintptr_t)image_ram_end; /* cppcheck-suppress misra-c2012-11.4 ; D8 */
    const uintptr_t last = end - (FRAME_WORDS * sizeof *frame);
    const bool readable = (stack >= first) && (stack <= last) && ((stack % 4u) == 0u);

    fault_last.pc = readable ? frame[FRAME_PC] : 0u;
    fault_last.lr = readable ? frame[FRAME_LR] : 0u;
    fault_last.psr = readable ? frame[FRAME_PSR] : 0u;
    fault_last.cfsr = scb.CFSR;
    fault_last.hfsr = scb.HFSR;
    fault_last.address = scb.BFAR;
    fault_last.count++;
    fault_last.mark = FAULT_MARK;
    synchronise();
    scb.AIRCR = SCB_AIRCR_RESET;
    for (;;) {
        /* until the reset, or the watchdog's */
    }
}

/* Hands on the stack pointer of what was interrupted, and goes on on a fresh stack: the old one may be the fault. */
__attribute__((naked)) void fault_interrupt(void)
{
    /* cppcheck-suppress misra-c2012-17.3 ; D9 */
    /* NOLINTNEXTLINE(portability-no-assembler): C cannot read a stack pointer */
    __asm__ volatile("tst lr, #4\n\t"
                     "ite eq\n\t"
                     "mrseq r0, msp\n\t"
                     "mrsne r0, psp\n\t"
                     "ldr r1, =image_stack_top\n\t"
                     "msr msp, r1\n\t"
                     "b fault_record\n\t"
                     ".ltorg");
}
