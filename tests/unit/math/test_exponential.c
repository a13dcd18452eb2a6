/* Exponential and logarithm against libm in double: the error bounds and domains that exponential.h states. */
#include "dense.h"
#include "math/exponential.h"
#include "unity.h"

enum { GRID = 1000000 };

void setUp(void)
{
}

void tearDown(void)
{
}

static double relative_error_at(float x)
{
    const double wanted = exp((double)x);
    return fabs(((double)exponential(x) - wanted) / wanted);
}

static void test_exponential_is_at_most_2e_minus_7_off_within_80(void)
{
    for (int32_t k = -GRID; k <= GRID; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-7, 0.0, relative_error_at((float)(80.0 * (double)k / (double)GRID)));
    }
}

static void test_exponential_is_at_most_2e_minus_7_off_at_the_seams_between_octaves(void)
{
    for (int32_t half_octave = -230; half_octave <= 230; half_octave++) {
        float x = (float)(0.5 * 0.6931471805599453 * (double)half_octave);
        for (int32_t k = 0; k < 50; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-7, 0.0, relative_error_at(x));
            x = nextafterf(x, 100.0f);
        }
    }
}

static void test_exponential_of_zero_is_one(void)
{
    TEST_ASSERT_TRUE(exponential(0.0f) == 1.0f);
}

static void test_exponential_beyond_its_domain_is_that_of_the_nearer_end(void)
{
    TEST_ASSERT_TRUE(exponential(nextafterf(80.0f, 90.0f)) == exponential(80.0f));
    TEST_ASSERT_TRUE(exponential(INFINITY) == exponential(80.0f));
    TEST_ASSERT_TRUE(exponential(-81.0f) == exponential(-80.0f));
    TEST_ASSERT_TRUE(exponential(-INFINITY) == exponential(-80.0f));
}

static void test_exponential_of_not_a_number_is_that_of_80(void)
{
    TEST_ASSERT_TRUE(exponential(NAN) == exponential(80.0f));
}

static double logarithm_error_at(float x)
{
    return fabs((double)logarithm(x) - log((double)x));
}

static void test_logarithm_is_at_most_2e_minus_6_off_from_1e_minus_4_to_1e4(void)
{
    for (int32_t k = -GRID; k <= GRID; k++) {
        const float x = (float)pow(10.0, 4.0 * (double)k / (double)GRID);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6, 0.0, logarithm_error_at(x));
    }
}

static void test_logarithm_of_one_is_zero(void)
{
    TEST_ASSERT_TRUE(logarithm(1.0f) == 0.0f);
}

static void test_logarithm_undoes_the_exponential(void)
{
    for (int32_t k = -600; k <= 600; k++) {
        const float x = 0.01f * (float)k;
        TEST_ASSERT_DOUBLE_WITHIN(7.0e-7, (double)x, (double)logarithm(exponential(x)));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_exponential_is_at_most_2e_minus_7_off_within_80);
    RUN_TEST(test_exponential_is_at_most_2e_minus_7_off_at_the_seams_between_octaves);
    RUN_TEST(test_exponential_of_zero_is_one);
    RUN_TEST(test_exponential_beyond_its_domain_is_that_of_the_nearer_end);
    RUN_TEST(test_exponential_of_not_a_number_is_that_of_80);
    RUN_TEST(test_logarithm_is_at_most_2e_minus_6_off_from_1e_minus_4_to_1e4);
    RUN_TEST(test_logarithm_of_one_is_zero);
    RUN_TEST(test_logarithm_undoes_the_exponential);
    return UNITY_END();
}
