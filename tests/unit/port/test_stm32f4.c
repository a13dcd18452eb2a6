/* What of the STM32F405 port is arithmetic: addresses, PLL, bit timing. How its drivers do on a bxCAN and clocks that behave like
 * ones: tests/target/bxcan. */
#include <stddef.h>

#include "port/stm32f4/bit_timing.h"
#include "port/stm32f4/clock.h"
#include "port/stm32f4/registers.h"
#include "test.h"

/* Offsets as the register maps of RM0090 (7.3.24, 8.4.11, 30.6.8, 32.9.5) and PM0214 (4.4.20) print them. */
TEST(registers_are_where_the_manual_says)
{
    TEST_ASSERT_EQUAL_HEX(0x30, offsetof(rcc_t, AHB1ENR));
    TEST_ASSERT_EQUAL_HEX(0x40, offsetof(rcc_t, APB1ENR));
    TEST_ASSERT_EQUAL_HEX(0x44, offsetof(rcc_t, APB2ENR));
    TEST_ASSERT_EQUAL_HEX(0x74, offsetof(rcc_t, CSR));
    TEST_ASSERT_EQUAL_HEX(0x20, offsetof(gpio_t, AFR));
    TEST_ASSERT_EQUAL_HEX(0x0C, offsetof(usart_t, CR1));
    TEST_ASSERT_EQUAL_HEX(0x1C, offsetof(can_t, BTR));
    TEST_ASSERT_EQUAL_HEX(0x180, offsetof(can_t, transmit));
    TEST_ASSERT_EQUAL_HEX(0x1B0, offsetof(can_t, receive));
    TEST_ASSERT_EQUAL_HEX(0x200, offsetof(can_t, FMR));
    TEST_ASSERT_EQUAL_HEX(0x20C, offsetof(can_t, FS1R));
    TEST_ASSERT_EQUAL_HEX(0x214, offsetof(can_t, FFA1R));
    TEST_ASSERT_EQUAL_HEX(0x21C, offsetof(can_t, FA1R));
    TEST_ASSERT_EQUAL_HEX(0x240, offsetof(can_t, FR));
    TEST_ASSERT_EQUAL_HEX(0x0C, offsetof(scb_t, AIRCR));
    TEST_ASSERT_EQUAL_HEX(0x28, offsetof(scb_t, CFSR));
    TEST_ASSERT_EQUAL_HEX(0x88, offsetof(scb_t, CPACR));
}

/* VCO of 336 MHz and its input of 1 to 2 MHz (RM0090 7.3.2), for the crystals that boards have. */
TEST(pll_reaches_168_mhz_from_every_crystal)
{
    for (int mhz = 4; mhz <= 26; mhz++) {
        const int m = CLOCK_PLL_M(mhz);
        TEST_ASSERT_EQUAL_INT(336 * m, mhz * CLOCK_PLL_N(mhz));
        TEST_ASSERT_TRUE((m >= 2) && (m <= 63) && (CLOCK_PLL_N(mhz) >= 50) && (CLOCK_PLL_N(mhz) <= 432));
        TEST_ASSERT_TRUE((mhz >= m) && (mhz <= (2 * m)));
    }
}

/* By hand from RM0090 32.7.7: 42 MHz / 2 is 21 quanta a bit, 1 + 15 before the sample point (76.2 %) and 5 after it; 16
 * MHz is 16 quanta, 1 + 11 (75 %) and 4. The jump width is 4. */
TEST(bit_timing_is_what_one_gets_by_hand)
{
    TEST_ASSERT_EQUAL_HEX32(0x034E0001u, BIT_TIMING_BTR(42000000));
    TEST_ASSERT_EQUAL_HEX32(0x033A0000u, BIT_TIMING_BTR(16000000));
    TEST_ASSERT_EQUAL_INT(761, BIT_TIMING_SAMPLE_POINT(42000000));
    TEST_ASSERT_EQUAL_INT(750, BIT_TIMING_SAMPLE_POINT(16000000));
}

/* Every clock that is accepted gives 1 Mbit/s within the hardware's limits; some must be refused. */
TEST(bit_timing_is_exact_or_refused)
{
    int accepted = 0;

    for (int hz = 1000000; hz <= 50000000; hz += 250000) {
        if (BIT_TIMING_IS_GOOD(hz)) {
            const uint32_t btr = BIT_TIMING_BTR(hz);
            const uint32_t quanta = 3u + ((btr >> 16) & 15u) + ((btr >> 20) & 7u);
            TEST_ASSERT_EQUAL_UINT32((uint32_t)hz, ((btr & 1023u) + 1u) * quanta * 1000000u);
            accepted++;
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(20, accepted);
    TEST_ASSERT_FALSE(BIT_TIMING_IS_GOOD(42500000)); /* no whole number of quanta */
    TEST_ASSERT_FALSE(BIT_TIMING_IS_GOOD(4000000));  /* too few of them */
}
