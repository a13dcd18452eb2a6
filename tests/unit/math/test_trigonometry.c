/* Sine and cosine against libm in double: the error bounds that trigonometry.h states, over the domains it states. */
#include "dense.h"
#include "math/trigonometry.h"
#include "unity.h"

enum { GRID = 1000000 };

#define QUARTER_TURN 1.5707963267948966

void setUp(void)
{
}

void tearDown(void)
{
}

static double error_against(sine_cosine_t found, double angle)
{
    const double sine = fabs((double)found.sine - sin(angle));
    const double cosine = fabs((double)found.cosine - cos(angle));
    return (sine > cosine) ? sine : cosine;
}

static double error_at(float angle)
{
    return error_against(sine_cosine(angle), (double)angle);
}

static void test_error_is_at_most_1_2e_minus_7_within_30_rad(void)
{
    for (int32_t k = -GRID; k <= GRID; k++) {
        const float angle = (float)(30.0 * (double)k / (double)GRID);
        TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, 0.0, error_at(angle));
    }
}

static void test_error_is_at_most_1_2e_minus_7_at_the_seams_between_quadrants(void)
{
    for (int32_t eighth = -38; eighth <= 38; eighth++) {
        float angle = (float)(0.5 * QUARTER_TURN * (double)eighth);
        for (int32_t k = 0; k < 50; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, 0.0, error_at(angle));
            TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, 0.0, error_at(-angle));
            angle = nextafterf(angle, 100.0f);
        }
    }
}

static void test_small_angles_are_their_own_sine(void)
{
    const float angles[] = {0.0f, 1.0e-38f, -1.0e-20f, 1.0e-6f, -1.0e-4f};
    for (uint32_t k = 0u; k < 5u; k++) {
        const sine_cosine_t found = sine_cosine(angles[k]);
        TEST_ASSERT_EQUAL_FLOAT(angles[k], found.sine);
        TEST_ASSERT_EQUAL_FLOAT(1.0f, found.cosine);
    }
}

static void test_beyond_30_rad_and_not_a_number_give_the_result_of_zero(void)
{
    const float refused[] = {nextafterf(30.0f, 31.0f), -nextafterf(30.0f, 31.0f), 1.0e30f, INFINITY, -INFINITY, NAN};
    for (uint32_t k = 0u; k < 6u; k++) {
        const sine_cosine_t found = sine_cosine(refused[k]);
        TEST_ASSERT_TRUE((found.sine == 0.0f) && (found.cosine == 1.0f));
    }
}

/* Greatest error of the variant for small angles, up to the one given. */
static double small_error(double most)
{
    double greatest = 0.0;
    for (int32_t k = -GRID; k <= GRID; k++) {
        const float angle = (float)(most * (double)k / (double)GRID);
        const double error = error_against(sine_cosine_small(angle), (double)angle);
        greatest = (isnan(greatest) || (error <= greatest)) ? greatest : error; /* NaN counts as greatest */
    }
    return greatest;
}

static void test_small_variant_is_at_most_5e_minus_7_off_within_a_quarter_rad(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-7, 0.0, small_error(0.25));
}

static void test_small_variant_is_at_most_3e_minus_5_off_within_half_a_rad(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(3.0e-5, 0.0, small_error(0.5));
}

/* Where sigma points are mostly, the series has ended: nothing is left but rounding. */
static void test_small_variant_is_rounding_off_within_a_tenth_of_a_rad(void)
{
    TEST_ASSERT_DOUBLE_WITHIN((double)FLT_EPSILON, 0.0, small_error(0.1));
}

static void test_small_variant_of_tiny_angles_is_exact(void)
{
    const float angles[] = {0.0f, 1.0e-38f, -1.0e-20f, 1.0e-6f, -1.0e-4f};
    for (uint32_t k = 0u; k < 5u; k++) {
        const sine_cosine_t found = sine_cosine_small(angles[k]);
        TEST_ASSERT_TRUE((found.sine == angles[k]) && (found.cosine == 1.0f));
    }
}

/* One evaluation serves both points of a pair. */
static void test_small_variant_is_odd_and_even_to_the_bit(void)
{
    for (int32_t k = 1; k <= 1000; k++) {
        const float angle = (float)(0.5 * (double)k / 1000.0);
        const sine_cosine_t plus = sine_cosine_small(angle);
        const sine_cosine_t minus = sine_cosine_small(-angle);
        TEST_ASSERT_TRUE((plus.sine == -minus.sine) && (plus.cosine == minus.cosine));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_error_is_at_most_1_2e_minus_7_within_30_rad);
    RUN_TEST(test_error_is_at_most_1_2e_minus_7_at_the_seams_between_quadrants);
    RUN_TEST(test_small_angles_are_their_own_sine);
    RUN_TEST(test_beyond_30_rad_and_not_a_number_give_the_result_of_zero);
    RUN_TEST(test_small_variant_is_at_most_5e_minus_7_off_within_a_quarter_rad);
    RUN_TEST(test_small_variant_is_at_most_3e_minus_5_off_within_half_a_rad);
    RUN_TEST(test_small_variant_is_rounding_off_within_a_tenth_of_a_rad);
    RUN_TEST(test_small_variant_of_tiny_angles_is_exact);
    RUN_TEST(test_small_variant_is_odd_and_even_to_the_bit);
    return UNITY_END();
}
