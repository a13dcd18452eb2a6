#include "port/stm32f4/can.h"

#include "can/messages.h"
#include "lever_build_port.h"
#include "port/embedded/ring.h"
#include "port/identifiers.h"
#include "port/port.h"
#include "port/stm32f4/bit_timing.h"
#include "port/stm32f4/pins.h"
#include "port/stm32f4/processor.h"
#include "port/stm32f4/registers.h"
#include "port/stm32f4/wait.h"

#if !BIT_TIMING_IS_GOOD(CLOCK_PLL_APB1_HZ) || !BIT_TIMING_IS_GOOD(CLOCK_RAW_HZ)
#error "no bit timing for 1 Mbit/s from the clock of CAN1"
#endif

/* A frame to send. */
typedef struct queued {
    lever_frame_t frame;
    uint32_t since_ms;
} queued_t;

enum {
    FRAME_BYTES = sizeof(lever_frame_t),
    QUEUED_BYTES = sizeof(queued_t),
    RECEIVE_BYTES = 512,  /* 16 samples: 32 frames */
    TRANSMIT_BYTES = 512, /* two steps with all their frames */
    MODE_POLLS = 10000,
    FUNCTION_CAN = 9, /* alternate function of PB8 and PB9: data sheet, table 9 */
    PIN_RECEIVE = 8,
    PIN_TRANSMIT = 9
};

static volatile uint8_t receive_bytes[RECEIVE_BYTES];
static volatile uint8_t transmit_bytes[TRANSMIT_BYTES];
static ring_t received = {.bytes = receive_bytes, .size = RECEIVE_BYTES};
static ring_t waiting = {.bytes = transmit_bytes, .size = TRANSMIT_BYTES};
static volatile can_counts_t counts; /* each written by one interrupt, or with interrupts off */
static volatile bool off;            /* the bus */
static volatile uint32_t time_ms;    /* of the last can_poll() */
static volatile bool receive_came;   /* the interrupt, since then */
static volatile bool transmit_came;
static bool is_served;                   /* can_is_served() */
static uint32_t since_ms[CAN_MAILBOXES]; /* of the frame in each */

/* --- start ------------------------------------------------------------------------------------------------------- */

static void start_pins(void)
{
    rcc.AHB1ENR |= RCC_AHB1_GPIOB;
    rcc.APB1ENR |= RCC_APB1_CAN1;
    (void)rcc.APB1ENR; /* errata ES0182 2.1.13: a clock is there two cycles after its enabling */
    pin_to_peripheral(&gpiob, PIN_RECEIVE, FUNCTION_CAN);
    pin_to_peripheral(&gpiob, PIN_TRANSMIT, FUNCTION_CAN);
}

/* Identifier, IDE and RTR of a data frame, as mailboxes and filters have them (RM0090 32.9.5 and 32.7.4). */
static uint32_t identifier_word(uint32_t id)
{
    const uint32_t bus = identifiers_to_bus(LEVER_IDENTIFIERS, id);

    return ((bus & IDENTIFIERS_EXTENDED) != 0u) ? (FIELD(bus & ~IDENTIFIERS_EXTENDED, CAN_IR_EXID_LOWEST) | CAN_IR_IDE)
                                                : FIELD(bus, CAN_IR_STID_LOWEST);
}

static void start_filter(void)
{
    static const uint32_t inputs[5] = PORT_INPUTS;

    can1.FMR |= CAN_FMR_FINIT;
    can1.FA1R = 0u;
    can1.FM1R = BIT(0) | BIT(1) | BIT(2); /* banks 0 to 2: lists ... */
    can1.FS1R = BIT(0) | BIT(1) | BIT(2); /* ... of two identifiers each ... */
    can1.FFA1R = 0u;                      /* ... into FIFO 0 */
    can1.FR[0][0] = identifier_word(inputs[0]);
    can1.FR[0][1] = identifier_word(inputs[1]);
    can1.FR[1][0] = identifier_word(inputs[2]);
    can1.FR[1][1] = identifier_word(inputs[3]);
    can1.FR[2][0] = identifier_word(inputs[4]);
    can1.FR[2][1] = identifier_word(inputs[4]);
    can1.FA1R = BIT(0) | BIT(1) | BIT(2);
    can1.FMR &= ~(uint32_t)CAN_FMR_FINIT;
}

void can_start(const clock_rates_t *rates)
{
    start_pins();
    /* RM0090 32.4.1: out of sleep into initialisation mode */
    can1.MCR = CAN_MCR_DBF | CAN_MCR_INRQ;
    (void)wait_for(&can1.MSR, CAN_MSR_INAK, CAN_MSR_INAK, MODE_POLLS);
    can1.MCR = CAN_MCR_DBF | CAN_MCR_INRQ | CAN_MCR_ABOM | CAN_MCR_RFLM | CAN_MCR_TXFP;
    /* cppcheck-suppress misra-c2012-10.8 ; D7 */
    can1.BTR = rates->has_pll ? BIT_TIMING_BTR(CLOCK_PLL_APB1_HZ) : BIT_TIMING_BTR(CLOCK_RAW_HZ);
    start_filter();
    can1.IER = CAN_IER_TMEIE | CAN_IER_FMPIE0 | CAN_IER_FOVIE0 | CAN_IER_BOFIE | CAN_IER_ERRIE;
    nvic.ISER[0] = BIT(INTERRUPT_CAN1_TX) | BIT(INTERRUPT_CAN1_RX0) | BIT(INTERRUPT_CAN1_SCE);
    /* On the bus as soon as it has been idle for 11 bits, which on a dead bus may be never. */
    can1.MCR = CAN_MCR_DBF | CAN_MCR_ABOM | CAN_MCR_RFLM | CAN_MCR_TXFP;
    (void)wait_for(&can1.MSR, CAN_MSR_INAK, 0u, MODE_POLLS);
}

/* --- reception --------------------------------------------------------------------------------------------------- */

static void read_mailbox(const can_mailbox_t *mailbox, lever_frame_t *frame)
{
    const uint32_t words[2] = {mailbox->DLR, mailbox->DHR};
    const uint32_t length = mailbox->DTR & CAN_DTR_DLC;

    const uint32_t word = mailbox->IR;
    const bool extended = (word & CAN_IR_IDE) != 0u;
    const uint32_t bus =
        extended ? ((word >> CAN_IR_EXID_LOWEST) | IDENTIFIERS_EXTENDED) : (word >> CAN_IR_STID_LOWEST);

    frame->id = identifiers_from_bus(LEVER_IDENTIFIERS, bus);
    frame->length = (uint8_t)((length < 8u) ? length : 8u);
    for (uint32_t i = 0u; i < 8u; i++) {
        frame->data[i] = (uint8_t)(words[i / 4u] >> (8u * (i % 4u)));
    }
}

/* RM0090 32.7.3. A mailbox that is being released still looks full: then the interrupt comes again. */
void can_receive_interrupt(void)
{
    lever_frame_t frame;

    receive_came = true;
    if ((can1.RFR[0] & CAN_RFR_FOVR) != 0u) {
        can1.RFR[0] = CAN_RFR_FOVR;
        counts.overruns++;
    }
    if (((can1.RFR[0] & CAN_RFR_FMP) != 0u) && ((can1.RFR[0] & CAN_RFR_RFOM) == 0u)) {
        read_mailbox(&can1.receive[0], &frame);
        can1.RFR[0] = CAN_RFR_RFOM;
        if (!ring_put(&received, &frame, FRAME_BYTES)) {
            counts.overruns++;
        }
    }
}

bool can_receive(lever_frame_t *frame)
{
    return ring_get(&received, frame, FRAME_BYTES);
}

bool can_has_received(void)
{
    return ring_used(&received) != 0u;
}

/* --- transmission ------------------------------------------------------------------------------------------------ */

static void write_mailbox(can_mailbox_t *mailbox, const lever_frame_t *frame)
{
    uint32_t words[2] = {0u, 0u};

    for (uint32_t i = 0u; i < 8u; i++) {
        words[i / 4u] |= (uint32_t)frame->data[i] << (8u * (i % 4u));
    }
    mailbox->IR = identifier_word(frame->id);
    mailbox->DTR = frame->length;
    mailbox->DLR = words[0];
    mailbox->DHR = words[1];
    mailbox->IR |= CAN_IR_TXRQ;
}

static bool is_stale(uint32_t since)
{
    return (time_ms - since) >= (uint32_t)PORT_STALE_MS;
}

/* The next frame that is still worth sending; drops those that are not. */
static bool next_waiting(queued_t *next)
{
    bool found = false;

    while (!found && ring_get(&waiting, next, QUEUED_BYTES)) {
        found = !is_stale(next->since_ms);
        counts.dropped += found ? 0u : 1u;
    }
    return found;
}

/* Fills empty mailboxes (RM0090 32.7.1). From the interrupt, or with interrupts off. */
static void fill_mailboxes(void)
{
    queued_t next;

    for (uint32_t i = 0u; i < (uint32_t)CAN_MAILBOXES; i++) {
        if (((can1.TSR & CAN_TSR_TME) != 0u) && next_waiting(&next)) {
            const uint32_t mailbox = (can1.TSR >> CAN_TSR_CODE_LOWEST) & 3u;
            since_ms[mailbox] = next.since_ms;
            write_mailbox(&can1.transmit[mailbox], &next.frame);
        }
    }
}

/* Takes back what is in mailboxes and ring; a frame on the bus at the moment is finished. With interrupts off. */
static void drop_all(void)
{
    const uint32_t frames = ring_used(&waiting) / (uint32_t)QUEUED_BYTES;

    counts.dropped += frames;
    ring_clear(&waiting);
    can1.TSR = CAN_TSR_ABRQ;
}

/* A request has ended: with success, or because it was taken back. */
void can_transmit_interrupt(void)
{
    const uint32_t status = can1.TSR;

    transmit_came = true;
    for (uint32_t mailbox = 0u; mailbox < (uint32_t)CAN_MAILBOXES; mailbox++) {
        if ((status & FIELD(CAN_TSR_RQCP0, 8u * mailbox)) != 0u) {
            can1.TSR = FIELD(CAN_TSR_RQCP0, 8u * mailbox);
            counts.dropped += ((status & FIELD(CAN_TSR_TXOK0, 8u * mailbox)) != 0u) ? 0u : 1u;
        }
    }
    fill_mailboxes();
}

bool can_send(const lever_frame_t *frame)
{
    const queued_t queued = {.frame = *frame, .since_ms = time_ms};

    interrupts_off();
    const bool taken = !off && ring_put(&waiting, &queued, QUEUED_BYTES);
    if (taken) {
        fill_mailboxes();
    } else {
        counts.dropped++;
    }
    interrupts_on();
    return taken;
}

/* What raises an interrupt is there, and none has come. */
static bool look_for_interrupts(void)
{
    const bool waits = (can1.RFR[0] & CAN_RFR_FMP) != 0u;
    const bool ended = (can1.TSR & CAN_TSR_RQCP) != 0u;
    const bool served = (receive_came || !waits) && (transmit_came || !ended);

    receive_came = false;
    transmit_came = false;
    return served;
}

bool can_is_served(void)
{
    return is_served;
}

/* RM0090 32.7.1: what is taken back raises the interrupt, which counts it. */
void can_poll(uint32_t now_ms)
{
    interrupts_off();
    if (now_ms != time_ms) {
        is_served = look_for_interrupts();
    }
    time_ms = now_ms;
    if ((can1.ESR & CAN_ESR_BOFF) == 0u) {
        off = false;
    }
    for (uint32_t mailbox = 0u; mailbox < (uint32_t)CAN_MAILBOXES; mailbox++) {
        if (((can1.TSR & FIELD(CAN_TSR_TME0, mailbox)) == 0u) && is_stale(since_ms[mailbox])) {
            can1.TSR = FIELD(CAN_TSR_ABRQ0, 8u * mailbox);
        }
    }
    interrupts_on();
}

/* --- errors ------------------------------------------------------------------------------------------------------ */

/* RM0090 32.7.6. Of the changes of the error state only bus-off asks for this interrupt. */
void can_error_interrupt(void)
{
    can1.MSR = CAN_MSR_ERRI;
    if (((can1.ESR & CAN_ESR_BOFF) != 0u) && !off) {
        off = true;
        counts.bus_offs++;
        drop_all();
    }
}

can_counts_t can_counts(void)
{
    const can_counts_t now = {.overruns = counts.overruns, .dropped = counts.dropped, .bus_offs = counts.bus_offs};

    return now;
}

can_errors_t can_errors(void)
{
    const uint32_t esr = can1.ESR;
    const can_errors_t now = {
        .transmit = (uint8_t)(esr >> CAN_ESR_TEC_LOWEST),
        .receive = (uint8_t)(esr >> CAN_ESR_REC_LOWEST),
        .bus_off = (esr & CAN_ESR_BOFF) != 0u,
    };

    return now;
}
