#include "port/embedded/port.h"
#include "port/stm32f4/can.h"
#include "port/stm32f4/transport.h"

void transport_start(const clock_rates_t *rates)
{
    can_start(rates);
}

bool transport_has_received(void)
{
    return can_has_received();
}

void transport_poll(uint32_t now_ms)
{
    can_poll(now_ms);
}

transport_status_t transport_status(void)
{
    const can_counts_t counts = can_counts();
    const can_errors_t errors = can_errors();
    const transport_status_t status = {
        .overruns = counts.overruns,
        .dropped = counts.dropped,
        .bus_offs = counts.bus_offs,
        .transmit_errors = errors.transmit,
        .receive_errors = errors.receive,
        .bus_off = errors.bus_off,
    };

    return status;
}

bool port_receive(lever_frame_t *frame)
{
    return can_receive(frame);
}

void port_send(const lever_frame_t *frame)
{
    can_send(frame);
}
