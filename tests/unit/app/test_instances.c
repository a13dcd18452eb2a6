/* Instances are independent, fit their memory, and depend on nothing but their configuration and their samples. */
#include "rig.h"

void setUp(void)
{
    lever_config_default(&config);
}

/* Interleaved, in memory with anything in it, or moved to another place half-way: as one alone. */
TEST(an_instance_depends_on_its_configuration_and_samples_only)
{
    static struct {
        uint8_t before[64];
        lever_memory_t memory;
        uint8_t after[64];
    } guarded;
    static lever_config_t other_config;
    static lever_memory_t moved;
    uint8_t guard[64];
    (void)memset(guard, 0x5A, sizeof guard);
    (void)memset(&guarded, 0x5A, sizeof guarded);
    (void)memset(&memory, 0xA5, sizeof memory);
    start();
    other_config = config;
    other_config.preload = (uint8_t)LEVER_PRELOAD_FIXED;
    lever_t *other = lever_init(&guarded.memory, &other_config);
    const simulation_t same = simulation;
    for (uint32_t k = 0u; k < 2000u; k++) {
        const lever_sample_t sample = sample_after(1u);
        if (k == 1000u) {
            moved = memory;
            lever = (lever_t *)(void *)&moved;
            (void)memset(&memory, 0xFF, sizeof memory); /* whatever still pointed there would show */
        }
        (void)lever_update(lever, &sample);
        (void)lever_update(other, &sample);
    }
    TEST_ASSERT_EQUAL_MEMORY(guard, guarded.before, sizeof guard);
    TEST_ASSERT_EQUAL_MEMORY(guard, guarded.after, sizeof guard);
    for (uint32_t k = 0u; k < 2u; k++) {
        lever_t *alone = lever_init(&memory, (k == 0u) ? &config : &other_config);
        simulation = same;
        time_us = 0u;
        (void)run_with(alone, 2000u, false);
        assert_same_estimates((k == 0u) ? lever : other, alone);
    }
}

TEST(a_parameter_has_a_name_and_a_unit_and_what_is_none_has_neither)
{
    TEST_ASSERT_EQUAL_STRING("k_p", lever_parameter_name((uint8_t)LEVER_MODEL_LEVER, 2u));
    TEST_ASSERT_EQUAL_STRING("N/m", lever_parameter_unit((uint8_t)LEVER_MODEL_LEVER, 2u));
    TEST_ASSERT_NULL(lever_parameter_name((uint8_t)LEVER_MODEL_LEVER, PARAMETERS));
    TEST_ASSERT_NULL(lever_parameter_unit((uint8_t)LEVER_MODEL_LEVER, PARAMETERS));
    TEST_ASSERT_NULL(lever_parameter_name((uint8_t)LEVER_MODEL_COUNT, 0u));
    TEST_ASSERT_NULL(lever_parameter_unit((uint8_t)LEVER_MODEL_COUNT, 0u));
}
