#include "can/messages.h"
#include "lever_build_port.h"
#include "port/slcan/slcan.h"
#include "port/stm32f4/registers.h"
#include "port/stm32f4/tick.h"
#include "port/stm32f4/transport.h"
#include "port/stm32f4/usart.h"

DEVICE_VECTORS = {[INTERRUPT_USART1] = usart_interrupt};

static slcan_t peer;

static bool put(void *self, const char *text, uint32_t length)
{
    (void)self;
    return usart_write(text, length);
}

void transport_start(const clock_rates_t *rates)
{
    static const slcan_sink_t sink = {.self = 0, .put = put};
    static const slcan_identity_t identity = {.version = SLCAN_VERSION, .serial = "F405"};

    slcan_init(&peer, &sink, &identity);
    usart_start(rates);
}

bool transport_has_received(void)
{
    return usart_has_received();
}

void transport_poll(uint32_t now_ms)
{
    static uint32_t overruns;

    (void)now_ms;
    usart_poll();
    if (usart_overruns() != overruns) {
        overruns = usart_overruns();
        peer.status |= (uint8_t)SLCAN_STATUS_DATA_OVERRUN; /* for F */
    }
}

bool transport_is_served(void)
{
    return usart_is_served();
}

bool transport_takes_commands(void)
{
    return true; /* a serial line is a bench */
}

void transport_status(lever_platform_t *status)
{
    status->overruns = (uint16_t)usart_overruns();
    status->dropped = (uint16_t)peer.counts.dropped;
}

/* Only data frames with its identifiers are the estimator's; the others were good SLCAN, and end here. */
enum port_result transport_receive(void *self, lever_frame_t *frame)
{
    uint8_t byte = 0u;
    slcan_frame_t received;
    bool found = false;

    (void)self;
    while (!found && usart_read(&byte)) {
        if (slcan_take(&peer, byte, &received)) {
            found = slcan_is_ours(&received, LEVER_IDENTIFIERS, frame);
        }
    }
    return found ? PORT_DONE : PORT_NOTHING;
}

/* What would leave too late has no room. */
enum port_result transport_send(void *self, const lever_frame_t *frame)
{
    const slcan_frame_t sent = slcan_shifted(frame, LEVER_IDENTIFIERS);

    (void)self;
    if (PORT_GOES_STALE(frame->id) && (usart_waiting_ms() >= (uint32_t)PORT_STALE_MS)) {
        return PORT_NOTHING;
    }
    return slcan_send(&peer, &sent, tick_ms()) ? PORT_DONE : PORT_NOTHING;
}
