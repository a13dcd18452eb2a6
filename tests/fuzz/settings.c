/* Any bytes as a settings file: a configuration in its ranges, which written and read again is the same, or one line
 * that says what is wrong. */
#define _POSIX_C_SOURCE 200809L /* fmemopen */

#include <math.h>
#include <string.h>

#include "lever_cdkf.h"
#include "port/linux/settings.h"
#include "require.h"

static bool is_in_range(const lever_config_t *config)
{
    const char *wrong = lever_config_check(config);
    return (wrong == NULL) || (strcmp(wrong, "gap_limit") == 0); /* which must go with another setting, too */
}

static bool read_again(const lever_config_t *config, lever_config_t *again)
{
    static char text[1 << 16];
    settings_error_t error;
    FILE *file = fmemopen(text, sizeof text, "w+");
    REQUIRE(file != NULL);
    settings_write(config, file);
    rewind(file);
    lever_config_default(again);
    const bool good = settings_read(again, file, "written", &error);
    (void)fclose(file);
    return good;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    lever_config_t config;
    lever_config_t again;
    settings_error_t error = {.text = ""};
    uint8_t none = '\n';
    FILE *file = fmemopen((size > 0u) ? (void *)(uintptr_t)data : &none, (size > 0u) ? size : 1u, "r");
    REQUIRE(file != NULL);
    lever_config_default(&config);
    const bool good = settings_read(&config, file, "a.settings", &error);
    (void)fclose(file);
    REQUIRE(is_in_range(&config)); /* also of a file that is refused in part */
    if (good) {
        REQUIRE(read_again(&config, &again));
        REQUIRE(memcmp(&config.settings, &again.settings, sizeof config.settings) == 0);
        REQUIRE((config.model == again.model) && (config.mitigation == again.mitigation));
    } else {
        REQUIRE((strncmp(error.text, "a.settings:", 11) == 0) && (strchr(error.text, '\n') == NULL));
    }
    return 0;
}
