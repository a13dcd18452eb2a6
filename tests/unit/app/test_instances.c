/* Instances are independent, fit their memory, and depend on nothing but their configuration and their samples. */
#include "frames.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_memory_t other_memory;

void setUp(void)
{
    lever_config_default(&config);
}

void tearDown(void)
{
}

static void test_two_interleaved_instances_equal_two_separate_ones(void)
{
    lever_memory_t alone_memory[2];
    lever_config_t other_config = config;
    other_config.preload = (uint8_t)LEVER_PRELOAD_FIXED;
    other_config.settings.theta_noise = 2.0e-3f;
    rig_t rig = rig_typical();
    rig_t other_rig = rig_typical();
    other_rig.simulation.source.state = 5u;
    rig_t alone_rig[2] = {rig, other_rig};

    lever_t *lever = lever_init(&memory, &config);
    lever_t *other = lever_init(&other_memory, &other_config);
    for (uint32_t k = 0u; k < 3000u; k++) {
        (void)rig_run(&rig, lever, 1u);
        (void)rig_run(&other_rig, other, 1u);
    }
    lever_t *alone = lever_init(&alone_memory[0], &config);
    (void)rig_run(&alone_rig[0], alone, 3000u);
    rig_assert_same_estimates(lever, alone);
    alone = lever_init(&alone_memory[1], &other_config);
    (void)rig_run(&alone_rig[1], alone, 3000u);
    rig_assert_same_estimates(other, alone);
}

static void test_nothing_depends_on_what_was_in_the_memory(void)
{
    rig_t rig = rig_typical();
    rig_t same = rig_typical();
    (void)memset(&memory, 0xA5, sizeof memory);
    (void)memset(&other_memory, 0x00, sizeof other_memory);
    lever_t *lever = lever_init(&memory, &config);
    lever_t *other = lever_init(&other_memory, &config);
    (void)rig_run(&rig, lever, 1000u);
    (void)rig_run(&same, other, 1000u);
    rig_assert_same_estimates(lever, other);
}

static void test_init_in_used_memory_starts_over_with_the_new_configuration(void)
{
    rig_t rig = rig_typical();
    (void)rig_run(&rig, lever_init(&memory, &config), 1000u);
    config.settings.k_p = 900.0f;
    lever_t *lever = lever_init(&memory, &config);
    TEST_ASSERT_EQUAL_FLOAT(900.0f, rig_estimate(lever).parameter[2]);
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).samples);
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, rig_health(lever).mode);
}

static void test_an_instance_writes_nothing_outside_its_memory(void)
{
    struct {
        uint8_t before[64];
        lever_memory_t memory;
        uint8_t after[64];
    } guarded;
    uint8_t guard[64];
    sender_t sender = sender_typical();
    (void)memset(guard, 0x5A, sizeof guard);
    (void)memset(&guarded, 0x5A, sizeof guarded);
    lever_t *lever = lever_init(&guarded.memory, &config);
    lever_command_t command = rig_command();
    command.dither_rms = 0.3f;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)sender_run(&sender, lever, 1000u);
    TEST_ASSERT_EQUAL_MEMORY(guard, guarded.before, sizeof guard);
    TEST_ASSERT_EQUAL_MEMORY(guard, guarded.after, sizeof guard);
}

static void test_a_copy_of_the_memory_is_an_instance_of_its_own(void)
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
    lever_t *again = lever_init(&memory, &config);
    rig_t whole = rig_typical();
    (void)rig_run(&whole, again, 2000u);
    rig_assert_same_estimates(copy, again);
}

static void test_two_runs_over_can_give_the_same_frames(void)
{
    sender_t sender = sender_typical();
    sender_t same = sender_typical();
    lever_t *lever = lever_init(&memory, &config);
    lever_t *other = lever_init(&other_memory, &config);
    for (uint32_t k = 0u; k < 1000u; k++) {
        lever_frame_t frames[FRAMES_MOST];
        lever_frame_t other_frames[FRAMES_MOST];
        (void)memset(frames, 0, sizeof frames);
        (void)memset(other_frames, 0, sizeof other_frames);
        (void)sender_deliver(&sender, lever);
        (void)sender_deliver(&same, other);
        TEST_ASSERT_EQUAL_UINT32(fetch_all(lever, frames), fetch_all(other, other_frames));
        for (uint32_t f = 0u; f < (uint32_t)FRAMES_MOST; f++) {
            TEST_ASSERT_EQUAL_HEX32(frames[f].id, other_frames[f].id);
            TEST_ASSERT_EQUAL_HEX8_ARRAY(frames[f].data, other_frames[f].data, 8);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_two_interleaved_instances_equal_two_separate_ones);
    RUN_TEST(test_nothing_depends_on_what_was_in_the_memory);
    RUN_TEST(test_init_in_used_memory_starts_over_with_the_new_configuration);
    RUN_TEST(test_an_instance_writes_nothing_outside_its_memory);
    RUN_TEST(test_a_copy_of_the_memory_is_an_instance_of_its_own);
    RUN_TEST(test_two_runs_over_can_give_the_same_frames);
    return UNITY_END();
}
