/* What the tests of the application share: samples of the simulated lever at 1 kHz, and comparison of estimates. */
#ifndef UNIT_APP_RIG_H
#define UNIT_APP_RIG_H

#include "../model/simulation.h"
#include "lever_cdkf.h"
#include "test.h"

#include <stdio.h>
#include <string.h>

enum { RIG_PERIOD_US = 1000 };

/* --- every model with every estimator, for programs that run their tests with all of them ------------------------- */

enum { RIG_COMBINATIONS = LEVER_MODEL_COUNT * LEVER_ESTIMATOR_COUNT };

/* The default configuration but for model and estimator. */
static inline lever_config_t rig_config(uint32_t combination)
{
    lever_config_t config;
    lever_config_default(&config);
    config.model = (uint8_t)(combination % (uint32_t)LEVER_MODEL_COUNT);
    config.estimator = (uint8_t)(combination / (uint32_t)LEVER_MODEL_COUNT);
    return config;
}

/* The setting of that name. */
static inline float *rig_setting(lever_config_t *config, const char *name)
{
    uint32_t index = 0u;
    while ((index < lever_setting_count()) && (strcmp(lever_setting(index)->name, name) != 0)) {
        index++;
    }
    TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(lever_setting_count(), index, name);
    return (float *)(void *)((uint8_t *)&config->settings + (index * sizeof(float)));
}

/* The setting of parameter i of the chosen model named like it with `suffix`: "" its first guess, "_sigma", "_walk". */
static inline float *rig_parameter_setting(lever_config_t *config, uint32_t i, const char *suffix)
{
    char name[32];
    (void)snprintf(name, sizeof name, "%s%s", lever_parameter_name(config->model, i), suffix);
    return rig_setting(config, name);
}

/* Standard deviation of the first guess of parameter i, in its unit. */
static inline float rig_first_sigma(lever_config_t *config, uint32_t i)
{
    const float sigma = *rig_parameter_setting(config, i, "_sigma");
    const bool relative = (config->model != (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX);
    return relative ? (sigma * *rig_parameter_setting(config, i, "")) : sigma;
}

/* Sensors and lever are exactly what the settings say. */
static inline void rig_trust_calibration(lever_config_t *config)
{
    config->settings.z_ddot_gain_sigma = 0.0f;
    config->settings.z_ddot_delay_sigma = 0.0f;
    config->settings.tau_m_gain_sigma = 0.0f;
    config->settings.lever_friction_sigma = 0.0f;
}

/* --- samples ------------------------------------------------------------------------------------------------------ */

typedef struct rig {
    simulation_t simulation;
    uint32_t time_us; /* of the last sample */
} rig_t;

static inline rig_t rig_typical(void)
{
    const rig_t rig = {.simulation = simulation_typical()};
    return rig;
}

/* The same of a plant that is what `model` takes it for; its parameters, none the first guess, are left in `truth`. */
static inline rig_t rig_of(uint8_t model, double truth[LEVER_PARAMETERS])
{
    static const double parameters[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {[LEVER_MODEL_LEVER] = {3.2, 60.0, 2100.0},
        [LEVER_MODEL_LINEAR_PHYSICAL] = {3.2, 60.0, 2100.0},
        [LEVER_MODEL_LINEAR_BLACK_BOX] = {-620.0, -19.0, -2.8},
        [LEVER_MODEL_HAND] = {620.0, 19.0, 12.0}};
    const double *p = parameters[model];
    rig_t rig = rig_typical();
    if (model == (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL) {
        rig.simulation.plant = plant_physical(p[0], p[1], p[2]);
        rig.simulation.torque_rms = 1.6; /* [N], moves this mass as 0.3 N m move the lever and its arm */
    } else if (model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX) {
        rig.simulation.plant = plant_black_box(p[0], p[1], p[2]);
        rig.simulation.torque_rms = 0.0;
    } else if (model == (uint8_t)LEVER_MODEL_HAND) {
        rig.simulation.plant = plant_hand(p[0], p[1], p[2]);
    } else {
        /* a lever it is */
    }
    (void)memcpy(truth, p, LEVER_PARAMETERS * sizeof truth[0]);
    return rig;
}

/* The next sample, `periods` later, everything valid. */
static inline lever_sample_t rig_sample_after(rig_t *rig, uint32_t periods)
{
    for (uint32_t k = 0u; k < periods; k++) {
        simulation_advance(&rig->simulation, 1.0e-6 * (double)RIG_PERIOD_US);
        rig->time_us += (uint32_t)RIG_PERIOD_US;
    }
    const lever_sample_t sample = {.time_us = rig->time_us,
        .theta = (float)rig->simulation.theta,
        .theta_dot = (float)rig->simulation.theta_dot,
        .tau_m = (float)rig->simulation.tau_m,
        .z_ddot = (float)rig->simulation.z_ddot,
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = true,
        .z_ddot_valid = true};
    return sample;
}

static inline lever_sample_t rig_sample(rig_t *rig)
{
    return rig_sample_after(rig, 1u);
}

/* `count` good samples; the mode after the last. */
static inline enum lever_mode rig_run(rig_t *rig, lever_t *lever, uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = rig_sample(rig);
        mode = lever_update(lever, &sample);
    }
    return mode;
}

/* A sample in which nothing could be measured. */
static inline lever_sample_t rig_sample_blind(rig_t *rig)
{
    lever_sample_t sample = rig_sample(rig);
    sample.theta_valid = false;
    sample.theta_dot_valid = false;
    return sample;
}

/* `count` of them; the mode after the last. */
static inline enum lever_mode rig_run_blind(rig_t *rig, lever_t *lever, uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = rig_sample_blind(rig);
        mode = lever_update(lever, &sample);
    }
    return mode;
}

/* Nothing moves any more. */
static inline void rig_let_rest(rig_t *rig)
{
    rig->simulation.base_rms = 0.0;
    rig->simulation.torque_rms = 0.0;
    rig->simulation.process_noise = 0.0;
}

/* Twice as stiff and damped, at once; of the black box, what multiplies theta and its rate. */
static inline void rig_grip(rig_t *rig)
{
    plant_t *plant = &rig->simulation.plant;
    plant->c_p *= 2.0;
    plant->k_p *= 2.0;
    plant->linear.damping *= 2.0;
    plant->linear.stiffness *= 2.0;
}

static inline lever_health_t rig_health(const lever_t *lever)
{
    lever_health_t health;
    lever_health(lever, &health);
    return health;
}

static inline lever_estimate_t rig_estimate(const lever_t *lever)
{
    lever_estimate_t estimate;
    (void)memset(&estimate, 0, sizeof estimate); /* padding too: estimates are compared as bytes */
    lever_estimate(lever, &estimate);
    return estimate;
}

/* Each parameter is within so many of the standard deviations that the estimate claims. */
static inline void rig_assert_within(double sigmas, const double truth[LEVER_PARAMETERS], lever_estimate_t estimate)
{
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        const double sigma = (double)estimate.parameter_sigma[i];
        TEST_ASSERT_DOUBLE_WITHIN(sigmas * sigma, truth[i], (double)estimate.parameter[i]);
    }
}

/* At the first guess of the configuration, as uncertain as that, and uncorrelated. */
static inline void rig_assert_first_guess(lever_config_t *config, lever_estimate_t estimate)
{
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        TEST_ASSERT_EQUAL_FLOAT(*rig_parameter_setting(config, i, ""), estimate.parameter[i]);
        TEST_ASSERT_EQUAL_FLOAT(rig_first_sigma(config, i), estimate.parameter_sigma[i]);
        TEST_ASSERT_TRUE(estimate.parameter_correlation[i] == 0.0f);
    }
}

/* Everything in it is a number. */
static inline void rig_assert_finite(lever_estimate_t estimate)
{
    const float values[] = {estimate.theta, estimate.theta_dot, estimate.theta_sigma, estimate.theta_dot_sigma,
        estimate.natural_frequency, estimate.natural_frequency_sigma, estimate.damping_ratio,
        estimate.damping_ratio_sigma, estimate.trim, estimate.nis};
    for (uint32_t i = 0u; i < (uint32_t)(sizeof values / sizeof values[0]); i++) {
        TEST_ASSERT_TRUE(isfinite(values[i]));
    }
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        TEST_ASSERT_TRUE(isfinite(estimate.parameter[i]) && isfinite(estimate.parameter_sigma[i]));
        TEST_ASSERT_TRUE(fabsf(estimate.parameter_correlation[i]) <= 1.0001f);
    }
}

static inline void rig_assert_same_estimates(const lever_t *expected, const lever_t *actual)
{
    const lever_estimate_t first = rig_estimate(expected);
    const lever_estimate_t second = rig_estimate(actual);
    TEST_ASSERT_EQUAL_MEMORY(&first, &second, sizeof first);
}

/* A command that changes nothing but what the test then sets. */
static inline lever_command_t rig_command(void)
{
    const lever_command_t command = {.request = (uint8_t)LEVER_REQUEST_NONE,
        .model = (uint8_t)LEVER_KEEP,
        .preload = (uint8_t)LEVER_KEEP,
        .estimator = (uint8_t)LEVER_KEEP,
        .adaptation = (uint8_t)LEVER_KEEP,
        .dither_rms = (float)LEVER_KEEP};
    return command;
}

static inline void rig_request(lever_t *lever, enum lever_request request)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)request;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

#endif
