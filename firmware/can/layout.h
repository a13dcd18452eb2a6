/* How a message lies in its frame: codes (integers) and quantities (physical values) at places of a payload of 64 bits, byte 0
 * lowest (Intel bit order). messages.c has the layout of each message.
 *
 * A quantity has one code for "not available": the most negative one where it is signed, all ones where it is not.
 */
#ifndef CAN_LAYOUT_H
#define CAN_LAYOUT_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"

typedef struct place {
    uint32_t mask; /* 2^width - 1 */
    uint8_t start; /* the lowest bit */
} place_t;

/* The resolution is given as counts per unit because that, unlike the DBC's decimal step, is exact in a float: then value *
 * per_unit and count / per_unit are each rounded only once. */
typedef struct quantity {
    place_t place;
    float per_unit;
    float least; /* counts: 0 and 2^width - 2, or -(2^(width-1) - 1) and 2^(width-1) - 1 */
    float greatest;
} quantity_t;

typedef struct layout {
    uint32_t id;
    const place_t *code;
    const quantity_t *quantity;
    uint8_t codes; /* how many */
    uint8_t quantities;
} layout_t;

/* Writes identifier, length and all payload bits. A value that is NaN or does not fit is sent as not available. Returns
 * false, and leaves the frame untouched, when a code does not fit. */
bool layout_encode(lever_frame_t *frame, const layout_t *layout, const uint32_t code[], const float value[]);

/* Reads all codes and quantities; NaN is one that is not available. Returns false, and touches nothing, when the frame's
 * identifier or length is not the layout's. */
bool layout_decode(uint32_t code[], float value[], const layout_t *layout, const lever_frame_t *frame);

#endif
