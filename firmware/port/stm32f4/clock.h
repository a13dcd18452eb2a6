/* The clock tree: 168 MHz from the crystal; if that, or the PLL on it, does not start, from the internal oscillator; if
 * that fails, too, 16 MHz without PLL. */
#ifndef LEVER_PORT_STM32F4_CLOCK_H
#define LEVER_PORT_STM32F4_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

/* Crystal of the board [MHz]: 8 on ST's Discovery and many other boards, 12 on some, 25 on the Netduino Plus 2. */
#ifndef LEVER_STM32_HSE_MHZ
#define LEVER_STM32_HSE_MHZ 8
#endif

/* RM0090 7.2.3: the PLL multiplies 1 or, with less jitter, 2 MHz to 336 MHz (N), of which a half is the core's
 * clock. */
#define CLOCK_HSI_MHZ 16
#define CLOCK_PLL_INPUT_MHZ(source_mhz) ((((source_mhz) % 2) == 0) ? 2 : 1)
#define CLOCK_PLL_M(source_mhz) ((source_mhz) / CLOCK_PLL_INPUT_MHZ(source_mhz))
#define CLOCK_PLL_N(source_mhz) (336 / CLOCK_PLL_INPUT_MHZ(source_mhz))

#define CLOCK_PLL_CORE_HZ 168000000
#define CLOCK_PLL_APB1_HZ 42000000
#define CLOCK_PLL_APB2_HZ 84000000
#define CLOCK_RAW_HZ 16000000 /* of core, APB1 and APB2 without PLL */

#if (LEVER_STM32_HSE_MHZ < 4) || (LEVER_STM32_HSE_MHZ > 26)
#error "LEVER_STM32_HSE_MHZ: the crystal has 4 to 26 MHz (data sheet of the STM32F405, 5.3.8)"
#endif
#if ((LEVER_STM32_HSE_MHZ * CLOCK_PLL_N(LEVER_STM32_HSE_MHZ)) != (336 * CLOCK_PLL_M(LEVER_STM32_HSE_MHZ))) ||          \
    ((CLOCK_HSI_MHZ * CLOCK_PLL_N(CLOCK_HSI_MHZ)) != (336 * CLOCK_PLL_M(CLOCK_HSI_MHZ)))
#error "the PLL does not give 336 MHz"
#endif

typedef struct clock_rates {
    uint32_t core_hz;
    uint32_t apb1_hz; /* CAN1 */
    uint32_t apb2_hz; /* USART1 */
    bool has_pll;     /* the three above are those of CLOCK_PLL_..., otherwise CLOCK_RAW_HZ */
    bool crystal; /* they are as accurate as the crystal, otherwise as the internal oscillator: 1 % at 25 degrees C */
} clock_rates_t;

/* Sets the clocks up, from their state after reset. Bounded: 30 ms if nothing answers. */
clock_rates_t clock_start(void);

/* Whether the last reset was that of a crystal that failed; from then on it is reported. */
bool clock_has_reset(void);

/* Interrupt of the clock security system: the crystal has failed. Resets, to start from the internal oscillator until
 * the next power-on. */
void clock_failure_interrupt(void);

#endif
