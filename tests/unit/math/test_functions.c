/* Rounding, exponential, logarithm, sine and cosine against libm in double: the error bounds and domains that their
 * headers state. */
#include "math/bounds.h"
#include "math/elapsed.h"
#include "math/exponential.h"
#include "math/rounding.h"
#include "math/trigonometry.h"
#include "random.h"
#include "test.h"

#include <float.h>

enum { GRID = 300000 };

/* NaN counts as greatest. */
static double greater_of(double a, double b)
{
    return (isnan(a) || (b <= a)) ? a : b;
}

/* Greatest error over [least, greatest], and at the floats that follow each multiple of `seam`. */
static double greatest_error(double (*error_at)(float), double least, double greatest, double seam)
{
    double error = 0.0;
    for (int32_t k = 0; k <= GRID; k++) {
        error = greater_of(error, error_at((float)(least + ((greatest - least) * (double)k / (double)GRID))));
    }
    for (double at = ceil(least / seam) * seam; at < greatest; at += seam) {
        float x = nextafterf((float)at, -1.0e6f);
        for (int32_t k = 0; k < 20; k++) {
            error = greater_of(error, error_at(x));
            x = nextafterf(x, 1.0e6f);
        }
    }
    return error;
}

/* --- rounding ----------------------------------------------------------------------------------------------------- */

static double rounding_error(float x)
{
    return fabs((double)nearest_integer(x) - nearbyint((double)x));
}

TEST(nearest_integer_is_exact_below_two_to_the_22_with_ties_to_even)
{
    TEST_ASSERT_TRUE(greatest_error(rounding_error, -1000.0, 1000.0, 0.5) == 0.0);
    TEST_ASSERT_TRUE(greatest_error(rounding_error, -4194303.5, 4194303.5, 1000.5) == 0.0);
    TEST_ASSERT_TRUE((nearest_integer(2.5f) == 2.0f) && (nearest_integer(-3.5f) == -4.0f));
}

/* --- exponential and logarithm ------------------------------------------------------------------------------------ */

static double exponential_error(float x)
{
    const double wanted = exp((double)x);
    return fabs(((double)exponential(x) - wanted) / wanted);
}

static double logarithm_error(float decades)
{
    const float x = (float)pow(10.0, (double)decades);
    return fabs((double)logarithm(x) - log((double)x));
}

static double logarithm_of_exponential_error(float x)
{
    return fabs((double)logarithm(exponential(x)) - (double)x);
}

TEST(exponential_is_2e_minus_7_off_within_80_and_exact_at_0)
{
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-7, 0.0, greatest_error(exponential_error, -80.0, 80.0, 0.5 * log(2.0)));
    TEST_ASSERT_TRUE(exponential(0.0f) == 1.0f);
}

TEST(exponential_beyond_80_is_that_of_the_nearer_end_and_of_nan_that_of_80)
{
    const float above[] = {80.001f, 1.0e30f, INFINITY, NAN};
    const float below[] = {-80.001f, -1.0e30f, -INFINITY};
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_TRUE(exponential(above[k]) == exponential(80.0f));
        TEST_ASSERT_TRUE((k == 3u) || (exponential(below[k % 3u]) == exponential(-80.0f)));
    }
}

TEST(logarithm_is_2e_minus_6_off_from_1e_minus_4_to_1e4_and_undoes_the_exponential)
{
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6, 0.0, greatest_error(logarithm_error, -4.0, 4.0, 1.0));
    TEST_ASSERT_DOUBLE_WITHIN(7.0e-7, 0.0, greatest_error(logarithm_of_exponential_error, -6.0, 6.0, log(2.0)));
    TEST_ASSERT_TRUE(logarithm(1.0f) == 0.0f);
}

/* --- sine and cosine ---------------------------------------------------------------------------------------------- */

static double error_against(sine_cosine_t found, double angle)
{
    return greater_of(fabs((double)found.sine - sin(angle)), fabs((double)found.cosine - cos(angle)));
}

static double sine_cosine_error(float angle)
{
    return error_against(sine_cosine(angle), (double)angle);
}

static double small_error(float angle)
{
    return error_against(sine_cosine_small(angle), (double)angle);
}

TEST(sine_and_cosine_are_1_2e_minus_7_off_within_30_rad)
{
    TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, 0.0, greatest_error(sine_cosine_error, -30.0, 30.0, 0.7853981633974483));
}

TEST(beyond_30_rad_and_not_a_number_give_the_result_of_zero)
{
    const float refused[] = {nextafterf(30.0f, 31.0f), -nextafterf(30.0f, 31.0f), 1.0e30f, INFINITY, -INFINITY, NAN};
    for (uint32_t k = 0u; k < 6u; k++) {
        const sine_cosine_t found = sine_cosine(refused[k]);
        TEST_ASSERT_TRUE((found.sine == 0.0f) && (found.cosine == 1.0f));
    }
}

/* Within 0.1 rad, where sigma points mostly are, nothing is left but rounding. */
TEST(the_variant_for_small_angles_keeps_its_bounds)
{
    const double bounds[3][2] = {{0.1, (double)FLT_EPSILON}, {0.25, 5.0e-7}, {0.5, 3.0e-5}};
    for (uint32_t k = 0u; k < 3u; k++) {
        const double most = bounds[k][0];
        TEST_ASSERT_DOUBLE_WITHIN(bounds[k][1], 0.0, greatest_error(small_error, -most, most, 0.1));
    }
}

TEST(tiny_angles_are_their_own_sine_and_the_small_variant_is_odd_and_even_to_the_bit)
{
    const float angles[] = {0.0f, 1.0e-38f, -1.0e-20f, 1.0e-6f, -1.0e-4f};
    for (uint32_t k = 0u; k < 5u; k++) {
        const sine_cosine_t found = sine_cosine(angles[k]);
        const sine_cosine_t small = sine_cosine_small(angles[k]);
        TEST_ASSERT_TRUE((found.sine == angles[k]) && (found.cosine == 1.0f));
        TEST_ASSERT_TRUE((small.sine == angles[k]) && (small.cosine == 1.0f));
    }
    for (float angle = 0.0005f; angle < 0.5f; angle += 0.0005f) {
        const sine_cosine_t plus = sine_cosine_small(angle);
        const sine_cosine_t minus = sine_cosine_small(-angle);
        TEST_ASSERT_TRUE((plus.sine == -minus.sine) && (plus.cosine == minus.cosine));
    }
}

TEST(neither_infinity_nor_nan_is_finite_and_a_value_beyond_its_bound_is_at_it)
{
    TEST_ASSERT_TRUE(is_finite(-3.0e38f) && is_finite(0.0f));
    TEST_ASSERT_FALSE(is_finite(INFINITY) || is_finite(-INFINITY) || is_finite(NAN));
    TEST_ASSERT_TRUE((clamped(2.0f, 1.5f) == 1.5f) && (clamped(-2.0f, 1.5f) == -1.5f) && (clamped(1.0f, 1.5f) == 1.0f));
}

TEST(of_two_the_lesser_or_greater_and_the_second_where_one_is_not_a_number)
{
    TEST_ASSERT_TRUE((lesser(-1.0f, 2.0f) == -1.0f) && (lesser(2.0f, -1.0f) == -1.0f));
    TEST_ASSERT_TRUE((greater(-1.0f, 2.0f) == 2.0f) && (greater(2.0f, -1.0f) == 2.0f));
    TEST_ASSERT_TRUE((lesser(NAN, 2.0f) == 2.0f) && (greater(NAN, 2.0f) == 2.0f));
    TEST_ASSERT_TRUE(isnan(lesser(2.0f, NAN)) && isnan(greater(2.0f, NAN)));
    TEST_ASSERT_EQUAL_UINT32(1u, lesser_count(1u, 2u) * lesser_count(2u, 1u));
    TEST_ASSERT_EQUAL_UINT32(4u, greater_count(1u, 2u) * greater_count(2u, 1u));
}

TEST(a_time_is_rounded_and_runs_out_and_a_sum_of_times_ends_at_the_longest)
{
    TEST_ASSERT_EQUAL_UINT32(1000u, microseconds_of(1.00030e-3f));
    TEST_ASSERT_EQUAL_UINT32(1001u, microseconds_of(1.00060e-3f));
    TEST_ASSERT_EQUAL_UINT32(3u, time_left(5u, 2u));
    TEST_ASSERT_EQUAL_UINT32(0u, time_left(5u, 6u));
    TEST_ASSERT_EQUAL_UINT32(7u, time_sum(5u, 2u));
    TEST_ASSERT_EQUAL_UINT32(5u, time_sum(5u, 0u));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, time_sum(5u, UINT32_MAX - 2u));
}
