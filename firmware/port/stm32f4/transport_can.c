#include "port/stm32f4/can.h"
#include "port/stm32f4/registers.h"
#include "port/stm32f4/transport.h"

#ifndef LEVER_COMMANDS
#define LEVER_COMMANDS 0 /* CMakeLists.txt says it */
#endif

DEVICE_VECTORS = {[INTERRUPT_CAN1_TX] = can_transmit_interrupt,
    [INTERRUPT_CAN1_RX0] = can_receive_interrupt,
    [INTERRUPT_CAN1_SCE] = can_error_interrupt};

void transport_start(const clock_rates_t *rates)
{
    can_start(rates);
}

enum port_result transport_receive(void *self, lever_frame_t *frame)
{
    (void)self;
    return can_receive(frame) ? PORT_DONE : PORT_NOTHING;
}

enum port_result transport_send(void *self, const lever_frame_t *frame)
{
    (void)self;
    return can_send(frame) ? PORT_DONE : PORT_NOTHING;
}

bool transport_has_received(void)
{
    return can_has_received();
}

void transport_poll(uint32_t now_ms)
{
    can_poll(now_ms);
}

bool transport_is_served(void)
{
    return can_is_served();
}

bool transport_takes_commands(void)
{
    return LEVER_COMMANDS != 0;
}

void transport_status(lever_platform_t *status)
{
    const can_counts_t counts = can_counts();
    const can_errors_t errors = can_errors();

    status->faults |= errors.bus_off ? (uint8_t)LEVER_PLATFORM_BUS_OFF : 0u;
    status->transmit_errors = errors.transmit;
    status->receive_errors = errors.receive;
    status->bus_offs = (uint8_t)counts.bus_offs;
    status->overruns = (uint16_t)counts.overruns;
    status->dropped = (uint16_t)counts.dropped;
}
