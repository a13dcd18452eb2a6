/* A sudden change of the pilot: noticed and said. With every model and estimator. */
#include "rig.h"

enum { PARAMETERS = LEVER_PARAMETERS };

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;
static double truth[PARAMETERS];

static void start(void)
{
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    rig = rig_of(config.model, truth);
}

void setUp(void)
{
    config = rig_config(test_round);
    start();
}

static bool has_changed(void)
{
    return (rig_health(lever).faults & (uint32_t)LEVER_FAULT_CHANGE) != 0u;
}

/* Samples until a change is reported, at most so many. */
static uint32_t samples_until_change(uint32_t most)
{
    uint32_t samples = 0u;
    while ((samples < most) && !has_changed()) {
        (void)rig_run(&rig, lever, 1u);
        samples++;
    }
    return samples;
}

TEST_EACH(RIG_COMBINATIONS, a_sudden_grip_is_reported_for_a_second_and_opens_the_parameters)
{
    (void)rig_run(&rig, lever, 20000u);
    const lever_estimate_t before = rig_estimate(lever);
    rig_grip(&rig);
    TEST_ASSERT_LESS_THAN_UINT32(1000u, samples_until_change(1000u));
    const lever_estimate_t opened = rig_estimate(lever);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_TRUE(opened.parameter_sigma[i] > before.parameter_sigma[i]);
    }
    uint32_t reported = 0u;
    for (uint32_t k = 0u; k < 10000u; k++) {
        reported += has_changed() ? 1u : 0u;
        (void)rig_run(&rig, lever, 1u);
    }
    TEST_ASSERT_GREATER_THAN_UINT32(950u, reported);
    TEST_ASSERT_FALSE(has_changed());
}

TEST_EACH(RIG_COMBINATIONS, threshold_0_reports_no_change)
{
    config.settings.change_threshold = 0.0f;
    start();
    (void)rig_run(&rig, lever, 20000u);
    rig_grip(&rig);
    TEST_ASSERT_EQUAL_UINT32(3000u, samples_until_change(3000u));
}

TEST_EACH(RIG_COMBINATIONS, a_grip_at_rest_is_not_seen)
{
    (void)rig_run(&rig, lever, 10000u);
    rig_let_rest(&rig);
    (void)rig_run(&rig, lever, 10000u);
    rig_grip(&rig);
    TEST_ASSERT_EQUAL_UINT32(10000u, samples_until_change(10000u));
}
