/* The least that a project does with the estimator: a second of samples in, an estimate out.
 *
 * An arm that swings freely at 3 Hz; prints theta [rad] and natural frequency [Hz] as the bits of a float. */
#include <lever_cdkf.h>

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static lever_memory_t memory;

static uint32_t bits_of(float value)
{
    uint32_t bits = 0u;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

int main(void)
{
    lever_config_t config;
    lever_estimate_t estimate;
    lever_config_default(&config);
    lever_t *lever = lever_init(&memory, &config);
    if (lever == NULL) {
        return 1;
    }
    for (uint32_t i = 0u; i < 1000u; i++) {
        const int32_t phase =
            (int32_t)(i % 333u) - 166; /* a parabola for each half of a period: no libm, the same anywhere */
        const float swing = (float)(phase * (166 - ((phase < 0) ? -phase : phase))) / 6889.0f;
        const lever_sample_t sample = {.time_us = i * 1000u,
            .theta = 0.35f + (0.0625f * swing),
            .theta_valid = true,
            .tau_m_valid = true,
            .z_ddot_valid = true};
        (void)lever_update(lever, &sample);
    }
    lever_estimate(lever, &estimate);
    (void)printf("%08" PRIx32 " %08" PRIx32 "\n", bits_of(estimate.theta), bits_of(estimate.natural_frequency));
    return 0;
}
