/* lever_can's reader of settings files for test_settings_file.py. On standard input stand files one after the other, each behind
 * a line with its size in bytes. A line for each comes out: "bad REASON", or "good", the choices and the bits of every
 * setting, which are the defaults where the file says nothing. */
#define _POSIX_C_SOURCE 200809L

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "port/linux/settings.h"

enum { FILE_BYTES = 1 << 16 };

static void print_config(const lever_config_t *config)
{
    (void)printf("good %u %u %u %u %u", config->model, config->preload, config->estimator, config->adaptation,
        config->mitigation);
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        uint32_t bits = 0u;
        (void)memcpy(&bits, (const uint8_t *)&config->settings + (i * sizeof bits), sizeof bits);
        (void)printf(" %08" PRIx32, bits);
    }
    (void)printf("\n");
}

int main(void)
{
    static char content[FILE_BYTES];
    size_t size = 0u;

    while ((scanf("%zu", &size) == 1) && (getchar() == '\n') && (size < sizeof content)) {
        lever_config_t config;
        settings_error_t error;
        FILE *file = tmpfile();

        if ((file == NULL) || (fread(content, 1u, size, stdin) != size) || (fwrite(content, 1u, size, file) != size)) {
            return 1;
        }
        rewind(file);
        lever_config_default(&config);
        if (settings_read(&config, file, "it", &error)) {
            print_config(&config);
        } else {
            (void)printf("bad %s\n", error.text);
        }
        (void)fclose(file);
    }
    return (feof(stdin) != 0) ? 0 : 1;
}
