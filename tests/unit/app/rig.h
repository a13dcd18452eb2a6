/* What the tests of the application share: samples of the simulated lever at 1 kHz, and comparison of estimates. */
#ifndef UNIT_APP_RIG_H
#define UNIT_APP_RIG_H

#include "../model/simulation.h"
#include "lever_cdkf.h"
#include "unity.h"

#include <string.h>

enum { RIG_PERIOD_US = 1000 };

typedef struct rig {
    simulation_t simulation;
    uint32_t time_us; /* of the last sample */
} rig_t;

static inline rig_t rig_typical(void)
{
    const rig_t rig = {.simulation = simulation_typical()};
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

/* `count` samples in which nothing could be measured. */
static inline enum lever_mode rig_run_blind(rig_t *rig, lever_t *lever, uint32_t count)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        lever_sample_t sample = rig_sample(rig);
        sample.theta_valid = false;
        sample.theta_dot_valid = false;
        mode = lever_update(lever, &sample);
    }
    return mode;
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
