/* Whether the estimates of a case are those of the float64 oracle: oracle FILE, from oracle_cases.py. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

#include "lever_cdkf.h"

enum { QUANTITIES = 15, SAMPLES_MOST = 20000 };

typedef struct limit {
    double value;
    double within;
} limit_t;

static lever_config_t config;
static lever_memory_t memory;
static lever_sample_t samples[SAMPLES_MOST];
static limit_t row[QUANTITIES];

static void read_into(void *what, size_t size, FILE *file)
{
    if (fread(what, size, 1u, file) != 1u) {
        (void)fputs("oracle: the file ends too early\n", stderr);
        exit(2);
    }
}

static bool agrees(const lever_estimate_t *e)
{
    const float *p = e->parameter;
    const float *sigma = e->parameter_sigma;
    const float found[QUANTITIES] = {e->theta, e->theta_sigma, e->theta_dot, e->theta_dot_sigma, p[0], sigma[0], p[1],
        sigma[1], p[2], sigma[2], e->natural_frequency, e->natural_frequency_sigma, e->damping_ratio,
        e->damping_ratio_sigma, e->nis};
    bool all = true;
    for (int i = 0; i < QUANTITIES; i++) {
        all = (fabs((double)found[i] - row[i].value) <= row[i].within) && all;
    }
    return all;
}

int main(int count, char **arguments)
{
    struct {
        uint32_t samples;
        uint32_t first;
        uint32_t every;
        uint32_t rows;
    } size;
    FILE *file = (count == 2) ? fopen(arguments[1], "rb") : NULL;
    if (file == NULL) {
        return 2;
    }
    read_into(&config, sizeof config, file);
    read_into(&size, sizeof size, file);
    read_into(samples, size.samples * sizeof samples[0], file);
    lever_t *lever = lever_init(&memory, &config);
    bool good = (lever != NULL);
    for (uint32_t k = 0u; good && (k < size.samples); k++) {
        (void)lever_update(lever, &samples[k]);
        if ((k >= size.first) && (((k - size.first) % size.every) == 0u)) {
            lever_estimate_t estimate;
            lever_estimate(lever, &estimate);
            read_into(row, sizeof row, file);
            good = agrees(&estimate);
        }
    }
    (void)fclose(file);
    return good ? EXIT_SUCCESS : EXIT_FAILURE;
}
