#include "can/layout.h"

#include <math.h>

enum { FRAME_BYTES = 8 };

/* Four bytes, lowest first, whatever the byte order and alignment of the machine. */
static void write_word(uint8_t bytes[4], uint32_t word)
{
    bytes[0] = (uint8_t)(word & 0xFFu);
    bytes[1] = (uint8_t)((word >> 8u) & 0xFFu);
    bytes[2] = (uint8_t)((word >> 16u) & 0xFFu);
    bytes[3] = (uint8_t)(word >> 24u);
}

static uint32_t read_word(const uint8_t bytes[4])
{
    return (uint32_t)bytes[0] | ((uint32_t)bytes[1] << 8u) | ((uint32_t)bytes[2] << 16u) | ((uint32_t)bytes[3] << 24u);
}

/* Bits of the count that means "not available". */
static uint32_t not_available(const quantity_t *quantity)
{
    const uint32_t mask = quantity->place.mask;
    return (quantity->least < 0.0f) ? (mask ^ (mask >> 1u)) : mask;
}

/* Bits of the nearest count, half away from zero. */
static uint32_t quantity_bits(const quantity_t *quantity, float value)
{
    const float scaled = value * quantity->per_unit;
    uint32_t bits = 0u;
    if ((scaled > (quantity->least - 0.5f)) && (scaled < (quantity->greatest + 0.5f))) {
        /* The float below 0.5: it rounds 0.5 up like 0.5 would, but not 0.49999997. */
        const float rounded = scaled + ((scaled < 0.0f) ? -0.49999997f : 0.49999997f);
        bits = (uint32_t)(int32_t)rounded & quantity->place.mask;
    } else { /* NaN too */
        bits = not_available(quantity);
    }
    return bits;
}

static float quantity_value(const quantity_t *quantity, uint32_t bits)
{
    const uint32_t mask = quantity->place.mask;
    const bool negative = (quantity->least < 0.0f) && (bits > (mask >> 1u));
    const int32_t count = (int32_t)bits - (negative ? (int32_t)(mask + 1u) : 0);
    return (bits == not_available(quantity)) ? NAN : ((float)count / quantity->per_unit);
}

bool layout_encode(lever_frame_t *frame, const layout_t *layout, const uint32_t code[], const float value[])
{
    uint64_t payload = 0u;
    uint32_t wrong = 0u; /* bits that have no place */
    for (uint32_t i = 0u; i < layout->codes; i++) {
        const place_t place = layout->code[i];
        wrong |= code[i] & ~place.mask;
        payload |= (uint64_t)code[i] << place.start;
    }
    for (uint32_t i = 0u; i < layout->quantities; i++) {
        const quantity_t *quantity = &layout->quantity[i];
        payload |= (uint64_t)quantity_bits(quantity, value[i]) << quantity->place.start;
    }
    if (wrong == 0u) {
        frame->id = layout->id;
        frame->length = (uint8_t)FRAME_BYTES;
        write_word(&frame->data[0], (uint32_t)(payload & UINT32_MAX));
        write_word(&frame->data[4], (uint32_t)(payload >> 32u));
    }
    return wrong == 0u;
}

bool layout_decode(uint32_t code[], float value[], const layout_t *layout, const lever_frame_t *frame)
{
    const bool fits = (frame->id == layout->id) && (frame->length == (uint8_t)FRAME_BYTES);
    if (fits) {
        const uint64_t payload = read_word(&frame->data[0]) | ((uint64_t)read_word(&frame->data[4]) << 32u);
        for (uint32_t i = 0u; i < layout->codes; i++) {
            code[i] = (uint32_t)(payload >> layout->code[i].start) & layout->code[i].mask;
        }
        for (uint32_t i = 0u; i < layout->quantities; i++) {
            const quantity_t *quantity = &layout->quantity[i];
            value[i] = quantity_value(quantity, (uint32_t)(payload >> quantity->place.start) & quantity->place.mask);
        }
    }
    return fits;
}
