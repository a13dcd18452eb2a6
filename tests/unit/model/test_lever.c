/* Increments of the lever model against the equation of motion integrated in double with a thousand steps of Runge and
 * Kutta to each step of the model. */
#include "../math/dense.h"
#include "constants.h"
#include "increments.h"
#include "unity.h"

enum { FINE = 1000, REPEATS = 200 };

static random_source_t source;

void setUp(void)
{
    source.state = 11u;
}

void tearDown(void)
{
}

static model_step_t step_of(const plant_t *plant, double period, double z_ddot, double tau_m)
{
    const model_step_t step = {.period = (float)period,
        .z_ddot = (float)z_ddot,
        .tau_m = (float)tau_m,
        .trim = (float)plant->trim,
        .trim_sine = (float)sin(plant->trim),
        .trim_cosine = (float)cos(plant->trim)};
    return step;
}

/* A lever and an arm of any size, moving; preload angles and trim differ, so that mixing them up shows. */
static plant_t random_plant(bool follows_trim)
{
    plant_t plant = plant_typical();
    plant.length = random_between(&source, 0.3, 0.6);
    plant.mass = random_between(&source, 0.5, 2.0);
    plant.mass_position = random_between(&source, 0.2, 0.8);
    plant.inertia = random_between(&source, 0.01, 0.05);
    plant.damping = random_between(&source, 0.2, 2.0);
    plant.stiffness = random_between(&source, 2.0, 20.0);
    plant.arm_preload_angle = random_between(&source, 0.3, 0.5);
    plant.lever_preload_angle = random_between(&source, -0.2, 0.2);
    plant.trim = random_between(&source, 0.2, 0.5);
    plant.follows_trim = follows_trim;
    plant.m_p = random_between(&source, 1.0, 5.0);
    plant.c_p = random_between(&source, 10.0, 150.0);
    plant.k_p = random_between(&source, 200.0, 4000.0);
    plant.theta = plant.trim + random_between(&source, -0.1, 0.1);
    plant.theta_dot = random_between(&source, -1.5, 1.5);
    return plant;
}

static model_arm_t arm_of(const plant_t *plant)
{
    const model_constants_t constants = constants_of(plant);
    const float p[MODEL_PARAMETERS] = {(float)plant->m_p, (float)plant->c_p, (float)plant->k_p};
    model_arm_t arm;
    model_lever.prepare(&constants, p, &arm);
    return arm;
}

/* Increment at the state and parameters of `plant`. All points are there, and must say the same. */
static void propagate_alike(const plant_t *plant, const model_step_t *step, double increment[MODEL_STATES])
{
    const model_constants_t constants = constants_of(plant);
    const model_arm_t arm = arm_of(plant);
    const float x[MODEL_STATES] = {(float)plant->theta, (float)plant->theta_dot};
    model_arm_t arms[MODEL_PARAMETER_POINTS];
    const model_points_t points = points_alike(x, &arm, arms);
    double increments[POINTS][MODEL_STATES];
    increments_of(&model_lever, &constants, step, &points, increments);
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        TEST_ASSERT_TRUE((increments[i][0] == increments[0][0]) && (increments[i][1] == increments[0][1]));
    }
    increment[0] = increments[0][0];
    increment[1] = increments[0][1];
}

/* What theta and theta_dot change by in `period` seconds of the equation of motion. */
static void true_increment(plant_t plant, double period, double z_ddot, double tau_m, double increment[2])
{
    const plant_t before = plant;
    for (uint32_t k = 0u; k < FINE; k++) {
        plant_runge_kutta(&plant, period / (double)FINE, z_ddot, tau_m);
    }
    increment[0] = plant.theta - before.theta;
    increment[1] = plant.theta_dot - before.theta_dot;
}

/* Error of one step of the model in theta [rad] and theta_dot [rad/s]. */
static void local_error(const plant_t *plant, double period, double error[2])
{
    const model_step_t step = step_of(plant, period, 2.0, 1.5);
    double increment[MODEL_STATES];
    double wanted[2];
    propagate_alike(plant, &step, increment);
    true_increment(*plant, period, 2.0, 1.5, wanted);
    error[0] = fabs(increment[0] - wanted[0]);
    error[1] = fabs(increment[1] - wanted[1]);
}

static void assert_follows_the_equation_of_motion(bool follows_trim)
{
    const double period = 1.0e-4;
    for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
        const plant_t plant = random_plant(follows_trim);
        const double z_ddot = random_between(&source, -5.0, 5.0);
        const double tau_m = random_between(&source, -3.0, 3.0);
        const model_step_t step = step_of(&plant, period, z_ddot, tau_m);
        double increment[MODEL_STATES];
        double wanted[2];
        propagate_alike(&plant, &step, increment);
        true_increment(plant, period, z_ddot, tau_m, wanted);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-9, wanted[0], increment[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, wanted[1], increment[1]);
    }
}

static void test_follows_the_equation_of_motion_with_preload_fixed(void)
{
    assert_follows_the_equation_of_motion(false);
}

static void test_follows_the_equation_of_motion_with_preload_trim(void)
{
    assert_follows_the_equation_of_motion(true);
}

static void assert_of_second_order(bool follows_trim)
{
    plant_t plant = plant_typical();
    plant.follows_trim = follows_trim;
    plant.theta = 0.45;
    plant.theta_dot = 1.0;
    double error[2];
    double halved[2];
    local_error(&plant, 2.0e-3, error);
    local_error(&plant, 1.0e-3, halved);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 8.0, error[0] / halved[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 8.0, error[1] / halved[1]);
}

static void test_halving_the_step_makes_the_error_of_a_step_eight_times_smaller(void)
{
    assert_of_second_order(false);
    assert_of_second_order(true);
}

/* Eleven points that all differ: each must be what the equation gives for its own state and parameters. */
static void test_every_point_has_its_own_state_and_parameters(void)
{
    const double period = 1.0e-4;
    const plant_t mean = random_plant(true);
    plant_t plants[POINTS];
    const model_constants_t constants = constants_of(&mean);
    const model_step_t step = step_of(&mean, period, 2.0, 1.5);
    model_arm_t arms[MODEL_PARAMETER_POINTS];
    model_points_t points = {.x = {(float)mean.theta, (float)mean.theta_dot}, .arm = arms};
    double increment[POINTS][MODEL_STATES];
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        const double apart = point_sign(i) * (double)(point_pair(i) + 1u);
        plants[i] = mean;
        plants[i].theta += 0.02 * apart;
        plants[i].theta_dot -= 0.2 * apart;
        if (i < (uint32_t)MODEL_PARAMETER_POINTS) { /* the state pairs are at the mean parameters */
            plants[i].m_p *= 1.0 + (0.1 * (double)i);
            plants[i].c_p *= 1.0 - (0.1 * (double)i);
            plants[i].k_p *= 1.0 + (0.2 * (double)i);
            arms[i] = arm_of(&plants[i]);
        }
    }
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PAIRS; j++) {
        points.offset[j][0] = (float)(0.02 * (double)(j + 1u));
        points.offset[j][1] = (float)(-0.2 * (double)(j + 1u));
    }
    increments_of(&model_lever, &constants, &step, &points, increment);
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        double wanted[2];
        true_increment(plants[i], period, 2.0, 1.5, wanted);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-9, wanted[0], increment[i][0]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, wanted[1], increment[i][1]);
    }
}

/* What theta_dot would change by if all torques pulled the same way [rad/s]: rounding is in units of it. */
static double size_of_change(const plant_t *plant, const model_step_t *step)
{
    const double l = plant->length;
    const double mu = (plant->mass_position * plant->mass) + plant->m_p;
    const double base = l * mu * (PLANT_GRAVITY + fabs((double)step->z_ddot));
    const double springs = (l * l * plant->k_p) + plant->stiffness;
    const double dampers = ((l * l * plant->c_p) + plant->damping) * fabs(plant->theta_dot);
    return (double)step->period * (fabs((double)step->tau_m) + base + springs + dampers) / plant_inertia(plant);
}

/* pair_error() of a random lever, in units of the change, with points that are apart in state and parameters. */
static double random_pair_error(bool follows_trim, double state_spread, double arm_spread)
{
    const plant_t mean = random_plant(follows_trim);
    const model_constants_t constants = constants_of(&mean);
    const model_step_t step = step_of(&mean, 1.0e-3, 2.0, 1.5);
    model_arm_t arms[MODEL_PARAMETER_POINTS];
    model_points_t points = {.x = {(float)mean.theta, (float)mean.theta_dot}, .arm = arms};
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETER_POINTS; i++) {
        plant_t plant = mean;
        plant.m_p *= 1.0 + (arm_spread * random_between(&source, -0.3, 0.3));
        plant.c_p *= 1.0 + (arm_spread * random_between(&source, -0.3, 0.3));
        plant.k_p *= 1.0 + (arm_spread * random_between(&source, -0.3, 0.3));
        arms[i] = arm_of((i == 0u) ? &mean : &plant);
    }
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PAIRS; j++) {
        points.offset[j][0] = (float)(state_spread * random_between(&source, -0.1, 0.1));
        points.offset[j][1] = (float)(state_spread * random_between(&source, -1.0, 1.0));
    }
    return pair_error(&model_lever, &constants, &step, &points) / size_of_change(&mean, &step);
}

static void test_pairs_are_what_their_points_are_by_themselves(void)
{
    const double spreads[] = {1.0, 1.0e-3, 1.0e-6};
    for (uint32_t repeat = 0u; repeat < (uint32_t)(10 * REPEATS); repeat++) {
        const double spread = spreads[repeat % 3u];
        const double error = random_pair_error((repeat % 2u) == 0u, spread, spread);
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)FLT_EPSILON, 0.0, error);
    }
}

static void test_pairs_that_differ_in_their_arms_alone_are_so_to_the_bit(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        TEST_ASSERT_TRUE(random_pair_error((repeat % 2u) == 0u, 0.0, 1.0) == 0.0);
    }
}

static void test_theta_may_count_from_an_origin(void)
{
    plant_t plant = random_plant(true);
    model_step_t step = step_of(&plant, 1.0e-4, 2.0, 1.5);
    double increment[MODEL_STATES];
    double wanted[2];
    true_increment(plant, 1.0e-4, 2.0, 1.5, wanted);
    step.origin = (float)plant.trim;
    plant.theta -= plant.trim;
    propagate_alike(&plant, &step, increment);
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-9, wanted[0], increment[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, wanted[1], increment[1]);
}

static void test_rests_where_preload_fixed_balances_gravity(void)
{
    plant_t plant = plant_typical();
    const double mu = (plant.mass_position * plant.mass) + plant.m_p;
    plant.follows_trim = false;
    plant.lever_preload_angle = plant.theta;
    plant.arm_preload_angle = asin(sin(plant.theta) + (PLANT_GRAVITY * mu / (plant.k_p * plant.length)));
    const model_step_t step = step_of(&plant, 1.0e-3, 0.0, 0.0);
    double increment[MODEL_STATES];
    propagate_alike(&plant, &step, increment);
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-8, 0.0, increment[1]); /* gravity alone: 0.02 rad/s */
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-11, 0.0, increment[0]);
}

static void test_rests_at_its_trim_with_preload_trim(void)
{
    const plant_t plant = plant_typical();
    const model_step_t step = step_of(&plant, 1.0e-3, 0.0, 0.0);
    double increment[MODEL_STATES];
    propagate_alike(&plant, &step, increment);
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-8, 0.0, increment[1]);
}

static void test_heavy_damping_and_a_long_step_still_decay(void)
{
    plant_t plant = plant_typical();
    plant.c_p = 400.0;
    plant.k_p = 200.0;
    plant.m_p = 0.3;
    double previous = 1.0;
    for (uint32_t k = 0u; k < 20u; k++) {
        const model_step_t step = step_of(&plant, 2.0e-2, 0.0, 0.0);
        double increment[MODEL_STATES];
        plant.theta_dot = previous;
        plant.theta = plant.trim;
        propagate_alike(&plant, &step, increment);
        const double next = previous + increment[1];
        TEST_ASSERT_TRUE(fabs(next) < fabs(previous));
        previous = next;
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_follows_the_equation_of_motion_with_preload_fixed);
    RUN_TEST(test_follows_the_equation_of_motion_with_preload_trim);
    RUN_TEST(test_halving_the_step_makes_the_error_of_a_step_eight_times_smaller);
    RUN_TEST(test_every_point_has_its_own_state_and_parameters);
    RUN_TEST(test_pairs_are_what_their_points_are_by_themselves);
    RUN_TEST(test_pairs_that_differ_in_their_arms_alone_are_so_to_the_bit);
    RUN_TEST(test_theta_may_count_from_an_origin);
    RUN_TEST(test_rests_where_preload_fixed_balances_gravity);
    RUN_TEST(test_rests_at_its_trim_with_preload_trim);
    RUN_TEST(test_heavy_damping_and_a_long_step_still_decay);
    return UNITY_END();
}
