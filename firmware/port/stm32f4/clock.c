#include "port/stm32f4/clock.h"

#include "port/stm32f4/processor.h"
#include "port/stm32f4/registers.h"
#include "port/stm32f4/wait.h"

enum {
    CRYSTAL_POLLS = 40000, /* 10 ms at 16 MHz and 4 cycles; a crystal takes 2 ms (data sheet 5.3.8) */
    PLL_POLLS = 8000,      /* 2 ms; the PLL takes at most 0.3 ms (data sheet 5.3.10) */
    SWITCH_POLLS = 1000,
    PLL_Q = 7 /* 48 MHz for peripherals that are not used: within what they bear */
};

/* Whether it has failed since power-on, and if that made the last reset. Survives the reset that follows. */
static uint32_t crystal_state __attribute__((section(".noinit")));
#define CRYSTAL_HAS_RESET 0xC4157A1Fu
#define CRYSTAL_FAILED 0xC4157A20u

/* RM0090 3.5.1 (table 10): 5 wait states at 168 MHz and 2.7 to 3.6 V; caches and prefetch hide most of them. */
static bool slow_flash_down(void)
{
    flash.ACR = 5u | FLASH_ACR_PRFTEN | FLASH_ACR_ICEN | FLASH_ACR_DCEN;
    return wait_for(&flash.ACR, FLASH_ACR_LATENCY, 5u, SWITCH_POLLS);
}

/* RM0090 7.2.3 and 7.3.2: set up while it is off. P = 2 is coded as 0. */
static bool start_pll(bool crystal)
{
    /* cppcheck-suppress misra-c2012-10.8 ; D7 */
    const uint32_t m = crystal ? (uint32_t)CLOCK_PLL_M(LEVER_STM32_HSE_MHZ) : (uint32_t)CLOCK_PLL_M(CLOCK_HSI_MHZ);
    /* cppcheck-suppress misra-c2012-10.8 ; D7 */
    const uint32_t n = crystal ? (uint32_t)CLOCK_PLL_N(LEVER_STM32_HSE_MHZ) : (uint32_t)CLOCK_PLL_N(CLOCK_HSI_MHZ);

    rcc.CR &= ~(uint32_t)RCC_CR_PLLON;
    (void)wait_for(&rcc.CR, RCC_CR_PLLRDY, 0u, PLL_POLLS);
    rcc.PLLCFGR = m | FIELD(n, 6) | FIELD(PLL_Q, 24) | (crystal ? (uint32_t)RCC_PLLCFGR_PLLSRC_HSE : 0u);
    rcc.CR |= RCC_CR_PLLON;
    return wait_for(&rcc.CR, RCC_CR_PLLRDY, RCC_CR_PLLRDY, PLL_POLLS);
}

/* RM0090 7.2.6, 7.3.3: the bus dividers first, so that no bus is ever too fast. */
static bool switch_to_pll(void)
{
    const uint32_t dividers = (uint32_t)RCC_CFGR_PPRE1_DIV4 | (uint32_t)RCC_CFGR_PPRE2_DIV2;

    rcc.CFGR = dividers;
    rcc.CFGR = dividers | RCC_CFGR_SW_PLL;
    if (wait_for(&rcc.CFGR, RCC_CFGR_SWS, RCC_CFGR_SWS_PLL, SWITCH_POLLS)) {
        return true;
    }
    rcc.CFGR = 0u;
    return false;
}

static bool run_from_pll(bool crystal)
{
    return start_pll(crystal) && slow_flash_down() && switch_to_pll();
}

static bool has_failed(void)
{
    return (crystal_state == CRYSTAL_HAS_RESET) || (crystal_state == CRYSTAL_FAILED);
}

clock_rates_t clock_start(void)
{
    clock_rates_t rates = {.core_hz = CLOCK_RAW_HZ, .apb1_hz = CLOCK_RAW_HZ, .apb2_hz = CLOCK_RAW_HZ};

    rcc.APB1ENR |= RCC_APB1_PWR;
    pwr.CR |= PWR_CR_VOS; /* RM0090 5.4.1: scale 1, needed above 144 MHz */
    if ((rcc.CSR & RCC_CSR_PORRSTF) != 0u) {
        crystal_state = 0u;
    }
    rcc.CR |= RCC_CR_HSEON;
    if (!has_failed() && wait_for(&rcc.CR, RCC_CR_HSERDY, RCC_CR_HSERDY, CRYSTAL_POLLS)) {
        rates.crystal = run_from_pll(true);
    }
    rates.has_pll = rates.crystal || run_from_pll(false);
    if (rates.has_pll) {
        rates.core_hz = CLOCK_PLL_CORE_HZ;
        rates.apb1_hz = CLOCK_PLL_APB1_HZ;
        rates.apb2_hz = CLOCK_PLL_APB2_HZ;
    }
    if (rates.crystal) {
        rcc.CR |= RCC_CR_CSSON; /* RM0090 7.2.7 */
    } else {
        rcc.CR &= ~(uint32_t)RCC_CR_HSEON;
    }
    return rates;
}

bool clock_has_reset(void)
{
    const bool has = crystal_state == CRYSTAL_HAS_RESET;

    if (has) {
        crystal_state = CRYSTAL_FAILED;
    }
    return has;
}

void clock_failure_interrupt(void)
{
    rcc.CIR |= RCC_CIR_CSSC;
    crystal_state = CRYSTAL_HAS_RESET;
    scb.AIRCR = SCB_AIRCR_RESET;
    synchronise();
}
