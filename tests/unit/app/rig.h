/* An instance and the lever that it is fed with, at 1 kHz: what the tests of the application share. */
#ifndef UNIT_APP_RIG_H
#define UNIT_APP_RIG_H

#include "lever_cdkf.h"
#include "simulation.h"
#include "test.h"

#include <stdio.h>
#include <string.h>

enum {
    PARAMETERS = LEVER_PARAMETERS,
    COMBINATIONS = LEVER_MODEL_COUNT * LEVER_ESTIMATOR_COUNT, /* of model and estimator */
    PERIOD_US = 1000
};

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static simulation_t simulation;
static uint32_t time_us; /* of the last sample */

/* The default configuration but for model and estimator. */
static inline lever_config_t config_of(uint32_t combination)
{
    lever_config_t result;
    lever_config_default(&result);
    result.model = (uint8_t)(combination % (uint32_t)LEVER_MODEL_COUNT);
    result.estimator = (uint8_t)(combination / (uint32_t)LEVER_MODEL_COUNT);
    return result;
}

/* A new instance of `config`, and a lever as its model has it. */
static inline void start(void)
{
    simulation = simulation_of(config.model);
    time_us = 0u;
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
}

/* --- samples ------------------------------------------------------------------------------------------------------ */

/* The next one, so many milliseconds later, everything valid. */
static inline lever_sample_t sample_after(uint32_t periods)
{
    for (uint32_t k = 0u; k < periods; k++) {
        simulation_advance(&simulation, 1.0e-6 * (double)PERIOD_US);
    }
    time_us += periods * (uint32_t)PERIOD_US;
    return (lever_sample_t){.time_us = time_us,
        .theta = (float)simulation.measured_theta,
        .theta_dot = (float)simulation.measured_theta_dot,
        .tau_m = (float)simulation.tau_m,
        .z_ddot = (float)simulation.z_ddot,
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = true,
        .z_ddot_valid = true};
}

/* One in which nothing could be measured. */
static inline lever_sample_t sample_blind(void)
{
    lever_sample_t sample = sample_after(1u);
    sample.theta_valid = false;
    sample.theta_dot_valid = false;
    return sample;
}

static inline enum lever_mode run_with(lever_t *instance, uint32_t count, bool blind)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = blind ? sample_blind() : sample_after(1u);
        mode = lever_update(instance, &sample);
    }
    return mode;
}

/* `count` good samples, or blind ones; the mode after the last. */
static inline enum lever_mode run(uint32_t count)
{
    return run_with(lever, count, false);
}

static inline enum lever_mode run_blind(uint32_t count)
{
    return run_with(lever, count, true);
}

/* Nothing moves any more. */
static inline void let_rest(void)
{
    simulation.base_rms = 0.0;
    simulation.torque_rms = 0.0;
    simulation.process_noise = 0.0;
}

/* --- what it says ------------------------------------------------------------------------------------------------- */

static inline lever_health_t health_of(const lever_t *instance)
{
    lever_health_t health;
    lever_health(instance, &health);
    return health;
}

static inline lever_health_t health(void)
{
    return health_of(lever);
}

static inline bool has_fault(enum lever_fault fault)
{
    return (health().faults & (uint32_t)fault) != 0u;
}

static inline lever_estimate_t estimate_of(const lever_t *instance)
{
    lever_estimate_t estimate;
    (void)memset(&estimate, 0, sizeof estimate); /* padding too: estimates are compared as bytes */
    lever_estimate(instance, &estimate);
    return estimate;
}

static inline lever_estimate_t estimate(void)
{
    return estimate_of(lever);
}

static inline void assert_same_estimates(const lever_t *expected, const lever_t *actual)
{
    const lever_estimate_t first = estimate_of(expected);
    const lever_estimate_t second = estimate_of(actual);
    TEST_ASSERT_EQUAL_MEMORY(&first, &second, sizeof first);
}

static inline void assert_same_parameters(const lever_estimate_t *expected, const lever_estimate_t *actual)
{
    TEST_ASSERT_EQUAL_MEMORY(expected->parameter, actual->parameter, sizeof expected->parameter);
}

/* Everything in it is a number. */
static inline void assert_finite(lever_estimate_t e)
{
    const float values[] = {e.theta, e.theta_dot, e.theta_sigma, e.theta_dot_sigma, e.natural_frequency,
        e.natural_frequency_sigma, e.damping_ratio, e.damping_ratio_sigma, e.trim, e.nis};
    for (uint32_t i = 0u; i < (uint32_t)(sizeof values / sizeof values[0]); i++) {
        TEST_ASSERT_TRUE(isfinite(values[i]));
    }
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_TRUE(isfinite(e.parameter[i]) && isfinite(e.parameter_sigma[i]));
        TEST_ASSERT_TRUE(fabsf(e.parameter_correlation[i]) <= 1.0001f);
    }
}

/* --- first guesses ------------------------------------------------------------------------------------------------ */

/* The setting of parameter i of the configured model named like it with `suffix`: "" its first guess, "_sigma",
 * "_walk". */
static inline float *parameter_setting(uint32_t i, const char *suffix)
{
    char name[32];
    uint32_t index = 0u;
    (void)snprintf(name, sizeof name, "%s%s", lever_parameter_name(config.model, i), suffix);
    while (strcmp(lever_setting(index)->name, name) != 0) {
        index++;
    }
    return (float *)(void *)((uint8_t *)&config.settings + (index * sizeof(float)));
}

/* At the first guess of the configuration, as uncertain as that, and uncorrelated. */
static inline void assert_first_guess(void)
{
    const lever_estimate_t found = estimate();
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        const float guess = *parameter_setting(i, "");
        const float unit = (config.model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX) ? 1.0f : guess;
        TEST_ASSERT_EQUAL_FLOAT(guess, found.parameter[i]);
        TEST_ASSERT_EQUAL_FLOAT(unit * *parameter_setting(i, "_sigma"), found.parameter_sigma[i]);
        TEST_ASSERT_TRUE(found.parameter_correlation[i] == 0.0f);
    }
}

/* --- commands ----------------------------------------------------------------------------------------------------- */

/* One that changes nothing but what the test then sets. */
static inline lever_command_t command_none(void)
{
    return (lever_command_t){.request = (uint8_t)LEVER_REQUEST_NONE,
        .model = (uint8_t)LEVER_KEEP,
        .preload = (uint8_t)LEVER_KEEP,
        .estimator = (uint8_t)LEVER_KEEP,
        .adaptation = (uint8_t)LEVER_KEEP,
        .mitigation = (uint8_t)LEVER_KEEP,
        .dither_rms = (float)LEVER_KEEP};
}

static inline void request(enum lever_request what)
{
    lever_command_t command = command_none();
    command.request = (uint8_t)what;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

static inline void dither(float rms)
{
    lever_command_t command = command_none();
    command.dither_rms = rms;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

#endif
