/* Commands: what each changes, what it leaves alone, and that unknown ones change nothing. */
#include "app/instance.h"
#include "rig.h"

enum { CHOICES = COMBINATIONS * LEVER_ADAPTATION_COUNT * LEVER_PRELOAD_COUNT };

#ifdef LEVER_MUTATED
enum { STEP = 7 };
#else
enum { STEP = 1 };
#endif

static lever_config_t other_config;
static lever_memory_t other_memory;

void setUp(void)
{
    lever_config_default(&config);
    start();
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1000u));
}

static lever_t *another(void)
{
    lever_t *other = lever_init(&other_memory, &other_config);
    TEST_ASSERT_NOT_NULL(other);
    return other;
}

static void assert_refused(const lever_command_t *command)
{
    const lever_memory_t before = memory;
    TEST_ASSERT_FALSE(lever_command(lever, command));
    TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
}

/* --- refused ------------------------------------------------------------------------------------------------------ */

/* R24 */
TEST(a_command_with_one_unknown_part_is_refused_as_a_whole)
{
    static const uint32_t known[5] = {(uint32_t)LEVER_REQUEST_RESET + 1u, LEVER_MODEL_COUNT, LEVER_PRELOAD_COUNT,
        LEVER_ESTIMATOR_COUNT, LEVER_ADAPTATION_COUNT};
    const float amplitudes[] = {NAN, INFINITY, -INFINITY, -0.1f};
    for (uint32_t part = 0u; part < 6u; part++) {
        for (uint32_t code = (part < 5u) ? known[part] : 252u; code < 256u; code++) {
            lever_command_t command = {.request = LEVER_REQUEST_RESET, .dither_rms = 0.3f};
            uint8_t *const parts[5] = {
                &command.request, &command.model, &command.preload, &command.estimator, &command.adaptation};
            if (part == 5u) {
                command.dither_rms = amplitudes[code - 252u];
            } else {
                *parts[part] = (uint8_t)code;
            }
            if ((part == 0u) || (part == 5u) || (code != (uint32_t)LEVER_KEEP)) {
                assert_refused(&command);
            }
        }
    }
    lever_command_t command = command_none();
    command.dither_rms = 1.0e4f;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
}

/* --- reset -------------------------------------------------------------------------------------------------------- */

TEST(after_a_reset_it_is_like_new_but_for_its_counts)
{
    config.settings.z_ddot_delay = 5.0e-3f; /* signals are held back, */
    config.settings.lever_friction = 0.2f;  /* the rate is kept, */
    start();
    (void)run(999u);
    other_config = config;
    lever_t *other = another();
    request(LEVER_REQUEST_FREEZE);
    lever_sample_t sample = sample_after(1u);
    sample.tau_m_valid = false; /* and the torque has been missing */
    (void)lever_update(lever, &sample);
    (void)run(6u);
    request(LEVER_REQUEST_RESET);
    assert_first_guess();
    const simulation_t same = simulation;
    time_us = 0u; /* it may start anew, too */
    (void)run(2000u);
    simulation = same;
    time_us = 0u;
    (void)run_with(other, 2000u, false);
    assert_same_estimates(lever, other);
    TEST_ASSERT_EQUAL_UINT32(3006u, health().samples);
    TEST_ASSERT_EQUAL_UINT32(0u, health().late);
}

/* As a first run of a fresh instance has it: the same torque at the same sample. */
TEST(reset_ends_dither_and_the_next_run_is_the_first_one_again)
{
    lever_command_t command = command_none();
    other_config = config;
    lever_t *other = another();
    dither(0.3f);
    (void)run(900u);
    TEST_ASSERT_TRUE(health().torque != 0.0f);
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    TEST_ASSERT_TRUE(lever_command(lever, &command) && lever_command(other, &command));
    command = command_none();
    command.dither_rms = 0.3f;
    for (uint32_t k = 0u; k < 1200u; k++) {
        const lever_sample_t sample = sample_after(1u);
        if (k == 400u) {
            TEST_ASSERT_TRUE(health().torque == 0.0f);
            TEST_ASSERT_TRUE(lever_command(lever, &command) && lever_command(other, &command));
        }
        (void)lever_update(lever, &sample);
        (void)lever_update(other, &sample);
    }
    assert_same_estimates(lever, other);
    TEST_ASSERT_TRUE((health().torque != 0.0f) && (health().torque == health_of(other).torque));
}

/* But for counts, and what the first samples set. */
TEST(a_reset_leaves_nothing_of_what_was)
{
    start();
    estimator_t *now = &lever->estimator;
    learning_t *learning = &now->learning;
    estimator_t expected = *now;
    const dither_t no_dither = lever->dither;
    dither(0.3f);
    (void)run(2000u);
    void *const all[] = {&learning->evidence, &now->trim};
    const size_t size[] = {sizeof learning->evidence, sizeof now->trim};
    for (uint32_t i = 0u; i < (sizeof size / sizeof size[0]); i++) {
        (void)memset(all[i], 1, size[i]);
    }
    float *const value[] = {&learning->kept_ago, &learning->elapsed, &now->restarts, &now->nis, &now->base_missing,
        &now->last_z_ddot, &now->raw_z_ddot, &now->last_tau_m};
    for (uint32_t i = 0u; i < (sizeof value / sizeof value[0]); i++) {
        *value[i] = 1.0f;
    }
    bool *const flag[] = {&learning->levels, &now->frozen};
    for (uint32_t i = 0u; i < (sizeof flag / sizeof flag[0]); i++) {
        *flag[i] = true;
    }
    learning->verdict = (uint8_t)VERDICT_NEW;
    now->faults = LEVER_FAULT_GAP;
    request(LEVER_REQUEST_RESET);
    expected.samples = now->samples;
    expected.time_us = now->time_us;
    expected.alignment = now->alignment;
    expected.z_ddot = now->z_ddot;
    expected.tau_m = now->tau_m;
    TEST_ASSERT_EQUAL_MEMORY(&expected, now, sizeof expected);
    for (uint32_t i = 0u; i < (sizeof value / sizeof value[0]); i++) {
        TEST_ASSERT_EQUAL_FLOAT(0.0f, *value[i]);
    }
    for (uint32_t i = 0u; i < (sizeof flag / sizeof flag[0]); i++) {
        TEST_ASSERT_FALSE(*flag[i]);
    }
    TEST_ASSERT_EQUAL_UINT32(0u, now->faults);
    TEST_ASSERT_TRUE((no_dither.low_pass == 0.0f) && (no_dither.low_pass_rate == 0.0f) && (no_dither.slope == 0.0f));
    TEST_ASSERT_EQUAL_MEMORY(&no_dither, &lever->dither, sizeof no_dither);
}

TEST(an_instance_in_memory_that_was_used_is_a_new_one)
{
    lever_t *other = lever_init(&other_memory, &config);
    (void)memset(&memory, 0xA5, sizeof memory);
    start();
    TEST_ASSERT_EQUAL_MEMORY(other, lever, sizeof *lever);
}

/* Dither that a reset asks for fades in anew, as there is no torque to fade from. */
TEST(a_reset_may_ask_for_dither)
{
    lever_command_t command = command_none();
    dither(0.3f);
    (void)run(900u);
    command.request = (uint8_t)LEVER_REQUEST_RESET;
    command.dither_rms = 0.2f;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    (void)run(1u);
    TEST_ASSERT_FALSE(health().gate_open);
    (void)run(900u);
    TEST_ASSERT_TRUE(health().gate_open && (health().torque != 0.0f));
}

/* --- choices ------------------------------------------------------------------------------------------------------ */

/* Commanded, or configured from the start: the same samples give the same estimates to the bit, and no other choice
 * does. */
TEST(every_choice_can_be_commanded_and_makes_a_difference)
{
    static lever_estimate_t estimates[CHOICES];
    for (uint32_t choice = 0u; choice < (uint32_t)CHOICES; choice += STEP) {
        other_config = config_of(choice % (uint32_t)COMBINATIONS);
        other_config.adaptation = (uint8_t)((choice / (uint32_t)COMBINATIONS) % (uint32_t)LEVER_ADAPTATION_COUNT);
        other_config.preload = (uint8_t)(choice / (uint32_t)(COMBINATIONS * LEVER_ADAPTATION_COUNT));
        lever_t *other = another();
        const lever_command_t command = {.request = (uint8_t)LEVER_REQUEST_RESET,
            .model = other_config.model,
            .preload = other_config.preload,
            .estimator = other_config.estimator,
            .adaptation = other_config.adaptation,
            .dither_rms = (float)LEVER_KEEP};
        TEST_ASSERT_TRUE(lever_command(lever, &command));
        simulation.plant = plant_of_lever(4.5, 110.0, 3800.0); /* far from the first guess */
        for (uint32_t k = 0u; k < 2000u; k++) {
            const lever_sample_t sample = sample_after(1u);
            (void)lever_update(lever, &sample);
            (void)lever_update(other, &sample);
        }
        assert_same_estimates(lever, other);
        estimates[choice] = estimate();
        estimates[choice].time_us = 0u;
        for (uint32_t k = 0u; k < choice; k += STEP) {
            TEST_ASSERT_TRUE(memcmp(&estimates[k], &estimates[choice], sizeof estimates[k]) != 0);
        }
    }
}

/* Model, preload and estimator; the first guesses are those of the chosen model, whatever those of the others are. */
TEST(a_change_of_model_preload_or_estimator_starts_over_with_the_models_own_first_guess)
{
    const uint8_t models[] = {2u, 3u, 0u, 1u, 0u, 0u, 0u};
    const uint8_t preloads[] = {1u, 1u, 1u, 1u, 1u, 0u, 0u};
    const uint8_t estimators[] = {0u, 0u, 0u, 0u, 0u, 0u, 1u};
    for (uint8_t model = 0u; model < (uint8_t)LEVER_MODEL_COUNT; model++) {
        config.model = model;
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
            *parameter_setting(i, "") *= 1.0f + (0.1f * (float)(1u + i + model));
            *parameter_setting(i, "_sigma") *= 1.0f - (0.1f * (float)(1u + i + model));
        }
    }
    config.model = (uint8_t)LEVER_MODEL_LEVER;
    start();
    for (uint32_t k = 0u; k < (uint32_t)sizeof models; k++) {
        lever_command_t command = command_none();
        (void)run(500u);
        command.request = (k == 0u) ? (uint8_t)LEVER_REQUEST_FREEZE : (uint8_t)LEVER_REQUEST_RUN;
        command.model = models[k];
        command.preload = preloads[k];
        command.estimator = estimators[k];
        config.model = models[k];
        TEST_ASSERT_TRUE(lever_command(lever, &command));
        TEST_ASSERT_EQUAL(LEVER_MODE_INIT, health().mode);
        assert_first_guess();
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run(1u));
        TEST_ASSERT_EQUAL((k == 0u) ? LEVER_MODE_FROZEN : LEVER_MODE_RUN, run(310u));
        TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
    }
}

TEST(what_is_there_already_or_kept_and_another_adaptation_do_not_start_over)
{
    lever_command_t command = command_none();
    const lever_estimate_t before = estimate();
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    command.model = config.model;
    command.preload = config.preload;
    command.estimator = config.estimator;
    command.adaptation = (uint8_t)LEVER_ADAPTATION_FORGETTING;
    TEST_ASSERT_TRUE(lever_command(lever, &command));
    const lever_estimate_t after = estimate();
    TEST_ASSERT_EQUAL_MEMORY(&before, &after, sizeof before);
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1u));
}

/* Annealing begins at the ceiling of the walk, so less certain than at the floor. */
TEST(a_chosen_adaptation_starts_its_walk_anew)
{
    const uint8_t adaptations[] = {LEVER_ADAPTATION_FIXED, LEVER_ADAPTATION_ANNEALING};
    const lever_memory_t kept = memory;
    const simulation_t same = simulation;
    float sigma[2];
    for (uint32_t k = 0u; k < 2u; k++) {
        lever_command_t command = command_none();
        memory = kept;
        simulation = same;
        time_us = 1000u * (uint32_t)PERIOD_US;
        command.adaptation = adaptations[k];
        TEST_ASSERT_TRUE(lever_command(lever, &command));
        (void)run(500u);
        sigma[k] = estimate().parameter_sigma[2];
    }
    TEST_ASSERT_TRUE(sigma[1] > (1.001f * sigma[0]));
}

/* Each by itself; what is as it was does not. */
TEST(a_choice_that_changes_is_said_on_the_bus)
{
    for (uint32_t k = 0u; k <= 5u; k++) {
        lever_command_t command = command_none();
        uint8_t *const choice[] = {
            &command.model, &command.preload, &command.estimator, &command.adaptation, &command.mitigation};
        const uint8_t now[] = {config.model, config.preload, config.estimator, config.adaptation, config.mitigation};
        start();
        for (uint32_t i = 0u; i < 5u; i++) {
            *choice[i] = (uint8_t)(now[i] ^ ((i == k) ? 1u : 0u));
        }
        lever->link.pages = 0u;
        TEST_ASSERT_TRUE(lever_command(lever, &command));
        TEST_ASSERT_EQUAL(k < 5u, lever->link.pages != 0u);
    }
    lever_command_t command = command_none();
    command.dither_rms = 1.1e4f;
    TEST_ASSERT_FALSE(lever_command(lever, &command));
}
