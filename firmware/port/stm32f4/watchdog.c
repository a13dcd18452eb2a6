#include "port/stm32f4/watchdog.h"

#include "port/stm32f4/registers.h"
#include "port/stm32f4/wait.h"

/* RM0090 21.3: counts down at 32 kHz / 4, an oscillator of 17 to 47 kHz (data sheet 5.3.9): 34 to 94 ms. */
enum { DIVIDE_BY_4 = 0, COUNTS = 400, UPDATE_POLLS = 200000 };

void watchdog_start(void)
{
    dbgmcu.APB1_FZ |= DBGMCU_APB1_FZ_IWDG;
    iwdg.KR = IWDG_KR_START; /* also starts the oscillator, without which PR and RLR are never updated */
    iwdg.KR = IWDG_KR_UNLOCK;
    iwdg.PR = DIVIDE_BY_4;
    iwdg.RLR = COUNTS;
    (void)wait_for(&iwdg.SR, UINT32_MAX, 0u, UPDATE_POLLS); /* otherwise its time is that after reset, 0.5 s */
    watchdog_kick();
}

void watchdog_kick(void)
{
    iwdg.KR = IWDG_KR_RELOAD;
}

bool watchdog_has_reset(void)
{
    const bool has = (rcc.CSR & RCC_CSR_IWDGRSTF) != 0u;

    rcc.CSR |= RCC_CSR_RMVF; /* RM0090 7.3.21 */
    return has;
}
