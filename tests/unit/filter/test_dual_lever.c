/* The dual filter with the lever model on samples of the simulated plant: it finds the parameters, says honestly how well,
 * and keeps its invariant whatever comes. */
#include "filter/dual.h"

#include "../model/constants.h"
#include "../model/simulation.h"
#include "math/factor.h"
#include "revise.h"
#include "unity.h"

#include <string.h>

enum { L = MODEL_PARAMETERS };

#define PERIOD 1.0e-3

static simulation_t simulation;
static model_constants_t constants;
static dual_t dual;
static double last_z_ddot;
static double last_tau_m;

static void start(void)
{
    const prior_t prior = {.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.6f}};
    const plant_t *plant = &simulation.plant;
    constants = constants_of(plant);
    (void)memset(&dual, 0, sizeof dual);
    parameter_filter_init(&dual.parameters, &model_lever, &constants, &prior);
    dual.state.x[0] = (float)plant->theta;
    dual.state.s[0] = (float)simulation.theta_noise;
    dual.state.s[3] = (float)simulation.theta_dot_noise;
    dual.state.process_noise[1] = (float)simulation.process_noise;
    dual.state.output_noise[0] = (float)simulation.theta_noise;
    dual.state.output_noise[1] = (float)simulation.theta_dot_noise;
    last_z_ddot = 0.0;
    last_tau_m = 0.0;
}

void setUp(void)
{
    simulation = simulation_typical();
    start();
}

void tearDown(void)
{
}

/* One sample; the filter must be valid after prediction and after update. Returns the normalised innovation squared. */
static double sample(bool theta_valid, bool theta_dot_valid, bool learn)
{
    simulation_advance(&simulation, PERIOD);
    const model_step_t step = {.period = (float)PERIOD,
        .z_ddot = (float)(0.5 * (last_z_ddot + simulation.z_ddot)),
        .tau_m = (float)(0.5 * (last_tau_m + simulation.tau_m)),
        .trim = (float)simulation.plant.trim,
        .trim_sine = (float)sin(simulation.plant.trim),
        .trim_cosine = (float)cos(simulation.plant.trim)};
    const measurement_t measurement = {
        .y = {theta_valid ? (float)simulation.theta : NAN, theta_dot_valid ? (float)simulation.theta_dot : NAN},
        .valid = {theta_valid, theta_dot_valid}};
    float correction[L];
    last_z_ddot = simulation.z_ddot;
    last_tau_m = simulation.tau_m;
    dual_predict(&dual, &model_lever, &constants, &step);
    TEST_ASSERT_TRUE(dual_is_valid(&dual));
    const double nis = (double)dual_update(&dual, &measurement, learn);
    if (learn) {
        (void)revise(&dual, &model_lever, &constants, (float)PERIOD, 0.0f, false, correction);
    }
    TEST_ASSERT_TRUE(dual_is_valid(&dual));
    return nis;
}

static void set_walk(float relative_per_root_second)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        dual.parameters.walk[i] = relative_per_root_second * relative_per_root_second;
    }
}

/* Error of ln p over its standard deviation must be below `sigmas`, and below `relative` itself. */
static void assert_parameters_found(double sigmas, double relative)
{
    const double truth[L] = {simulation.plant.m_p, simulation.plant.c_p, simulation.plant.k_p};
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double found = (double)dual.parameters.w[i];
        const double wanted = log(truth[i] / (double)dual.parameters.prior.guess[i]);
        const double sigma = (double)factor_sigma(dual.parameters.s, (uint32_t)L, i);
        TEST_ASSERT_DOUBLE_WITHIN(relative, wanted, found);
        TEST_ASSERT_DOUBLE_WITHIN(sigmas * sigma, wanted, found);
    }
}

static void test_finds_constant_parameters_within_three_per_cent_in_a_minute(void)
{
    for (uint32_t k = 0u; k < 60000u; k++) {
        (void)sample(true, true, true);
    }
    assert_parameters_found(3.0, 0.03);
}

static void test_finds_them_with_preload_fixed(void)
{
    simulation.plant.follows_trim = false;
    simulation.plant.arm_preload_angle = 0.40; /* the lever sags under gravity and stands near 20 degrees */
    start();
    for (uint32_t k = 0u; k < 60000u; k++) {
        (void)sample(true, true, true);
    }
    assert_parameters_found(3.0, 0.03);
}

static void test_finds_them_from_theta_alone(void)
{
    for (uint32_t k = 0u; k < 60000u; k++) {
        (void)sample(true, false, true);
    }
    assert_parameters_found(3.0, 0.05);
}

static void test_finds_them_from_theta_dot_alone(void)
{
    for (uint32_t k = 0u; k < 60000u; k++) {
        (void)sample(false, true, true);
    }
    assert_parameters_found(3.0, 0.05);
}

static void test_without_a_torque_it_says_that_the_scale_is_not_known(void)
{
    simulation.torque_rms = 0.0;
    set_walk(0.02f);
    for (uint32_t k = 0u; k < 30000u; k++) {
        (void)sample(true, true, true);
    }
    assert_parameters_found(3.0, 0.6);
    TEST_ASSERT_TRUE(factor_sigma(dual.parameters.s, (uint32_t)L, 0u) > 0.1f);
}

static void test_innovations_have_the_covariance_that_is_predicted(void)
{
    double sum = 0.0;
    for (uint32_t k = 0u; k < 30000u; k++) {
        sum += sample(true, true, true);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 2.0, sum / 30000.0);
}

static void test_follows_a_sudden_grip(void)
{
    set_walk(0.06f);
    for (uint32_t k = 0u; k < 20000u; k++) {
        (void)sample(true, true, true);
    }
    simulation.plant.c_p *= 1.3;
    simulation.plant.k_p *= 1.3;
    for (uint32_t k = 0u; k < 20000u; k++) {
        (void)sample(true, true, true);
    }
    assert_parameters_found(3.0, 0.15);
}

static void test_invariant_holds_over_a_long_run_with_outputs_missing_and_parameters_frozen_at_random(void)
{
    random_source_t *source = &simulation.source;
    bool learn = true;
    double missing = 0.0;
    set_walk(0.05f);
    for (uint32_t k = 0u; k < 100000u; k++) {
        if ((k % 500u) == 0u) {
            learn = random_unit(source) > 0.3;
            missing = (random_unit(source) > 0.2) ? random_unit(source) : 1.0;
        }
        (void)sample(random_unit(source) >= missing, random_unit(source) >= missing, learn);
    }
}

static void test_without_outputs_the_uncertainty_grows(void)
{
    for (uint32_t k = 0u; k < 5000u; k++) {
        (void)sample(true, true, true);
    }
    const float theta = dual_state_sigma(&dual, 0u);
    const float theta_dot = dual_state_sigma(&dual, 1u);
    for (uint32_t k = 0u; k < 300u; k++) {
        (void)sample(false, false, true);
    }
    TEST_ASSERT_TRUE(dual_state_sigma(&dual, 0u) > 1.5f * theta);
    TEST_ASSERT_TRUE(dual_state_sigma(&dual, 1u) > 1.5f * theta_dot);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_finds_constant_parameters_within_three_per_cent_in_a_minute);
    RUN_TEST(test_finds_them_with_preload_fixed);
    RUN_TEST(test_finds_them_from_theta_alone);
    RUN_TEST(test_finds_them_from_theta_dot_alone);
    RUN_TEST(test_without_a_torque_it_says_that_the_scale_is_not_known);
    RUN_TEST(test_innovations_have_the_covariance_that_is_predicted);
    RUN_TEST(test_follows_a_sudden_grip);
    RUN_TEST(test_invariant_holds_over_a_long_run_with_outputs_missing_and_parameters_frozen_at_random);
    RUN_TEST(test_without_outputs_the_uncertainty_grows);
    return UNITY_END();
}
