/* Flies the estimator for a long time and prints its parameters ten times a second.
 *
 *     single|double SCENE ESTIMATOR SETTINGS SECONDS
 *
 * SCENE: drift (the arm changes slowly by a factor of two, fair excitation) or calm (a constant arm, hardly any).
 * ESTIMATOR: the number of enum lever_estimator. SETTINGS: default, or plain (neither change detection nor noise
 * estimation). A line is: time [s], then value and standard deviation of each parameter. The exit status is 1 as soon
 * as the belief breaks its invariant after any sample. Samples are the same in both precisions. */
#include "app/estimator.h"
#include "simulation.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { SAMPLES_A_SECOND = 1000, SAMPLES_A_LINE = 100 };

#define TURN 6.283185307179586

/* What a sensor with single-precision output gives. */
static double rounded(double value)
{
    const uint32_t shift = 29u; /* of the 52 bits of a double's mantissa, 23 are left */
    uint64_t bits = 0u;
    (void)memcpy(&bits, &value, sizeof bits);
    bits &= ~((UINT64_C(1) << shift) - 1u);
    (void)memcpy(&value, &bits, sizeof bits);
    return value;
}

static void set_arm(simulation_t *simulation, bool drifts)
{
    if (drifts) {
        const double hours = simulation->time / 3600.0;
        const double m_p = 2.5 * exp(0.2 * sin(TURN * 1.1 * hours));
        const double c_p = 45.0 * exp(0.35 * sin(TURN * 1.7 * hours));
        const double k_p = 1600.0 * exp(0.35 * sin(TURN * 2.3 * hours));
        simulation->plant = plant_of_lever(m_p, c_p, k_p);
    }
}

static lever_sample_t sample_of(const simulation_t *simulation, uint32_t index)
{
    const lever_sample_t sample = {.time_us = index * 1000u,
        .theta = rounded(simulation->measured_theta),
        .theta_dot = rounded(simulation->measured_theta_dot),
        .tau_m = rounded(simulation->tau_m),
        .z_ddot = rounded(simulation->z_ddot),
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = true,
        .z_ddot_valid = true};
    return sample;
}

static void print_line(const estimator_t *estimator, const simulation_t *simulation)
{
    lever_estimate_t estimate;
    estimator_estimate(estimator, &estimate);
    (void)printf("%.3f", simulation->time);
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        (void)printf(" %.9g %.9g", (double)estimate.parameter[i], (double)estimate.parameter_sigma[i]);
    }
    (void)printf("\n");
}

static bool fly(const lever_config_t *config, bool drifts, uint32_t samples)
{
    static estimator_t estimator;
    simulation_t simulation = simulation_of((uint8_t)LEVER_MODEL_LEVER);
    bool valid = true;
    if (!drifts) { /* three sixteenths of the usual motion, which is enough to be learnt from at any time, and no torque */
        simulation.base_rms *= 0.1875;
        simulation.torque_rms = 0.0;
        simulation.process_noise *= 0.1875;
    }
    estimator_init(&estimator, config);
    for (uint32_t index = 0u; (index < samples) && valid; index++) {
        set_arm(&simulation, drifts);
        const lever_sample_t sample = sample_of(&simulation, index);
        (void)estimator_update(&estimator, &sample, 0.0f);
        valid = (index == 0u) || (cdkf_is_valid(&estimator.cdkf) && (estimator.recoveries == 0u));
        if ((index % (uint32_t)SAMPLES_A_LINE) == 0u) {
            print_line(&estimator, &simulation);
        }
        simulation_advance(&simulation, 1.0 / (double)SAMPLES_A_SECOND);
    }
    return valid;
}

int main(int argc, char **argv)
{
    if (argc != 5) {
        (void)fprintf(stderr, "usage: %s drift|calm ESTIMATOR default|plain SECONDS\n", argv[0]);
        return 2;
    }
    const bool drifts = (strcmp(argv[1], "drift") == 0);
    const uint32_t seconds = (uint32_t)strtoul(argv[4], NULL, 10);
    lever_config_t config;
    lever_config_default(&config);
    config.estimator = (uint8_t)strtoul(argv[2], NULL, 10);
    if (strcmp(argv[3], "plain") == 0) {
        config.settings.change_threshold = 0.0f;
        config.settings.noise_window = 0.0f;
    }
    return fly(&config, drifts, seconds * (uint32_t)SAMPLES_A_SECOND) ? 0 : 1;
}
