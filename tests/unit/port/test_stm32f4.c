/* What of the STM32F405 port is arithmetic: addresses, PLL, bit timing; and its drivers on registers that are plain
 * memory here. How they do on a bxCAN that behaves like one: tests/target. */
#include <stddef.h>
#include <string.h>

#include "can/messages.h"
#include "port/stm32f4/bit_timing.h"
#include "port/stm32f4/can.c"   /* NOLINT(bugprone-suspicious-include): with memory for its registers */
#include "port/stm32f4/clock.c" /* NOLINT(bugprone-suspicious-include) */
#include "unity.h"

rcc_t rcc;
pwr_t pwr;
flash_t flash;
gpio_t gpiob;
can_t can1;
nvic_t nvic;
scb_t scb;

static const clock_rates_t full = {.pll = true, .crystal = true};

void setUp(void)
{
    (void)memset((void *)&rcc, 0, sizeof rcc);
    (void)memset((void *)&flash, 0, sizeof flash);
    (void)memset((void *)&gpiob, 0, sizeof gpiob);
    (void)memset((void *)&can1, 0, sizeof can1);
    ring_clear(&received);
    ring_clear(&waiting);
    (void)memset(since_ms, 0, sizeof since_ms);
    time_ms = 0u;
    crystal_state = 0u;
    off = false;
    counts.dropped = 0u;
    counts.overruns = 0u;
    counts.bus_offs = 0u;
}

void tearDown(void)
{
}

/* Offsets as the register maps of RM0090 (7.3.24, 8.4.11, 30.6.8, 32.9.5) and PM0214 (4.4.20) print them. */
static void registers_are_where_the_manual_says(void)
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
static void pll_reaches_168_mhz_from_every_crystal(void)
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
static void bit_timing_is_what_one_gets_by_hand(void)
{
    TEST_ASSERT_EQUAL_HEX32(0x034E0001u, BIT_TIMING_BTR(42000000));
    TEST_ASSERT_EQUAL_HEX32(0x033A0000u, BIT_TIMING_BTR(16000000));
    TEST_ASSERT_EQUAL_INT(761, BIT_TIMING_SAMPLE_POINT(42000000));
    TEST_ASSERT_EQUAL_INT(750, BIT_TIMING_SAMPLE_POINT(16000000));
}

/* Every clock that is accepted gives 1 Mbit/s within the hardware's limits; some must be refused. */
static void bit_timing_is_exact_or_refused(void)
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

/* RM0090 figure 342: a 16-bit identifier is STID[10:0] RTR IDE EXID[17:15]. */
static void filter_lets_the_inputs_through(void)
{
    can_start(&full);
    TEST_ASSERT_EQUAL_HEX32(0x22202200u, can1.FR[0][0]); /* 0x111, 0x110 */
    TEST_ASSERT_EQUAL_HEX32(0x24002240u, can1.FR[0][1]); /* 0x120, 0x112 */
    TEST_ASSERT_EQUAL_HEX32(0x42E042E0u, can1.FR[1][0]); /* 0x217, as often as there is room */
    TEST_ASSERT_EQUAL_HEX32(0x42E042E0u, can1.FR[1][1]);
    TEST_ASSERT_EQUAL_HEX32(3u, can1.FM1R);
    TEST_ASSERT_EQUAL_HEX32(3u, can1.FA1R);
    TEST_ASSERT_EQUAL_HEX32(0u, can1.FS1R | can1.FFA1R | (can1.FMR & 1u));
}

static void start_gives_pins_and_timing(void)
{
    can_start(&full);
    TEST_ASSERT_EQUAL_HEX32(0x99u, gpiob.AFR[1] & 0xFFu);         /* AF9 for PB8 and PB9 */
    TEST_ASSERT_EQUAL_HEX32(0x000A0000u, gpiob.MODER & 0xF0000u); /* alternate function */
    TEST_ASSERT_EQUAL_HEX32(0x034E0001u, can1.BTR);
    TEST_ASSERT_EQUAL_HEX32(BIT(16) | BIT(6) | BIT(3) | BIT(2), can1.MCR); /* DBF, ABOM, RFLM, TXFP; no longer INRQ */
    const clock_rates_t raw = {.pll = false};
    can_start(&raw);
    TEST_ASSERT_EQUAL_HEX32(0x033A0000u, can1.BTR);
}

static void received_frame_is_read_and_released(void)
{
    lever_frame_t frame;

    can1.RFR[0] = 1u;
    can1.receive[0] = (can_mailbox_t){.IR = 0x111u << 21, .DTR = 0xABCD0008u, .DLR = 0x03020100u, .DHR = 0x07060504u};
    can_receive_interrupt();
    TEST_ASSERT_EQUAL_HEX32(BIT(5), can1.RFR[0]);
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL_HEX32(0x111, frame.id);
    TEST_ASSERT_EQUAL_UINT8(8, frame.length);
    for (uint8_t i = 0u; i < 8u; i++) {
        TEST_ASSERT_EQUAL_UINT8(i, frame.data[i]);
    }
    TEST_ASSERT_FALSE(can_receive(&frame));
}

/* A DLC of 9 to 15 means 8 bytes (ISO 11898-1). */
static void length_is_at_most_eight(void)
{
    lever_frame_t frame;

    can1.RFR[0] = 1u;
    can1.receive[0].DTR = 15u;
    can_receive_interrupt();
    TEST_ASSERT_TRUE(can_receive(&frame));
    TEST_ASSERT_EQUAL_UINT8(8, frame.length);
}

static void full_ring_and_full_fifo_are_counted(void)
{
    for (int i = 0; i < 33; i++) {
        can1.RFR[0] = 1u;
        can_receive_interrupt();
    }
    TEST_ASSERT_EQUAL_UINT32(1u, can_counts().overruns);
    can1.RFR[0] = BIT(4);
    can_receive_interrupt();
    TEST_ASSERT_EQUAL_UINT32(2u, can_counts().overruns);
}

static void sent_frame_fills_the_mailbox_that_is_next(void)
{
    const lever_frame_t frame = {.id = 0x210u, .length = 8u, .data = {0, 1, 2, 3, 4, 5, 6, 7}};

    can1.TSR = BIT(27) | (1u << 24); /* mailbox 1 is empty, and next */
    can_send(&frame);
    TEST_ASSERT_EQUAL_HEX32((0x210u << 21) | 1u, can1.transmit[1].IR);
    TEST_ASSERT_EQUAL_HEX32(8u, can1.transmit[1].DTR);
    TEST_ASSERT_EQUAL_HEX32(0x03020100u, can1.transmit[1].DLR);
    TEST_ASSERT_EQUAL_HEX32(0x07060504u, can1.transmit[1].DHR);
}

static void frames_without_room_are_dropped_and_counted(void)
{
    const lever_frame_t frame = {.id = 0x210u, .length = 8u};
    int taken = 0;

    while (can_send(&frame)) { /* no mailbox is empty */
        taken++;
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT(18, taken); /* two steps with all their frames */
    TEST_ASSERT_FALSE(can_send(&frame));
    TEST_ASSERT_EQUAL_UINT32(2u, can_counts().dropped);
}

/* Each by its own age, in a mailbox or before one: on a bus that lets one through now and then, too. */
static void stale_frames_are_taken_back(void)
{
    const lever_frame_t frame = {.id = 0x215u, .length = 8u};

    can_poll(1000u);
    can1.TSR = CAN_TSR_TME0; /* mailbox 0 is empty, and next */
    TEST_ASSERT_TRUE(can_send(&frame));
    can1.TSR = 2u * CAN_TSR_TME0;
    can_poll(1010u);
    can1.TSR = 0u;
    TEST_ASSERT_TRUE(can_send(&frame)); /* waits before a mailbox */
    since_ms[1] = 1010u;
    since_ms[2] = 1010u;
    can_poll(1019u);
    TEST_ASSERT_EQUAL_HEX32(0u, can1.TSR);
    can_poll(1020u);
    TEST_ASSERT_EQUAL_HEX32(CAN_TSR_ABRQ0, can1.TSR);
    can1.TSR = CAN_TSR_RQCP0; /* without TXOK0: taken back */
    can_transmit_interrupt();
    TEST_ASSERT_EQUAL_UINT32(1u, can_counts().dropped);
    can_poll(1030u);
    can1.TSR = CAN_TSR_TME0;
    can1.transmit[0].IR = 0u;
    can_transmit_interrupt();
    TEST_ASSERT_EQUAL_UINT32(2u, can_counts().dropped);
    TEST_ASSERT_EQUAL_HEX32(0u, can1.transmit[0].IR);
}

static void bus_off_drops_what_waits_and_refuses_more(void)
{
    const lever_frame_t frame = {.id = 0x215u, .length = 8u};

    can_send(&frame);
    can1.ESR = BIT(2) | (200u << 16) | (3u << 24);
    can_error_interrupt();
    can_error_interrupt(); /* the same one again */
    can_send(&frame);
    TEST_ASSERT_EQUAL_UINT32(1u, can_counts().bus_offs);
    TEST_ASSERT_EQUAL_UINT32(2u, can_counts().dropped);
    TEST_ASSERT_TRUE(can_errors().bus_off);
    TEST_ASSERT_EQUAL_UINT8(200, can_errors().transmit);
    TEST_ASSERT_EQUAL_UINT8(3, can_errors().receive);

    can1.ESR = 0u; /* 128 times 11 recessive bits later */
    can_poll(2000u);
    can1.TSR = CAN_TSR_TME;
    can_send(&frame);
    TEST_ASSERT_EQUAL_HEX32((0x215u << 21) | 1u, can1.transmit[0].IR);
}

/* A clock tree of which nothing is ever ready, as in QEMU. */
static void without_any_clock_the_internal_one_runs_on(void)
{
    const clock_rates_t rates = clock_start();

    TEST_ASSERT_FALSE(rates.pll);
    TEST_ASSERT_FALSE(rates.crystal);
    TEST_ASSERT_EQUAL_UINT32(16000000u, rates.core_hz);
    TEST_ASSERT_EQUAL_HEX32(0u, rcc.CFGR);
}

/* Registers of memory keep what is written, so a ready flag that is set here stays. */
static void without_crystal_the_pll_runs_from_the_internal_oscillator(void)
{
    rcc.CR = RCC_CR_PLLRDY;
    (void)clock_start();
    TEST_ASSERT_EQUAL_HEX32(8u | (168u << 6) | (7u << 24), rcc.PLLCFGR); /* 16 MHz / 8 * 168, source HSI */
    TEST_ASSERT_EQUAL_HEX32(0x705u, flash.ACR);
    TEST_ASSERT_EQUAL_HEX32(0u, rcc.CR & (RCC_CR_HSEON | RCC_CR_CSSON));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(registers_are_where_the_manual_says);
    RUN_TEST(pll_reaches_168_mhz_from_every_crystal);
    RUN_TEST(bit_timing_is_what_one_gets_by_hand);
    RUN_TEST(bit_timing_is_exact_or_refused);
    RUN_TEST(filter_lets_the_inputs_through);
    RUN_TEST(start_gives_pins_and_timing);
    RUN_TEST(received_frame_is_read_and_released);
    RUN_TEST(length_is_at_most_eight);
    RUN_TEST(full_ring_and_full_fifo_are_counted);
    RUN_TEST(sent_frame_fills_the_mailbox_that_is_next);
    RUN_TEST(frames_without_room_are_dropped_and_counted);
    RUN_TEST(stale_frames_are_taken_back);
    RUN_TEST(bus_off_drops_what_waits_and_refuses_more);
    RUN_TEST(without_any_clock_the_internal_one_runs_on);
    RUN_TEST(without_crystal_the_pll_runs_from_the_internal_oscillator);
    return UNITY_END();
}
