/* Whiteness: white innovations stay white however long, coloured ones are found; against their known correlations. */
#include "filter/whiteness.h"

#include "random.h"
#include "test.h"

#include <stdbool.h>

enum { SAMPLES = 20 }; /* in a block */

#define PERIOD 1.0e-3f
#define BLOCK 0.02f

static random_source_t source;
static whiteness_t whiteness;
static double state;
static bool is_coloured;

void setUp(void)
{
    source.state = 17u;
    state = 0.0;
    is_coloured = false;
    whiteness_start(&whiteness);
}

/* Blocks of white noise of variance 1, on top of which is a first-order process of variance `share` that keeps the
 * part `keep` from one block to the next. Returns how many had the verdict coloured at their end. */
static uint32_t run(uint32_t blocks, double share, double keep)
{
    uint32_t coloured = 0u;
    for (uint32_t block = 0u; block < blocks; block++) {
        state = (keep * state) + (sqrt(share * (1.0 - (keep * keep))) * random_normal(&source));
        for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
            whiteness_add(&whiteness, (float)(state + random_normal(&source)), PERIOD);
        }
        is_coloured = (whiteness_correlation(&whiteness) > (is_coloured ? 0.25f : 0.35f)); /* as in app/evidence.def */
        coloured += is_coloured ? 1u : 0u;
    }
    return coloured;
}

/* Each alone of the lags is looked at: blocks that repeat k blocks later. */
TEST(every_lag_of_20_to_80_ms_is_seen)
{
    for (uint32_t lag = 1u; lag <= (uint32_t)WHITENESS_LAGS + 1u; lag++) {
        float before[WHITENESS_LAGS + 1] = {0.0f};
        setUp();
        for (uint32_t block = 0u; block < 2000u; block++) {
            const bool repeats = ((block / lag) % 2u) == 1u;
            const float sum = repeats ? before[lag - 1u] : (float)random_normal(&source);
            for (uint32_t k = (uint32_t)WHITENESS_LAGS; k > 0u; k--) {
                before[k] = before[k - 1u];
            }
            before[0] = sum;
            whiteness_add(&whiteness, sum, BLOCK);
        }
        TEST_ASSERT_EQUAL(lag <= (uint32_t)WHITENESS_LAGS, whiteness_correlation(&whiteness) > 0.35f);
    }
}

/* Sensors that are quieter than stated: what is left is coloured, but smaller than what was expected. A tenth of the
 * standard deviation, wholly coloured, is a hundredth of the variance of a sample and, as 20 of them add up, a fifth of a
 * sum's: no more than 0.35 of it. Three tenths are 1.8 of it. */
/* R60 */
TEST(innovations_smaller_than_expected_count_by_what_is_expected)
{
    for (uint32_t tenths = 1u; tenths <= 3u; tenths += 2u) {
        setUp();
        for (uint32_t k = 0u; k < 20000u; k++) {
            whiteness_add(&whiteness, 0.1f * (float)tenths, PERIOD);
        }
        const float expected = (tenths == 1u) ? 0.2f : 1.0f;
        TEST_ASSERT_FLOAT_WITHIN(0.01f, expected, whiteness_correlation(&whiteness));
    }
}

/* However many samples make a block of 20 ms. */
TEST(the_first_two_seconds_say_nothing)
{
    (void)run(99u, 10.0, 0.99);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, whiteness_correlation(&whiteness));
    (void)run(2u, 10.0, 0.99);
    TEST_ASSERT_TRUE(is_coloured);
    setUp();
    for (uint32_t sample = 1u; sample <= 400u; sample++) { /* of 10 ms */
        whiteness_add(&whiteness, 1.0f, 0.01f);
        if ((sample < 198u) || (sample > 202u)) { /* sums of 0.01f are rounded */
            TEST_ASSERT_EQUAL(sample > 200u, whiteness_correlation(&whiteness) > 0.0f);
        }
    }
}

/* Of the mean of the products over that of the squares, whichever lag and sign. */
TEST(the_correlation_is_the_largest_of_all_lags)
{
    for (uint32_t k = 0u; k < (uint32_t)WHITENESS_LAGS; k++) {
        setUp();
        whiteness = (whiteness_t){.time = 5.0f, .variance = 2.0f};
        whiteness.product[k] = -0.6f;
        TEST_ASSERT_EQUAL_FLOAT(0.3f, whiteness_correlation(&whiteness));
    }
}

TEST(innovations_of_nothing_have_no_colour)
{
    for (uint32_t block = 0u; block < 1000u; block++) {
        whiteness_add(&whiteness, 0.0f, BLOCK);
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, whiteness_correlation(&whiteness));
}

/* Averages of the last seconds: no more than its memory. */
TEST(it_remembers_so_long_and_no_longer)
{
    (void)run(200u, 0.0, 0.0);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 200.0f * BLOCK, whiteness.time);
    (void)run(200u, 0.0, 0.0);
    TEST_ASSERT_EQUAL_FLOAT(5.0f, whiteness.time);
}
