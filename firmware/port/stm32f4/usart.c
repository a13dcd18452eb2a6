#include "port/stm32f4/usart.h"

#include "port/embedded/ring.h"
#include "port/stm32f4/pins.h"
#include "port/stm32f4/processor.h"
#include "port/stm32f4/registers.h"

/* RM0090 30.3.4: BRR is the clock by the rate, both in whole numbers. Receivers bear 2 % in all; this end may have
 * half. */
#define DIVIDER(clock_hz) (((clock_hz) + (LEVER_STM32_BAUD / 2)) / LEVER_STM32_BAUD)
#define ERROR_HZ(clock_hz) ((DIVIDER(clock_hz) * LEVER_STM32_BAUD) - (clock_hz))
#define IS_GOOD(clock_hz)                                                                                              \
    ((DIVIDER(clock_hz) >= 16) && (DIVIDER(clock_hz) <= 0xFFFF) && (ERROR_HZ(clock_hz) <= ((clock_hz) / 100)) &&       \
        (-ERROR_HZ(clock_hz) <= ((clock_hz) / 100)))

#if !IS_GOOD(CLOCK_PLL_APB2_HZ) || !IS_GOOD(CLOCK_RAW_HZ)
#error "LEVER_STM32_BAUD: not within 1 % of what the clocks of USART1 (84 MHz, 16 MHz) divide to"
#endif

enum {
    RECEIVE_BYTES = 1024,  /* 10 ms at 1 Mbit/s */
    TRANSMIT_BYTES = 2048, /* 13 steps with all their frames */
    BYTES_AT_ONCE = 32,
    FUNCTION_USART = 7, /* alternate function of PA9 and PA10: data sheet, table 9 */
    PIN_TRANSMIT = 9,
    PIN_RECEIVE = 10
};

static volatile uint8_t receive_bytes[RECEIVE_BYTES];
static volatile uint8_t transmit_bytes[TRANSMIT_BYTES];
static ring_t received = {.bytes = receive_bytes, .size = RECEIVE_BYTES};
static ring_t waiting = {.bytes = transmit_bytes, .size = TRANSMIT_BYTES};
static volatile uint32_t overruns;
static bool is_served; /* usart_is_served() */

void usart_start(const clock_rates_t *rates)
{
    rcc.AHB1ENR |= RCC_AHB1_GPIOA;
    rcc.APB2ENR |= RCC_APB2_USART1;
    (void)rcc.APB2ENR; /* errata ES0182 2.1.13: a clock is there two cycles after its enabling */
    pin_to_peripheral(&gpioa, PIN_TRANSMIT, FUNCTION_USART);
    pin_to_peripheral(&gpioa, PIN_RECEIVE, FUNCTION_USART);
    usart1.BRR = rates->has_pll ? DIVIDER(CLOCK_PLL_APB2_HZ) : DIVIDER(CLOCK_RAW_HZ);
    usart1.CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
    nvic.ISER[INTERRUPT_USART1 / 32u] = BIT(INTERRUPT_USART1 % 32u);
}

/* Writes while there is room in the hardware, which is two bytes; the rest goes out by interrupt. A QEMU older than 8.2
 * has no such interrupt, but always has room. From the interrupt, or with interrupts off. */
static void transmit(void)
{
    uint8_t byte = 0u;

    while (((usart1.SR & USART_SR_TXE) != 0u) && ring_get(&waiting, &byte, 1u)) {
        usart1.DR = byte;
    }
    if (ring_used(&waiting) != 0u) {
        usart1.CR1 |= USART_CR1_TXEIE;
    } else {
        usart1.CR1 &= ~(uint32_t)USART_CR1_TXEIE;
    }
}

/* Takes what has arrived. RM0090 30.6.1: reading SR, then DR, clears ORE too. A byte with a framing or noise error
 * spoils its line, which is refused. In QEMU the next byte may be there at once, and then raises no interrupt of its
 * own: therefore several at once, and usart_poll(). From the interrupt, or with interrupts off. */
static void receive(void)
{
    for (uint32_t i = 0u; i < (uint32_t)BYTES_AT_ONCE; i++) {
        const uint32_t status = usart1.SR;
        if ((status & ((uint32_t)USART_SR_RXNE | (uint32_t)USART_SR_ORE)) == 0u) {
            break;
        }
        const uint8_t byte = (uint8_t)usart1.DR;
        if ((status & USART_SR_ORE) != 0u) {
            overruns++;
        }
        if (((status & USART_SR_RXNE) != 0u) && !ring_put(&received, &byte, 1u)) {
            overruns++;
        }
    }
}

void usart_interrupt(void)
{
    receive();
    if ((usart1.CR1 & USART_CR1_TXEIE) != 0u) {
        transmit();
    }
}

void usart_poll(void)
{
    static uint32_t got;

    interrupts_off();
    receive();
    is_served = (ring_used(&waiting) == 0u) || (waiting.got != got);
    got = waiting.got;
    interrupts_on();
}

bool usart_is_served(void)
{
    return is_served;
}

bool usart_read(uint8_t *byte)
{
    return ring_get(&received, byte, 1u);
}

bool usart_has_received(void)
{
    return ring_used(&received) != 0u;
}

bool usart_write(const void *bytes, uint32_t length)
{
    interrupts_off();
    const bool taken = ring_put(&waiting, bytes, length);
    transmit();
    interrupts_on();
    return taken;
}

uint32_t usart_waiting_ms(void)
{
    return (10u * 1000u * ring_used(&waiting)) / (uint32_t)LEVER_STM32_BAUD;
}

uint32_t usart_overruns(void)
{
    return overruns;
}
