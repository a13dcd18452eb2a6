#define _POSIX_C_SOURCE 200809L

#include "port/linux/settings.h"

#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { LINE_BYTES = 512, CHOICE_VALUES = 4 };

/* A choice: its names in the order of its enum, and where it is in the configuration. */
typedef struct choice {
    const char *name;
    const char *values[CHOICE_VALUES];
    size_t offset;
} choice_t;

static const choice_t choices[] = {
    {"model",
        {[LEVER_MODEL_LEVER] = "lever",
            [LEVER_MODEL_LINEAR_PHYSICAL] = "linear_physical",
            [LEVER_MODEL_LINEAR_BLACK_BOX] = "linear_black_box"},
        offsetof(lever_config_t, model)},
    {"preload", {[LEVER_PRELOAD_FIXED] = "fixed", [LEVER_PRELOAD_TRIM] = "trim"}, offsetof(lever_config_t, preload)},
    {"estimator", {[LEVER_ESTIMATOR_DUAL] = "dual", [LEVER_ESTIMATOR_JOINT] = "joint"},
        offsetof(lever_config_t, estimator)},
    {"adaptation",
        {[LEVER_ADAPTATION_FIXED] = "fixed",
            [LEVER_ADAPTATION_ANNEALING] = "annealing",
            [LEVER_ADAPTATION_ROBBINS_MONRO] = "robbins_monro",
            [LEVER_ADAPTATION_FORGETTING] = "forgetting"},
        offsetof(lever_config_t, adaptation)},
};
enum { CHOICES = sizeof choices / sizeof choices[0] };

static bool refuse(settings_error_t *error, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}

static const choice_t *find_choice(const char *name)
{
    for (uint32_t i = 0u; i < (uint32_t)CHOICES; i++) {
        if (strcmp(choices[i].name, name) == 0) {
            return &choices[i];
        }
    }
    return NULL;
}

static bool set_choice(lever_config_t *config, const choice_t *choice, const char *value, settings_error_t *error)
{
    char names[LINE_BYTES];

    for (uint8_t i = 0u; i < (uint8_t)CHOICE_VALUES; i++) {
        if ((choice->values[i] != NULL) && (strcmp(choice->values[i], value) == 0)) {
            ((uint8_t *)config)[choice->offset] = i;
            return true;
        }
    }
    (void)settings_choice_names(choice->name, names, sizeof names);
    return refuse(error, "%s: \"%s\" is not known; it can be %s", choice->name, value, names);
}

static bool set_number(lever_config_t *config, uint32_t index, const char *value, settings_error_t *error)
{
    const lever_setting_t *setting = lever_setting(index);
    char *end = NULL;
    const float number = strtof(value, &end);

    if ((end == value) || (*end != '\0') || !isfinite(number)) {
        return refuse(
            error, "%s: \"%s\" is not a number (give it in %s, without the unit)", setting->name, value, setting->unit);
    }
    if ((number < setting->least) || (number > setting->greatest)) {
        return refuse(error, "%s: %g is out of range, which is %g to %g %s", setting->name, (double)number,
            (double)setting->least, (double)setting->greatest, setting->unit);
    }
    (void)memcpy((uint8_t *)&config->settings + (index * sizeof number), &number, sizeof number);
    return true;
}

bool settings_set(lever_config_t *config, const char *name, const char *value, settings_error_t *error)
{
    const choice_t *choice = find_choice(name);

    if (choice != NULL) {
        return set_choice(config, choice, value, error);
    }
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        if (strcmp(lever_setting(i)->name, name) == 0) {
            return set_number(config, i, value, error);
        }
    }
    return refuse(error, "\"%s\" is not a setting; lever_can --help lists them", name);
}

/* Cuts the white space off both ends, in place. */
static char *trim(char *text)
{
    char *end = text + strlen(text);

    while (isspace((unsigned char)*text) != 0) {
        text++;
    }
    while ((end > text) && (isspace((unsigned char)end[-1]) != 0)) {
        end--;
    }
    *end = '\0';
    return text;
}

bool settings_assign(lever_config_t *config, const char *text, settings_error_t *error)
{
    char name[LINE_BYTES];

    if (strlen(text) >= sizeof name) {
        return refuse(error, "longer than %d characters", LINE_BYTES - 1);
    }
    (void)memcpy(name, text, strlen(text) + 1u);
    char *value = strchr(name, '=');
    if (value == NULL) {
        return refuse(error, "\"%s\" has no \"=\": write name = value", trim(name));
    }
    *value = '\0';
    return settings_set(config, trim(name), trim(value + 1), error);
}

bool settings_read(lever_config_t *config, FILE *file, const char *path, settings_error_t *error)
{
    char line[LINE_BYTES];
    settings_error_t reason;
    uint32_t number = 0u;

    while (fgets(line, (int)sizeof line, file) != NULL) {
        number++;
        if ((strchr(line, '\n') == NULL) && (feof(file) == 0)) {
            return refuse(error, "%.200s:%u: the line is longer than %d characters", path, number, LINE_BYTES - 2);
        }
        line[strcspn(line, "#")] = '\0';
        const char *text = trim(line);
        if ((*text != '\0') && !settings_assign(config, text, &reason)) {
            return refuse(error, "%.200s:%u: %.280s", path, number, reason.text);
        }
    }
    return (ferror(file) == 0) || refuse(error, "%.200s: cannot be read", path);
}

bool settings_choice_names(const char *choice, char *text, size_t size)
{
    const choice_t *found = find_choice(choice);
    size_t used = 0u;

    text[0] = '\0';
    for (uint32_t i = 0u; (found != NULL) && (i < (uint32_t)CHOICE_VALUES); i++) {
        if ((found->values[i] != NULL) && (used < size)) {
            used += (size_t)snprintf(&text[used], size - used, "%s%s", (used > 0u) ? ", " : "", found->values[i]);
        }
    }
    return found != NULL;
}

/* Writes a number with as few digits as give the same float when read again. */
static void write_number(float number, FILE *file)
{
    char text[32];
    int digits = 6;

    do {
        (void)snprintf(text, sizeof text, "%.*g", digits, (double)number);
        digits++;
    } while ((digits <= 9) && (strtof(text, NULL) != number));
    (void)fputs(text, file);
}

void settings_write(const lever_config_t *config, FILE *file)
{
    for (uint32_t i = 0u; i < (uint32_t)CHOICES; i++) {
        char names[LINE_BYTES];
        (void)settings_choice_names(choices[i].name, names, sizeof names);
        const uint8_t chosen = ((const uint8_t *)config)[choices[i].offset];
        (void)fprintf(file, "%s = %s  # one of %s\n", choices[i].name, choices[i].values[chosen], names);
    }
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const lever_setting_t *setting = lever_setting(i);
        float value = 0.0f;
        (void)memcpy(&value, (const uint8_t *)&config->settings + (i * sizeof value), sizeof value);
        (void)fprintf(file, "%s = ", setting->name);
        write_number(value, file);
        (void)fprintf(file, "  # [%s] %g to %g: %s\n", setting->unit, (double)setting->least, (double)setting->greatest,
            setting->meaning);
    }
}
