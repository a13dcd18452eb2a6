/* Model, preload, estimator and adaptation chosen while running: that each choice is the one used, and what it starts
 * with. */
#include "rig.h"

enum { CHOICES = RIG_COMBINATIONS * LEVER_ADAPTATION_COUNT * LEVER_PRELOAD_COUNT };

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;
static double truth[LEVER_PARAMETERS];

/* One of all the choices. */
static lever_config_t configured(uint32_t choice)
{
    lever_config_t result = rig_config(choice % (uint32_t)RIG_COMBINATIONS);
    result.adaptation = (uint8_t)((choice / (uint32_t)RIG_COMBINATIONS) % (uint32_t)LEVER_ADAPTATION_COUNT);
    result.preload = (uint8_t)(choice / (uint32_t)(RIG_COMBINATIONS * LEVER_ADAPTATION_COUNT));
    return result;
}

void setUp(void)
{
    lever_config_default(&config);
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    rig = rig_of(config.model, truth);
}

/* Commanded, or configured from the start: the same samples give the same estimates to the bit, and no other choice
 * does. */
TEST(every_choice_can_be_commanded_and_makes_a_difference)
{
    static lever_estimate_t estimates[CHOICES];
    for (uint32_t choice = 0u; choice < (uint32_t)CHOICES; choice++) {
        static lever_memory_t other_memory;
        static lever_config_t other_config;
        setUp();
        (void)rig_run(&rig, lever, 500u);
        other_config = configured(choice);
        lever_t *other = lever_init(&other_memory, &other_config);
        const lever_command_t command = {.request = (uint8_t)LEVER_REQUEST_RESET,
            .model = other_config.model,
            .preload = other_config.preload,
            .estimator = other_config.estimator,
            .adaptation = other_config.adaptation,
            .dither_rms = (float)LEVER_KEEP};
        TEST_ASSERT_TRUE(lever_command(lever, &command));
        rig = rig_of((uint8_t)LEVER_MODEL_LEVER, truth);
        rig_t same = rig;
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 3000u));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&same, other, 3000u));
        rig_assert_same_estimates(lever, other);
        estimates[choice] = rig_estimate(lever);
        for (uint32_t k = 0u; k < choice; k++) {
            TEST_ASSERT_TRUE(memcmp(&estimates[k], &estimates[choice], sizeof estimates[k]) != 0);
        }
    }
}

/* Model, preload and estimator; the first guesses are those of the chosen model, whatever those of the others are. */
TEST(a_change_of_model_preload_or_estimator_starts_over_with_the_models_own_first_guess)
{
    const uint8_t models[] = {2u, 0u, 1u, 2u, 1u, 0u, 0u, 0u};
    const uint8_t preloads[] = {1u, 1u, 1u, 1u, 1u, 1u, 0u, 0u};
    const uint8_t estimators[] = {0u, 0u, 0u, 0u, 0u, 0u, 0u, 1u};
    for (uint8_t model = 0u; model < (uint8_t)LEVER_MODEL_COUNT; model++) {
        config.model = model;
        for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
            *rig_parameter_setting(&config, i, "") *= 1.0f + (0.1f * (float)(1u + i + model));
            *rig_parameter_setting(&config, i, "_sigma") *= 1.0f - (0.1f * (float)(1u + i + model));
        }
    }
    config.model = (uint8_t)LEVER_MODEL_LEVER;
    lever = lever_init(&memory, &config);
    for (uint32_t k = 0u; k < (uint32_t)sizeof models; k++) {
        lever_command_t command = rig_command();
        (void)rig_run(&rig, lever, 2000u);
        command.model = models[k];
        command.preload = preloads[k];
        command.estimator = estimators[k];
        config.model = models[k];
        TEST_ASSERT_TRUE(lever_command(lever, &command));
        TEST_ASSERT_EQUAL(LEVER_MODE_INIT, rig_health(lever).mode);
        rig_assert_first_guess(&config, rig_estimate(lever));
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, rig_run(&rig, lever, 1u));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 310u));
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

TEST(a_choice_that_is_there_already_or_kept_and_another_adaptation_do_not_start_over)
{
    lever_command_t command = rig_command();
    (void)rig_run(&rig, lever, 2000u);
    const lever_estimate_t before = rig_estimate(lever);
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    command.model = config.model;
    command.preload = config.preload;
    command.estimator = config.estimator;
    command.adaptation = (uint8_t)LEVER_ADAPTATION_FORGETTING;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    const lever_estimate_t after = rig_estimate(lever);
    TEST_ASSERT_EQUAL_MEMORY(&before, &after, sizeof before);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 1u));
}
