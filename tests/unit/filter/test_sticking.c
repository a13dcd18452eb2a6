/* Sticking: of Gaussian motion nothing, of a lever at standstill for a part of the time the part, against closed forms. */
#include "filter/sticking.h"

#include "random.h"
#include "test.h"

#include <math.h>
#include <stdbool.h>

enum { SAMPLES = 20 }; /* in a block of 20 ms */

#define PERIOD 1.0e-3f
#define RATE 0.1    /* rms while it moves [rad/s] */
#define NOISE 0.01f /* [rad/s] */

static random_source_t source;
static sticking_t sticking;

void setUp(void)
{
    source.state = 23u;
    sticking = (sticking_t){.sum = 0.0f};
}

static void add_block(double rate)
{
    for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
        sticking_add(&sticking, (float)(rate + ((double)NOISE * random_normal(&source))), PERIOD);
    }
}

/* Blocks at random rates, of which the first `still` in `of` are at standstill. Returns the last verdict. */
static float run(uint32_t blocks, uint32_t still, uint32_t of, bool moves)
{
    const double moving = 1.0 - ((double)still / (double)of);
    float excess = 0.0f;
    for (uint32_t block = 0u; block < blocks; block++) {
        excess = sticking_judge(&sticking, (float)(RATE * RATE * moving), NOISE, moves);
        add_block(((block % of) < still) ? 0.0 : (RATE * random_normal(&source)));
    }
    return excess;
}

/* 0.2 rms and the noise of a mean over 20 samples: r / sigma is 0.2012; a Gaussian rate is below it for erf(r / sqrt 2
 * sigma) of the time, 0.1595, which by the slope at 0 would be 0.1610. */
TEST(gaussian_motion_is_not_sticking)
{
    double sum = 0.0;
    for (uint32_t k = 0u; k < 200u; k++) {
        sum += (double)run(200u, 0u, 1u, true); /* 4 s */
        TEST_ASSERT_TRUE(sticking.excess < 0.6f);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 0.0, sum / 200.0);
}

/* Half of the time still: 0.5 + 0.5 erf(0.1423 / sqrt 2) = 0.5566 of it is slower than 0.2 rms, over 0.16: an excess of
 * 2.48. */
/* R60 */
TEST(a_lever_that_stands_still_half_of_the_time_sticks)
{
    double sum = 0.0;
    for (uint32_t k = 0u; k < 50u; k++) {
        sum += (double)run(800u, 5u, 10u, true);
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 2.48, sum / 50.0);
}

/* In less time chance is larger: the excess counts by the root of it, up to 4 s. */
TEST(an_excess_of_a_short_time_counts_less)
{
    (void)run(50u, 5u, 10u, true); /* 1 s */
    const float quarter = sticking_judge(&sticking, 0.005f, NOISE, true);
    TEST_ASSERT_FLOAT_WITHIN(0.02f * quarter, 0.5f * sticking.excess, quarter);
    (void)run(600u, 5u, 10u, true);
    TEST_ASSERT_EQUAL_FLOAT(sticking.excess, sticking_judge(&sticking, 0.005f, NOISE, true));
}

/* It stands still for good: no part of the motion, as little as what was before it. */
TEST(a_standstill_of_more_than_a_second_does_not_count)
{
    for (uint32_t blocks = 45u; blocks <= 55u; blocks += 10u) { /* 0.9 and 1.1 s */
        setUp();
        (void)run(400u, 0u, 1u, true);
        const float before = sticking.excess;
        for (uint32_t k = 0u; k < blocks; k++) {
            add_block(0.0);
        }
        TEST_ASSERT_EQUAL_FLOAT(before, sticking.excess);
        add_block(RATE);
        TEST_ASSERT_EQUAL(blocks == 45u, sticking.excess > (before + 0.5f));
    }
}

TEST(what_does_not_count_changes_nothing)
{
    TEST_ASSERT_EQUAL_FLOAT(0.0f, run(400u, 5u, 10u, false));
    (void)run(400u, 5u, 10u, true);
    const float before = sticking_judge(&sticking, 0.01f, NOISE, false);
    (void)run(100u, 0u, 1u, false);
    TEST_ASSERT_EQUAL_FLOAT(before, sticking.excess);
}
