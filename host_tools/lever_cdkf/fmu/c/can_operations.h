/* Bus operations of CAN as FMI-LS-BUS 1.0 lays them out: code and length of 4 bytes each, then arguments, the least
 * significant byte first. */
#ifndef CAN_OPERATIONS_H
#define CAN_OPERATIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "lever_cdkf.h"

enum can_code {
    CAN_FORMAT_ERROR = 0x01,
    CAN_TRANSMIT = 0x10,
    CAN_FD_TRANSMIT = 0x11,
    CAN_XL_TRANSMIT = 0x12,
    CAN_CONFIRM = 0x20,
    CAN_ARBITRATION_LOST = 0x30,
    CAN_BUS_ERROR = 0x31,
    CAN_CONFIGURATION = 0x40,
    CAN_STATUS = 0x41,
    CAN_WAKEUP = 0x42
};

enum can_status { CAN_ERROR_ACTIVE = 1, CAN_ERROR_PASSIVE = 2, CAN_BUS_OFF = 3 };

/* An operation that was received. */
typedef struct can_operation {
    uint32_t code;       /* enum can_code */
    size_t length;       /* bytes, all of it */
    const char *fault;   /* why these bytes are no operation, where they are none */
    bool is_data;        /* of CAN_TRANSMIT: a data frame with an 11-bit identifier */
    lever_frame_t frame; /* then */
    bool is_first;       /* of CAN_BUS_ERROR: this node has found the error */
    bool is_sender;      /* of CAN_BUS_ERROR: it was sending */
} can_operation_t;

/* Where operations are put one behind the other. */
typedef struct can_buffer {
    uint8_t *bytes;
    size_t room;
    uint32_t *used;
} can_buffer_t;

/* Reads the first operation of `size` bytes; false: these bytes are none, `length` of them. */
bool can_operation_read(const uint8_t *bytes, size_t size, can_operation_t *operation);

/* Each puts an operation behind those before; false: no room, and nothing is put. */
bool can_put_transmit(const can_buffer_t *buffer, const lever_frame_t *frame);
bool can_put_bit_rate(const can_buffer_t *buffer, uint32_t bit_rate);
bool can_put_buffering(const can_buffer_t *buffer); /* what loses arbitration is to be sent again by the bus */
bool can_put_status(const can_buffer_t *buffer, enum can_status status);
bool can_put_format_error(const can_buffer_t *buffer, const uint8_t *bytes, size_t size);

#endif
