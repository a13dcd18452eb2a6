/* Limits of the walk of the parameters: where each kind starts and ends, and what it must not leave. */
#include "filter/adaptation.h"

#include "lever_cdkf.h"
#include "test.h"

#include <math.h>

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

TEST(each_kind_starts_and_ends_where_it_is_said_to)
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

TEST(a_period_longer_than_the_averaging_time_counts_fully_and_stays_between_floor_and_ceiling)
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
