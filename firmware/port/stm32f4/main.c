/* The estimator on an STM32F405: self tests, then the loop for ever. README.md says what is reported when. */
#include <stddef.h>
#include <string.h>

#include "can/e2e.h"
#include "can/messages.h"
#include "lever_build.h"
#include "lever_build_port.h"
#include "lever_cdkf.h"
#include "port/command_guard.h"
#include "port/embedded/self_test.h"
#include "port/loop.h"
#include "port/stm32f4/clock.h"
#include "port/stm32f4/fault.h"
#include "port/stm32f4/periodic_test.h"
#include "port/stm32f4/processor.h"
#include "port/stm32f4/reset_cause.h"
#include "port/stm32f4/tick.h"
#include "port/stm32f4/transport.h"
#include "port/stm32f4/watchdog.h"

enum {
    SHOWN_MS = 1000, /* a loss is shown for so long, so that some HEALTH frame shows it */
    RESET_MS = 1000  /* between two PLATFORM_RESET */
};

/* A count, and until when its last change is to be seen. */
typedef struct loss {
    uint32_t count;
    uint32_t since_ms;
    bool shown;
} loss_t;

static lever_memory_t memory;
static loop_t loop;
static uint8_t lasting_faults; /* of enum lever_platform_fault, until the next reset */
static message_platform_reset_t reset;
static loss_t overruns;
static loss_t dropped;

/* --- port.h: what is not the transport's -------------------------------------------------------------------------- */

static bool is_shown(loss_t *loss, uint32_t count, uint32_t now_ms)
{
    if (count != loss->count) {
        loss->count = count;
        loss->since_ms = now_ms;
        loss->shown = true;
    } else if ((now_ms - loss->since_ms) >= (uint32_t)SHOWN_MS) {
        loss->shown = false;
    } else {
        /* as it was */
    }
    return loss->shown;
}

static uint32_t faults_of(uint32_t failed_tests)
{
    uint32_t faults = ((failed_tests & (uint32_t)MESSAGE_SELF_TEST_ROM) != 0u) ? (uint32_t)LEVER_PLATFORM_ROM : 0u;

    faults |= ((failed_tests & ~(uint32_t)MESSAGE_SELF_TEST_ROM) != 0u) ? (uint32_t)LEVER_PLATFORM_SELF_TEST : 0u;
    return faults;
}

/* In two places, as one of them may be the bit of RAM that is wrong. */
static void note_failed(uint32_t tests)
{
    reset.failed |= (uint8_t)tests;
    lasting_faults |= (uint8_t)faults_of(tests);
}

static void report_status(void *self, lever_platform_t *status)
{
    const uint32_t now_ms = tick_ms();

    (void)self;
    (void)memset(status, 0, sizeof *status);
    transport_status(status);
    status->dropped = (uint16_t)(status->dropped + (uint32_t)loop.totals.stale);
    status->faults |= (uint8_t)(lasting_faults | faults_of(reset.failed));
    status->faults |= is_shown(&overruns, status->overruns, now_ms) ? (uint8_t)LEVER_PLATFORM_OVERRUN : 0u;
    status->faults |= is_shown(&dropped, status->dropped, now_ms) ? (uint8_t)LEVER_PLATFORM_DROPPED : 0u;
}

/* Every interrupt ends it, and the tick is one. Interrupts are off between the look and the sleep, so that none comes
 * between them; it ends the sleep all the same. */
static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    (void)self;
    (void)for_frame;
    transport_poll(tick_ms());
    interrupts_off();
    if ((timeout_ms != 0) && !transport_has_received()) {
        wait_for_interrupt();
    }
    interrupts_on();
    return true;
}

static uint32_t now_us(void *self)
{
    (void)self;
    return 1000u * tick_ms();
}

static command_guard_t guard = {.receive = transport_receive};
static const port_t port = {
    .self = &guard,
    .receive = command_guard_receive,
    .send = transport_send,
    .wait = wait_frame,
    .now_us = now_us,
    .status = report_status,
};

/* --- start ------------------------------------------------------------------------------------------------------- */

/* The one place where the configuration is made; COMMAND changes models and choices later. */
static lever_t *configure(void)
{
    static lever_config_t config; /* as long as the instance */

    lever_build_config(&config);
    lever_t *lever = lever_init(&memory, &config);
    if ((lever != NULL) && !lever_aircraft(lever, lever_build_aircraft())) {
        lever = NULL;
    }
    return lever;
}

static uint32_t fault_of(enum message_cause cause)
{
    uint32_t fault = 0u;

    if (cause == MESSAGE_CAUSE_WATCHDOG) {
        fault = LEVER_PLATFORM_WATCHDOG;
    } else if ((cause == MESSAGE_CAUSE_HARD_FAULT) || (cause == MESSAGE_CAUSE_STACK_OVERFLOW)) {
        fault = LEVER_PLATFORM_HARD_FAULT;
    } else {
        /* nothing went wrong, or CLOCK says so */
    }
    return fault;
}

/* Nothing here stops the estimator: it says what is wrong, and who depends on it decides. Each step takes less than the
 * 0.35 s that the watchdog allows at the least, at 16 MHz, too. */
static void test_all(const clock_rates_t *rates)
{
    reset.cause = (uint8_t)reset_cause_read();
    reset.resets = (uint8_t)reset_cause_count();
    reset.fault_address = fault_last.pc;
    lasting_faults = rates->crystal ? (uint8_t)0u : (uint8_t)LEVER_PLATFORM_CLOCK;
    lasting_faults |= (uint8_t)fault_of((enum message_cause)reset.cause);
    watchdog_start();
    note_failed(periodic_test_start());
    watchdog_kick();
    note_failed(self_test(&memory) ? 0u : (uint32_t)MESSAGE_SELF_TEST_GOLDEN);
    watchdog_kick();
}

/* --- beside the loop --------------------------------------------------------------------------------------------- */

/* The loop has finished something: a step, or telling the estimator that no sample comes, which is due each LOOP_IDLE_MS.
 * Going round, or a tick, or interrupts are nothing, and neither is a step if what its frames travel by stands still. */
static void feed_watchdog(void)
{
    static uint32_t fed_us;

    if ((loop.sample_us != fed_us) && transport_is_served()) {
        fed_us = loop.sample_us;
        watchdog_kick();
    }
}

static void send_reset(void)
{
    static uint8_t counter;
    lever_frame_t frame;

    if (message_platform_reset_encode(&frame, &reset)) {
        e2e_protect(&frame, MESSAGE_PLATFORM_RESET_DATA_ID, counter);
        (void)transport_send(NULL, &frame); /* counted there if it finds no room */
        counter++;
    }
}

/* After the first sample and then each second, if there are samples: on a bus that asks nothing, nothing is said. */
static void report_reset(uint32_t now_ms)
{
    static uint32_t sent_ms;
    static uint64_t samples;

    if ((loop.totals.samples != samples) && ((samples == 0u) || ((now_ms - sent_ms) >= (uint32_t)RESET_MS))) {
        samples = loop.totals.samples;
        sent_ms = now_ms;
        send_reset();
    }
}

/* In a line, so that the watchdog is not fed without the tests either. */
static void each_millisecond(void)
{
    static uint32_t last_ms;
    const uint32_t now_ms = tick_ms();

    if (now_ms != last_ms) {
        last_ms = now_ms;
        note_failed(periodic_test_step());
        report_reset(now_ms);
        feed_watchdog();
    }
}

/* For ever: a configuration is refused, so that nothing can be estimated, and each second the bus is told. What is
 * received is taken, as a host may have to open its channel, and ends here. */
static void report_refusal(void)
{
    uint32_t sent_ms = tick_ms();
    lever_frame_t frame;

    note_failed((uint32_t)MESSAGE_SELF_TEST_SETTINGS);
    while (wait_frame(NULL, true, 1)) {
        const uint32_t now_ms = tick_ms();
        while (transport_receive(NULL, &frame) == PORT_DONE) {
            /* for nobody */
        }
        if ((now_ms - sent_ms) >= (uint32_t)RESET_MS) {
            sent_ms = now_ms;
            send_reset();
        }
        if (transport_is_served()) {
            watchdog_kick();
        }
    }
}

int main(void)
{
    const clock_rates_t rates = clock_start();

    test_all(&rates);
    lever_t *lever = configure();
    tick_start(rates.core_hz);
    transport_start(&rates);
    watchdog_tighten(); /* not before: at 16 MHz lever_init() may take longer than the loop may */
    if (lever != NULL) {
        guard.lever = lever;
        guard.takes_commands = transport_takes_commands();
        loop_init(&loop, &port, lever, LOOP_DROP);
        while (loop_turn(&loop) == PORT_DONE) {
            each_millisecond();
        }
    } else {
        report_refusal();
    }
    return 1; /* never: the watchdog resets */
}
