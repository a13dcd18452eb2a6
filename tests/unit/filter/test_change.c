/* Detection of sudden changes: what is white is none, what drifts is one as soon as its chi-square says so. */
#include "filter/change.h"

#include "../math/dense.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS };

#define PERIOD 0.01f
#define MEMORY 0.3f
#define THRESHOLD 30.0f

static random_source_t source;
static change_detector_t change;
static const double sigma[L] = {1.0e-3, 3.0e-4, 2.0e-2}; /* of a correction: scales do not matter */

void setUp(void)
{
    source.state = 99u;
    change_init(&change);
}

void tearDown(void)
{
}

/* A correction that is `drift` sigmas off on average and `scale` times as large as it should be. */
static bool step(double drift, double scale, float threshold)
{
    float correction[L];
    float learnt[L];
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        correction[i] = (float)(sigma[i] * ((scale * random_normal(&source)) + drift));
        learnt[i] = (float)(sigma[i] * sigma[i]);
    }
    return change_step(&change, correction, learnt, PERIOD, MEMORY, threshold);
}

static uint32_t detections(uint32_t steps, double drift, double scale)
{
    uint32_t count = 0u;
    for (uint32_t k = 0u; k < steps; k++) {
        count += step(drift, scale, THRESHOLD) ? 1u : 0u;
    }
    return count;
}

/* Chi-square with three degrees of freedom exceeds 30 with a probability of 1.4e-6; half an hour has 3000 memories. */
static void test_white_corrections_are_no_change(void)
{
    TEST_ASSERT_EQUAL_UINT32(0u, detections(180000u, 0.0, 1.0));
    TEST_ASSERT_FLOAT_WITHIN(0.3f, 1.0f, change.usual);
}

/* Without noise the sum of n corrections of d sigmas has the statistic 3 (d sum r^k)^2 / sum r^2k, r = 1 - period/memory. */
static void test_a_drift_is_found_when_its_chi_square_says_so(void)
{
    const double keep = 1.0 - ((double)PERIOD / (double)MEMORY);
    const double drift = 1.2;
    double sum = 0.0;
    double squares = 0.0;
    uint32_t wanted = 0u;
    while ((3.0 * drift * drift * sum * sum) <= ((double)THRESHOLD * squares)) {
        sum = (keep * sum) + 1.0;
        squares = (keep * keep * squares) + 1.0;
        wanted++;
    }
    for (uint32_t k = 1u; k < wanted; k++) {
        TEST_ASSERT_FALSE(step(drift, 0.0, THRESHOLD));
    }
    /* the long average has risen a little, too */
    TEST_ASSERT_TRUE(step(drift, 0.0, THRESHOLD) || step(drift, 0.0, THRESHOLD));
    TEST_ASSERT_TRUE((wanted > 3u) && (wanted < 30u));
}

static void test_a_drift_in_noise_is_found_within_the_memory(void)
{
    for (uint32_t repeat = 0u; repeat < 200u; repeat++) {
        change_init(&change);
        (void)detections(200u, 0.0, 1.0);
        TEST_ASSERT_TRUE(detections(100u, 1.5, 1.0) > 0u);
    }
}

static void test_after_a_detection_the_sum_starts_anew(void)
{
    (void)detections(100u, 0.0, 1.0);
    bool found = false;
    while (!found) {
        found = step(2.0, 0.0, THRESHOLD);
    }
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE((change.drift[i] == 0.0f) && (change.variance[i] == 0.0f));
    }
    TEST_ASSERT_FALSE(step(2.0, 0.0, THRESHOLD));
}

/* Noise that is set wrongly makes every correction too large: that becomes the usual, and no change. */
static void test_corrections_that_are_always_too_large_become_usual(void)
{
    (void)detections(30000u, 0.0, 5.0);
    TEST_ASSERT_EQUAL_UINT32(0u, detections(30000u, 0.0, 5.0));
    TEST_ASSERT_FLOAT_WITHIN(8.0f, 25.0f, change.usual);
}

static void test_a_threshold_of_zero_finds_nothing(void)
{
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_FALSE(step(100.0, 1.0, 0.0f));
    }
}

/* Nothing learnt, or a variance that rounding has let grow, is no evidence. */
static void test_what_was_not_learnt_does_not_count(void)
{
    const float correction[L] = {1.0f, 1.0f, 1.0f};
    const float learnt[L] = {0.0f, -1.0e-9f, 0.0f};
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_FALSE(change_step(&change, correction, learnt, PERIOD, MEMORY, THRESHOLD));
    }
    TEST_ASSERT_TRUE(change.usual <= 1.0f);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_white_corrections_are_no_change);
    RUN_TEST(test_a_drift_is_found_when_its_chi_square_says_so);
    RUN_TEST(test_a_drift_in_noise_is_found_within_the_memory);
    RUN_TEST(test_after_a_detection_the_sum_starts_anew);
    RUN_TEST(test_corrections_that_are_always_too_large_become_usual);
    RUN_TEST(test_a_threshold_of_zero_finds_nothing);
    RUN_TEST(test_what_was_not_learnt_does_not_count);
    return UNITY_END();
}
