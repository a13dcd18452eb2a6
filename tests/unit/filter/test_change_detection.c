/* Detection of sudden changes: a drift is one as soon as its chi-square says so. */
#include "filter/change_detection.h"

#include "test.h"

#include <string.h>

enum { L = MODEL_PARAMETERS };

#define PERIOD 0.01f
#define MEMORY 0.3f
#define THRESHOLD 30.0f

static change_detection_t change;
static const scaling_t scaling = {
    .prior = {.guess = {1.0f, 1.0f, 1.0f}, .sigma = {0.5f, 0.5f, 0.5f}}, .positive = true};
static const double sigma[L] = {1.0e-2, 3.0e-3, 0.2}; /* of a correction: scales do not matter */

void setUp(void)
{
    (void)memset(&change, 0x40, sizeof change); /* as memory may be */
    change_detection_init(&change);
}

/* How many of so many corrections are changes; each is `drift` sigmas off. */
static uint32_t detections(uint32_t steps, double drift, float threshold)
{
    uint32_t count = 0u;
    for (uint32_t k = 0u; k < steps; k++) {
        correction_t correction = {.bounded = false};
        uint32_t diagonal = 0u;
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            correction.w[i] = (float)(sigma[i] * drift);
            correction.covariance[diagonal] = (float)(sigma[i] * sigma[i]);
            diagonal += i + 2u;
        }
        if (change_detection_step(&change, &correction, &scaling, PERIOD, MEMORY) > threshold) {
            change_detection_restart(&change);
            count++;
        }
    }
    return count;
}

/* Without noise the sum of n corrections of d sigmas has the statistic 3 (d sum r^k)^2 / sum r^2k, r = 1 -
 * period/memory. */
TEST(a_drift_is_found_when_its_chi_square_says_so_and_the_sum_starts_anew)
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
    TEST_ASSERT_TRUE((wanted > 3u) && (wanted < 30u));
    TEST_ASSERT_EQUAL_UINT32(0u, detections(wanted - 1u, drift, THRESHOLD));
    uint32_t late = 0u; /* the long average has risen a little, too */
    while (detections(1u, drift, THRESHOLD) == 0u) {
        late++;
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(1u, late);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE((change.sum[i] == 0.0f) && (change.covariance[2u * i] == 0.0f));
    }
}

/* Three parameters that moved by their standard deviation: 3, which is what is expected. */
TEST(the_statistic_is_chi_square)
{
    const correction_t correction = {.w = {1.0f, 1.0f, 1.0f}, .covariance = {1.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f}};
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 3.0f, change_detection_step(&change, &correction, &scaling, PERIOD, MEMORY));
}

/* Parameters A z, with z independent of each other, of variance 1: the statistic is |z|^2, whatever A. Each row of A is
 * nearly the same: by itself each parameter moves by half of its standard deviation. */
TEST(what_is_known_of_a_combination_of_parameters_counts)
{
    static const float a[L][L] = {{1.0f, 0.0f, 0.0f}, {1.0f, 0.1f, 0.0f}, {1.0f, 0.05f, 0.02f}};
    static const float z[L] = {0.5f, 4.0f, -3.0f};
    correction_t correction = {.bounded = false};
    uint32_t k = 0u;
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        correction.w[i] = (a[i][0] * z[0]) + (a[i][1] * z[1]) + (a[i][2] * z[2]);
        for (uint32_t j = 0u; j <= i; j++) {
            correction.covariance[k] = (a[i][0] * a[j][0]) + (a[i][1] * a[j][1]) + (a[i][2] * a[j][2]);
            k++;
        }
    }
    TEST_ASSERT_FLOAT_WITHIN(0.1f, 25.25f, change_detection_step(&change, &correction, &scaling, PERIOD, MEMORY));
}

/* Nor does the rounding of a covariance, of either sign, or a change of w that is smaller than it. */
TEST(what_was_not_learnt_does_not_count)
{
    const correction_t nothing = {.covariance = {0.0f, 1.0e-9f, -1.0e-9f, 0.0f, 1.0e-9f, 0.0f}};
    const correction_t little = {.w = {1.0e-6f, -1.0e-6f, 1.0e-6f}};
    TEST_ASSERT_TRUE(change.average == 1.0f);
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_EQUAL_FLOAT(0.0f, change_detection_step(&change, &nothing, &scaling, PERIOD, MEMORY));
    }
    TEST_ASSERT_TRUE(change.average <= 1.0f);
    for (uint32_t k = 0u; k < 1000u; k++) {
        TEST_ASSERT_TRUE(change_detection_step(&change, &little, &scaling, PERIOD, MEMORY) < 0.3f);
    }
}
