/* USART1 of the STM32F405 port and SLCAN on it, on registers that are plain memory here: what is read stays there, and
 * what is written is read back. */
#include <string.h>

#include "port/stm32f4/transport_slcan.c" /* NOLINT(bugprone-suspicious-include): with memory for the registers */
#include "port/stm32f4/usart.c"           /* NOLINT(bugprone-suspicious-include) */
#include "test.h"

rcc_t rcc;
gpio_t gpioa;
usart_t usart1;
nvic_t nvic;

static const clock_rates_t full = {.has_pll = true, .crystal = true};

uint32_t tick_ms(void)
{
    return 0u;
}

void setUp(void)
{
    (void)memset((void *)&usart1, 0, sizeof usart1);
    (void)memset((void *)&gpioa, 0, sizeof gpioa);
    ring_clear(&received);
    ring_clear(&waiting);
    overruns = 0u;
    transport_start(&full);
}

/* The bytes, as if they had come by interrupt. */
static void receive_text(const char *text)
{
    for (; *text != '\0'; text++) {
        TEST_ASSERT_TRUE(ring_put(&received, text, 1u));
    }
}

TEST(received_byte_is_read_and_counted_as_overrun_when_one_was_lost)
{
    uint8_t byte = 0u;

    usart1.DR = 'x';
    usart1.SR = BIT(5);
    usart_interrupt();
    TEST_ASSERT_TRUE(usart_has_received());
    TEST_ASSERT_TRUE(usart_read(&byte));
    TEST_ASSERT_EQUAL_UINT8('x', byte);
    TEST_ASSERT_EQUAL_UINT32(0u, usart_overruns());
    usart1.SR = BIT(5) | BIT(3);
    usart_interrupt();
    TEST_ASSERT_GREATER_THAN_UINT32(0u, usart_overruns());
}

/* A receiver that says for ever that it has a byte must not hold the processor. */
TEST(an_interrupt_takes_so_many_bytes_and_a_full_ring_counts)
{
    usart1.SR = BIT(5);
    usart_interrupt();
    TEST_ASSERT_EQUAL_UINT32(32u, ring_used(&received));
    for (int i = 0; i < 32; i++) {
        usart_poll();
    }
    TEST_ASSERT_EQUAL_UINT32(1024u, ring_used(&received));
    TEST_ASSERT_EQUAL_UINT32(32u, usart_overruns());
}

TEST(a_line_without_room_is_dropped_whole)
{
    static const char line[31];

    for (int i = 0; i < 66; i++) {
        TEST_ASSERT_TRUE(usart_write(line, sizeof line));
    }
    TEST_ASSERT_FALSE(usart_write(line, sizeof line));
    TEST_ASSERT_EQUAL_UINT32(66u * 31u, ring_used(&waiting));
}

/* 2,000 bytes take 20 ms at 1 Mbit/s; a line has 22. */
TEST(a_motor_command_that_would_leave_late_has_no_room)
{
    static const lever_frame_t motor = {.id = 0x215u, .length = 8u};
    static const lever_frame_t state = {.id = 0x210u, .length = 8u};
    lever_frame_t none;
    int lines = 0;

    receive_text("O\r");
    (void)transport_receive(NULL, &none);
    while (transport_send(NULL, &motor) == PORT_DONE) {
        lines++;
    }
    TEST_ASSERT_EQUAL_INT(2000 / 22 + 1, lines);
    TEST_ASSERT_EQUAL_INT(PORT_DONE, transport_send(NULL, &state));
}

TEST(losses_are_in_the_status_and_in_the_flags)
{
    static const lever_frame_t frame = {.id = 0x210u, .length = 8u};
    lever_platform_t status = {0};
    lever_frame_t none;

    receive_text("O\r");
    TEST_ASSERT_EQUAL_INT(PORT_NOTHING, transport_receive(NULL, &none));
    for (int i = 0; i < 200; i++) { /* nobody takes them */
        (void)transport_send(NULL, &frame);
    }
    TEST_ASSERT_EQUAL_INT(PORT_NOTHING, transport_send(NULL, &frame));
    transport_status(&status);
    TEST_ASSERT_GREATER_THAN_UINT32(0u, status.dropped);
    usart1.SR = BIT(3);
    usart_interrupt();
    usart1.SR = 0u;
    transport_poll(0u);
    transport_status(&status);
    TEST_ASSERT_GREATER_THAN_UINT32(0u, status.overruns);
    TEST_ASSERT_BITS_HIGH(SLCAN_STATUS_DATA_OVERRUN, peer.status);
}
