/* factor_tria() against the Gram matrix in double: L L^T = A A^T, L lower triangular with non-negative diagonal, is all
 * that L has to be. Errors are in units of eps |row i| |row j|. */
#include "dense.h"
#include "math/factor.h"
#include "unity.h"

enum { MOST_ROWS = 5, MOST_COLUMNS = 10, REPEATS = 50 };

#define TOLERANCE (8.0 * (double)FLT_EPSILON)

static random_source_t source;

void setUp(void)
{
    source.state = 20240229u;
}

void tearDown(void)
{
}

static void assert_triangular(const float *factor, uint32_t n)
{
    for (uint32_t i = 0u; i < n; i++) {
        TEST_ASSERT_TRUE(factor[(i * n) + i] >= 0.0f);
        for (uint32_t j = i + 1u; j < n; j++) {
            TEST_ASSERT_TRUE(factor[(i * n) + j] == 0.0f);
        }
    }
}

/* Checks the factor of a[n x m]; leaves it in `factor`. */
static void assert_factorises(const float *a, uint32_t n, uint32_t m, float *factor)
{
    float used_up[MOST_ROWS * MOST_COLUMNS];
    for (uint32_t k = 0u; k < (n * m); k++) {
        used_up[k] = a[k];
    }
    for (uint32_t k = 0u; k < (n * n); k++) {
        factor[k] = NAN; /* every entry must be written */
    }
    factor_tria(used_up, n, m, factor);
    const matrix_t wanted = matrix_gram(matrix_of(a, n, m));
    const matrix_t found = matrix_gram(matrix_of(factor, n, n));
    TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE, 0.0, covariance_difference(&found, &wanted, &wanted));
    assert_triangular(factor, n);
}

static void random_matrices_of_every_size(uint32_t least_columns_over_rows, double scale)
{
    for (uint32_t n = 1u; n <= MOST_ROWS; n++) {
        for (uint32_t m = n + least_columns_over_rows; m <= MOST_COLUMNS; m++) {
            for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
                float a[MOST_ROWS * MOST_COLUMNS];
                float factor[MOST_ROWS * MOST_ROWS];
                random_floats(&source, a, n * m, scale);
                assert_factorises(a, n, m, factor);
            }
        }
    }
}

static void test_factorises_random_matrices_of_every_size(void)
{
    random_matrices_of_every_size(0u, 1.0);
}

static void test_factorises_entries_near_the_ends_of_its_range(void)
{
    random_matrices_of_every_size(0u, 1.0e17);
    random_matrices_of_every_size(0u, 1.0e-16);
}

static void test_rows_from_1e_minus_16_to_1e16_are_each_accurate_on_their_own_scale(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)(20 * REPEATS); repeat++) {
        float a[MOST_ROWS * MOST_COLUMNS];
        float factor[MOST_ROWS * MOST_ROWS];
        for (uint32_t i = 0u; i < MOST_ROWS; i++) {
            random_floats(&source, &a[i * MOST_COLUMNS], MOST_COLUMNS, pow(10.0, random_between(&source, -16.0, 16.0)));
        }
        assert_factorises(a, MOST_ROWS, MOST_COLUMNS, factor);
    }
}

static void test_columns_from_1e_minus_12_to_1e12_may_be_mixed_in_a_row(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)(20 * REPEATS); repeat++) {
        float a[MOST_ROWS * MOST_COLUMNS];
        float factor[MOST_ROWS * MOST_ROWS];
        for (uint32_t k = 0u; k < (uint32_t)(MOST_ROWS * MOST_COLUMNS); k++) {
            random_floats(&source, &a[k], 1u, pow(10.0, random_between(&source, -12.0, 12.0)));
        }
        assert_factorises(a, MOST_ROWS, MOST_COLUMNS, factor);
    }
}

static void test_has_no_absolute_threshold(void)
{
    const int exponents[] = {-40, 40};
    for (uint32_t e = 0u; e < 2u; e++) {
        float a[MOST_ROWS * MOST_COLUMNS];
        float scaled[MOST_ROWS * MOST_COLUMNS];
        float factor[MOST_ROWS * MOST_ROWS];
        float factor_of_scaled[MOST_ROWS * MOST_ROWS];
        random_floats(&source, a, (uint32_t)(MOST_ROWS * MOST_COLUMNS), 1.0);
        for (uint32_t k = 0u; k < (uint32_t)(MOST_ROWS * MOST_COLUMNS); k++) {
            scaled[k] = ldexpf(a[k], exponents[e]);
        }
        factor_tria(a, MOST_ROWS, MOST_COLUMNS, factor);
        factor_tria(scaled, MOST_ROWS, MOST_COLUMNS, factor_of_scaled);
        for (uint32_t k = 0u; k < (uint32_t)(MOST_ROWS * MOST_ROWS); k++) {
            TEST_ASSERT_TRUE(factor_of_scaled[k] == ldexpf(factor[k], exponents[e]));
        }
    }
}

static void test_a_row_that_depends_on_earlier_ones_gives_nothing_on_the_diagonal(void)
{
    for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
        float a[3 * MOST_COLUMNS];
        float factor[9];
        random_floats(&source, a, (uint32_t)(3 * MOST_COLUMNS), 1.0);
        for (uint32_t k = 0u; k < MOST_COLUMNS; k++) {
            a[(2u * MOST_COLUMNS) + k] = (2.0f * a[k]) - a[MOST_COLUMNS + k];
        }
        assert_factorises(a, 3u, MOST_COLUMNS, factor);
        TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE, 0.0, (double)(factor[8] / factor_sigma(factor, 3u, 2u)));
    }
}

static void test_fewer_columns_than_rows_give_a_deficient_factor(void)
{
    for (uint32_t n = 2u; n <= MOST_ROWS; n++) {
        for (uint32_t m = 1u; m < n; m++) {
            float a[MOST_ROWS * MOST_COLUMNS];
            float factor[MOST_ROWS * MOST_ROWS];
            random_floats(&source, a, n * m, 1.0);
            assert_factorises(a, n, m, factor);
            TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE, 0.0, (double)(factor[(n * n) - 1u] / factor_sigma(factor, n, n - 1u)));
        }
    }
}

static void test_a_zero_row_gives_a_zero_row(void)
{
    float a[6] = {0.0f, 0.0f, 0.0f, 1.0f, 2.0f, 2.0f};
    float factor[4];
    factor_tria(a, 2u, 3u, factor);
    float wanted[4] = {0.0f, 0.0f, 0.0f, 3.0f};
    TEST_ASSERT_EQUAL_FLOAT_ARRAY(wanted, factor, 4);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_factorises_random_matrices_of_every_size);
    RUN_TEST(test_factorises_entries_near_the_ends_of_its_range);
    RUN_TEST(test_rows_from_1e_minus_16_to_1e16_are_each_accurate_on_their_own_scale);
    RUN_TEST(test_columns_from_1e_minus_12_to_1e12_may_be_mixed_in_a_row);
    RUN_TEST(test_has_no_absolute_threshold);
    RUN_TEST(test_a_row_that_depends_on_earlier_ones_gives_nothing_on_the_diagonal);
    RUN_TEST(test_fewer_columns_than_rows_give_a_deficient_factor);
    RUN_TEST(test_a_zero_row_gives_a_zero_row);
    return UNITY_END();
}
