/* Times lever_update() on this machine over recorded samples.
 *
 *     lever_benchmark SAMPLES ROUNDS model=N estimator=N [SETTING=VALUE …] [dither_rms=VALUE]
 *
 * SAMPLES holds lever_sample_t, as many as there are. Prints, for each of ROUNDS runs from the first sample to the last, the
 * nanoseconds that a call took in the mean. */
#define _POSIX_C_SOURCE 200809L

#include "lever_cdkf.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define SAMPLES_MOST 100000u

static lever_sample_t samples[SAMPLES_MOST];

static void give_up(const char *why, const char *what)
{
    (void)fprintf(stderr, "lever_benchmark: %s: %s\n", what, why);
    exit(2);
}

static size_t read_samples(const char *path)
{
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        give_up("cannot be read", path);
        return 0u;
    }
    const size_t count = fread(samples, sizeof samples[0], SAMPLES_MOST, file);
    (void)fclose(file);
    return count;
}

/* The value of a setting or of the dither by its name, or NULL. */
static float *number_named(const char *name, lever_config_t *config, lever_command_t *command)
{
    float *found = (strcmp(name, "dither_rms") == 0) ? &command->dither_rms : NULL;
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        if (strcmp(name, lever_setting(i)->name) == 0) {
            found = (float *)&config->settings + i;
        }
    }
    return found;
}

static void take_argument(char *word, lever_config_t *config, lever_command_t *command)
{
    char *value = strchr(word, '=');
    if (value == NULL) {
        give_up("not of the form KEY=VALUE", word);
        return;
    }
    *value = '\0';
    value++;
    if (strcmp(word, "model") == 0) {
        config->model = (uint8_t)strtoul(value, NULL, 10);
    } else if (strcmp(word, "estimator") == 0) {
        config->estimator = (uint8_t)strtoul(value, NULL, 10);
    } else {
        float *number = number_named(word, config, command);
        if (number == NULL) {
            give_up("no setting of this name", word);
            return;
        }
        *number = strtof(value, NULL);
    }
}

static double now_ns(void)
{
    struct timespec time;
    (void)clock_gettime(CLOCK_MONOTONIC, &time);
    return (1.0e9 * (double)time.tv_sec) + (double)time.tv_nsec;
}

/* Nanoseconds a call, over all samples with a fresh instance. */
static double run(const lever_config_t *config, const lever_command_t *command, size_t count)
{
    static lever_memory_t memory;
    lever_t *lever = lever_init(&memory, config);
    if ((lever == NULL) || !lever_command(lever, command)) {
        give_up("refused", "configuration");
        return 0.0;
    }
    const double begin = now_ns();
    for (size_t i = 0u; i < count; i++) {
        (void)lever_update(lever, &samples[i]);
    }
    return (now_ns() - begin) / (double)count;
}

int main(int argc, char **argv)
{
    lever_config_t config;
    lever_command_t command = {(uint8_t)LEVER_REQUEST_NONE, (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP,
        (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP, 0.0f};
    if (argc < 3) {
        give_up("SAMPLES ROUNDS [KEY=VALUE]...", "usage");
        return 2;
    }
    lever_config_default(&config);
    for (int i = 3; i < argc; i++) {
        take_argument(argv[i], &config, &command);
    }
    const size_t count = read_samples(argv[1]);
    const unsigned long rounds = strtoul(argv[2], NULL, 10);
    for (unsigned long round = 0u; round < rounds; round++) {
        (void)printf("%.3f\n", run(&config, &command, count));
    }
    return 0;
}
