/* Vectors and reset: enough of a machine to call main(). No interrupt is ever enabled. */
#include "semihosting.h"

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define CPACR (*(volatile uint32_t *)0xE000ED88u) /* ARMv7-M ARM B3.2.20: access to the FPU */
#define CPACR_CP10_CP11_FULL 0x00F00000u

extern uint32_t stack_top[];
extern uint8_t data_begin[];
extern uint8_t data_end[];
extern const uint8_t data_in_flash[];
extern uint8_t bss_begin[];
extern uint8_t bss_end[];

int main(void);
void reset(void);

static void fault(void)
{
    semihosting_exit("fault: an exception on the target");
}

void reset(void)
{
    CPACR |= CPACR_CP10_CP11_FULL;
    __asm volatile("dsb\n isb");
    (void)memcpy(data_begin, data_in_flash, (size_t)(data_end - data_begin));
    (void)memset(bss_begin, 0, (size_t)(bss_end - bss_begin));
    (void)main();
    semihosting_exit(NULL);
}

typedef void (*vector_t)(void);
typedef struct vectors {
    uint32_t *stack;
    vector_t handlers[15];
} vectors_t;

__attribute__((section(".vectors"), used)) static const vectors_t vectors = {stack_top,
    {reset, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault, fault}};
