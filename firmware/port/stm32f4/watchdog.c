#include "port/stm32f4/watchdog.h"

#include "port/stm32f4/registers.h"
#include "port/stm32f4/wait.h"

/* RM0090 21.3: counts down from 4095 after a reset, at a quarter of 32 kHz (17 to 47 kHz, data sheet 5.3.9): 0.35 to
 * 0.96 s. From 400 that is 34 to 94 ms. */
enum { COUNTS = 400, UPDATE_POLLS = 100000 };

void watchdog_start(void)
{
    dbgmcu.APB1_FZ |= DBGMCU_APB1_FZ_IWDG;
    iwdg.KR = IWDG_KR_START;
    watchdog_kick();
}

void watchdog_tighten(void)
{
    iwdg.KR = IWDG_KR_UNLOCK;
    iwdg.RLR = COUNTS;
    (void)wait_for(
        &iwdg.SR, UINT32_MAX, 0u, UPDATE_POLLS); /* 5 cycles of its oscillator; if never, it stays at 0.5 s */
    watchdog_kick();
}

void watchdog_kick(void)
{
    iwdg.KR = IWDG_KR_RELOAD;
}
