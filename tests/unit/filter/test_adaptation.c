/* The walk of the parameters against the formulas that adaptation.h states, in double. */
#include "filter/adaptation.h"

#include "../math/dense.h"
#include "lever_cdkf.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS };

#define PERIOD 1.0e-3f

static adaptation_t adaptation;
static parameter_filter_t filter;
static const float no_correction[L] = {0.0f, 0.0f, 0.0f};

void setUp(void)
{
    adaptation = (adaptation_t){.kind = (uint8_t)LEVER_ADAPTATION_FIXED,
        .floor = {1.0e-4f, 4.0e-4f, 9.0e-4f},
        .ceiling = 100.0f,
        .annealing_time = 5.0f,
        .averaging_time = 2.0f,
        .forgetting_time = 4.0f};
}

void tearDown(void)
{
}

static void start(enum lever_adaptation kind)
{
    adaptation.kind = (uint8_t)kind;
    adaptation_start(&adaptation, &filter);
}

/* A walk of so many floors. */
static void assert_walk(float floors)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE(filter.walk[i] == floors * adaptation.floor[i]);
    }
}

static void test_fixed_is_always_the_floor(void)
{
    const float correction[L] = {0.1f, -0.1f, 0.1f};
    start(LEVER_ADAPTATION_FIXED);
    assert_walk(1.0f);
    adaptation_step(&adaptation, PERIOD, correction, true, &filter);
    assert_walk(1.0f);
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
        adaptation_step(&adaptation, PERIOD, no_correction, true, &filter);
    }
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double wanted = (double)(adaptation.ceiling * adaptation.floor[i]) * exp(-1.0);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * wanted, wanted, (double)filter.walk[i]);
    }
}

static void test_annealing_ends_at_the_floor_and_not_below(void)
{
    start(LEVER_ADAPTATION_ANNEALING);
    for (uint32_t k = 0u; k < 40000u; k++) {
        adaptation_step(&adaptation, PERIOD, no_correction, true, &filter);
    }
    assert_walk(1.0f);
}

static void test_robbins_monro_starts_at_the_floor(void)
{
    start(LEVER_ADAPTATION_ROBBINS_MONRO);
    assert_walk(1.0f);
}

static void test_robbins_monro_averages_the_square_of_the_corrections_per_second(void)
{
    const float correction[L] = {1.0e-3f, -3.0e-3f, 5.0e-3f};
    start(LEVER_ADAPTATION_ROBBINS_MONRO);
    double wanted[L];
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        wanted[i] = (double)filter.walk[i];
    }
    for (uint32_t k = 0u; k < 3000u; k++) {
        adaptation_step(&adaptation, PERIOD, correction, true, &filter);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double nu = (double)PERIOD / 2.0;
            const double rate = (double)correction[i] * (double)correction[i] / (double)PERIOD;
            wanted[i] = ((1.0 - nu) * wanted[i]) + (nu * rate);
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-5 * wanted[i], wanted[i], (double)filter.walk[i]);
        }
    }
}

static void test_robbins_monro_stays_between_floor_and_ceiling(void)
{
    const float large[L] = {1.0f, -1.0f, 1.0f};
    start(LEVER_ADAPTATION_ROBBINS_MONRO);
    adaptation_step(&adaptation, PERIOD, large, true, &filter);
    assert_walk(adaptation.ceiling);
    for (uint32_t k = 0u; k < 30000u; k++) {
        adaptation_step(&adaptation, PERIOD, no_correction, true, &filter);
    }
    assert_walk(1.0f);
}

static void test_forgetting_grows_by_one_over_its_time_and_walks_at_the_floor(void)
{
    const float large[L] = {1.0f, -1.0f, 1.0f};
    start(LEVER_ADAPTATION_FORGETTING);
    for (uint32_t k = 0u; k < 10u; k++) {
        TEST_ASSERT_EQUAL_FLOAT(0.25f, filter.growth);
        assert_walk(1.0f);
        adaptation_step(&adaptation, PERIOD, large, true, &filter);
    }
}

static void test_no_other_kind_forgets(void)
{
    for (uint8_t kind = 0u; kind < (uint8_t)LEVER_ADAPTATION_COUNT; kind++) {
        filter.growth = 1.0f;
        start((enum lever_adaptation)kind);
        TEST_ASSERT_TRUE((filter.growth > 0.0f) == (kind == (uint8_t)LEVER_ADAPTATION_FORGETTING));
        adaptation_step(&adaptation, PERIOD, no_correction, true, &filter);
        TEST_ASSERT_TRUE((filter.growth > 0.0f) == (kind == (uint8_t)LEVER_ADAPTATION_FORGETTING));
    }
}

static void test_a_period_longer_than_the_averaging_time_stays_between_floor_and_ceiling(void)
{
    const enum lever_adaptation kinds[] = {LEVER_ADAPTATION_ANNEALING, LEVER_ADAPTATION_ROBBINS_MONRO};
    const float correction[L] = {1.0f, 0.0f, 1.0e-3f};
    for (uint32_t kind = 0u; kind < 2u; kind++) {
        start(kinds[kind]);
        for (uint32_t k = 0u; k < 10u; k++) {
            adaptation_step(&adaptation, 10.0f, correction, true, &filter);
            for (uint32_t i = 0u; i < (uint32_t)L; i++) {
                const float ceiling = adaptation.ceiling * adaptation.floor[i];
                TEST_ASSERT_TRUE((filter.walk[i] >= adaptation.floor[i]) && (filter.walk[i] <= ceiling));
            }
        }
    }
}

static void test_without_excitation_every_kind_is_held_at_its_floor_and_forgets_nothing(void)
{
    const float large[L] = {1.0f, -1.0f, 1.0f};
    for (uint8_t kind = 0u; kind < (uint8_t)LEVER_ADAPTATION_COUNT; kind++) {
        start((enum lever_adaptation)kind);
        adaptation_step(&adaptation, PERIOD, large, false, &filter);
        assert_walk(1.0f);
        TEST_ASSERT_TRUE(filter.growth == 0.0f);
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
    RUN_TEST(test_forgetting_grows_by_one_over_its_time_and_walks_at_the_floor);
    RUN_TEST(test_no_other_kind_forgets);
    RUN_TEST(test_a_period_longer_than_the_averaging_time_stays_between_floor_and_ceiling);
    RUN_TEST(test_without_excitation_every_kind_is_held_at_its_floor_and_forgets_nothing);
    return UNITY_END();
}
