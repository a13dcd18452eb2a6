#include "port/linux/aircraft.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define BLANK " \t\r\n"

enum { LINE_BYTES = 512, COLUMNS = 3, NAMES = 4 };

/* A line without its LF. */
typedef struct line {
    char text[LINE_BYTES + 1];
    bool is_text; /* it fits, and has no NUL */
} line_t;

/* A line "name = number", and where the number goes. */
typedef struct entry {
    const char *name;
    size_t offset;
} entry_t;

static const entry_t entries[NAMES] = {
    {"gain_sigma", offsetof(lever_aircraft_t, gain_sigma)},
    {"phase_sigma", offsetof(lever_aircraft_t, phase_sigma)},
    {"warning", offsetof(lever_aircraft_t, warning)},
    {"alarm", offsetof(lever_aircraft_t, alarm)},
};

/* A number at the beginning of a text, which then begins after it and the blanks that follow; NaN if there is none. */
static float next_number(const char **text)
{
    char *end = NULL;
    const float number = strtof(*text, &end);
    const bool is_word = (end != *text) && (*end != '\0') && (strchr(BLANK, *end) == NULL);
    const bool good = (end != *text) && !is_word && isfinite(number);

    *text = end + strspn(end, BLANK);
    return good ? number : NAN;
}

static bool take_point(lever_aircraft_t *aircraft, const char *text)
{
    float numbers[COLUMNS];
    bool good = aircraft->count < (uint8_t)LEVER_AIRCRAFT_POINTS;

    for (uint32_t i = 0u; good && (i < (uint32_t)COLUMNS); i++) {
        numbers[i] = next_number(&text);
        good = isfinite(numbers[i]);
    }
    if (good && (*text == '\0')) {
        aircraft->frequency[aircraft->count] = numbers[0];
        aircraft->real[aircraft->count] = numbers[1];
        aircraft->imaginary[aircraft->count] = numbers[2];
        aircraft->count++;
        return true;
    }
    return false;
}

static bool take_entry(lever_aircraft_t *aircraft, const char *text, const char *equals)
{
    const size_t length = strcspn(text, "= \t");
    const char *rest = equals + 1;
    const float number = next_number(&rest);

    for (uint32_t i = 0u; i < (uint32_t)NAMES; i++) {
        if ((strlen(entries[i].name) == length) && (strncmp(text, entries[i].name, length) == 0)) {
            (void)memcpy((uint8_t *)aircraft + entries[i].offset, &number, sizeof number);
            return isfinite(number) && (*rest == '\0');
        }
    }
    return false;
}

/* Whether a line, without its comment, is one of those that a file has. */
static bool take_line(lever_aircraft_t *aircraft, char *line)
{
    line[strcspn(line, "#")] = '\0';
    const char *text = line + strspn(line, BLANK);
    const char *equals = strchr(text, '=');

    if (*text == '\0') {
        return true;
    }
    return (equals != NULL) ? take_entry(aircraft, text, equals) : take_point(aircraft, text);
}

/* Reads a line; false at the end of the file, when it is what was left. */
static bool read_line(FILE *file, line_t *line)
{
    int byte = getc(file);

    *line = (line_t){.is_text = true};
    for (size_t length = 0u; (byte != EOF) && (byte != '\n'); length++) {
        line->is_text = line->is_text && (byte != 0) && (length < (size_t)LINE_BYTES);
        if (line->is_text) {
            line->text[length] = (char)byte;
        }
        byte = getc(file);
    }
    return byte != EOF;
}

bool aircraft_read(lever_aircraft_t *aircraft, FILE *file, const char *path, settings_error_t *error)
{
    line_t line;
    unsigned number = 0u;
    bool is_more = true;

    *aircraft = (lever_aircraft_t){.gain_sigma = NAN, .phase_sigma = NAN, .warning = 5.0f, .alarm = 3.5f};
    while (is_more) {
        is_more = read_line(file, &line);
        number++;
        if (!line.is_text || !take_line(aircraft, line.text)) {
            (void)snprintf(error->text, sizeof error->text,
                "%.200s:%u: neither gain_sigma, phase_sigma, warning or alarm = number, nor frequency, real and "
                "imaginary part (of %d at most), in %d bytes of text at most",
                path, number, LEVER_AIRCRAFT_POINTS, LINE_BYTES);
            return false;
        }
    }
    if (!isfinite(aircraft->gain_sigma) || !isfinite(aircraft->phase_sigma)) {
        (void)snprintf(error->text, sizeof error->text,
            "%.200s: how well is it known? It needs the lines gain_sigma = number and phase_sigma = number", path);
        return false;
    }
    return true;
}
