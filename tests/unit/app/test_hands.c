/* Hands on the lever or off, on the lever of the tests' plant: with an arm, without one, and from one to the other. */
#include "app/hands.h"

#include "../model/constants.h"
#include "../model/simulation.h"
#include "test.h"

enum { SAMPLES = 20 }; /* in a block */

#define PERIOD 1.0e-3f

static simulation_t simulation;
static hands_t hands;

void setUp(void)
{
    simulation = simulation_typical();
    hands_start(&hands);
}

static void hold(double m_p, double c_p, double k_p)
{
    simulation.plant.m_p = m_p;
    simulation.plant.c_p = c_p;
    simulation.plant.k_p = k_p;
}

static void let_go(void)
{
    hold(0.0, 0.0, 1.0e-9);
}

/* Blocks with the state as measured; how many had the verdict off at their end. */
static uint32_t run(uint32_t blocks, bool counts)
{
    const model_constants_t constants = constants_of(&simulation.plant);
    uint32_t off = 0u;
    for (uint32_t block = 0u; block < blocks; block++) {
        for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
            const float x[MODEL_STATES] = {
                (float)(simulation.theta - simulation.plant.trim), (float)simulation.theta_dot};
            const double z_ddot = simulation.z_ddot;
            const double tau_m = simulation.tau_m;
            simulation_advance(&simulation, (double)PERIOD);
            const model_step_t step = {.period = PERIOD,
                .z_ddot = (float)(0.5 * (z_ddot + simulation.z_ddot)),
                .tau_m = (float)(0.5 * (tau_m + simulation.tau_m)),
                .trim_cosine = (float)cos(simulation.plant.trim)};
            (void)hands_predict(&hands, &constants, &step, x);
        }
        hands_step(&hands, &constants, (float)simulation.theta_dot, (float)SAMPLES * PERIOD, counts);
        off += hands.off ? 1u : 0u;
    }
    return off;
}

/* Two minutes of each; the last two move the lever by base or by motor alone. */
TEST(a_hand_on_the_lever_is_never_off)
{
    const double arms[][3] = {
        {3.2, 60.0, 2100.0}, {1.0, 10.0, 200.0}, {5.0, 150.0, 4000.0}, {2.5, 18.0, 1500.0}, {2.5, 42.0, 1500.0}};
    for (uint32_t k = 0u; k < 7u; k++) {
        const double *arm = arms[(k < 5u) ? k : 4u];
        setUp();
        hold(arm[0], arm[1], arm[2]);
        simulation.torque_rms = (k == 5u) ? 0.0 : simulation.torque_rms;
        simulation.base_rms = (k == 6u) ? 0.0 : simulation.base_rms;
        TEST_ASSERT_EQUAL_UINT32(0u, run(6000u, true));
    }
}

TEST(a_lever_that_is_let_go_is_off_within_a_second_and_held_again_within_one)
{
    const double base[] = {0.98, 0.98, 0.0};
    const double torque[] = {0.3, 0.0, 0.3};
    for (uint32_t k = 0u; k < 3u; k++) {
        setUp();
        simulation.base_rms = base[k];
        simulation.torque_rms = torque[k];
        (void)run(500u, true);
        let_go();
        TEST_ASSERT_TRUE(run(50u, true) > 0u);
        TEST_ASSERT_TRUE(run(500u, true) >= 380u); /* the lever alone swings out of what is linear */
        hold(2.5, 42.0, 1500.0);
        (void)run(50u, true);
        TEST_ASSERT_EQUAL_UINT32(0u, run(500u, true));
    }
}

/* One block that the lever alone explains may be chance. */
TEST(the_first_blocks_decide_nothing)
{
    let_go();
    TEST_ASSERT_EQUAL_UINT32(0u, run(5u, true));
    (void)run(50u, true);
    TEST_ASSERT_TRUE(hands.off);
}

TEST(blocks_that_do_not_count_leave_the_verdict)
{
    (void)run(100u, true);
    let_go();
    TEST_ASSERT_EQUAL_UINT32(0u, run(500u, false));
    (void)run(50u, true);
    TEST_ASSERT_TRUE(hands.off);
    hold(2.5, 42.0, 1500.0);
    TEST_ASSERT_EQUAL_UINT32(500u, run(500u, false));
    (void)run(50u, true);
    TEST_ASSERT_FALSE(hands.off);
}

/* A block that the lever alone explains but for a part, in squares, of its change; between the thresholds it stays. */
TEST(the_verdict_has_hysteresis)
{
    const double part[] = {0.025, 0.035, 0.09, 0.11};
    const model_constants_t constants = {.inertia = 0.1f};
    for (uint32_t k = 0u; k < 8u; k++) {
        const bool was = (k >= 4u);
        setUp();
        hands.off = was;
        for (uint32_t n = 0u; n < 100u; n++) {
            hands.begin = 0.0f;
            hands.impulse = 0.1f * (float)(1.0 - sqrt(part[k % 4u]));
            hands.off = (n < 99u) ? was : hands.off;
            hands_step(&hands, &constants, 1.0f, 0.04f, true);
            TEST_ASSERT_TRUE((hands.begin == 1.0f) && (hands.impulse == 0.0f));
        }
        TEST_ASSERT_EQUAL(was ? ((k % 4u) != 3u) : ((k % 4u) == 0u), hands.off);
    }
}
