/* The rest of factor.h: solve, add_noise, sigma, is_valid, against plain algebra in double. */
#include "dense.h"
#include "math/factor.h"
#include "unity.h"

#include <string.h>

enum { MOST_N = 5, MOST_CARRIED = 2, MOST_ROWS = MOST_N + MOST_CARRIED, REPEATS = 100 };

#define TOLERANCE (8.0 * (double)FLT_EPSILON)

static random_source_t source;

void setUp(void)
{
    source.state = 3u;
}

void tearDown(void)
{
}

static void draw_factor(float *s, uint32_t rows, uint32_t n, double scale)
{
    random_floats(&source, s, rows * n, scale);
    for (uint32_t i = 0u; i < n; i++) {
        s[(i * n) + i] = (float)(scale * random_between(&source, 0.3, 1.0));
        for (uint32_t j = i + 1u; j < n; j++) {
            s[(i * n) + j] = 0.0f;
        }
    }
}

/* --- solve --------------------------------------------------------------------------------------------------------- */

/* |L x - b| against the sum of the magnitudes in it, which is what backward stability means. */
static void assert_solves(uint32_t n, uint32_t columns, double scale)
{
    float l[MOST_N * MOST_N];
    float b[MOST_N * MOST_N];
    float x[MOST_N * MOST_N];
    draw_factor(l, n, n, scale);
    random_floats(&source, b, n * columns, 1.0);
    for (uint32_t k = 0u; k < (n * columns); k++) {
        x[k] = b[k];
    }
    factor_solve(l, n, x, columns);
    for (uint32_t i = 0u; i < n; i++) {
        for (uint32_t c = 0u; c < columns; c++) {
            double left = 0.0;
            double size = fabs((double)b[(i * columns) + c]);
            for (uint32_t k = 0u; k <= i; k++) {
                const double term = (double)l[(i * n) + k] * (double)x[(k * columns) + c];
                left += term;
                size += fabs(term);
            }
            TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE * size, (double)b[(i * columns) + c], left);
        }
    }
}

static void test_solve_leaves_a_residual_of_rounding_for_every_size(void)
{
    const double scales[] = {1.0e-12, 1.0, 1.0e12};
    for (uint32_t n = 1u; n <= MOST_N; n++) {
        for (uint32_t columns = 1u; columns <= MOST_N; columns++) {
            for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
                assert_solves(n, columns, scales[repeat % 3u]);
            }
        }
    }
}

/* --- add_noise ----------------------------------------------------------------------------------------------------- */

/* Adds noise to a random factor: the new factor and what is left of the noise must make up P + Q of all rows, carried ones
 * too, and what is left must not touch the first n. */
static void assert_adds(uint32_t n, uint32_t carried, double noise_scale)
{
    const uint32_t rows = n + carried;
    float s[MOST_ROWS * MOST_N];
    float noise[MOST_N];
    float rest[MOST_N * MOST_ROWS];
    draw_factor(s, rows, n, 1.0);
    random_floats(&source, noise, n, noise_scale);
    for (uint32_t k = 0u; k < (n * rows); k++) {
        rest[k] = NAN; /* every entry must be written */
    }
    matrix_t wanted = matrix_gram(matrix_of(s, rows, n));
    for (uint32_t i = 0u; i < n; i++) {
        noise[i] = fabsf(noise[i]);
        wanted.at[i][i] += (double)noise[i] * (double)noise[i];
    }
    factor_add_noise(s, rows, n, noise, rest);
    for (uint32_t k = 0u; k < (n * rows); k++) {
        TEST_ASSERT_TRUE(((k % rows) >= n) || (rest[k] == 0.0f));
    }
    const matrix_t left = matrix_transposed(matrix_of(rest, n, rows));
    const matrix_t found = matrix_sum(matrix_gram(matrix_of(s, rows, n)), 1.0, matrix_gram(left));
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * TOLERANCE, 0.0, covariance_difference(&found, &wanted, &wanted));
    TEST_ASSERT_TRUE(factor_is_valid(s, n));
}

static void test_noise_adds_to_the_covariance_and_its_rest_keeps_that_of_carried_rows(void)
{
    const double scales[] = {1.0e-3, 1.0, 1.0e3, 1.0e12};
    for (uint32_t n = 1u; n <= MOST_N; n++) {
        for (uint32_t carried = 0u; carried <= MOST_CARRIED; carried++) {
            for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
                assert_adds(n, carried, scales[repeat % 4u]);
            }
        }
    }
}

/* As for a filter that is frozen for minutes. */
static void test_no_noise_changes_nothing_however_often(void)
{
    for (uint32_t repeat = 0u; repeat < 10u; repeat++) {
        float s[35];
        float before[35];
        float rest[35];
        const float none[5] = {0.0f, 0.0f, 0.0f, 0.0f, 0.0f};
        draw_factor(s, 7u, 5u, 1.0);
        (void)memcpy(before, s, sizeof before);
        for (uint32_t k = 0u; k < 10000u; k++) {
            factor_add_noise(s, 7u, 5u, none, rest);
        }
        for (uint32_t k = 0u; k < 35u; k++) {
            TEST_ASSERT_DOUBLE_WITHIN((double)FLT_EPSILON, (double)before[k], (double)s[k]);
        }
    }
}

static void test_noise_on_nothing_is_the_noise(void)
{
    float s[9] = {0.0f};
    float rest[9];
    const float noise[3] = {1.0e-12f, 3.0f, 1.0e12f};
    factor_add_noise(s, 3u, 3u, noise, rest);
    float wanted[9] = {1.0e-12f, 0.0f, 0.0f, 0.0f, 3.0f, 0.0f, 0.0f, 0.0f, 1.0e12f};
    TEST_ASSERT_EQUAL_FLOAT_ARRAY(wanted, s, 9);
}

static void test_a_millionth_of_the_variance_a_step_adds_up_to_within_five_per_cent(void)
{
    float s[4] = {0.5f, 0.0f, 0.3f, 0.4f};
    float rest[4];
    const float noise[2] = {5.0e-4f, 5.0e-4f};
    for (uint32_t k = 0u; k < 100000u; k++) {
        factor_add_noise(s, 2u, 2u, noise, rest);
    }
    const double added = 100000.0 * 25.0e-8;
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * added, 0.25 + added, (double)(s[0] * s[0]));
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * added, 0.25 + added, (double)((s[2] * s[2]) + (s[3] * s[3])));
}

/* --- sigma, is_valid ----------------------------------------------------------------------------------------------- */

static void test_sigma_is_the_norm_of_the_row_up_to_the_diagonal(void)
{
    const float s[9] = {2.0f, 9.0f, 9.0f, 3.0f, 4.0f, 9.0f, 1.0e-12f, 2.0e-12f, 2.0e-12f};
    TEST_ASSERT_EQUAL_FLOAT(2.0f, factor_sigma(s, 3u, 0u));
    TEST_ASSERT_EQUAL_FLOAT(5.0f, factor_sigma(s, 3u, 1u));
    TEST_ASSERT_EQUAL_FLOAT(3.0e-12f, factor_sigma(s, 3u, 2u));
}

static void test_valid_factors_are_valid_on_any_scale(void)
{
    for (uint32_t n = 1u; n <= MOST_N; n++) {
        float s[MOST_N * MOST_N];
        draw_factor(s, n, n, 1.0e-17);
        TEST_ASSERT_TRUE(factor_is_valid(s, n));
        draw_factor(s, n, n, 0.9e17);
        TEST_ASSERT_TRUE(factor_is_valid(s, n));
    }
}

static void test_a_bad_entry_anywhere_makes_a_factor_invalid(void)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, 1.0e17f, -1.0e17f};
    for (uint32_t k = 0u; k < 25u; k++) {
        for (uint32_t b = 0u; b < 5u; b++) {
            float s[25];
            draw_factor(s, 5u, 5u, 1.0);
            s[k] = bad[b];
            TEST_ASSERT_FALSE(factor_is_valid(s, 5u));
        }
    }
}

static void test_a_diagonal_that_is_not_positive_is_invalid(void)
{
    for (uint32_t i = 0u; i < 5u; i++) {
        float s[25];
        draw_factor(s, 5u, 5u, 1.0);
        s[i * 6u] = 0.0f;
        TEST_ASSERT_FALSE(factor_is_valid(s, 5u));
        s[i * 6u] = -1.0e-3f;
        TEST_ASSERT_FALSE(factor_is_valid(s, 5u));
    }
}

static void test_an_upper_triangle_that_is_not_zero_is_invalid(void)
{
    for (uint32_t i = 0u; i < 5u; i++) {
        for (uint32_t j = i + 1u; j < 5u; j++) {
            float s[25];
            draw_factor(s, 5u, 5u, 1.0);
            s[(i * 5u) + j] = 1.0e-30f;
            TEST_ASSERT_FALSE(factor_is_valid(s, 5u));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_solve_leaves_a_residual_of_rounding_for_every_size);
    RUN_TEST(test_noise_adds_to_the_covariance_and_its_rest_keeps_that_of_carried_rows);
    RUN_TEST(test_no_noise_changes_nothing_however_often);
    RUN_TEST(test_noise_on_nothing_is_the_noise);
    RUN_TEST(test_a_millionth_of_the_variance_a_step_adds_up_to_within_five_per_cent);
    RUN_TEST(test_sigma_is_the_norm_of_the_row_up_to_the_diagonal);
    RUN_TEST(test_valid_factors_are_valid_on_any_scale);
    RUN_TEST(test_a_bad_entry_anywhere_makes_a_factor_invalid);
    RUN_TEST(test_a_diagonal_that_is_not_positive_is_invalid);
    RUN_TEST(test_an_upper_triangle_that_is_not_zero_is_invalid);
    return UNITY_END();
}
