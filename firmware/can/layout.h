/* How a message lies in its frame: codes (integers) and quantities (physical values) at places of a payload of 64 bits,
 * byte 0 lowest (Intel bit order).
 *
 * A quantity has one code for "not available": the most negative one where it is signed, all ones where it is not.
 */
#ifndef CAN_LAYOUT_H
#define CAN_LAYOUT_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "math/rounding.h"

enum { FRAME_BYTES = 8 };

typedef struct place {
    uint32_t mask; /* 2^width - 1 */
    uint8_t start; /* the lowest bit */
} place_t;

/* The resolution is given as counts per unit because that, unlike the DBC's decimal step, is exact in a float: then
 * value * per_unit and count / per_unit are each rounded only once. */
typedef struct quantity {
    place_t place;
    bool is_signed;
    float per_unit;
} quantity_t;

#define CODE(start_bit, mask) {(mask), (start_bit)}
#define UNSIGNED(start_bit, mask, counts_per_unit) {CODE(start_bit, mask), false, (counts_per_unit)}
#define SIGNED(start_bit, mask, counts_per_unit) {CODE(start_bit, mask), true, (counts_per_unit)}

/* --- one code, one quantity --------------------------------------------------------------------------------------- */

static inline uint32_t layout_code(uint64_t payload, place_t place)
{
    return (uint32_t)(payload >> place.start) & place.mask;
}

/* Bits of the count that means "not available". */
static inline uint32_t layout_not_available(const quantity_t *quantity)
{
    const uint32_t mask = quantity->place.mask;
    return quantity->is_signed ? (mask ^ (mask >> 1u)) : mask;
}

/* The nearest count, half to even, at its place; not available for NaN and what does not fit. */
static inline uint64_t layout_bits(const quantity_t *quantity, float value)
{
    const uint32_t mask = quantity->place.mask;
    const uint32_t most = quantity->is_signed ? (mask >> 1u) : (mask - 1u);
    const float greatest = (float)most;
    const float least = quantity->is_signed ? -greatest : 0.0f;
    const float rounded = nearest_integer(value * quantity->per_unit);
    uint32_t bits = layout_not_available(quantity);
    if ((rounded >= least) && (rounded <= greatest)) {
        bits = (uint32_t)(int32_t)rounded & mask;
    }
    return (uint64_t)bits << quantity->place.start;
}

/* NaN where it is not available. */
static inline float layout_value(uint64_t payload, const quantity_t *quantity)
{
    const uint32_t bits = layout_code(payload, quantity->place);
    const uint32_t sign = quantity->is_signed ? layout_not_available(quantity) : 0u;
    const uint32_t flipped = bits ^ sign;
    const int32_t count = (int32_t)flipped - (int32_t)sign; /* extends the sign */
    return (bits == layout_not_available(quantity)) ? NAN : ((float)count / quantity->per_unit);
}

/* --- the payload of a frame --------------------------------------------------------------------------------------- */

static inline bool layout_is(const lever_frame_t *frame, uint32_t id)
{
    return (frame->id == id) && (frame->length == (uint8_t)FRAME_BYTES);
}

/* Byte by byte, lowest first, whatever the byte order and alignment of the machine. */
static inline void layout_write(lever_frame_t *frame, uint32_t id, uint64_t payload)
{
    const uint32_t word[2] = {(uint32_t)(payload & UINT32_MAX), (uint32_t)(payload >> 32u)};
    frame->id = id;
    frame->length = (uint8_t)FRAME_BYTES;
    for (uint32_t i = 0u; i < 2u; i++) {
        uint8_t *byte = &frame->data[4u * i];
        byte[0] = (uint8_t)(word[i] & 0xFFu);
        byte[1] = (uint8_t)((word[i] >> 8u) & 0xFFu);
        byte[2] = (uint8_t)((word[i] >> 16u) & 0xFFu);
        byte[3] = (uint8_t)(word[i] >> 24u);
    }
}

static inline uint32_t layout_read_word(const uint8_t byte[4])
{
    return (uint32_t)byte[0] | ((uint32_t)byte[1] << 8u) | ((uint32_t)byte[2] << 16u) | ((uint32_t)byte[3] << 24u);
}

static inline uint64_t layout_read(const lever_frame_t *frame)
{
    return layout_read_word(&frame->data[0]) | ((uint64_t)layout_read_word(&frame->data[4]) << 32u);
}

/* --- any message, by a table: smaller than code for each ---------------------------------------------------------- */

typedef struct layout {
    const place_t *code;
    const quantity_t *quantity;
    uint32_t id;
    uint8_t codes; /* how many */
    uint8_t quantities;
} layout_t;

#define COUNT(array) ((uint8_t)(sizeof(array) / sizeof((array)[0])))
#define LAYOUT(id, code, quantity) {(code), (quantity), (uint32_t)(id), COUNT(code), COUNT(quantity)}
#define CODES_ONLY(id, code) {(code), NULL, (uint32_t)(id), COUNT(code), 0u}

/* Writes identifier, length and all payload bits. Returns false, leaving the frame alone, when a code does not fit. */
bool layout_encode(lever_frame_t *frame, const layout_t *layout, const uint32_t code[], const float value[]);

/* Reads all codes and quantities. Returns false, and touches nothing, when the frame is not of this message. */
bool layout_decode(uint32_t code[], float value[], const layout_t *layout, const lever_frame_t *frame);

#endif
