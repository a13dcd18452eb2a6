#define _POSIX_C_SOURCE 200809L

#include "port/linux/settings.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define BOM "\xEF\xBB\xBF"
#define BLANK " \t"

enum { BOM_BYTES = 3, LINE_BYTES = 510, CHOICE_VALUES = 6 };

/* A line without its LF; what does not fit into the text is not kept, but counted. */
typedef struct line {
    char text[BOM_BYTES + LINE_BYTES + 2]; /* CR and NUL */
    size_t length;
    bool has_nul;
} line_t;

/* A choice: its names in the order of its enum, and where it is in the configuration. */
typedef struct choice {
    const char *name;
    const char *values[CHOICE_VALUES];
    size_t offset;
} choice_t;

/* A unit that may follow a number, and its factor to the unit of the setting. */
typedef struct unit {
    const char *of;
    const char *spelling;
    double factor;
} unit_t;

static const choice_t choices[] = {
    {"model",
        {[LEVER_MODEL_LEVER] = "lever",
            [LEVER_MODEL_LINEAR_PHYSICAL] = "linear_physical",
            [LEVER_MODEL_LINEAR_BLACK_BOX] = "linear_black_box",
            [LEVER_MODEL_HAND] = "hand"},
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
    {"mitigation",
        {[LEVER_MITIGATION_NONE] = "none",
            [LEVER_MITIGATION_DAMPING] = "damping",
            [LEVER_MITIGATION_CANCELLATION] = "cancellation",
            [LEVER_MITIGATION_CANCELLATION_AND_DAMPING] = "cancellation_and_damping",
            [LEVER_MITIGATION_NOTCH] = "notch",
            [LEVER_MITIGATION_NOTCH_AND_DAMPING] = "notch_and_damping"},
        offsetof(lever_config_t, mitigation)},
};
enum { CHOICES = (sizeof choices) / (sizeof choices[0]) };

static const unit_t units[] = {
/* cppcheck-suppress misra-c2012-20.7 ; D1 */
#define LEVER_UNIT(of, spelling, factor) {of, spelling, factor},
#include "lever_units.def"
#undef LEVER_UNIT
};
enum { UNITS = (sizeof units) / (sizeof units[0]) };

static bool refuse(settings_error_t *error, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}

/* Adds a name to a list in memory of `size` bytes, as far as it fits. */
static void add_name(char *list, size_t size, const char *name)
{
    (void)strncat(list, (list[0] != '\0') ? ", " : "", size - strlen(list) - 1u);
    (void)strncat(list, name, size - strlen(list) - 1u);
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

static const char *after_digits(const char *text)
{
    return text + strspn(text, "0123456789");
}

static const char *after_sign(const char *text)
{
    return ((*text == '+') || (*text == '-')) ? (text + 1) : text;
}

const char *settings_number_end(const char *text)
{
    const char *begin = after_sign(text);
    const char *end = after_digits(begin);
    bool good = end != begin;

    if (*end == '.') {
        const char *fraction = end + 1;
        end = after_digits(fraction);
        good = good || (end != fraction);
    }
    if (good && ((*end == 'e') || (*end == 'E'))) {
        const char *exponent = after_sign(end + 1);
        const char *exponent_end = after_digits(exponent);
        end = (exponent_end != exponent) ? exponent_end : end;
    }
    return good ? end : text;
}

/* The factor of a unit to that of a setting; 0 if it is none of its units. */
static double unit_factor(const char *of, const char *spelling)
{
    for (uint32_t i = 0u; i < (uint32_t)UNITS; i++) {
        if ((strcmp(units[i].of, of) == 0) && (strcmp(units[i].spelling, spelling) == 0)) {
            return units[i].factor;
        }
    }
    return (*spelling == '\0') ? 1.0 : 0.0;
}

/* The spellings of a unit, as "kg, g". */
static const char *unit_names(const char *of, char *text, size_t size)
{
    text[0] = '\0';
    for (uint32_t i = 0u; i < (uint32_t)UNITS; i++) {
        if (strcmp(units[i].of, of) == 0) {
            add_name(text, size, units[i].spelling);
        }
    }
    return text;
}

static bool set_number(lever_config_t *config, uint32_t index, const char *value, settings_error_t *error)
{
    const lever_setting_t *setting = lever_setting(index);
    const char *end = settings_number_end(value);
    const char *spelling = end + strspn(end, BLANK);
    const double factor = unit_factor(setting->unit, spelling);
    char names[128];

    if (end == value) {
        return refuse(error, "%s: \"%s\" is not a number (give it in %s, or with a unit: %s)", setting->name, value,
            setting->unit, unit_names(setting->unit, names, sizeof names));
    }
    if (!(factor > 0.0)) {
        return refuse(error, "%s: \"%s\" has unit \"%s\"; allowed: %s", setting->name, value, spelling,
            unit_names(setting->unit, names, sizeof names));
    }
    const double number = strtod(value, NULL) * factor;
    const float rounded = (fabs(number) <= (double)FLT_MAX) ? (float)number : INFINITY;
    if (!((rounded >= setting->least) && (rounded <= setting->greatest))) {
        return refuse(error, "%s: %g is out of range, which is %g to %g %s", setting->name, number,
            (double)setting->least, (double)setting->greatest, setting->unit);
    }
    /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    (void)memcpy((uint8_t *)&config->settings + (index * sizeof rounded), &rounded, sizeof rounded);
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

/* Cuts the blanks off both ends, in place. */
static char *trim(char *text)
{
    char *begin = text + strspn(text, BLANK);
    char *end = begin + strlen(begin);

    while ((end > begin) && (strchr(BLANK, end[-1]) != NULL)) {
        end--;
    }
    *end = '\0';
    return begin;
}

bool settings_assign(lever_config_t *config, const char *text, settings_error_t *error)
{
    char name[LINE_BYTES + 1];

    if (strlen(text) >= sizeof name) {
        return refuse(error, "longer than %d characters", LINE_BYTES);
    }
    (void)memcpy(name, text, strlen(text) + 1u);
    const size_t length = strcspn(name, "=");
    if (name[length] == '\0') {
        return refuse(error, "\"%s\" has no \"=\": write name = value", trim(name));
    }
    name[length] = '\0';
    return settings_set(config, trim(name), trim(&name[length + 1u]), error);
}

/* Reads a line; false at the end of the file, when the line is what was left. */
static bool read_line(FILE *file, line_t *line)
{
    int byte = getc(file);

    (void)memset(line, 0, sizeof *line);
    while ((byte != EOF) && (byte != '\n')) {
        if (line->length < (sizeof line->text - 1u)) {
            line->text[line->length] = (char)byte;
        }
        line->has_nul = line->has_nul || (byte == 0);
        line->length++;
        byte = getc(file);
    }
    return byte != EOF;
}

/* Gives on what one line says; `is_first`: it may begin with a byte order mark. */
static bool take_line(line_t *line, bool is_first, settings_take_t take, void *context, settings_error_t *error)
{
    const size_t skipped = (is_first && (strncmp(line->text, BOM, BOM_BYTES) == 0)) ? (size_t)BOM_BYTES : 0u;
    char *text = &line->text[skipped];
    size_t length = line->length - skipped;

    if (line->has_nul) {
        return refuse(error, "is not text");
    }
    if ((length > 0u) && (length <= (size_t)LINE_BYTES + 1u) && (text[length - 1u] == '\r')) {
        length--;
    }
    if (length > (size_t)LINE_BYTES) {
        return refuse(error, "the line is longer than %d bytes", LINE_BYTES);
    }
    text[length] = '\0';
    text[strcspn(text, "#")] = '\0';
    text = trim(text);
    return (*text == '\0') || take(context, text, error);
}

bool settings_lines(FILE *file, const char *path, settings_take_t take, void *context, settings_error_t *error)
{
    line_t line;
    settings_error_t reason;
    uint32_t number = 0u;
    bool is_more = true;

    while (is_more) {
        is_more = read_line(file, &line);
        number++;
        if (!take_line(&line, number == 1u, take, context, &reason)) {
            return refuse(error, "%.200s:%u: %.280s", path, number, reason.text);
        }
    }
    return (ferror(file) == 0) || refuse(error, "%.200s: cannot be read", path);
}

static bool assign_line(void *context, const char *text, settings_error_t *error)
{
    return settings_assign(context, text, error);
}

bool settings_read(lever_config_t *config, FILE *file, const char *path, settings_error_t *error)
{
    return settings_lines(file, path, assign_line, config, error);
}

bool settings_choice_names(const char *choice, char *text, size_t size)
{
    const choice_t *found = find_choice(choice);

    text[0] = '\0';
    for (uint32_t i = 0u; (found != NULL) && (i < (uint32_t)CHOICE_VALUES); i++) {
        if (found->values[i] != NULL) {
            add_name(text, size, found->values[i]);
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
        /* cppcheck-suppress misra-c2012-21.15 ; D2 */
        (void)memcpy(&value, (const uint8_t *)&config->settings + (i * sizeof value), sizeof value);
        (void)fprintf(file, "%s = ", setting->name);
        write_number(value, file);
        (void)fprintf(file, "  # [%s] %g to %g: %s\n", setting->unit, (double)setting->least, (double)setting->greatest,
            setting->meaning);
    }
}
