/* The walk of the parameters against the formulas that adaptation.h states, in double. */
#include "filter/adaptation.h"

#include "../math/dense.h"
#include "lever_cdkf.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS };

#define PERIOD 1.0e-3f

static adaptation_t adaptation;
static cdkf_t cdkf;
static const float none[L] = {0.0f, 0.0f, 0.0f};
static const float large[L] = {10.0f, -10.0f, 10.0f};

void setUp(void)
{
    adaptation = (adaptation_t){.floor = {1.0e-4f, 4.0e-4f, 9.0e-4f},
        .ceiling = 100.0f,
        .annealing_time = 5.0f,
        .averaging_time = 2.0f,
        .memory = 0.5f,
        .forgetting_time = 4.0f};
}

void tearDown(void)
{
}

static void start(uint8_t kind)
{
    adaptation.kind = kind;
    cdkf.growth = 1.0f;
    adaptation_start(&adaptation, &cdkf);
}

static void step(uint32_t count, const float correction[L], bool excited)
{
    for (uint32_t k = 0u; k < count; k++) {
        adaptation_step(&adaptation, PERIOD, correction, excited, &cdkf);
    }
}

/* Walks of so many floors, within a part of them. */
static void assert_walk(double floors, double relative)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double wanted = floors * (double)adaptation.floor[i];
        TEST_ASSERT_DOUBLE_WITHIN(relative * wanted, wanted, (double)cdkf.walk[i]);
    }
}

static void test_each_kind_starts_and_ends_where_it_is_said_to(void)
{
    const double starts[LEVER_ADAPTATION_COUNT] = {1.0, 100.0, 1.0, 1.0};
    const double wildest[LEVER_ADAPTATION_COUNT] = {1.0, 100.0, 100.0, 1.0};
    for (uint8_t kind = 0u; kind < (uint8_t)LEVER_ADAPTATION_COUNT; kind++) {
        const float growth = (kind == (uint8_t)LEVER_ADAPTATION_FORGETTING) ? 0.25f : 0.0f;
        start(kind);
        assert_walk(starts[kind], 1.0e-7);
        TEST_ASSERT_TRUE(cdkf.growth == growth);
        step(1u, large, true); /* a millisecond of annealing is hardly any */
        assert_walk(wildest[kind], 2.1e-4);
        TEST_ASSERT_TRUE(cdkf.growth == growth);
        step(40000u, none, true);
        assert_walk(1.0, 0.0);
    }
}

static void test_annealing_decays_exponentially_with_its_time(void)
{
    start((uint8_t)LEVER_ADAPTATION_ANNEALING);
    step(5000u, large, true);
    assert_walk(100.0 * exp(-1.0), 1.0e-3);
}

/* drift <- (1 - T / memory) drift + correction; the walk averages 2 drift^2 / memory. */
static void test_robbins_monro_averages_the_square_of_the_corrections_summed_up(void)
{
    const float correction[L] = {3.0e-5f, -9.0e-5f, 15.0e-5f};
    double wanted[L];
    double drift[L] = {0.0, 0.0, 0.0};
    start((uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        wanted[i] = (double)cdkf.walk[i];
    }
    for (uint32_t k = 0u; k < 3000u; k++) {
        step(1u, correction, true);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double nu = (double)PERIOD / 2.0;
            const double floor = (double)adaptation.floor[i];
            drift[i] += (double)correction[i] - (drift[i] * (double)PERIOD / 0.5);
            wanted[i] = fmax(((1.0 - nu) * wanted[i]) + (nu * 2.0 * drift[i] * drift[i] / 0.5), floor);
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-5 * wanted[i], wanted[i], (double)cdkf.walk[i]);
        }
    }
    TEST_ASSERT_TRUE((cdkf.walk[0] > (2.0f * adaptation.floor[0])) && (cdkf.walk[2] > (2.0f * adaptation.floor[2])));
    adaptation_start(&adaptation, &cdkf);
    TEST_ASSERT_TRUE((cdkf.drift[0] == 0.0f) && (cdkf.drift[2] == 0.0f));
}

/* Corrections that the walk itself explains, white and of its variance, leave it; behind a ramp as fast as that noise
 * in the memory they add up. With the squares of single corrections both would be alike: the ramp adds a
 * fiftieth. */
static void test_robbins_monro_tells_a_ramp_from_white_corrections(void)
{
    random_source_t source = {3u};
    double mean[2] = {0.0, 0.0};
    const float period = 0.02f;
    adaptation.memory = 2.0f;
    for (uint32_t ramp = 0u; ramp < 2u; ramp++) {
        start((uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
        for (uint32_t k = 0u; k < 20000u; k++) {
            float correction[L];
            for (uint32_t i = 0u; i < (uint32_t)L; i++) {
                const double sigma = sqrt(2.0 * (double)adaptation.floor[i] * (double)period);
                const double drift = (ramp == 1u) ? (3.0 * sigma / sqrt(2.0 / (double)period)) : 0.0;
                correction[i] = (float)(drift + (sigma * random_normal(&source)));
            }
            adaptation_step(&adaptation, period, correction, true, &cdkf);
            mean[ramp] += (double)(cdkf.walk[1] / adaptation.floor[1]) / 20000.0;
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.4, 2.2, mean[0]); /* 2, but never below 1 */
    TEST_ASSERT_TRUE(mean[1] > 8.0 * mean[0]);
}

static void test_a_period_longer_than_the_averaging_time_counts_fully_and_stays_between_floor_and_ceiling(void)
{
    const float five_floors[L] = {sqrtf(1.25e-4f), -sqrtf(5.0e-4f), sqrtf(11.25e-4f)}; /* 2 drift^2 / 0.5 s */
    start((uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO);
    adaptation_step(&adaptation, 10.0f, five_floors, true, &cdkf);
    assert_walk(5.0, 1.0e-6);
    adaptation_step(&adaptation, 10.0f, five_floors, true, &cdkf);
    assert_walk(5.0, 1.0e-6);
    for (uint8_t kind = 0u; kind < (uint8_t)LEVER_ADAPTATION_COUNT; kind++) {
        start(kind);
        for (uint32_t k = 0u; k < 10u; k++) {
            adaptation_step(&adaptation, 10.0f, ((k % 2u) == 0u) ? large : none, true, &cdkf);
            for (uint32_t i = 0u; i < (uint32_t)L; i++) {
                TEST_ASSERT_TRUE(cdkf.walk[i] >= adaptation.floor[i]);
                TEST_ASSERT_TRUE(cdkf.walk[i] <= (adaptation.ceiling * adaptation.floor[i]));
            }
        }
    }
}

static void test_without_excitation_every_kind_is_at_its_floor_and_forgets_nothing(void)
{
    for (uint8_t kind = 0u; kind < (uint8_t)LEVER_ADAPTATION_COUNT; kind++) {
        start(kind);
        step(1u, large, false);
        assert_walk(1.0, 0.0);
        TEST_ASSERT_TRUE(cdkf.growth == 0.0f);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_each_kind_starts_and_ends_where_it_is_said_to);
    RUN_TEST(test_annealing_decays_exponentially_with_its_time);
    RUN_TEST(test_robbins_monro_averages_the_square_of_the_corrections_summed_up);
    RUN_TEST(test_robbins_monro_tells_a_ramp_from_white_corrections);
    RUN_TEST(test_a_period_longer_than_the_averaging_time_counts_fully_and_stays_between_floor_and_ceiling);
    RUN_TEST(test_without_excitation_every_kind_is_at_its_floor_and_forgets_nothing);
    return UNITY_END();
}
