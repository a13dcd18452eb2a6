/* Whiteness: white innovations stay white however long, coloured ones are found; against their known correlations. */
#include "filter/whiteness.h"

#include "random.h"
#include "test.h"

enum { SAMPLES = 20 }; /* in a block */

#define PERIOD 0.02f

static random_source_t source;
static whiteness_t whiteness;
static double state;

void setUp(void)
{
    source.state = 17u;
    state = 0.0;
    whiteness_start(&whiteness);
}

/* Blocks of white noise of variance 1, on top of which is a first-order process of variance `share` that keeps the
 * part `keep` from one block to the next. Returns how many had the verdict coloured at their end. */
static uint32_t run(uint32_t blocks, double share, double keep, bool counts)
{
    uint32_t coloured = 0u;
    for (uint32_t block = 0u; block < blocks; block++) {
        state = (keep * state) + (sqrt(share * (1.0 - (keep * keep))) * random_normal(&source));
        for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
            whiteness_add(&whiteness, (float)(state + random_normal(&source)));
        }
        whiteness_step(&whiteness, PERIOD, counts);
        coloured += whiteness.coloured ? 1u : 0u;
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
            whiteness_add(&whiteness, sum);
            whiteness_step(&whiteness, PERIOD, true);
        }
        TEST_ASSERT_EQUAL(lag <= (uint32_t)WHITENESS_LAGS, whiteness_correlation(&whiteness) > 0.35f);
    }
}

TEST(blocks_that_do_not_count_and_the_first_two_seconds_say_nothing)
{
    (void)run(99u, 10.0, 0.99, true);
    TEST_ASSERT_TRUE(!whiteness.coloured && (whiteness_correlation(&whiteness) == 0.0f));
    (void)run(2u, 10.0, 0.99, true);
    TEST_ASSERT_TRUE(whiteness.coloured);
    setUp();
    for (uint32_t block = 1u; block <= 4u; block++) { /* at two seconds a verdict is due */
        whiteness_add(&whiteness, 1.0f);
        whiteness_step(&whiteness, 0.5f, true);
        TEST_ASSERT_EQUAL(block == 4u, whiteness_correlation(&whiteness) > 0.0f);
    }
    setUp();
    (void)run(500u, 0.0, 0.0, true);
    const whiteness_t before = whiteness;
    TEST_ASSERT_EQUAL_UINT32(0u, run(500u, 10.0, 0.99, false));
    TEST_ASSERT_EQUAL_MEMORY(&before, &whiteness, sizeof before);
    whiteness.coloured = true;
    TEST_ASSERT_EQUAL_UINT32(10u, run(10u, 0.0, 0.0, false)); /* a verdict stays until there is another */
}

/* Between the two thresholds a verdict stays what it is; they belong to white. */
TEST(a_verdict_has_hysteresis)
{
    static const struct {
        float correlation;
        bool was;
        bool is;
    } row[] = {{-0.3f, false, false}, {-0.3f, true, true}, {0.35f, false, false}, {0.25f, true, false}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        setUp();
        whiteness = (whiteness_t){.time = 5.0f, .variance = 1.0f, .coloured = row[i].was};
        whiteness.product[2] = row[i].correlation;
        whiteness.before[2] = row[i].correlation;
        whiteness_add(&whiteness, 1.0f); /* so that neither mean moves */
        whiteness_step(&whiteness, 1.0e-6f, true);
        TEST_ASSERT_EQUAL(row[i].is, whiteness.coloured);
    }
}

TEST(innovations_of_nothing_have_no_colour)
{
    for (uint32_t block = 0u; block < 1000u; block++) {
        whiteness_step(&whiteness, PERIOD, true);
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, whiteness_correlation(&whiteness));
    TEST_ASSERT_FALSE(whiteness.coloured);
}

/* Averages of the last seconds: no more than its memory. */
TEST(it_remembers_so_long_and_no_longer)
{
    (void)run(200u, 0.0, 0.0, true);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 200.0f * PERIOD, whiteness.time);
    (void)run(200u, 0.0, 0.0, true);
    TEST_ASSERT_EQUAL_FLOAT(5.0f, whiteness.time);
}
