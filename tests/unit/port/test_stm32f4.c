/* What of the STM32F405 port is arithmetic: addresses, PLL, bit timing. How its drivers do on a bxCAN and clocks
 * that behave like ones: tests/target/bxcan. */
#include <stddef.h>

#include "port/stm32f4/bit_timing.h"
#include "port/stm32f4/clock.h"
#include "port/stm32f4/registers.h"
#include "test.h"

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
