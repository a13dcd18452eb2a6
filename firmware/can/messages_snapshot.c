#include "can/layout.h"
#include "can/messages.h"

/* SNAPSHOT, multiplexed by part: a word and half a word, whatever they mean. A file of its own for a linker without
 * sections of functions. */

static const place_t part_place = CODE(12u, 15u);
static const place_t word_place = CODE(16u, UINT32_MAX);
static const place_t half_place = CODE(48u, 65535u);

bool message_snapshot_encode(lever_frame_t *frame, const message_snapshot_t *message)
{
    const uint8_t part = message->part;
    const bool known = (part < (uint8_t)MESSAGE_PART_COUNT);
    if (known) {
        const uint32_t word[MESSAGE_PART_COUNT] = {message->time_us, message->data_low, message->digest};
        const uint16_t half[MESSAGE_PART_COUNT] = {message->layout, message->data_high, message->length};
        layout_write(frame, (uint32_t)MESSAGE_SNAPSHOT_ID,
            ((uint64_t)part << part_place.start) | ((uint64_t)word[part] << word_place.start) |
                ((uint64_t)half[part] << half_place.start));
    }
    return known;
}

bool message_snapshot_decode(message_snapshot_t *message, const lever_frame_t *frame)
{
    const uint64_t payload = layout_read(frame);
    const uint32_t part = layout_code(payload, part_place);
    const bool fits = layout_is(frame, (uint32_t)MESSAGE_SNAPSHOT_ID) && (part < (uint32_t)MESSAGE_PART_COUNT);
    if (fits) {
        const uint32_t word = layout_code(payload, word_place);
        const uint16_t half = (uint16_t)layout_code(payload, half_place);
        *message = (message_snapshot_t){.part = (uint8_t)part};
        if (part == (uint32_t)MESSAGE_PART_BEGIN) {
            message->time_us = word;
            message->layout = half;
        } else if (part == (uint32_t)MESSAGE_PART_DATA) {
            message->data_low = word;
            message->data_high = half;
        } else {
            message->digest = word;
            message->length = half;
        }
    }
    return fits;
}
