/* Any bytes as the file of an aircraft's response: one with finite numbers, or one line that says what is wrong. What
 * is after a # never counts. */
#define _POSIX_C_SOURCE 200809L /* fmemopen */

#include <math.h>
#include <string.h>

#include "lever_cdkf.h"
#include "port/linux/aircraft.h"
#include "require.h"

enum { MOST_BYTES = 4096 };

static bool read_bytes(lever_aircraft_t *aircraft, const uint8_t *data, size_t size)
{
    settings_error_t error = {.text = ""};
    FILE *file = fmemopen((void *)(uintptr_t)data, size, "r");
    REQUIRE(file != NULL);
    const bool good = aircraft_read(aircraft, file, "a.response", &error);
    (void)fclose(file);
    REQUIRE(good || ((strncmp(error.text, "a.response:", 11) == 0) && (strchr(error.text, '\n') == NULL)));
    return good;
}

/* Without comments. */
static size_t stripped(uint8_t *into, const uint8_t *data, size_t size)
{
    size_t length = 0u;
    bool in_comment = false;
    for (size_t i = 0u; i < size; i++) {
        in_comment = (data[i] == (uint8_t)'#') || (in_comment && (data[i] != (uint8_t)'\n'));
        if (!in_comment) {
            into[length] = data[i];
            length++;
        }
    }
    return length;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t text[MOST_BYTES];
    lever_aircraft_t aircraft;
    lever_aircraft_t again;
    if ((size == 0u) || (size > (size_t)MOST_BYTES)) {
        return 0;
    }
    const bool good = read_bytes(&aircraft, data, size);
    const size_t length = stripped(text, data, size);
    if (good) {
        REQUIRE(aircraft.count <= (uint8_t)LEVER_AIRCRAFT_POINTS);
        for (uint32_t i = 0u; i < aircraft.count; i++) {
            REQUIRE(isfinite(aircraft.frequency[i]) && isfinite(aircraft.real[i]) && isfinite(aircraft.imaginary[i]));
        }
        REQUIRE(isfinite(aircraft.gain_sigma) && isfinite(aircraft.phase_sigma));
        REQUIRE(isfinite(aircraft.warning) && isfinite(aircraft.alarm));
        REQUIRE((length > 0u) && read_bytes(&again, text, length));
        REQUIRE(memcmp(&aircraft, &again, sizeof aircraft) == 0);
    }
    return 0;
}
