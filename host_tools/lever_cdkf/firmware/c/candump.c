/* The text of candump -L: (1700000000.000000) vcan0 110#0011223344556677 R */
#include "bulk.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum { FRACTION_DIGITS = 6, MOST_SECOND_DIGITS = 11, DATA_BYTES = 8, STANDARD_DIGITS = 3, EXTENDED_DIGITS = 8 };

#define ERROR_FLAG 0x20000000u /* in the identifier of an error frame, as in <linux/can.h> */
#define STANDARD_MASK 0x7FFu
#define EXTENDED_MASK 0x1FFFFFFFu

/* What is left of a line. */
typedef struct cursor {
    const char *at;
    const char *end;
} cursor_t;

static bool take(cursor_t *cursor, char wanted)
{
    const bool found = (cursor->at < cursor->end) && (*cursor->at == wanted);
    cursor->at += found ? 1 : 0;
    return found;
}

static bool is_digit(char character)
{
    return (character >= '0') && (character <= '9');
}

/* The value of a hexadecimal digit, or -1. */
static int nibble(char character)
{
    int value = -1;
    if (is_digit(character)) {
        value = character - '0';
    } else if ((character >= 'A') && (character <= 'F')) {
        value = character - 'A' + 10;
    } else if ((character >= 'a') && (character <= 'f')) {
        value = character - 'a' + 10;
    } else {
        value = -1;
    }
    return value;
}

/* "(seconds.fraction)" to microseconds; further digits of the fraction are dropped. */
static bool take_time(cursor_t *cursor, int64_t *time_us)
{
    if (!take(cursor, '(')) {
        return false;
    }
    int64_t value = 0;
    int seconds = 0;
    while ((cursor->at < cursor->end) && is_digit(*cursor->at) && (seconds <= MOST_SECOND_DIGITS)) {
        value = (value * 10) + (*cursor->at - '0');
        cursor->at++;
        seconds++;
    }
    if ((seconds == 0) || (seconds > MOST_SECOND_DIGITS) || !take(cursor, '.')) {
        return false;
    }
    int fraction = 0;
    while ((cursor->at < cursor->end) && is_digit(*cursor->at)) {
        if (fraction < FRACTION_DIGITS) {
            value = (value * 10) + (*cursor->at - '0');
            fraction++;
        }
        cursor->at++;
    }
    for (int digits = fraction; digits < FRACTION_DIGITS; digits++) {
        value *= 10;
    }
    *time_us = value;
    return (fraction > 0) && take(cursor, ')');
}

/* The name up to the next blank as an index into `buses`; `last` is what it probably is. */
static bool take_bus(cursor_t *cursor, bulk_buses_t *buses, uint16_t last, uint16_t *bus)
{
    const char *name = cursor->at;
    while ((cursor->at < cursor->end) && (*cursor->at > ' ')) {
        cursor->at++;
    }
    const size_t length = (size_t)(cursor->at - name);
    if ((length == 0u) || (length >= (size_t)BULK_BUS_NAME)) {
        return false;
    }
    for (uint32_t tried = 0u; tried < buses->count; tried++) {
        const uint32_t index = (tried + last) % buses->count;
        if ((memcmp(buses->name[index], name, length) == 0) && (buses->name[index][length] == '\0')) {
            *bus = (uint16_t)index;
            return true;
        }
    }
    if (buses->count >= (uint32_t)BULK_BUSES) {
        return false;
    }
    (void)memset(buses->name[buses->count], 0, BULK_BUS_NAME);
    (void)memcpy(buses->name[buses->count], name, length);
    *bus = (uint16_t)buses->count;
    buses->count++;
    return true;
}

static bool take_identifier(cursor_t *cursor, bulk_frame_t *frame)
{
    uint32_t value = 0u;
    int digits = 0;
    int digit = 0;
    while ((cursor->at < cursor->end) && (digits <= EXTENDED_DIGITS) && ((digit = nibble(*cursor->at)) >= 0)) {
        value = (value << 4u) | (uint32_t)digit;
        cursor->at++;
        digits++;
    }
    frame->flags = 0u;
    frame->id = value;
    if (digits == STANDARD_DIGITS) {
        return value <= STANDARD_MASK;
    }
    frame->flags = (uint8_t)(((value & ERROR_FLAG) != 0u) ? BULK_ERROR : BULK_EXTENDED);
    frame->id = value & EXTENDED_MASK;
    return (digits == EXTENDED_DIGITS) && ((value & ~(ERROR_FLAG | EXTENDED_MASK)) == 0u);
}

/* What follows '#': "R" and perhaps a length; '#', flags and data of CAN FD; or up to 8 bytes. */
static bool take_data(cursor_t *cursor, bulk_frame_t *frame)
{
    (void)memset(frame->data, 0, sizeof frame->data);
    frame->length = 0u;
    if (take(cursor, 'R')) {
        frame->flags |= (uint8_t)BULK_REMOTE;
        if ((cursor->at < cursor->end) && is_digit(*cursor->at)) {
            frame->length = (uint8_t)(*cursor->at - '0');
            cursor->at++;
        }
        return frame->length <= (uint8_t)DATA_BYTES;
    }
    if (take(cursor, '#')) {
        frame->flags |= (uint8_t)BULK_FD;
        while ((cursor->at < cursor->end) && (nibble(*cursor->at) >= 0)) {
            cursor->at++;
        }
        return true;
    }
    while (((cursor->end - cursor->at) >= 2) && (frame->length < (uint8_t)DATA_BYTES)) {
        const int high = nibble(cursor->at[0]);
        const int low = nibble(cursor->at[1]);
        if ((high < 0) || (low < 0)) {
            break;
        }
        frame->data[frame->length] = (uint8_t)((high * 16) + low);
        frame->length++;
        cursor->at += 2;
    }
    if (take(cursor, '_')) { /* a raw DLC above 8 */
        cursor->at += (cursor->at < cursor->end) ? 1 : 0;
    }
    return true;
}

/* The end of a line: nothing, or the direction. */
static bool take_end(cursor_t *cursor)
{
    if (take(cursor, ' ') && !take(cursor, 'R')) {
        (void)take(cursor, 'T');
    }
    (void)take(cursor, '\r');
    return cursor->at == cursor->end;
}

static bool parse_line(cursor_t *cursor, bulk_buses_t *buses, uint16_t last_bus, bulk_frame_t *frame)
{
    return take_time(cursor, &frame->time_us) && take(cursor, ' ') && take_bus(cursor, buses, last_bus, &frame->bus) &&
           take(cursor, ' ') && take_identifier(cursor, frame) && take(cursor, '#') && take_data(cursor, frame) &&
           take_end(cursor);
}

uint64_t bulk_parse(
    const char *text, uint64_t size, bulk_buses_t *buses, bulk_frame_t *frames, uint64_t room, bulk_parsed_t *parsed)
{
    const char *const end = text + size;
    const char *at = text;
    const char *newline = NULL;
    uint64_t count = 0u;
    uint16_t last_bus = 0u;
    (void)memset(parsed, 0, sizeof *parsed);
    while ((count < room) && (at < end) && ((newline = memchr(at, '\n', (size_t)(end - at))) != NULL)) {
        cursor_t line = {at, newline};
        at = newline + 1;
        if (line.at < line.end) {
            parsed->lines++;
            if (parse_line(&line, buses, last_bus, &frames[count])) {
                last_bus = frames[count].bus;
                count++;
            } else {
                parsed->damaged++;
            }
        }
    }
    parsed->used = (uint64_t)(at - text);
    return count;
}

/* --- writing --------------------------------------------------------------------------------------------------- */

static const char hexadecimal[] = "0123456789ABCDEF";

/* "(seconds.fraction) " with as many digits of seconds as there are. */
static char *put_time(char *text, int64_t time_us)
{
    char digits[24];
    int count = 0;
    uint64_t left = (time_us < 0) ? 0u : (uint64_t)time_us;
    while ((left > 0u) || (count <= FRACTION_DIGITS)) {
        digits[count] = hexadecimal[left % 10u];
        left /= 10u;
        count++;
    }
    char *at = text;
    *at++ = '(';
    while (count > 0) {
        count--;
        *at++ = digits[count];
        if (count == FRACTION_DIGITS) {
            *at++ = '.';
        }
    }
    *at++ = ')';
    *at++ = ' ';
    return at;
}

uint64_t bulk_format(const bulk_frame_t *frames, uint64_t count, const char *bus, char *text)
{
    const size_t bus_length = strlen(bus);
    char *at = text;
    for (uint64_t i = 0u; i < count; i++) {
        const bulk_frame_t *frame = &frames[i];
        at = put_time(at, frame->time_us);
        (void)memcpy(at, bus, bus_length);
        at += bus_length;
        *at++ = ' ';
        for (int shift = 8; shift >= 0; shift -= 4) {
            *at++ = hexadecimal[(frame->id >> (uint32_t)shift) & 15u];
        }
        *at++ = '#';
        for (uint8_t byte = 0u; byte < frame->length; byte++) {
            *at++ = hexadecimal[frame->data[byte] >> 4u];
            *at++ = hexadecimal[frame->data[byte] & 15u];
        }
        *at++ = ' ';
        *at++ = ((frame->flags & (uint8_t)BULK_ANSWER) != 0u) ? 'R' : 'T';
        *at++ = '\n';
    }
    return (uint64_t)(at - text);
}
