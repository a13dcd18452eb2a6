/* Instances are independent, fit their memory, and depend on nothing but their configuration and their samples. */
#include "rig.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_memory_t other_memory;

void setUp(void)
{
    lever_config_default(&config);
}

TEST(two_interleaved_instances_equal_two_separate_ones_whatever_was_in_their_memory)
{
    static lever_memory_t alone_memory[2];
    lever_config_t configs[2] = {config, config};
    configs[1].preload = (uint8_t)LEVER_PRELOAD_FIXED;
    configs[1].settings.theta_noise = 2.0e-3f;
    rig_t rigs[2] = {rig_typical(), rig_typical()};
    rigs[1].simulation.source.state = 5u;
    rig_t alone[2] = {rigs[0], rigs[1]};
    (void)memset(&memory, 0xA5, sizeof memory);
    (void)memset(&other_memory, 0x00, sizeof other_memory);
    lever_t *const levers[2] = {lever_init(&memory, &configs[0]), lever_init(&other_memory, &configs[1])};
    for (uint32_t k = 0u; k < 3000u; k++) {
        (void)rig_run(&rigs[0], levers[0], 1u);
        (void)rig_run(&rigs[1], levers[1], 1u);
    }
    for (uint32_t k = 0u; k < 2u; k++) {
        (void)memset(&alone_memory[k], 0xFF, sizeof alone_memory[k]);
        lever_t *lever = lever_init(&alone_memory[k], &configs[k]);
        (void)rig_run(&alone[k], lever, 3000u);
        rig_assert_same_estimates(levers[k], lever);
    }
}

TEST(init_in_used_memory_starts_over_with_the_new_configuration)
{
    rig_t rig = rig_typical();
    (void)rig_run(&rig, lever_init(&memory, &config), 1000u);
    config.settings.k_p = 900.0f;
    lever_t *lever = lever_init(&memory, &config);
    TEST_ASSERT_EQUAL_FLOAT(900.0f, rig_estimate(lever).parameter[2]);
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).samples);
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, rig_health(lever).mode);
}

TEST(an_instance_writes_nothing_outside_its_memory)
{
    struct {
        uint8_t before[64];
        lever_memory_t memory;
        uint8_t after[64];
    } guarded;
    uint8_t guard[64];
    rig_t rig = rig_typical();
    (void)memset(guard, 0x5A, sizeof guard);
    (void)memset(&guarded, 0x5A, sizeof guarded);
    lever_t *lever = lever_init(&guarded.memory, &config);
    lever_command_t command = rig_command();
    command.dither_rms = 0.3f;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)rig_run(&rig, lever, 1000u);
    TEST_ASSERT_EQUAL_MEMORY(guard, guarded.before, sizeof guard);
    TEST_ASSERT_EQUAL_MEMORY(guard, guarded.after, sizeof guard);
}

TEST(a_copy_of_the_memory_is_an_instance_of_its_own)
{
    rig_t rig = rig_typical();
    lever_t *lever = lever_init(&memory, &config);
    (void)rig_run(&rig, lever, 1000u);
    rig_t same = rig;
    other_memory = memory;
    lever_t *copy = (lever_t *)(void *)&other_memory;
    (void)rig_run(&rig, lever, 1000u);
    (void)memset(&memory, 0xFF, sizeof memory); /* whatever still pointed there would show */
    (void)rig_run(&same, copy, 1000u);
    lever_t *repeated = lever_init(&memory, &config);
    rig_t whole = rig_typical();
    (void)rig_run(&whole, repeated, 2000u);
    rig_assert_same_estimates(copy, repeated);
}
