#include "port/linux/aircraft.h"

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define BLANK " \t"
#define WARNING 5.0f /* where nothing else is said [dB] */
#define ALARM 4.0f

#define SEAT "seat"

enum { COLUMNS = 3, NAMES = 5, MODE_NUMBERS = 4, SEAT_LENGTH = 4 };

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
    {"seat_direct", offsetof(lever_aircraft_t, seat_direct)},
};

/* A number at the beginning of a text, which then begins after it and the blanks that follow; NaN if there is none. */
static float next_number(const char **text)
{
    const char *end = settings_number_end(*text);
    const bool good = (end != *text) && ((*end == '\0') || (strchr(BLANK, *end) != NULL));
    const float number = good ? (float)strtod(*text, NULL) : NAN;

    *text = end + strspn(end, BLANK);
    return isfinite(number) ? number : NAN;
}

/* So many numbers and nothing else. */
static bool take_numbers(float numbers[], uint32_t count, const char *text)
{
    bool good = true;

    for (uint32_t i = 0u; good && (i < count); i++) {
        numbers[i] = next_number(&text);
        good = isfinite(numbers[i]);
    }
    return good && (*text == '\0');
}

static bool take_mode(lever_aircraft_t *aircraft, const char *text)
{
    float numbers[MODE_NUMBERS] = {0};

    if ((aircraft->seat_modes < (uint8_t)LEVER_SEAT_MODES) && take_numbers(numbers, MODE_NUMBERS, text)) {
        aircraft->seat[aircraft->seat_modes] = (lever_seat_mode_t){
            .by_rate = numbers[0], .by_place = numbers[1], .damping = numbers[2], .stiffness = numbers[3]};
        aircraft->seat_modes++;
        return true;
    }
    return false;
}

static bool take_point(lever_aircraft_t *aircraft, const char *text)
{
    float numbers[COLUMNS] = {0};

    if ((aircraft->count < (uint8_t)LEVER_AIRCRAFT_POINTS) && take_numbers(numbers, COLUMNS, text)) {
        aircraft->frequency[aircraft->count] = numbers[0];
        aircraft->real[aircraft->count] = numbers[1];
        aircraft->imaginary[aircraft->count] = numbers[2];
        aircraft->count++;
        return true;
    }
    return false;
}

/* Of equal names the second is refused. */
static bool take_entry(lever_aircraft_t *aircraft, const char *text, const char *equals)
{
    const size_t length = strcspn(text, "=" BLANK);
    const char *rest = equals + 1;
    rest += strspn(rest, BLANK);
    const float number = next_number(&rest);

    for (uint32_t i = 0u; i < (uint32_t)NAMES; i++) {
        if ((strlen(entries[i].name) == length) && (strncmp(text, entries[i].name, length) == 0)) {
            uint8_t *place = (uint8_t *)aircraft + entries[i].offset;
            float before = 0.0f;
            /* cppcheck-suppress misra-c2012-21.15 ; D2 */
            (void)memcpy(&before, place, sizeof before);
            /* cppcheck-suppress misra-c2012-21.15 ; D2 */
            (void)memcpy(place, &number, sizeof number);
            return isnan(before) && isfinite(number) && (*rest == '\0');
        }
    }
    return false;
}

static bool take_line(void *context, const char *text, settings_error_t *error)
{
    lever_aircraft_t *aircraft = context;
    const char *equals = strchr(text, '=');
    const size_t first = strcspn(text, BLANK);
    bool good = false;

    if (equals != NULL) {
        good = take_entry(aircraft, text, equals);
    } else if ((first == (size_t)SEAT_LENGTH) && (strncmp(text, SEAT, first) == 0)) {
        good = take_mode(aircraft, text + first + strspn(text + first, BLANK));
    } else {
        good = take_point(aircraft, text);
    }
    if (good) {
        return true;
    }
    (void)snprintf(error->text, sizeof error->text,
        "neither gain_sigma, phase_sigma, warning, alarm or seat_direct = number, each once, nor frequency, real and "
        "imaginary part (of %d at most), nor seat and four numbers (of %d at most)",
        LEVER_AIRCRAFT_POINTS, LEVER_SEAT_MODES);
    return false;
}

bool aircraft_read(lever_aircraft_t *aircraft, FILE *file, const char *path, settings_error_t *error)
{
    *aircraft =
        (lever_aircraft_t){.gain_sigma = NAN, .phase_sigma = NAN, .warning = NAN, .alarm = NAN, .seat_direct = NAN};
    if (!settings_lines(file, path, take_line, aircraft, error)) {
        return false;
    }
    if (!isfinite(aircraft->gain_sigma) || !isfinite(aircraft->phase_sigma)) {
        (void)snprintf(error->text, sizeof error->text,
            "%.200s: how well is it known? It needs the lines gain_sigma = number and phase_sigma = number", path);
        return false;
    }
    if (isnan(aircraft->seat_direct) != (aircraft->seat_modes == 0u)) {
        (void)snprintf(
            error->text, sizeof error->text, "%.200s: seat_direct and lines that begin with seat go together", path);
        return false;
    }
    aircraft->seat_direct = (aircraft->seat_modes == 0u) ? 1.0f : aircraft->seat_direct;
    aircraft->warning = isnan(aircraft->warning) ? WARNING : aircraft->warning;
    aircraft->alarm = isnan(aircraft->alarm) ? ALARM : aircraft->alarm;
    return true;
}
