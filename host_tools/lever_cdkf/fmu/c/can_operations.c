#include "can_operations.h"

#include <string.h>

enum { HEAD = 8, MOST_DATA = 8, MOST_IDENTIFIER = 0x7FF, BIT_RATE = 1, ARBITRATION_LOST = 4, AGAIN = 1 };

/* Lengths with their head, and places of arguments. */
enum {
    TRANSMIT_BYTES = 16, /* without data */
    AT_ID = 8,
    AT_EXTENDED = 12,
    AT_REMOTE = 13,
    AT_DATA_LENGTH = 14,
    IDENTIFIER_BYTES = 12, /* of CAN_CONFIRM and CAN_ARBITRATION_LOST */
    BUS_ERROR_BYTES = 15,
    AT_ERROR_FLAG = 13,
    AT_IS_SENDER = 14,
    STATUS_BYTES = 9,
    FORMAT_ERROR_BYTES = 10 /* without data */
};

static uint32_t number(const uint8_t *bytes, uint32_t count)
{
    uint32_t value = 0u;
    for (uint32_t i = count; i > 0u; i--) {
        value = (value << 8) | bytes[i - 1u];
    }
    return value;
}

static void put(uint8_t *bytes, uint32_t value, uint32_t count)
{
    for (uint32_t i = 0u; i < count; i++) {
        bytes[i] = (uint8_t)((value >> (8u * i)) & 0xFFu);
    }
}

/* --- received ----------------------------------------------------------------------------------------------------- */

static bool read_transmit(const uint8_t *bytes, can_operation_t *operation)
{
    bool is_right = operation->length >= (size_t)TRANSMIT_BYTES;
    if (is_right) {
        const uint32_t length = number(&bytes[AT_DATA_LENGTH], 2u);
        const uint32_t id = number(&bytes[AT_ID], 4u);
        is_right = (length <= (uint32_t)MOST_DATA) && (operation->length == ((size_t)TRANSMIT_BYTES + length)) &&
                   (bytes[AT_EXTENDED] <= 1u) && (bytes[AT_REMOTE] <= 1u);
        operation->is_data =
            is_right && (bytes[AT_EXTENDED] == 0u) && (bytes[AT_REMOTE] == 0u) && (id <= (uint32_t)MOST_IDENTIFIER);
        if (operation->is_data) {
            operation->frame.id = id;
            operation->frame.length = (uint8_t)length;
            (void)memcpy(operation->frame.data, &bytes[TRANSMIT_BYTES], length);
        }
    }
    return is_right;
}

static bool read_bus_error(const uint8_t *bytes, can_operation_t *operation)
{
    const bool is_right = operation->length == (size_t)BUS_ERROR_BYTES;
    if (is_right) {
        operation->is_first = (bytes[AT_ERROR_FLAG] == 1u);
        operation->is_sender = (bytes[AT_IS_SENDER] == 1u);
    }
    return is_right;
}

static bool read_arguments(const uint8_t *bytes, can_operation_t *operation)
{
    bool is_right = true; /* what no node answers is not looked into */
    operation->fault = "its arguments or its length are not those of its code";
    switch (operation->code) {
    case CAN_TRANSMIT:
        is_right = read_transmit(bytes, operation);
        break;
    case CAN_BUS_ERROR:
        is_right = read_bus_error(bytes, operation);
        break;
    case CAN_CONFIRM:
    case CAN_ARBITRATION_LOST:
        is_right = (operation->length == (size_t)IDENTIFIER_BYTES);
        break;
    case CAN_FORMAT_ERROR:
    case CAN_FD_TRANSMIT:
    case CAN_XL_TRANSMIT:
    case CAN_CONFIGURATION:
    case CAN_STATUS:
    case CAN_WAKEUP:
        break;
    default:
        operation->fault = "its code is unknown";
        is_right = false;
        break;
    }
    return is_right;
}

bool can_operation_read(const uint8_t *bytes, size_t size, can_operation_t *operation)
{
    bool is_right = false;
    (void)memset(operation, 0, sizeof *operation);
    operation->length = size;
    operation->fault = "its length is not that of the bytes there";
    if (size >= (size_t)HEAD) {
        const uint32_t length = number(&bytes[4], 4u);
        operation->code = number(bytes, 4u);
        if ((length >= (uint32_t)HEAD) && (length <= size)) {
            operation->length = length;
            is_right = read_arguments(bytes, operation);
        }
    }
    return is_right;
}

/* --- to send ------------------------------------------------------------------------------------------------------ */

/* The bytes of a new operation, behind its head; NULL: no room. */
static uint8_t *new_operation(const can_buffer_t *buffer, enum can_code code, size_t length)
{
    uint8_t *arguments = NULL;
    if ((*buffer->used <= buffer->room) && (length <= (buffer->room - *buffer->used))) {
        uint8_t *bytes = &buffer->bytes[*buffer->used];
        put(bytes, (uint32_t)code, 4u);
        put(&bytes[4], (uint32_t)length, 4u);
        *buffer->used += (uint32_t)length;
        arguments = &bytes[HEAD];
    }
    return arguments;
}

bool can_put_transmit(const can_buffer_t *buffer, const lever_frame_t *frame)
{
    uint8_t *arguments = new_operation(buffer, CAN_TRANSMIT, (size_t)TRANSMIT_BYTES + frame->length);
    if (arguments != NULL) {
        put(arguments, frame->id, 4u);
        put(&arguments[AT_EXTENDED - HEAD], 0u, 1u);
        put(&arguments[AT_REMOTE - HEAD], 0u, 1u);
        put(&arguments[AT_DATA_LENGTH - HEAD], frame->length, 2u);
        (void)memcpy(&arguments[TRANSMIT_BYTES - HEAD], frame->data, frame->length);
    }
    return arguments != NULL;
}

bool can_put_bit_rate(const can_buffer_t *buffer, uint32_t bit_rate)
{
    uint8_t *arguments = new_operation(buffer, CAN_CONFIGURATION, (size_t)HEAD + 5u);
    if (arguments != NULL) {
        put(arguments, BIT_RATE, 1u);
        put(&arguments[1], bit_rate, 4u);
    }
    return arguments != NULL;
}

bool can_put_buffering(const can_buffer_t *buffer)
{
    uint8_t *arguments = new_operation(buffer, CAN_CONFIGURATION, (size_t)HEAD + 2u);
    if (arguments != NULL) {
        put(arguments, ARBITRATION_LOST, 1u);
        put(&arguments[1], AGAIN, 1u);
    }
    return arguments != NULL;
}

bool can_put_status(const can_buffer_t *buffer, enum can_status status)
{
    uint8_t *arguments = new_operation(buffer, CAN_STATUS, STATUS_BYTES);
    if (arguments != NULL) {
        put(arguments, (uint32_t)status, 1u);
    }
    return arguments != NULL;
}

bool can_put_format_error(const can_buffer_t *buffer, const uint8_t *bytes, size_t size)
{
    const size_t kept = (size < (size_t)UINT16_MAX) ? size : (size_t)UINT16_MAX;
    uint8_t *arguments = new_operation(buffer, CAN_FORMAT_ERROR, (size_t)FORMAT_ERROR_BYTES + kept);
    if (arguments != NULL) {
        put(arguments, (uint32_t)kept, 2u);
        (void)memcpy(&arguments[FORMAT_ERROR_BYTES - HEAD], bytes, kept);
    }
    return arguments != NULL;
}
