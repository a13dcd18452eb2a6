/* Tables of numbers as text. */
#include "bulk.h"

#include <math.h>
#include <stdbool.h>

#define DECIMALS 6
#define UNIT 1000000u   /* ten to that power */
#define GREATEST 9.2e18 /* about 2^63 */

static char *put_word(char *at, const char *word)
{
    while (*word != '\0') {
        *at++ = *word++;
    }
    return at;
}

/* The digits of a number, with zeros before them if they are less than `least`. */
static char *put_digits(char *at, uint64_t number, int least)
{
    char digits[20];
    int count = 0;
    while ((number > 0u) || (count < least)) {
        digits[count] = (char)('0' + (int)(number % 10u));
        number /= 10u;
        count++;
    }
    while (count > 0) {
        count--;
        *at++ = digits[count];
    }
    return at;
}

/* Rounded to the nearest; what lies halfway, to the even one. Whatever is a half after a rounding of its own is looked
 * at exactly. */
static char *put_decimals(char *at, double magnitude)
{
    uint64_t whole = (uint64_t)magnitude;
    const double rest = magnitude - (double)whole;
    const double scaled = rest * (double)UNIT;
    uint64_t fraction = (uint64_t)scaled;
    double above = (scaled - (double)fraction) - 0.5;
    if (!(above < 0.0) && !(above > 0.0)) {
        above = fma(rest, (double)UNIT, -scaled);
    }
    if ((above > 0.0) || (!(above < 0.0) && ((fraction % 2u) != 0u))) {
        fraction++;
    }
    if (fraction == UNIT) {
        fraction = 0u;
        whole++;
    }
    at = put_digits(at, whole, 1);
    *at++ = '.';
    return put_digits(at, fraction, DECIMALS);
}

static char *put_number(char *at, double value, bool is_whole)
{
    if (isnan(value)) {
        return put_word(at, is_whole ? "" : "NaN");
    }
    if (is_whole ? (value < 0.0) : (signbit(value) != 0)) {
        *at++ = '-';
    }
    const double magnitude = fabs(value);
    if (magnitude > GREATEST) {
        return put_word(at, "inf");
    }
    return is_whole ? put_digits(at, (uint64_t)magnitude, 1) : put_decimals(at, magnitude);
}

uint64_t bulk_format_table(const double *numbers, uint64_t rows, uint64_t columns, const uint8_t *whole, char *text)
{
    char *at = text;
    for (uint64_t row = 0u; row < rows; row++) {
        for (uint64_t column = 0u; column < columns; column++) {
            at = put_number(at, numbers[(row * columns) + column], whole[column] != 0u);
            *at++ = ((column + 1u) < columns) ? ',' : '\n';
        }
    }
    return (uint64_t)(at - text);
}
