#include "can/layout.h"

bool layout_encode(lever_frame_t *frame, const layout_t *layout, const uint32_t code[], const float value[])
{
    uint64_t payload = 0u;
    uint32_t wrong = 0u; /* bits that have no place */
    for (uint32_t i = 0u; i < layout->codes; i++) {
        wrong |= code[i] & ~layout->code[i].mask;
        payload |= (uint64_t)code[i] << layout->code[i].start;
    }
    for (uint32_t i = 0u; i < layout->quantities; i++) {
        payload |= layout_bits(&layout->quantity[i], value[i]);
    }
    if (wrong == 0u) {
        layout_write(frame, layout->id, payload);
    }
    return wrong == 0u;
}

bool layout_decode(uint32_t code[], float value[], const layout_t *layout, const lever_frame_t *frame)
{
    const bool fits = layout_is(frame, layout->id);
    if (fits) {
        const uint64_t payload = layout_read(frame);
        for (uint32_t i = 0u; i < layout->codes; i++) {
            code[i] = layout_code(payload, layout->code[i]);
        }
        for (uint32_t i = 0u; i < layout->quantities; i++) {
            value[i] = layout_value(payload, &layout->quantity[i]);
        }
    }
    return fits;
}
