/* The walk of the parameters against the formulas that adaptation.h states, in double. */
#include "filter/adaptation.h"

#include "../math/dense.h"
#include "lever_cdkf.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS };

#define PERIOD 1.0e-3f

static adaptation_t adaptation;
static float walk[L];
static const float no_correction[L] = {0.0f, 0.0f, 0.0f};

void setUp(void)
{
    adaptation = (adaptation_t){.kind = (uint8_t)LEVER_ADAPTATION_FIXED,
        .floor = {1.0e-4f, 4.0e-4f, 9.0e-4f},
        .ceiling = {1.0e-2f, 4.0e-2f, 9.0e-2f},
        .annealing_time = 5.0f,
        .averaging_time = 2.0f};
}

void tearDown(void)
{
}

static void start(enum lever_adaptation kind)
{
    adaptation.kind = (uint8_t)kind;
    adaptation_start(&adaptation, walk);
}

static void assert_walk(const float wanted[L])
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE(walk[i] == wanted[i]);
    }
}

static void test_fixed_is_always_the_floor(void)
{
    const float correction[L] = {0.1f, -0.1f, 0.1f};
    start(LEVER_ADAPTATION_FIXED);
    assert_walk(adaptation.floor);
    adaptation_step(&adaptation, PERIOD, correction, true, walk);
    assert_walk(adaptation.floor);
}

static void test_annealing_starts_at_the_ceiling(void)
{
    start(LEVER_ADAPTATION_ANNEALING);
    assert_walk(adaptation.ceiling);
}

static void test_annealing_decays_exponentially_with_its_time(void)
{
    start(LEVER_ADAPTATION_ANNEALING);
    for (uint32_t k = 0u; k < 5000u; k++) {
        adaptation_step(&adaptation, PERIOD, no_correction, true, walk);
    }
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double wanted = (double)adaptation.ceiling[i] * exp(-1.0);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * wanted, wanted, (double)walk[i]);
    }
}

static void test_annealing_ends_at_the_floor_and_not_below(void)
{
    start(LEVER_ADAPTATION_ANNEALING);
    for (uint32_t k = 0u; k < 40000u; k++) {
        adaptation_step(&adaptation, PERIOD, no_correction, true, walk);
    }
    assert_walk(adaptation.floor);
}

static void test_robbins_monro_starts_at_the_floor(void)
{
    start(LEVER_ADAPTATION_ROBBINS_MONRO);
    assert_walk(adaptation.floor);
}

static void test_robbins_monro_averages_the_square_of_the_corrections_per_second(void)
{
    const float correction[L] = {1.0e-3f, -3.0e-3f, 5.0e-3f};
    start(LEVER_ADAPTATION_ROBBINS_MONRO);
    double wanted[L];
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        wanted[i] = (double)walk[i];
    }
    for (uint32_t k = 0u; k < 3000u; k++) {
        adaptation_step(&adaptation, PERIOD, correction, true, walk);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double nu = (double)PERIOD / 2.0;
            const double rate = (double)correction[i] * (double)correction[i] / (double)PERIOD;
            wanted[i] = ((1.0 - nu) * wanted[i]) + (nu * rate);
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-5 * wanted[i], wanted[i], (double)walk[i]);
        }
    }
}

static void test_robbins_monro_stays_between_floor_and_ceiling(void)
{
    const float large[L] = {1.0f, -1.0f, 1.0f};
    start(LEVER_ADAPTATION_ROBBINS_MONRO);
    adaptation_step(&adaptation, PERIOD, large, true, walk);
    assert_walk(adaptation.ceiling);
    for (uint32_t k = 0u; k < 30000u; k++) {
        adaptation_step(&adaptation, PERIOD, no_correction, true, walk);
    }
    assert_walk(adaptation.floor);
}

static void test_a_period_longer_than_the_averaging_time_stays_between_floor_and_ceiling(void)
{
    const enum lever_adaptation kinds[] = {LEVER_ADAPTATION_ANNEALING, LEVER_ADAPTATION_ROBBINS_MONRO};
    const float correction[L] = {1.0f, 0.0f, 1.0e-3f};
    for (uint32_t kind = 0u; kind < 2u; kind++) {
        start(kinds[kind]);
        for (uint32_t k = 0u; k < 10u; k++) {
            adaptation_step(&adaptation, 10.0f, correction, true, walk);
            for (uint32_t i = 0u; i < (uint32_t)L; i++) {
                TEST_ASSERT_TRUE((walk[i] >= adaptation.floor[i]) && (walk[i] <= adaptation.ceiling[i]));
            }
        }
    }
}

static void test_without_excitation_every_kind_is_held_at_its_floor(void)
{
    const float large[L] = {1.0f, -1.0f, 1.0f};
    for (uint8_t kind = 0u; kind < (uint8_t)LEVER_ADAPTATION_COUNT; kind++) {
        start((enum lever_adaptation)kind);
        adaptation_step(&adaptation, PERIOD, large, false, walk);
        assert_walk(adaptation.floor);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_fixed_is_always_the_floor);
    RUN_TEST(test_annealing_starts_at_the_ceiling);
    RUN_TEST(test_annealing_decays_exponentially_with_its_time);
    RUN_TEST(test_annealing_ends_at_the_floor_and_not_below);
    RUN_TEST(test_robbins_monro_starts_at_the_floor);
    RUN_TEST(test_robbins_monro_averages_the_square_of_the_corrections_per_second);
    RUN_TEST(test_robbins_monro_stays_between_floor_and_ceiling);
    RUN_TEST(test_a_period_longer_than_the_averaging_time_stays_between_floor_and_ceiling);
    RUN_TEST(test_without_excitation_every_kind_is_held_at_its_floor);
    return UNITY_END();
}
