/* Any bytes on the serial line: the SLCAN peer keeps its promises, and what either end reads is what the other would
 * write.
 *
 * The first byte says how much room the sink has, the rest is what comes over the line. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "port/slcan/slcan.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

enum { MOST_BYTES = 4096 };

typedef struct sink {
    uint32_t room;
    uint32_t answers; /* put calls that were taken */
    uint32_t refused; /* of them, those that were BEL */
    uint32_t dropped;
} sink_t;

static void require(bool condition)
{
    if (!condition) {
        abort();
    }
}

/* An answer is a BEL, or up to four characters after a command, and CR. */
static bool put(void *self, const char *text, uint32_t length)
{
    sink_t *sink = self;

    require((length >= 1u) && (length <= (uint32_t)SLCAN_LINE_BYTES));
    require((text[length - 1u] == '\r') || ((length == 1u) && (text[0] == '\a')));
    for (uint32_t i = 0u; i < (length - 1u); i++) {
        require((text[i] >= ' ') && (text[i] <= '~'));
    }
    if (length > sink->room) {
        sink->dropped++;
        return false;
    }
    sink->room -= length;
    sink->answers++;
    sink->refused += (text[0] == '\a') ? 1u : 0u;
    return true;
}

static bool is_good(const slcan_frame_t *frame)
{
    return (frame->frame.length <= 8u) && (frame->frame.id <= (frame->extended ? 0x1FFFFFFFu : 0x7FFu));
}

static bool is_same(const slcan_frame_t *a, const slcan_frame_t *b)
{
    return (a->extended == b->extended) && (a->remote == b->remote) && (a->frame.id == b->frame.id) &&
           (a->frame.length == b->frame.length) && (memcmp(a->frame.data, b->frame.data, 8) == 0);
}

/* Writes a frame and reads it back, as the other end would. */
static void check_round_trip(const slcan_frame_t *frame)
{
    slcan_line_t line = {.length = 0u};
    slcan_frame_t again;
    char text[SLCAN_LINE_BYTES];
    const uint32_t length = slcan_write_frame(frame, 59999u, text);

    require(length <= (uint32_t)SLCAN_LINE_BYTES);
    for (uint32_t i = 0u; i < length; i++) {
        const enum slcan_end end = slcan_line_take(&line, (uint8_t)text[i]);
        require(end == (((i + 1u) == length) ? SLCAN_CR : SLCAN_GOES_ON));
    }
    require(slcan_read_frame(&line, true, &again) && is_same(frame, &again));
}

/* The peer's side: every line gets one answer, and frames come only while it is open. */
static void feed_peer(const uint8_t *data, size_t size, uint32_t room)
{
    static const slcan_identity_t identity = {.version = "0000", .serial = "FUZZ"};
    sink_t counted = {.room = room};
    const slcan_sink_t sink = {.self = &counted, .put = put};
    slcan_t slcan;
    uint32_t lines = 0u;
    uint32_t sent = 0u;

    slcan_init(&slcan, &sink, &identity);
    for (size_t i = 0u; i < size; i++) {
        const bool was_open = slcan.channel == (uint8_t)SLCAN_CHANNEL_OPEN;
        slcan_frame_t frame;
        lines += ((data[i] == (uint8_t)'\r') || (data[i] == (uint8_t)'\a')) ? 1u : 0u;
        if (slcan_take(&slcan, data[i], &frame)) {
            require(was_open && is_good(&frame));
            check_round_trip(&frame);
            require(slcan_send(&slcan, &frame, (uint32_t)i) || (counted.dropped > 0u));
            sent++;
        }
        require(slcan.bit_rate <= 8u);
        require(slcan.channel <= (uint8_t)SLCAN_CHANNEL_LISTEN);
    }
    require(slcan.counts.frames_in == sent);
    require(slcan.counts.dropped == counted.dropped);
    require((counted.answers + counted.dropped) >= lines);
    require((counted.answers - slcan.counts.frames_out + counted.dropped) >= lines);
    require(slcan.counts.refused >= counted.refused);
}

/* The host's side: what it reads of an adapter's lines, and only that, is a frame. */
static void feed_host(const uint8_t *data, size_t size)
{
    slcan_line_t line = {.length = 0u};

    for (size_t i = 0u; i < size; i++) {
        const enum slcan_end end = slcan_line_take(&line, data[i]);
        slcan_frame_t frame;
        require(line.length < (uint32_t)SLCAN_LINE_BYTES);
        if ((end == SLCAN_CR) && slcan_read_frame(&line, true, &frame)) {
            require(is_good(&frame));
            check_round_trip(&frame);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if ((size > 1u) && (size <= (size_t)MOST_BYTES)) {
        feed_peer(&data[1], size - 1u, (data[0] < 128u) ? UINT32_MAX : ((uint32_t)data[0] - 128u));
        feed_host(&data[1], size - 1u);
    }
    return 0;
}
