/* Instructions that C has no words for (PM0214 3.10), and interrupts on and off around what they share with the
 * loop. */
#ifndef LEVER_PORT_STM32F4_PROCESSOR_H
#define LEVER_PORT_STM32F4_PROCESSOR_H

#ifdef __arm__

/* NOLINTBEGIN(portability-no-assembler): there is no other way to these four */

static inline void interrupts_off(void)
{
    /* cppcheck-suppress misra-c2012-17.3 ; D9 */
    __asm__ volatile("cpsid i" ::: "memory");
}

static inline void interrupts_on(void)
{
    /* cppcheck-suppress misra-c2012-17.3 ; D9 */
    __asm__ volatile("cpsie i" ::: "memory");
}

/* Sleeps until an interrupt asks for attention, also while interrupts are off: then it is served when they are on
 * again. */
static inline void wait_for_interrupt(void)
{
    /* cppcheck-suppress misra-c2012-17.3 ; D9 */
    __asm__ volatile("dsb\n\twfi" ::: "memory");
}

/* All memory accesses before are done, and all instructions after are fetched anew. */
static inline void synchronise(void)
{
    /* cppcheck-suppress misra-c2012-17.3 ; D9 */
    __asm__ volatile("dsb\n\tisb" ::: "memory");
}

/* NOLINTEND(portability-no-assembler) */

#else /* on the host, where tests play the hardware */

static inline void interrupts_off(void)
{
}

static inline void interrupts_on(void)
{
}

static inline void wait_for_interrupt(void)
{
}

static inline void synchronise(void)
{
}

#endif

#endif
