/* A settings file of any bytes, of any length; then any texts as assignments, of up to 24 characters and about as many
 * as there is room for. */
#include "texts.h"

#include "port/linux/settings.h"

enum { TEXT = 512, LONG = 510, SHORT = 24 };

size_t strcspn(const char *text, const char *refused)
{
    (void)refused;
    return any_position(text);
}

int getc(FILE *file)
{
    (void)file;
    return Frama_C_interval(-1, 255);
}

static bool take(void *context, const char *text, settings_error_t *error)
{
    (void)context;
    (void)error;
    //@ assert valid_read_string(text);
    return any_bool();
}

/*@ requires valid_read_string(name);
    requires valid_read_string(value);
    assigns *config, *error, \result \from indirect:name[0 ..], indirect:value[0 ..];
    ensures \result == 0 || \result == 1; */
bool settings_set(lever_config_t *config, const char *name, const char *value, settings_error_t *error);

static void assign(uint32_t length)
{
    static char text[TEXT + 1];
    static lever_config_t config;
    settings_error_t error;
    any_text(text, length, 127);
    (void)settings_assign(&config, text, &error);
}

void main(void)
{
    static FILE file;
    settings_error_t error;
    (void)settings_lines(&file, "a.settings", take, NULL, &error);
    apart = true;
    for (uint32_t length = 0u; length <= (uint32_t)SHORT; length++) {
        assign(length);
    }
    for (uint32_t length = (uint32_t)LONG; length <= (uint32_t)TEXT; length++) {
        assign(length);
    }
}
