/* Natural frequency and damping ratio against the plant linearised numerically in double; what the descriptor says. */
#include "../math/dense.h"
#include "constants.h"
#include "unity.h"

enum { REPEATS = 500 };

static random_source_t source;

void setUp(void)
{
    source.state = 5u;
}

void tearDown(void)
{
}

static model_dynamics_t dynamics_of(const plant_t *plant)
{
    const model_constants_t constants = constants_of(plant);
    const model_step_t step = {
        .trim = (float)plant->trim, .trim_sine = (float)sin(plant->trim), .trim_cosine = (float)cos(plant->trim)};
    const float p[MODEL_PARAMETERS] = {(float)plant->m_p, (float)plant->c_p, (float)plant->k_p};
    model_arm_t arm;
    model_lever.prepare(&constants, p, &arm);
    return model_lever.dynamics(&constants, &step, &arm);
}

static void assert_dynamics(bool follows_trim)
{
    for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
        plant_t plant = plant_typical();
        plant.follows_trim = follows_trim;
        plant.trim = random_between(&source, -0.3, 0.7);
        plant.arm_preload_angle = plant.trim + random_between(&source, -0.2, 0.2);
        plant.lever_preload_angle = random_between(&source, -1.0, 1.0);
        plant.mass_position = random_between(&source, 0.2, 0.8);
        plant.m_p = random_between(&source, 1.0, 5.0);
        plant.c_p = random_between(&source, 10.0, 150.0);
        plant.k_p = random_between(&source, 800.0, 4000.0);
        const model_dynamics_t found = dynamics_of(&plant);
        const double frequency = plant_natural_frequency(&plant);
        const double ratio = plant_damping_ratio(&plant);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * frequency, frequency, (double)found.natural_frequency);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * ratio, ratio, (double)found.damping_ratio);
    }
}

static void test_dynamics_are_the_linearisation_with_preload_trim(void)
{
    assert_dynamics(true);
}

static void test_dynamics_are_the_linearisation_with_preload_fixed_gravity_and_preload_included(void)
{
    assert_dynamics(false);
}

static void test_typical_arm_has_the_frequency_and_damping_of_the_design(void)
{
    const plant_t plant = plant_typical();
    const model_dynamics_t found = dynamics_of(&plant);
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 3.6, (double)found.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 0.3, (double)found.damping_ratio);
}

static void test_a_trim_at_which_the_lever_would_fall_has_no_frequency(void)
{
    plant_t plant = plant_typical();
    plant.follows_trim = false;
    plant.trim = 1.3;
    plant.stiffness = 0.0;
    plant.k_p = 50.0;
    const model_dynamics_t found = dynamics_of(&plant);
    TEST_ASSERT_TRUE(found.natural_frequency == 0.0f);
    TEST_ASSERT_TRUE(found.damping_ratio == 0.0f);
}

static void test_parameters_have_the_names_and_units_of_the_paper(void)
{
    const char *const names[MODEL_PARAMETERS] = {"m_p", "c_p", "k_p"};
    const char *const units[MODEL_PARAMETERS] = {"kg", "N s/m", "N/m"};
    TEST_ASSERT_EQUAL_STRING("lever", model_lever.name);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        TEST_ASSERT_EQUAL_STRING(names[i], model_lever.parameter[i].name);
        TEST_ASSERT_EQUAL_STRING(units[i], model_lever.parameter[i].unit);
    }
}

static void test_bounds_hold_every_pilot_of_the_design_with_room_and_fit_into_their_can_signals(void)
{
    const float pilot_least[MODEL_PARAMETERS] = {1.0f, 10.0f, 200.0f};
    const float pilot_greatest[MODEL_PARAMETERS] = {5.0f, 150.0f, 4000.0f};
    const float signal_greatest[MODEL_PARAMETERS] = {65.535f, 655.35f, 6553.5f};
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        TEST_ASSERT_TRUE(model_lever.parameter[i].least > 0.0f); /* log-scaled */
        TEST_ASSERT_TRUE(model_lever.parameter[i].least <= 0.5f * pilot_least[i]);
        TEST_ASSERT_TRUE(model_lever.parameter[i].greatest >= 1.5f * pilot_greatest[i]);
        TEST_ASSERT_TRUE(model_lever.parameter[i].greatest <= signal_greatest[i]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_dynamics_are_the_linearisation_with_preload_trim);
    RUN_TEST(test_dynamics_are_the_linearisation_with_preload_fixed_gravity_and_preload_included);
    RUN_TEST(test_typical_arm_has_the_frequency_and_damping_of_the_design);
    RUN_TEST(test_a_trim_at_which_the_lever_would_fall_has_no_frequency);
    RUN_TEST(test_parameters_have_the_names_and_units_of_the_paper);
    RUN_TEST(test_bounds_hold_every_pilot_of_the_design_with_room_and_fit_into_their_can_signals);
    return UNITY_END();
}
