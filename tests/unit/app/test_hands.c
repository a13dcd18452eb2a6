/* Hands on the lever or off: from one to the other, at the ends of the verdict's hysteresis. */
#include "app/hands.h"

#include "simulation.h"
#include "test.h"

#include <string.h>

enum { SAMPLES = 20 }; /* in a block */

#define PERIOD 1.0e-3f

static const model_constants_t constants = {
    .length = 0.45f, .inertia = 0.08075f, .mass_moment = 0.6f, .damping = 0.5f, .stiffness = 5.0f, .trim = true};
static simulation_t simulation;
static hands_t hands;
static bool is_off;

void setUp(void)
{
    simulation = simulation_of((uint8_t)LEVER_MODEL_LEVER);
    (void)memset(&hands, 0x40, sizeof hands); /* as memory may be */
    hands_start(&hands);
    is_off = false;
}

/* Blocks with the state as measured; how many had the verdict off at their end. */
static uint32_t run(uint32_t blocks, bool held, bool counts)
{
    uint32_t off = 0u;
    simulation.plant = held ? plant_of_lever(2.5, 42.0, 1500.0) : plant_of_lever(0.0, 0.0, 0.0);
    for (uint32_t block = 0u; block < blocks; block++) {
        for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
            const float x[MODEL_STATES] = {
                (float)(simulation.measured_theta - SIMULATION_TRIM), (float)simulation.measured_theta_dot};
            const double before[2] = {simulation.z_ddot, simulation.tau_m};
            simulation_advance(&simulation, (double)PERIOD);
            const model_step_t step = {.period = PERIOD,
                .z_ddot = (float)(0.5 * (before[0] + simulation.z_ddot)),
                .tau_m = (float)(0.5 * (before[1] + simulation.tau_m)),
                .trim_cosine = (float)cos(SIMULATION_TRIM)};
            (void)hands_predict(&hands, &constants, &step, x);
        }
        if (hands_step(&hands, &constants, (float)simulation.measured_theta_dot, (float)SAMPLES * PERIOD, counts)
                .counted) {
            is_off = (hands_statistic(&hands) > (is_off ? 10.0f : 33.3f)); /* as in app/evidence.def */
        }
        off += is_off ? 1u : 0u;
    }
    return off;
}

/* Within a second, both ways; by base and motor, and by each alone. One block that the lever alone explains may be
 * chance, and blocks that do not count leave the verdict. */
TEST_EACH(3, a_lever_that_is_let_go_is_off_and_held_again)
{
    simulation.base_rms *= (test_round == 1u) ? 0.0 : 1.0;
    simulation.torque_rms *= (test_round == 2u) ? 0.0 : 1.0;
    simulation.measured_theta = SIMULATION_TRIM;
    TEST_ASSERT_EQUAL_UINT32(0u, run(500u, true, true));
    TEST_ASSERT_EQUAL_UINT32(0u, run(50u, false, false));
    TEST_ASSERT_TRUE(run(50u, false, true) > 0u);
    TEST_ASSERT_EQUAL_UINT32(100u, run(100u, false, true));
    TEST_ASSERT_EQUAL_UINT32(50u, run(50u, true, false));
    (void)run(50u, true, true);
    TEST_ASSERT_EQUAL_UINT32(0u, run(500u, true, true));
    setUp();
    TEST_ASSERT_EQUAL_UINT32(0u, run(5u, false, true));
}

/* A block that the lever alone explains but for a part, in squares, of its change. */
TEST(the_statistic_is_the_change_over_what_the_lever_alone_leaves_of_it)
{
    const double part[] = {0.025, 0.1, 1.0};
    const model_constants_t light = {.inertia = 0.1f};
    for (uint32_t k = 0u; k < 3u; k++) {
        setUp();
        TEST_ASSERT_EQUAL_FLOAT(0.0f, hands_step(&hands, &light, 1.0f, 0.038f, true).length);
        for (uint32_t n = 0u; n < 100u; n++) {
            hands.begin = 0.0f;
            hands.impulse = 0.1f * (float)(1.0 - sqrt(part[k]));
            TEST_ASSERT_TRUE(hands_step(&hands, &light, 1.0f, 0.04f, true).counted);
            TEST_ASSERT_TRUE((hands.begin == 1.0f) && (hands.impulse == 0.0f));
        }
        TEST_ASSERT_FLOAT_WITHIN(1.0e-2f / (float)part[k], 1.0f / (float)part[k], hands_statistic(&hands));
    }
    hands.residual = 0.0f;
    TEST_ASSERT_TRUE(isfinite(hands_statistic(&hands)));
}

/* The lever's own equation of motion, with gravity and spring where the preload is fixed. */
TEST(the_impulse_without_hands_is_that_of_the_lever_alone)
{
    model_constants_t fixed = constants;
    const model_step_t step = {.period = PERIOD, .z_ddot = 2.0f, .tau_m = 1.5f, .trim_cosine = 0.9f};
    const float x[MODEL_STATES] = {0.4f, 0.3f};
    const float lift = 0.45f * 0.6f * 0.9f;
    TEST_ASSERT_FLOAT_WITHIN(1.0e-7f, PERIOD * (1.5f - (lift * 2.0f) - (0.5f * 0.3f) - (5.0f * 0.4f)),
        hands_predict(&hands, &constants, &step, x));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-7f, PERIOD * (1.5f - (lift * 2.0f)), hands.drive);
    fixed.trim = false;
    fixed.lever_preload_angle = 0.1f;
    TEST_ASSERT_FLOAT_WITHIN(1.0e-7f, PERIOD * (1.5f - (lift * (2.0f + 9.80665f)) - (0.5f * 0.3f) - (5.0f * 0.3f)),
        hands_predict(&hands, &fixed, &step, x));
}

/* What a block has gathered is gone; what is known of the hands stays. */
TEST(a_block_begins_with_nothing)
{
    hands = (hands_t){
        .begin = 1.0f, .impulse = 2.0f, .drive = 3.0f, .elapsed = 4.0f, .change = 5.0f, .residual = 6.0f, .idle = true};
    hands_begin(&hands);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, fabsf(hands.begin) + fabsf(hands.impulse) + fabsf(hands.drive) + hands.elapsed);
    TEST_ASSERT_FALSE(hands.idle);
    TEST_ASSERT_EQUAL_FLOAT(11.0f, hands.change + hands.residual);
}
