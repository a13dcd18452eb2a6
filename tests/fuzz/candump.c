/* Any bytes as a recording: whatever is read of it is a frame that can be, is the same however the text is cut, and,
 * written, is read again.
 *
 * The first byte says where the text is cut. */
#include <string.h>

#include "bulk.h"
#include "require.h"

enum { MOST_FRAMES = 256, ROOM_BYTES = MOST_FRAMES * (BULK_BUS_NAME + 64) };

typedef struct recording {
    bulk_buses_t buses;
    bulk_frame_t frames[MOST_FRAMES];
    uint64_t count;
    uint64_t lines;
    uint64_t damaged;
} recording_t;

/* Reads what there is room for and returns the bytes done with. */
static uint64_t read_some(recording_t *recording, const char *text, uint64_t size, uint64_t room)
{
    bulk_parsed_t parsed;
    const uint64_t left = (uint64_t)MOST_FRAMES - recording->count;
    const uint64_t count = bulk_parse(
        text, size, &recording->buses, &recording->frames[recording->count], (room < left) ? room : left, &parsed);
    REQUIRE((count <= room) && (count <= left) && (parsed.used <= size));
    REQUIRE((count + parsed.damaged) == parsed.lines);
    recording->count += count;
    recording->lines += parsed.lines;
    recording->damaged += parsed.damaged;
    return parsed.used;
}

static void check_frame(const bulk_buses_t *buses, const bulk_frame_t *frame)
{
    const bool is_extended = (frame->flags & (uint8_t)(BULK_EXTENDED | BULK_ERROR)) != 0u;
    REQUIRE((frame->length <= 8u) && (frame->time_us >= 0) && (frame->bus < buses->count));
    REQUIRE(frame->id <= (is_extended ? 0x1FFFFFFFu : 0x7FFu));
    REQUIRE((frame->flags & (uint8_t)BULK_ANSWER) == 0u);
}

/* Frames of 11-bit identifiers, one by one. */
static void check_round_trip(const bulk_buses_t *buses, const bulk_frame_t *frame)
{
    static char text[ROOM_BYTES];
    recording_t again;
    (void)memset(&again.buses, 0, sizeof again.buses);
    again.count = 0u;
    again.lines = 0u;
    again.damaged = 0u;
    const uint64_t size = bulk_format(frame, 1u, buses->name[frame->bus], text);
    REQUIRE(size <= (uint64_t)(BULK_BUS_NAME + 64));
    REQUIRE((read_some(&again, text, size, 1u) == size) && (again.count == 1u));
    REQUIRE((again.frames[0].time_us == frame->time_us) && (again.frames[0].id == frame->id));
    REQUIRE((again.frames[0].length == frame->length) && (memcmp(again.frames[0].data, frame->data, 8) == 0));
    REQUIRE(strcmp(again.buses.name[0], buses->name[frame->bus]) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static recording_t whole;
    static recording_t in_parts;
    if (size < 2u) {
        return 0;
    }
    const char *text = (const char *)&data[1];
    const uint64_t length = (uint64_t)size - 1u;
    const uint64_t cut = ((uint64_t)data[0] * length) / 256u;
    (void)memset(&whole, 0, sizeof whole);
    (void)memset(&in_parts, 0, sizeof in_parts);
    const uint64_t used = read_some(&whole, text, length, (uint64_t)MOST_FRAMES);
    uint64_t at = read_some(&in_parts, text, cut, (uint64_t)MOST_FRAMES);
    while ((at < used) && (in_parts.count < (uint64_t)MOST_FRAMES)) {
        at += read_some(&in_parts, &text[at], length - at, 1u);
    }
    REQUIRE((in_parts.count == whole.count) && (in_parts.lines == whole.lines) && (in_parts.damaged == whole.damaged));
    for (uint64_t i = 0u; i < whole.count; i++) {
        check_frame(&whole.buses, &whole.frames[i]);
        REQUIRE(memcmp(&in_parts.frames[i], &whole.frames[i], sizeof whole.frames[i]) == 0);
        if (whole.frames[i].flags == 0u) {
            check_round_trip(&whole.buses, &whole.frames[i]);
        }
    }
    return 0;
}
