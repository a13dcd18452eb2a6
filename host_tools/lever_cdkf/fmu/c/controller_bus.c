/* Samples and commands from the frames of a CAN bus, as bus operations of FMI-LS-BUS; answers back.
 *
 * Time is that of the simulation. What comes in an event is answered at the end of the next step, as that standard asks
 * of a Tx_Clock that is triggered. */
#include "can_operations.h"
#include "controller.h"

#include <string.h>

#define PERIOD 1.0e-6
#define LEAST_BIT_RATE 1.0e4
#define MOST_BIT_RATE 1.0e6
#define RECOVERY_BITS 1408.0 /* 128 times 11 recessive bits, after which a node that is off the bus is back on it */

enum { PASSIVE = 128, OFF = 256, ERROR_STEP = 8, MOST_RECEIVE_ERRORS = 136 };

static uint64_t now_us(const fmu_t *fmu)
{
    return fmu->samples;
}

static can_buffer_t to_send(controller_input_t *input)
{
    const can_buffer_t buffer = {input->tx, sizeof input->tx, &input->ready};
    return buffer;
}

/* --- out ---------------------------------------------------------------------------------------------------------- */

static void send_answers(controller_t *controller)
{
    controller_input_t *input = &controller->input;
    const can_buffer_t buffer = to_send(input);
    lever_frame_t frame;
    while (lever_next_frame(controller->lever, &frame)) {
        if ((input->status == (uint32_t)CAN_BUS_OFF) || !can_put_transmit(&buffer, &frame)) {
            input->dropped++;
        }
    }
}

static void set_status(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    controller_input_t *input = &controller->input;
    const can_buffer_t buffer = to_send(input);
    uint32_t status = CAN_ERROR_ACTIVE;
    if (input->transmit_errors >= (uint32_t)OFF) {
        status = CAN_BUS_OFF;
    } else if ((input->transmit_errors >= (uint32_t)PASSIVE) || (input->receive_errors >= (uint32_t)PASSIVE)) {
        status = CAN_ERROR_PASSIVE;
    } else {
        /* few errors */
    }
    if (status != input->status) {
        static const char *const name[] = {"error active", "error passive", "bus off"};
        fmu_log(fmu, (status == (uint32_t)CAN_BUS_OFF) ? fmi3Warning : fmi3OK, "CAN node: %s", name[status - 1u]);
        if (status == (uint32_t)CAN_BUS_OFF) {
            input->bus_offs++;
            input->back_us = now_us(fmu) + (uint64_t)((RECOVERY_BITS * 1.0e6) / fmu->value[AT_can_bit_rate]);
        }
        (void)can_put_status(&buffer, (enum can_status)status);
        input->status = status;
    }
}

/* --- in ----------------------------------------------------------------------------------------------------------- */

static uint8_t limited(uint32_t count)
{
    return (uint8_t)((count < (uint32_t)UINT8_MAX) ? count : (uint32_t)UINT8_MAX);
}

/* What a CAN controller would report; only where the bus simulation tells of errors. */
static void report_node(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    controller_input_t *input = &controller->input;
    const lever_platform_t platform = {
        .faults = (uint8_t)(((input->status == (uint32_t)CAN_BUS_OFF) ? (uint32_t)LEVER_PLATFORM_BUS_OFF : 0u) |
                            ((input->dropped > 0u) ? (uint32_t)LEVER_PLATFORM_DROPPED : 0u)),
        .transmit_errors = limited(input->transmit_errors),
        .receive_errors = limited(input->receive_errors),
        .bus_offs = limited(input->bus_offs),
        .dropped = (uint16_t)((input->dropped < (uint32_t)UINT16_MAX) ? input->dropped : (uint32_t)UINT16_MAX),
    };
    lever_platform(controller->lever, &platform);
    input->dropped = 0u;
}

static void take_frame(fmu_t *fmu, const lever_frame_t *frame, bool is_notified)
{
    controller_t *controller = fmu->model;
    if (lever_on_frame(controller->lever, frame) == LEVER_FRAME_SAMPLE) {
        if (is_notified) {
            report_node(fmu);
        }
        (void)lever_step(controller->lever);
        controller->input.sample_us = now_us(fmu);
        controller_report(fmu);
    }
    send_answers(controller);
}

/* The error counters of ISO 11898-1. */
static void count_error(controller_input_t *input, const can_operation_t *operation)
{
    if (operation->is_sender) {
        input->transmit_errors += (uint32_t)ERROR_STEP;
    } else if (input->receive_errors < (uint32_t)PASSIVE) {
        input->receive_errors += operation->is_first ? (uint32_t)ERROR_STEP : 1u;
    } else {
        /* it stays there */
    }
}

static void count_received(controller_input_t *input)
{
    if (input->receive_errors >= (uint32_t)PASSIVE) {
        input->receive_errors = (uint32_t)PASSIVE - 1u;
    } else if (input->receive_errors > 0u) {
        input->receive_errors--;
    } else {
        /* none */
    }
}

static void take(fmu_t *fmu, const can_operation_t *operation)
{
    controller_t *controller = fmu->model;
    controller_input_t *input = &controller->input;
    const bool is_notified = (fmu->value[AT_Can_BusNotifications] != 0.0);
    if (input->status == (uint32_t)CAN_BUS_OFF) {
        /* it hears nothing */
    } else if (operation->code == (uint32_t)CAN_TRANSMIT) {
        count_received(input);
        if (operation->is_data) {
            take_frame(fmu, &operation->frame, is_notified);
        }
    } else if (is_notified && (operation->code == (uint32_t)CAN_CONFIRM)) {
        input->transmit_errors -= (input->transmit_errors > 0u) ? 1u : 0u;
    } else if (is_notified && (operation->code == (uint32_t)CAN_ARBITRATION_LOST)) {
        input->dropped++;
    } else if (is_notified && (operation->code == (uint32_t)CAN_BUS_ERROR)) {
        count_error(input, operation);
    } else if (operation->code == (uint32_t)CAN_FORMAT_ERROR) {
        fmu_log(fmu, fmi3Warning, "the bus has refused an operation of this FMU as wrong in its format");
    } else {
        /* between others, or of CAN FD or CAN XL */
    }
    set_status(fmu);
}

static void take_all(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    controller_input_t *input = &controller->input;
    size_t at = 0u;
    while (at < input->received) {
        can_operation_t operation;
        const uint8_t *bytes = &input->rx[at];
        if (can_operation_read(bytes, input->received - at, &operation)) {
            take(fmu, &operation);
        } else {
            const can_buffer_t buffer = to_send(input);
            fmu_log(fmu, fmi3Warning,
                "Rx_Data, byte %zu: no operation of FMI-LS-BUS for CAN: %s (code 0x%X, %zu bytes)", at, operation.fault,
                (unsigned)operation.code, operation.length);
            (void)can_put_format_error(&buffer, bytes, operation.length);
        }
        at += operation.length;
    }
}

/* --- of controller.h ---------------------------------------------------------------------------------------------- */

void input_start(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    const can_buffer_t buffer = to_send(&controller->input);
    fmu->period = PERIOD;
    controller->input.status = CAN_ERROR_ACTIVE;
    (void)can_put_bit_rate(&buffer, (uint32_t)fmu->value[AT_can_bit_rate]);
    (void)can_put_buffering(&buffer);
}

bool input_accepts(fmu_t *fmu, uint32_t variable, double value)
{
    const bool accepts =
        (variable != (uint32_t)AT_can_bit_rate) || ((value >= LEAST_BIT_RATE) && (value <= MOST_BIT_RATE));
    if (!accepts) {
        fmu_log(fmu, fmi3Error, "can_bit_rate = %g is out of range: it must be a number from %g to %g bit/s", value,
            LEAST_BIT_RATE, MOST_BIT_RATE);
    }
    return accepts;
}

void input_step(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    controller_input_t *input = &controller->input;
    const uint64_t now = now_us(fmu) + 1u;
    if ((now - input->sample_us) >= (uint64_t)CONTROLLER_IDLE_US) {
        lever_idle(controller->lever, (uint32_t)(now - input->sample_us));
        input->sample_us = now;
        send_answers(controller);
        controller_report(fmu);
    }
    if ((input->status == (uint32_t)CAN_BUS_OFF) && (now >= input->back_us)) {
        input->transmit_errors = 0u;
        input->receive_errors = 0u;
        set_status(fmu);
    }
}

bool input_is_usable(const uint8_t *bytes)
{
    uint32_t received = 0u;
    uint32_t ready = 0u;
    uint32_t status = 0u;
    (void)memcpy(&received, &bytes[offsetof(controller_input_t, received)], sizeof received);
    (void)memcpy(&ready, &bytes[offsetof(controller_input_t, ready)], sizeof ready);
    (void)memcpy(&status, &bytes[offsetof(controller_input_t, status)], sizeof status);
    return (received <= (uint32_t)CAN_BYTES) && (ready <= (uint32_t)CAN_BYTES) && (status >= 1u) && (status <= 3u);
}

/* --- of fmu.h ----------------------------------------------------------------------------------------------------- */

bool model_set_binary(fmu_t *fmu, uint32_t variable, const uint8_t *bytes, size_t size)
{
    controller_t *controller = fmu->model;
    controller_input_t *input = &controller->input;
    (void)variable;
    if (size > sizeof input->rx) {
        fmu_log(fmu, fmi3Error, "Rx_Data: %zu bytes, but there is room for %zu", size, sizeof input->rx);
        return false;
    }
    if (size > 0u) {
        (void)memcpy(input->rx, bytes, size);
    }
    input->received = (uint32_t)size;
    return true;
}

void model_get_binary(fmu_t *fmu, uint32_t variable, const uint8_t **bytes, size_t *size)
{
    controller_t *controller = fmu->model;
    const bool is_sent = (variable == (uint32_t)AT_Tx_Data);
    *bytes = is_sent ? controller->input.tx : controller->input.rx;
    *size = is_sent ? controller->input.ready : controller->input.received;
}

void model_set_clock(fmu_t *fmu, uint32_t variable, bool is_active)
{
    controller_t *controller = fmu->model;
    (void)variable;
    controller->input.is_received = is_active ? 1u : 0u;
}

bool model_get_clock(fmu_t *fmu, uint32_t variable)
{
    controller_t *controller = fmu->model;
    bool is_active = (controller->input.is_received != 0u);
    if (variable == (uint32_t)AT_Tx_Clock) {
        is_active = (controller->input.is_ticking != 0u);
        controller->input.is_ticking = 0u;
    }
    return is_active;
}

bool model_ticks(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    controller->input.is_ticking = (controller->input.ready > 0u) ? 1u : 0u;
    controller->input.is_sent = controller->input.is_ticking;
    return controller->input.is_ticking != 0u;
}

void model_update(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    controller_input_t *input = &controller->input;
    if (input->is_sent != 0u) {
        input->ready = 0u;
    }
    input->is_sent = 0u;
    input->is_ticking = 0u;
    if (input->is_received != 0u) {
        take_all(fmu);
    }
    input->is_received = 0u;
    input->received = 0u;
    model_put_outputs(fmu);
}
