/* The force between hand and lever: when it is used, when it teaches, and what becomes of one that is wrong.
 * tests/python/oracle compares what is made of it with float64. */
#include "app/grip_force.h"
#include "app/instance.h"
#include "rig.h"

#define ALONE 0.08075f /* inertia of the lever without an arm [kg m^2] */
#define BLOCK 0.038f   /* [s] */
#define SETTLED 15000u /* samples */
#define SPIKE 300.0f   /* [N] */
#define WRONG_BY 1000.0f

static learning_t *learning;
static grip_force_t *grip;
static bool theta_is_missing;

void setUp(void)
{
    config = config_of(0u);
    start();
    learning = &lever->estimator.learning;
    grip = &learning->evidence.force;
    theta_is_missing = false;
}

/* `count` samples, with the force that makes the difference between held and alone, and `more`. */
static void run_gripped(uint32_t count, float more)
{
    const plant_t alone = plant_of_lever(0.0, 0.0, 0.0);
    for (uint32_t k = 0u; k < count; k++) {
        lever_sample_t sample = sample_after(1u);
        simulation_t other = simulation;
        const double input[2] = {simulation.z_ddot, simulation.tau_m};
        other.plant = alone;
        const double of_hand = simulation_acceleration(&simulation, simulation.theta, simulation.theta_dot, input) -
                               simulation_acceleration(&other, simulation.theta, simulation.theta_dot, input);
        sample.grip_force = ((ALONE / 0.45f) * (float)of_hand) + more;
        sample.grip_force_valid = true;
        sample.theta_valid = !theta_is_missing;
        (void)lever_update(lever, &sample);
    }
}

/* --- the comparison ----------------------------------------------------------------------------------------------- */

/* Blocks of impulses by sensor and by motion; how often the force was found wrong that had been used. */
static uint32_t judge(uint32_t blocks, float measured, float driven)
{
    uint32_t found = 0u;
    for (uint32_t k = 0u; k < blocks; k++) {
        const float sign = ((k % 2u) == 0u) ? 1.0f : -1.0f;
        const hands_block_t hands = {.length = BLOCK, .of_hand = sign, .driven = sign * driven, .counted = true};
        grip->impulse = sign * measured;
        const bool used = grip_force_is_used(grip);
        float away = 0.0f;
        (void)grip_force_judge(grip, &lever->estimator.setup, &hands, &away);
        found += ((away > 1.0f) && used) ? 1u : 0u;
        TEST_ASSERT_EQUAL_FLOAT(0.0f, grip->impulse);
    }
    return found;
}

/* Noise that the filter is given for a force over a step; negative: it is not used. */
static float used_noise(void)
{
    static const float error[CDKF_CONSIDERED] = {[CDKF_STEP] = 1.0f};
    const float force = 5.0f;
    const model_step_t step = {.period = 1.0e-3f, .trim_cosine = 0.94f};
    cdkf_grip_t seen = {.error = {[CDKF_STEP] = 1.0f}};
    const bool used =
        grip_force_step(grip, &lever->estimator.setup, &lever->estimator.trim, &force, &step, 0.0f, error, &seen);
    TEST_ASSERT_TRUE(!used || (seen.error[CDKF_STEP] == 0.0f));
    return used ? seen.noise : -1.0f;
}

TEST(a_force_that_was_wrong_once_is_not_used_again)
{
    run_gripped(SETTLED, 0.0f);
    TEST_ASSERT_TRUE((used_noise() > 0.0f) && !grip->wrong);
    TEST_ASSERT_EQUAL_UINT32(0u, judge(300u, 1.0f, 1.0f));
    TEST_ASSERT_FLOAT_WITHIN(0.0201f, 10.02f, grip->means.time); /* its memory, to the next block */
    TEST_ASSERT_EQUAL_UINT32(1u, judge(1u, WRONG_BY, 10.0f));
    TEST_ASSERT_EQUAL_UINT32(0u, judge(3000u, 1.0f, 1.0f));
    TEST_ASSERT_TRUE(grip->right && grip->wrong);
    TEST_ASSERT_TRUE(used_noise() < 0.0f);
}

/* Half as much again is measured: more than 24 % by 26 %, of which two standard deviations of the comparison are 8 % or
 * 40 %. After 20.5 ms without a sample nothing is compared. */
TEST(a_force_is_wrong_beyond_what_is_tolerated_and_two_standard_deviations)
{
    static const struct {
        float difference_square;
        float missing;
        bool wrong;
    } row[] = {{0.4f, 0.0f, true}, {10.5f, 0.0f, false}, {0.4f, 0.0204f, true}, {0.4f, 0.0205f, false}};
    run_gripped(SETTLED, 0.0f);
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        grip->wrong = false;
        grip->settling = 0.0f;
        grip->missing = row[i].missing;
        grip->means = (grip_comparison_t){.time = 10.0f,
            .measured = 1.5f,
            .expected = 1.0f,
            .drive_square = 1.0f,
            .difference_square = row[i].difference_square};
        (void)judge(1u, 1.5f, 1.0f);
        TEST_ASSERT_EQUAL(row[i].wrong, grip->wrong);
    }
}

TEST(parameters_that_hardly_walk_make_no_force_certain)
{
    static const float walk[] = {0.0f, 0.9e-3f, 1.0e-3f, 1.2e-3f};
    float noise[4];
    run_gripped(SETTLED, 0.0f);
    for (uint32_t i = 0u; i < 4u; i++) {
        config.settings.k_p_walk = walk[i];
        grip->square = 25.0f;
        noise[i] = used_noise();
    }
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f * noise[2], noise[2], noise[0]);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f * noise[2], noise[2], noise[1]);
    TEST_ASSERT_TRUE(noise[3] < (0.95f * noise[2]));
}

TEST(a_force_is_compensated_for_gain_and_bias)
{
    config.settings.grip_force_gain = 1.25f;
    config.settings.grip_force_bias = 3.0f;
    (void)used_noise();
    TEST_ASSERT_EQUAL_FLOAT((5.0f - 3.0f) / 1.25f, grip->raw);
}

/* With levels that are followed, the force's has to settle first. */
TEST_EACH(LEVER_PRELOAD_COUNT, a_force_is_compared_from_its_first_sample_where_no_level_is_followed)
{
    config.preload = (uint8_t)test_round;
    start();
    (void)run(1000u);
    run_gripped(1u, 0.0f);
    TEST_ASSERT_EQUAL(test_round == (uint32_t)LEVER_PRELOAD_TRIM, grip->settling > 0.0f);
}

/* --- in flight ---------------------------------------------------------------------------------------------------- */

/* What was learnt with it is taken back. */
TEST(a_force_that_is_found_wrong_is_said_and_what_it_taught_taken_back)
{
    run_gripped(SETTLED, 0.0f);
    TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_CALIBRATION));
    const snapshot_t kept = learning->kept[1];
    grip->means.measured = WRONG_BY;
    for (uint32_t k = 0u; (k < 60u) && !grip->wrong; k++) {
        run_gripped(1u, 0.0f);
    }
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_CALIBRATION));
    TEST_ASSERT_TRUE(learning->noise.elapsed < 0.021f); /* this block */
    TEST_ASSERT_EQUAL_MEMORY(&kept, &learning->kept[0], sizeof kept);
}

/* R5 R29 */
TEST(while_levels_settle_after_an_outage_of_theta_the_force_teaches_nothing)
{
    run_gripped(SETTLED, 0.0f);
    theta_is_missing = true;
    run_gripped(100u, 0.0f);
    theta_is_missing = false;
    run_gripped(100u, 0.0f);
    const lever_estimate_t before = estimate();
    run_gripped(100u, 0.0f);
    TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_SETTLING) && !has_fault(LEVER_FAULT_EXCITATION));
    TEST_ASSERT_TRUE(grip->right);
    const lever_estimate_t after = estimate();
    assert_same_parameters(&before, &after);
}

/* R5 */
TEST_EACH(2, frozen_or_at_rest_the_force_teaches_nothing)
{
    run_gripped(SETTLED, 0.0f);
    if (test_round == 0u) {
        request(LEVER_REQUEST_FREEZE);
    } else {
        let_rest();
        simulation.base_rms = 1.0e-4; /* an acceleration that stands still is none */
    }
    run_gripped(6000u, 0.0f);
    const lever_estimate_t before = estimate();
    run_gripped(100u, 0.0f);
    TEST_ASSERT_EQUAL(test_round == 1u, has_fault(LEVER_FAULT_EXCITATION));
    TEST_ASSERT_TRUE(grip->right);
    const lever_estimate_t after = estimate();
    assert_same_parameters(&before, &after);
}

/* Eight standard deviations and more. */
TEST(a_spike_of_the_force_moves_nothing)
{
    run_gripped(SETTLED, 0.0f);
    const lever_memory_t before = memory;
    const simulation_t then = simulation;
    const uint32_t then_us = time_us;
    float rate[2];
    for (uint32_t i = 0u; i < 2u; i++) {
        memory = before;
        simulation = then;
        time_us = then_us;
        run_gripped(1u, (float)i * SPIKE);
        rate[i] = estimate().theta_dot;
    }
    TEST_ASSERT_FLOAT_WITHIN(0.5f * estimate().theta_dot_sigma, rate[0], rate[1]);
}
