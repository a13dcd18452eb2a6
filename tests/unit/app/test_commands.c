/* Commands: what each changes, what it leaves alone, and that unknown ones change nothing. */
#include "rig.h"

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;

void setUp(void)
{
    rig = rig_typical();
    lever_config_default(&config);
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 3000u));
}

static void assert_refused(const lever_command_t *command)
{
    const lever_memory_t before = memory;
    TEST_ASSERT_FALSE(lever_command(lever, command));
    TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
}

TEST(unknown_codes_are_refused_and_change_nothing)
{
    for (uint32_t part = 0u; part < 5u; part++) {
        for (uint32_t code = 0u; code < 256u; code++) {
            lever_command_t command = rig_command();
            uint8_t *const parts[5] = {
                &command.request, &command.model, &command.preload, &command.estimator, &command.adaptation};
            const uint32_t known[5] = {(uint32_t)LEVER_REQUEST_RESET + 1u, (uint32_t)LEVER_MODEL_COUNT,
                (uint32_t)LEVER_PRELOAD_COUNT, (uint32_t)LEVER_ESTIMATOR_COUNT, (uint32_t)LEVER_ADAPTATION_COUNT};
            const bool keep = (part > 0u) && (code == (uint32_t)LEVER_KEEP);
            *parts[part] = (uint8_t)code;
            if ((code >= known[part]) && !keep) {
                assert_refused(&command);
            }
        }
    }
}

TEST(a_command_with_one_unknown_part_is_refused_as_a_whole)
{
    lever_command_t command = rig_command();
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    command.preload = (uint8_t)LEVER_PRELOAD_FIXED;
    command.dither_rms = 0.3f;
    command.adaptation = 7u;
    assert_refused(&command);
}

TEST(a_dither_that_is_no_amplitude_is_refused)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, -0.1f};
    for (uint32_t k = 0u; k < 4u; k++) {
        lever_command_t command = rig_command();
        command.dither_rms = bad[k];
        assert_refused(&command);
    }
}

TEST(reset_goes_back_to_the_first_guess)
{
    rig_request(lever, LEVER_REQUEST_RESET);
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, rig_health(lever).mode);
    TEST_ASSERT_EQUAL_FLOAT(config.settings.k_p, estimate.parameter[2]);
    TEST_ASSERT_EQUAL_FLOAT(config.settings.k_p * config.settings.k_p_sigma, estimate.parameter_sigma[2]);
    TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, rig_run(&rig, lever, 1u));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 310u));
}

TEST(after_a_reset_it_is_like_new_but_for_its_counts)
{
    lever_memory_t other_memory;
    lever_t *other = lever_init(&other_memory, &config);
    const uint32_t samples = rig_health(lever).samples;
    rig_request(lever, LEVER_REQUEST_RESET);
    rig_t same = rig;
    (void)rig_run(&rig, lever, 2000u);
    (void)rig_run(&same, other, 2000u);
    rig_assert_same_estimates(lever, other);
    TEST_ASSERT_EQUAL_UINT32(samples + 2000u, rig_health(lever).samples);
}

TEST(reset_accepts_a_time_that_starts_anew)
{
    rig_request(lever, LEVER_REQUEST_RESET);
    rig.time_us = 0u;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 310u));
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).late);
}

TEST(reset_unfreezes)
{
    rig_request(lever, LEVER_REQUEST_FREEZE);
    (void)rig_run(&rig, lever, 1u);
    rig_request(lever, LEVER_REQUEST_RESET);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 310u));
}

TEST(freeze_and_a_change_in_one_command_start_over_frozen)
{
    lever_command_t command = rig_command();
    command.preload = (uint8_t)LEVER_PRELOAD_FIXED;
    command.request = (uint8_t)LEVER_REQUEST_FREEZE;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    TEST_ASSERT_EQUAL(LEVER_MODE_FROZEN, rig_run(&rig, lever, 400u));
}

TEST(dither_of_keep_or_more_stays_as_it_is)
{
    lever_command_t command = rig_command();
    command.dither_rms = 0.3f;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)rig_run(&rig, lever, 900u);
    command.dither_rms = (float)LEVER_KEEP;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)rig_run(&rig, lever, 900u);
    TEST_ASSERT_TRUE(rig_health(lever).torque != 0.0f);
    command.dither_rms = 0.0f;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)rig_run(&rig, lever, 1001u);
    TEST_ASSERT_TRUE(rig_health(lever).torque == 0.0f);
}

/* As a first run of a fresh instance has it: the same torque at the same sample. */
TEST(reset_ends_dither_and_the_next_run_is_the_first_one_again)
{
    lever_memory_t other_memory;
    lever_t *other = lever_init(&other_memory, &config);
    lever_command_t on = rig_command();
    on.dither_rms = 0.3f;
    TEST_ASSERT_TRUE(lever_command(lever, &on));
    (void)rig_run(&rig, lever, 900u);
    TEST_ASSERT_TRUE(rig_health(lever).torque != 0.0f);
    rig_request(lever, LEVER_REQUEST_RESET);
    rig_request(other, LEVER_REQUEST_RESET); /* a command, as the other had one */
    rig_t same = rig;
    for (uint32_t k = 0u; k < 1200u; k++) {
        if (k == 400u) {
            TEST_ASSERT_TRUE(rig_health(lever).torque == 0.0f);
            TEST_ASSERT_TRUE(lever_command(lever, &on));
            TEST_ASSERT_TRUE(lever_command(other, &on));
        }
        (void)rig_run(&rig, lever, 1u);
        (void)rig_run(&same, other, 1u);
    }
    rig_assert_same_estimates(lever, other);
    TEST_ASSERT_TRUE(rig_health(other).torque != 0.0f);
    TEST_ASSERT_TRUE(rig_health(lever).torque == rig_health(other).torque);
}

/* Standard deviation of k_p half a second on, in a copy of the instance with this adaptation. */
static float sigma_with(enum lever_adaptation adaptation)
{
    lever_memory_t copy = memory;
    lever_t *other = (lever_t *)(void *)&copy;
    rig_t same = rig;
    lever_command_t command = rig_command();
    command.adaptation = (uint8_t)adaptation;
    TEST_ASSERT_TRUE(lever_command(other, &command));
    (void)rig_run(&same, other, 500u);
    return rig_estimate(other).parameter_sigma[2];
}

/* Annealing begins at the ceiling of the walk, so less certain than at the floor. */
TEST(a_chosen_adaptation_starts_its_walk_anew)
{
    TEST_ASSERT_TRUE(sigma_with(LEVER_ADAPTATION_ANNEALING) > (1.001f * sigma_with(LEVER_ADAPTATION_FIXED)));
}
