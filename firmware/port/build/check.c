/* Run on the machine that builds, by settings.cmake: `check CONFIGURED [AIRCRAFT_FILE]`.
 *
 * Checks the configuration of lever_build.h, and writes the aircraft of a file as the initialiser of a lever_aircraft_t to
 * standard output, by the reader of lever_can. Says what is wrong in a line, with status 1. */
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "lever_build.h"
#include "lever_cdkf.h"
#include "port/linux/aircraft.h"

static const char *meaning_of(const char *name)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        if (strcmp(lever_setting(i)->name, name) == 0) {
            return lever_setting(i)->meaning;
        }
    }
    return "no such choice";
}

static void write_floats(const char *name, const float *values, uint32_t count)
{
    (void)printf("    .%s = {", name);
    for (uint32_t i = 0u; i < count; i++) {
        (void)printf("%s%af", (i == 0u) ? "" : ", ", (double)values[i]);
    }
    (void)puts("},");
}

static void write_aircraft(const lever_aircraft_t *aircraft)
{
    (void)printf("    .count = %uu,\n", (unsigned)aircraft->count);
    write_floats("frequency", aircraft->frequency, aircraft->count);
    write_floats("real", aircraft->real, aircraft->count);
    write_floats("imaginary", aircraft->imaginary, aircraft->count);
    (void)printf("    .gain_sigma = %af,\n    .phase_sigma = %af,\n", (double)aircraft->gain_sigma,
        (double)aircraft->phase_sigma);
    (void)printf("    .warning = %af,\n    .alarm = %af,\n", (double)aircraft->warning, (double)aircraft->alarm);
}

/* Also whether the estimator takes it. */
static int convert(const lever_config_t *config, const char *path)
{
    lever_memory_t memory;
    lever_aircraft_t aircraft;
    settings_error_t error = {.text = ""};
    FILE *file = fopen(path, "r");

    if (file == NULL) {
        (void)fprintf(stderr, "%s: %s\n", path, strerror(errno));
        return 1;
    }
    const bool good = aircraft_read(&aircraft, file, path, &error);
    (void)fclose(file);
    if (!good) {
        (void)fprintf(stderr, "%s\n", error.text);
    } else if (!lever_aircraft(lever_init(&memory, config), &aircraft)) {
        (void)fprintf(stderr, "%s: " AIRCRAFT_REFUSED "\n", path);
    } else {
        write_aircraft(&aircraft);
        return 0;
    }
    return 1;
}

int main(int argc, char *argv[])
{
    lever_config_t config;

    lever_build_config(&config);
    const char *wrong = lever_config_check(&config);
    if (wrong != NULL) {
        (void)fprintf(stderr, "%s: %s does not fit the other settings: %s\n", argv[1], wrong, meaning_of(wrong));
        return 1;
    }
    return (argc > 2) ? convert(&config, argv[2]) : 0;
}
