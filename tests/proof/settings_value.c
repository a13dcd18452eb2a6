/* What settings_text takes for granted, of shorter texts: they are trimmed, and any value is given to a number, to one
 * whose unit has a blank in it, to a choice, and to what is no setting. Of the settings there are two. */
#include "texts.h"

#include "port/linux/settings.h"

enum { TEXT = 16, VALUE = 4 };

static const char *const names[] = {"theta_noise", "lever_inertia", "model", "other"};
static const lever_setting_t table[] = {
    {"theta_noise", "rad", "", 1.0f, 0.0f, 10.0f}, {"lever_inertia", "kg m^2", "", 1.0f, 0.0f, 10.0f}};

uint32_t lever_setting_count(void)
{
    return (uint32_t)(sizeof table / sizeof table[0]);
}

const lever_setting_t *lever_setting(uint32_t index)
{
    return &table[index];
}

/* Exact, for the one character of "=". */
size_t strcspn(const char *text, const char *refused)
{
    size_t i = 0u;
    while ((text[i] != '\0') && (text[i] != refused[0])) {
        i++;
    }
    return i;
}

int strcmp(const char *a, const char *b)
{
    size_t i = 0u;
    while ((a[i] != '\0') && (a[i] == b[i])) {
        i++;
    }
    return (a[i] == b[i]) ? 0 : 1;
}

char *strncat(char *restrict list, const char *restrict name, size_t most)
{
    const size_t used = strlen(list);
    size_t i = 0u;
    for (; (i < most) && (name[i] != '\0'); i++) {
        list[used + i] = name[i];
    }
    list[used + i] = '\0';
    return list;
}

void main(void)
{
    static char text[TEXT + 1];
    static lever_config_t config;
    settings_error_t error;
    apart = true;
    //@ loop unroll 99;
    for (uint32_t length = 0u; length <= (uint32_t)TEXT; length++) {
        any_text(text, length, '=' - 1);
        (void)settings_assign(&config, text, &error);
    }
    (void)settings_assign(&config, "theta_noise = 1 rad", &error);
    //@ loop unroll 99;
    for (uint32_t length = 0u; length <= (uint32_t)VALUE; length++) {
        char *value = &text[(uint32_t)TEXT - length]; /* behind it there is nothing to read */
        //@ loop unroll 4;
        for (uint32_t i = 0u; i < 4u; i++) {
            any_text(value, length, 127);
            (void)settings_set(&config, names[i], value, &error);
        }
    }
}
