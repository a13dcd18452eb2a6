/* Calibration: an error as large as stated is tolerated, a larger one found, from scores that are drawn as theirs are
 * distributed: vector = information b + noise of variance information. */
#include "filter/calibration.h"

#include "random.h"
#include "test.h"

#include <string.h>

enum { C = CDKF_CALIBRATION };

#define PERIOD 0.02f
#define MEMORY 20.0 /* [s] */

static random_source_t source;
static calibration_t calibration;
static cdkf_t cdkf;
static float ratio;
static bool is_wrong;

void setUp(void)
{
    source.state = 5u;
    (void)memset(&calibration, 0x40, sizeof calibration); /* as memory may be */
    calibration_start(&calibration);
    is_wrong = false;
    cdkf.considered_sigma[CDKF_BASE_GAIN] = 0.02f;
    cdkf.considered_sigma[CDKF_BASE_DELAY] = 0.5f;
    cdkf.considered_sigma[CDKF_TORQUE_GAIN] = 0.07f;
    cdkf.considered_sigma[CDKF_FRICTION] = 0.06f;
}

/* Blocks in which error c is so many of its standard deviations, and nothing is said of the others; `rate` is the
 * information of a second about it, in 1 / sigma^2. Returns how many blocks had the verdict wrong at their end. */
static uint32_t run(uint32_t blocks, uint32_t c, double sigmas, double rate)
{
    const double sigma = (double)cdkf.considered_sigma[c];
    const double information = rate * (double)PERIOD / (sigma * sigma);
    uint32_t wrong = 0u;
    for (uint32_t block = 0u; block < blocks; block++) {
        (void)memset(cdkf.considered, 0, sizeof cdkf.considered);
        cdkf.considered[c].vector =
            (float)((information * sigmas * sigma) + (sqrt(information) * random_normal(&source)));
        cdkf.considered[c].information = (float)information;
        ratio = calibration_step(&calibration, &cdkf, PERIOD);
        is_wrong = (ratio > (is_wrong ? 0.75f : 1.0f)); /* as in app/evidence.def */
        wrong += is_wrong ? 1u : 0u;
    }
    return wrong;
}

/* Twice what is stated, and four standard deviations of the innovations' noise. */
TEST(a_larger_one_is_found_for_each_error_and_sign_and_again_within_when_it_is_gone)
{
    for (uint32_t c = 0u; c < (uint32_t)C; c++) {
        const double sign = ((c % 2u) == 0u) ? 1.0 : -1.0;
        setUp();
        (void)run(1000u, c, 0.0, 100.0);
        TEST_ASSERT_FALSE(is_wrong);
        (void)run(3000u, c, 3.0 * sign, 100.0);
        TEST_ASSERT_TRUE(is_wrong);
        (void)run(3000u, c, 0.0, 100.0);
        TEST_ASSERT_FALSE(is_wrong);
    }
}

/* As soon as half a second tells it, whatever was known before, and over as soon. */
TEST(a_large_one_is_found_and_over_within_seconds)
{
    (void)run(3000u, CDKF_BASE_DELAY, 0.0, 100.0);
    TEST_ASSERT_GREATER_THAN_UINT32(150u, run(200u, CDKF_BASE_DELAY, 6.0, 100.0)); /* 4 s, found within 1 s */
    TEST_ASSERT_TRUE(is_wrong);
}

/* Long after the last torque its high-passed rest is so small that its square, the information, is 0 in float. */
TEST(nothing_is_found_where_the_information_has_underflowed)
{
    (void)memset(cdkf.considered, 0, sizeof cdkf.considered);
    cdkf.considered[CDKF_TORQUE_GAIN].vector = 1.0e-22f;
    TEST_ASSERT_TRUE(calibration_step(&calibration, &cdkf, PERIOD) < 1.0f);
    cdkf.considered[CDKF_TORQUE_GAIN].vector = -1.0e-38f;
    TEST_ASSERT_TRUE(calibration_step(&calibration, &cdkf, PERIOD) < 1.0f);
}

/* Without noise: the score of many times MEMORY is what comes in MEMORY; the limit is 2 sigma + 4 / sqrt(information). */
TEST(limits_and_memory_are_what_is_said)
{
    const double information = 1.0e4;
    const double limit = (2.0 * 0.02) + (4.0 / sqrt(information * MEMORY));
    considered_t *considered = &cdkf.considered[CDKF_BASE_GAIN];
    (void)memset(cdkf.considered, 0, sizeof cdkf.considered);
    considered->information = (float)(information * (double)PERIOD);
    considered->vector = (float)(0.9 * limit) * considered->information;
    TEST_ASSERT_EQUAL_FLOAT(
        0.0f, calibration_step(&(calibration_t){.score = {{0.0f, 0.0f}}}, &(cdkf_t){.p = {0.0f}}, PERIOD));
    for (uint32_t block = 0u; block < 10000u; block++) {
        ratio = calibration_step(&calibration, &cdkf, PERIOD);
    }
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.9f, ratio);
    TEST_ASSERT_DOUBLE_WITHIN(
        0.02 * information * MEMORY, information * MEMORY, (double)calibration.score[CDKF_BASE_GAIN].information);
}
