#include "port/slcan/slcan.h"

#include <stddef.h>
#include <string.h>

#include "port/identifiers.h"

#define CR '\r'
#define LF '\n'
#define BEL '\a'

enum {
    STANDARD_DIGITS = 3, /* of an identifier */
    EXTENDED_DIGITS = 8,
    TIME_DIGITS = 4,
    DATA_BYTES = 8
};

static const uint32_t standard_ids = 0x7FFu;
static const uint32_t extended_ids = 0x1FFFFFFFu;

static void count_up(uint32_t *count)
{
    if (*count < UINT32_MAX) {
        (*count)++;
    }
}

/* --- hexadecimal digits ------------------------------------------------------------------------------------------ */

/* Value of a digit; 16 if it is none. */
static uint32_t digit_value(char digit)
{
    uint32_t value = 16u;

    if ((digit >= '0') && (digit <= '9')) {
        value = (uint32_t)digit - (uint32_t)'0';
    } else if ((digit >= 'A') && (digit <= 'F')) {
        value = ((uint32_t)digit - (uint32_t)'A') + 10u;
    } else if ((digit >= 'a') && (digit <= 'f')) {
        value = ((uint32_t)digit - (uint32_t)'a') + 10u;
    } else {
        /* not a digit */
    }
    return value;
}

/* Reads `digits` (at most 8) of them; false if one is none. */
static bool read_hex(const char *text, uint32_t digits, uint32_t *value)
{
    bool good = true;

    *value = 0u;
    for (uint32_t i = 0u; i < digits; i++) {
        const uint32_t digit = digit_value(text[i]);
        good = good && (digit < 16u);
        *value = (*value << 4) | (digit & 0xFu);
    }
    return good;
}

/* Writes `digits` of them from text[at] on, and returns where the text goes on. */
static uint32_t write_hex(char *text, uint32_t at, uint32_t digits, uint32_t value)
{
    for (uint32_t i = 0u; i < digits; i++) {
        text[at + i] = "0123456789ABCDEF"[(value >> (4u * (digits - 1u - i))) & 0xFu];
    }
    return at + digits;
}

/* --- lines ------------------------------------------------------------------------------------------------------- */

enum slcan_end slcan_line_take(slcan_line_t *line, uint8_t byte)
{
    enum slcan_end end = SLCAN_GOES_ON;

    if (line->ended) {
        line->ended = false;
        line->too_long = false;
        line->length = 0u;
    }
    if ((byte == (uint8_t)CR) || (byte == (uint8_t)BEL)) {
        line->ended = true;
        end = (byte == (uint8_t)CR) ? SLCAN_CR : SLCAN_BEL;
    } else if ((byte == (uint8_t)LF) && (line->length == 0u)) {
        /* of a terminal that ends lines by CR LF */
    } else if (line->length < ((uint32_t)SLCAN_LINE_BYTES - 1u)) {
        line->text[line->length] = (char)byte;
        line->length++;
    } else {
        line->too_long = true;
    }
    return end;
}

/* Reads what is between the type and the data: identifier and length. */
static bool read_head(const char *text, slcan_frame_t *frame)
{
    const uint32_t digits = frame->extended ? (uint32_t)EXTENDED_DIGITS : (uint32_t)STANDARD_DIGITS;
    uint32_t length = 0u;

    if (!read_hex(&text[1], digits, &frame->frame.id) || !read_hex(&text[1u + digits], 1u, &length) ||
        (frame->frame.id > (frame->extended ? extended_ids : standard_ids)) || (length > (uint32_t)DATA_BYTES)) {
        return false;
    }
    frame->frame.length = (uint8_t)length;
    return true;
}

bool slcan_read_frame(const slcan_line_t *line, bool may_have_time, slcan_frame_t *frame)
{
    const char type = (line->length > 0u) ? line->text[0] : '\0';
    uint32_t time = 0u;

    (void)memset(frame, 0, sizeof *frame);
    frame->extended = (type == 'T') || (type == 'R');
    frame->remote = (type == 'r') || (type == 'R');
    const uint32_t head = 2u + (frame->extended ? (uint32_t)EXTENDED_DIGITS : (uint32_t)STANDARD_DIGITS);
    if (line->too_long || (line->length < head) || !(frame->extended || frame->remote || (type == 't')) ||
        !read_head(line->text, frame)) {
        return false;
    }
    const uint32_t bytes = frame->remote ? 0u : frame->frame.length;
    const uint32_t without_time = head + (2u * bytes);
    if (line->length != without_time) {
        const bool has_time = may_have_time && (line->length == (without_time + (uint32_t)TIME_DIGITS));
        if (!has_time || !read_hex(&line->text[without_time], TIME_DIGITS, &time)) {
            return false;
        }
    }
    bool good = true;
    for (uint32_t i = 0u; i < bytes; i++) {
        uint32_t byte = 0u;
        good = read_hex(&line->text[head + (2u * i)], 2u, &byte) && good;
        frame->frame.data[i] = (uint8_t)byte;
    }
    return good;
}

uint32_t slcan_write_frame(const slcan_frame_t *frame, uint16_t time_stamp, char text[SLCAN_LINE_BYTES])
{
    const uint32_t length = (frame->frame.length < (uint32_t)DATA_BYTES) ? frame->frame.length : (uint32_t)DATA_BYTES;
    uint32_t at = 1u;

    if (frame->extended) {
        text[0] = frame->remote ? 'R' : 'T';
        at = write_hex(text, at, EXTENDED_DIGITS, frame->frame.id & extended_ids);
    } else {
        text[0] = frame->remote ? 'r' : 't';
        at = write_hex(text, at, STANDARD_DIGITS, frame->frame.id & standard_ids);
    }
    at = write_hex(text, at, 1u, length);
    for (uint32_t i = 0u; (i < length) && !frame->remote; i++) {
        at = write_hex(text, at, 2u, frame->frame.data[i]);
    }
    if (time_stamp != (uint16_t)SLCAN_NO_TIME) {
        at = write_hex(text, at, TIME_DIGITS, time_stamp);
    }
    text[at] = CR;
    return at + 1u;
}

/* --- acceptance filter ------------------------------------------------------------------------------------------- */

/* One of an SJA1000's two filters: 16 bits of what the frame has, code and mask (data sheet, 6.4.15, dual filter). */
static bool passes(uint32_t bits, uint32_t code, uint32_t mask)
{
    return (((bits ^ code) & ~mask) & 0xFFFFu) == 0u;
}

/* Dual filter mode, as in the CAN232. Codes AC0 to AC3 are the bytes of the word, the first in the highest. Standard
 * frames: filter 1 is AC0, AC1 and the low half of AC3 (identifier, RTR, first data byte), filter 2 the rest
 * (identifier, RTR). Extended: each is the upper 16 bits of the identifier. */
static bool is_accepted(const slcan_t *slcan, const slcan_frame_t *frame)
{
    const uint32_t code = slcan->acceptance_code;
    const uint32_t mask = slcan->acceptance_mask;

    if (frame->extended) {
        const uint32_t upper = frame->frame.id >> 13;
        return passes(upper, code >> 16, mask >> 16) || passes(upper, code, mask);
    }
    const uint32_t head = (frame->frame.id << 5) | (frame->remote ? 0x10u : 0u);
    const bool has_data =
        !frame->remote && (frame->frame.length > 0u); /* without, filter 1 has only the head to go by */
    const uint32_t first = has_data ? frame->frame.data[0] : 0u;
    const uint32_t half = has_data ? 0u : 0xFu; /* not to be compared */
    const bool filter_1 = passes(head | (first >> 4), code >> 16, (mask >> 16) | half) &&
                          passes(first & 0xFu, code, mask | 0xFFF0u | half);

    return filter_1 || passes(head, code, mask | 0xFu);
}

/* --- the peer ---------------------------------------------------------------------------------------------------- */

static bool put(slcan_t *slcan, const char *text, uint32_t length)
{
    const bool has_room = slcan->sink.put(slcan->sink.self, text, length);

    if (!has_room) {
        count_up(&slcan->counts.dropped);
    }
    return has_room;
}

static void answer(slcan_t *slcan, bool good)
{
    const char end = good ? CR : BEL;

    if (!good) {
        count_up(&slcan->counts.refused);
    }
    (void)put(slcan, &end, 1u);
}

/* Answers V, v and N: the command, four characters, CR. */
static void answer_identity(slcan_t *slcan, char command, const char *four)
{
    char text[6];

    text[0] = command;
    (void)memcpy(&text[1], four, 4u);
    text[5] = CR;
    (void)put(slcan, text, sizeof text);
}

static bool set_bit_rate(slcan_t *slcan, const slcan_line_t *line)
{
    const bool good = (line->length == 2u) && (line->text[1] >= '0') && (line->text[1] <= '8');

    if (good) {
        slcan->bit_rate = (uint8_t)digit_value(line->text[1]);
        slcan->bit_timing = 0u;
    }
    return good;
}

static bool set_bit_timing(slcan_t *slcan, const slcan_line_t *line)
{
    uint32_t timing = 0u;
    const bool good = (line->length == 5u) && read_hex(&line->text[1], 4u, &timing);

    if (good) {
        slcan->bit_timing = (uint16_t)timing;
    }
    return good;
}

static bool set_word(uint32_t *word, const slcan_line_t *line)
{
    uint32_t value = 0u;
    const bool good = (line->length == 9u) && read_hex(&line->text[1], 8u, &value);

    if (good) {
        *word = value;
    }
    return good;
}

static bool set_time_stamps(slcan_t *slcan, const slcan_line_t *line)
{
    const bool good = (line->length == 2u) && ((line->text[1] == '0') || (line->text[1] == '1'));

    if (good) {
        slcan->time_stamps = (line->text[1] == '1');
    }
    return good;
}

static bool open_channel(slcan_t *slcan, const slcan_line_t *line, enum slcan_channel channel)
{
    const bool good = line->length == 1u;

    if (good) {
        slcan->channel = (uint8_t)channel;
    }
    return good;
}

/* What may be done only while the channel is closed; false to everything else. */
static bool configure(slcan_t *slcan, const slcan_line_t *line)
{
    bool good = false;

    switch (line->text[0]) {
    case 'S':
        good = set_bit_rate(slcan, line);
        break;
    case 's':
        good = set_bit_timing(slcan, line);
        break;
    case 'M':
        good = set_word(&slcan->acceptance_code, line);
        break;
    case 'm':
        good = set_word(&slcan->acceptance_mask, line);
        break;
    case 'Z':
        good = set_time_stamps(slcan, line);
        break;
    case 'O':
        good = open_channel(slcan, line, SLCAN_CHANNEL_OPEN);
        break;
    case 'L':
        good = open_channel(slcan, line, SLCAN_CHANNEL_LISTEN);
        break;
    default:
        break;
    }
    return good;
}

static void answer_status(slcan_t *slcan)
{
    char text[4];

    text[0] = 'F';
    (void)write_hex(text, 1u, 2u, slcan->status);
    text[3] = CR;
    if (put(slcan, text, sizeof text)) {
        slcan->status = 0u;
    }
}

/* Carries out and answers a line that is not a frame. */
static void carry_out(slcan_t *slcan, const slcan_line_t *line)
{
    const bool is_open = slcan->channel != (uint8_t)SLCAN_CHANNEL_CLOSED;
    const char command = line->text[0];

    if (line->length == 0u) {
        answer(slcan, true);
    } else if (line->too_long) {
        answer(slcan, false);
    } else if ((line->length == 1u) && ((command == 'V') || (command == 'v'))) {
        answer_identity(slcan, command, slcan->identity.version);
    } else if ((line->length == 1u) && (command == 'N')) {
        answer_identity(slcan, command, slcan->identity.serial);
    } else if (is_open && (line->length == 1u) && (command == 'F')) {
        answer_status(slcan);
    } else if (is_open && (line->length == 1u) && (command == 'C')) {
        slcan->channel = (uint8_t)SLCAN_CHANNEL_CLOSED;
        answer(slcan, true);
    } else {
        answer(slcan, !is_open && configure(slcan, line));
    }
}

void slcan_init(slcan_t *slcan, const slcan_sink_t *sink, const slcan_identity_t *identity)
{
    (void)memset(slcan, 0, sizeof *slcan);
    slcan->sink = *sink;
    slcan->identity = *identity;
    slcan->acceptance_mask = UINT32_MAX;
    slcan->bit_rate = 8u;
}

bool slcan_take(slcan_t *slcan, uint8_t byte, slcan_frame_t *frame)
{
    const enum slcan_end end = slcan_line_take(&slcan->line, byte);

    if (end == SLCAN_GOES_ON) {
        return false;
    }
    if (end == SLCAN_BEL) {
        answer(slcan, false); /* hosts do not send it */
        return false;
    }
    if ((slcan->channel == (uint8_t)SLCAN_CHANNEL_OPEN) && slcan_read_frame(&slcan->line, false, frame)) {
        count_up(&slcan->counts.frames_in);
        (void)put(slcan, frame->extended ? "Z\r" : "z\r", 2u);
        return true;
    }
    carry_out(slcan, &slcan->line);
    return false;
}

bool slcan_send(slcan_t *slcan, const slcan_frame_t *frame, uint32_t time_ms)
{
    char text[SLCAN_LINE_BYTES];

    if ((slcan->channel == (uint8_t)SLCAN_CHANNEL_CLOSED) || !is_accepted(slcan, frame)) {
        return true;
    }
    const uint32_t stamp = slcan->time_stamps ? (time_ms % (uint32_t)SLCAN_TIME_STAMPS) : (uint32_t)SLCAN_NO_TIME;
    const uint32_t length = slcan_write_frame(frame, (uint16_t)stamp, text);
    if (!put(slcan, text, length)) {
        slcan->status |= (uint8_t)SLCAN_STATUS_RECEIVE_FULL | (uint8_t)SLCAN_STATUS_DATA_OVERRUN;
        return false;
    }
    count_up(&slcan->counts.frames_out);
    return true;
}

void slcan_hang_up(slcan_t *slcan)
{
    (void)memset(&slcan->line, 0, sizeof slcan->line);
    slcan->channel = (uint8_t)SLCAN_CHANNEL_CLOSED;
}

slcan_frame_t slcan_shifted(const lever_frame_t *frame, uint32_t identifiers)
{
    const uint32_t id = identifiers_to_bus(identifiers, frame->id);
    slcan_frame_t shifted = {.frame = *frame, .extended = ((id & IDENTIFIERS_EXTENDED) != 0u)};

    shifted.frame.id = id & ~IDENTIFIERS_EXTENDED;
    return shifted;
}

bool slcan_is_ours(const slcan_frame_t *received, uint32_t identifiers, lever_frame_t *frame)
{
    const uint32_t flag = received->extended ? IDENTIFIERS_EXTENDED : 0u;

    *frame = received->frame;
    frame->id = identifiers_from_bus(identifiers, received->frame.id | flag);
    return !received->remote && identifiers_are_ours(frame->id);
}
