/* The rest of factor.h: solve, add_noise, sigma, is_valid, against plain algebra in double. */
#include "dense.h"
#include "math/factor.h"
#include "unity.h"

#include <string.h>

enum { MOST_N = 6, REPEATS = 100 }; /* factor and map together are as much as dense.h takes */

#define TOLERANCE (8.0 * (double)FLT_EPSILON)

static random_source_t source;

void setUp(void)
{
    source.state = 3u;
}

void tearDown(void)
{
}

static void draw_factor(float *s, uint32_t n, double scale)
{
    random_floats(&source, s, n * n, scale);
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
    draw_factor(l, n, scale);
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

/* [S; M], all with the same columns. */
static matrix_t stacked(const float *s, const float *map, uint32_t n)
{
    matrix_t result = matrix_zero(2u * n, n);
    for (uint32_t i = 0u; i < n; i++) {
        for (uint32_t j = 0u; j < n; j++) {
            result.at[i][j] = (double)s[(i * n) + j];
            result.at[n + i][j] = (double)map[(i * n) + j];
        }
    }
    return result;
}

/* What is left of a noise column: nothing of it in the rows of S. */
static matrix_t left_over(const float *rest, uint32_t n)
{
    matrix_t column = matrix_zero(2u * n, 1u);
    for (uint32_t i = 0u; i < n; i++) {
        column.at[n + i][0] = (double)rest[i];
    }
    return matrix_gram(column);
}

/* Adds noise to one element after the other of a random factor. P grows by it; the map keeps its covariance with the
 * factor, and with what is freed of it its own: after each noise, and after all of them. */
static void assert_adds(uint32_t n, double noise_scale)
{
    float s[MOST_N * MOST_N];
    float map[MOST_N * MOST_N];
    draw_factor(s, n, 1.0);
    random_floats(&source, map, n * n, 1.0);
    matrix_t wanted_of_all = matrix_gram(stacked(s, map, n));
    matrix_t freed = matrix_zero(2u * n, 2u * n);
    for (uint32_t i = 0u; i < n; i++) {
        float rest[MOST_N] = {NAN, NAN, NAN, NAN, NAN, NAN}; /* every entry must be written */
        const float noise = (float)(noise_scale * random_unit(&source));
        const double variance = (double)noise * (double)noise;
        matrix_t wanted = matrix_gram(stacked(s, map, n));
        wanted.at[i][i] += variance;
        wanted_of_all.at[i][i] += variance;
        factor_add_noise(s, map, n, i, noise, rest);
        freed = matrix_sum(freed, 1.0, left_over(rest, n));
        const matrix_t after = matrix_gram(stacked(s, map, n));
        const matrix_t found = matrix_sum(after, 1.0, left_over(rest, n));
        const matrix_t found_of_all = matrix_sum(after, 1.0, freed);
        TEST_ASSERT_DOUBLE_WITHIN(2.0 * TOLERANCE, 0.0, covariance_difference(&found, &wanted, &wanted));
        TEST_ASSERT_DOUBLE_WITHIN(
            4.0 * TOLERANCE, 0.0, covariance_difference(&found_of_all, &wanted_of_all, &wanted_of_all));
        TEST_ASSERT_TRUE(factor_is_valid(s, n));
    }
}

static void test_noise_adds_to_the_covariance_and_its_rest_keeps_that_of_the_map(void)
{
    const double scales[] = {1.0e-3, 1.0, 1.0e3, 1.0e12};
    for (uint32_t n = 1u; n <= MOST_N; n++) {
        for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
            assert_adds(n, scales[repeat % 4u]);
        }
    }
}

static void test_noise_adds_to_the_greatest_factor_too(void)
{
    float s[FACTOR_MOST * FACTOR_MOST];
    float map[FACTOR_MOST * FACTOR_MOST];
    float rest[FACTOR_MOST];
    const uint32_t n = (uint32_t)FACTOR_MOST;
    draw_factor(s, n, 1.0);
    draw_factor(map, n, 1.0);
    matrix_t wanted = matrix_gram(matrix_of(s, n, n));
    for (uint32_t i = 0u; i < n; i++) {
        wanted.at[i][i] += 0.25;
        factor_add_noise(s, map, n, i, 0.5f, rest);
    }
    const matrix_t found = matrix_gram(matrix_of(s, n, n));
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * TOLERANCE, 0.0, covariance_difference(&found, &wanted, &wanted));
    TEST_ASSERT_TRUE(factor_is_valid(s, n));
}

/* As for a filter that is frozen for minutes. */
static void test_no_noise_changes_nothing_to_the_bit_however_often(void)
{
    for (uint32_t repeat = 0u; repeat < 10u; repeat++) {
        float s[25];
        float map[25];
        float before[25];
        float map_before[25];
        float rest[5];
        draw_factor(s, 5u, 1.0);
        random_floats(&source, map, 25u, 1.0);
        (void)memcpy(before, s, sizeof before);
        (void)memcpy(map_before, map, sizeof map_before);
        for (uint32_t k = 0u; k < 10000u; k++) {
            factor_add_noise(s, map, 5u, k % 5u, 0.0f, rest);
            for (uint32_t r = 0u; r < 5u; r++) {
                TEST_ASSERT_TRUE(rest[r] == 0.0f);
            }
        }
        TEST_ASSERT_EQUAL_MEMORY(before, s, sizeof before);
        TEST_ASSERT_EQUAL_MEMORY(map_before, map, sizeof map_before);
    }
}

/* Where nothing was known, nothing of the map has to do with what is known now: it is freed. */
static void test_noise_on_nothing_is_the_noise(void)
{
    const float noise[3] = {1.0e-12f, 3.0f, 1.0e12f};
    const float map_before[9] = {1.0f, 0.75f, -2.0f, 0.5f, 2.0f, -3.0f, -0.25f, -1.0f, 3.0f};
    float s[9] = {0.0f};
    float map[9];
    (void)memcpy(map, map_before, sizeof map);
    for (uint32_t i = 0u; i < 3u; i++) {
        float rest[3];
        factor_add_noise(s, map, 3u, i, noise[i], rest);
        for (uint32_t r = 0u; r < 3u; r++) {
            const double column = (double)map_before[(r * 3u) + i];
            TEST_ASSERT_DOUBLE_WITHIN(3.0 * (double)FLT_EPSILON, fabs(column), fabs((double)rest[r]));
            TEST_ASSERT_TRUE(map[(r * 3u) + i] == 0.0f);
        }
    }
    float wanted[9] = {1.0e-12f, 0.0f, 0.0f, 0.0f, 3.0f, 0.0f, 0.0f, 0.0f, 1.0e12f};
    TEST_ASSERT_EQUAL_FLOAT_ARRAY(wanted, s, 9);
}

static void test_a_millionth_of_the_variance_a_step_adds_up_to_within_five_per_cent(void)
{
    float s[4] = {0.5f, 0.0f, 0.3f, 0.4f};
    for (uint32_t k = 0u; k < 200000u; k++) {
        float map[4] = {1.0f, 0.0f, 0.0f, 1.0f};
        float rest[2];
        factor_add_noise(s, map, 2u, k % 2u, 5.0e-4f, rest);
    }
    const double added = 100000.0 * 25.0e-8;
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * added, 0.25 + added, (double)(s[0] * s[0]));
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * added, 0.25 + added, (double)((s[2] * s[2]) + (s[3] * s[3])));
}

/* Too little for the diagonal to hold: then nothing else may drift either. */
static void test_noise_that_is_rounded_away_leaves_the_rest_as_it_is(void)
{
    for (uint32_t repeat = 0u; repeat < 10u; repeat++) {
        float s[9];
        draw_factor(s, 3u, 1.0);
        const matrix_t wanted = matrix_gram(matrix_of(s, 3u, 3u));
        for (uint32_t k = 0u; k < 100000u; k++) {
            float map[9] = {1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f};
            float rest[3];
            factor_add_noise(s, map, 3u, k % 3u, 1.0e-6f, rest);
        }
        const matrix_t found = matrix_gram(matrix_of(s, 3u, 3u));
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, 0.0, covariance_difference(&found, &wanted, &wanted));
    }
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
        draw_factor(s, n, 1.0e-17);
        TEST_ASSERT_TRUE(factor_is_valid(s, n));
        draw_factor(s, n, 1.9e17 / (double)(n * (n + 1u))); /* the magnitudes together may come to 1e17 */
        TEST_ASSERT_TRUE(factor_is_valid(s, n));
    }
}

static void test_a_bad_entry_anywhere_makes_a_factor_invalid(void)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, 1.0e17f, -1.0e17f};
    for (uint32_t k = 0u; k < 25u; k++) {
        for (uint32_t b = 0u; b < 5u; b++) {
            float s[25];
            draw_factor(s, 5u, 1.0);
            s[k] = bad[b];
            TEST_ASSERT_FALSE(factor_is_valid(s, 5u));
        }
    }
}

static void test_a_diagonal_that_is_not_positive_is_invalid(void)
{
    for (uint32_t i = 0u; i < 5u; i++) {
        float s[25];
        draw_factor(s, 5u, 1.0);
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
            draw_factor(s, 5u, 1.0);
            s[(i * 5u) + j] = 1.0e-30f;
            TEST_ASSERT_FALSE(factor_is_valid(s, 5u));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_solve_leaves_a_residual_of_rounding_for_every_size);
    RUN_TEST(test_noise_adds_to_the_covariance_and_its_rest_keeps_that_of_the_map);
    RUN_TEST(test_noise_adds_to_the_greatest_factor_too);
    RUN_TEST(test_no_noise_changes_nothing_to_the_bit_however_often);
    RUN_TEST(test_noise_on_nothing_is_the_noise);
    RUN_TEST(test_a_millionth_of_the_variance_a_step_adds_up_to_within_five_per_cent);
    RUN_TEST(test_noise_that_is_rounded_away_leaves_the_rest_as_it_is);
    RUN_TEST(test_sigma_is_the_norm_of_the_row_up_to_the_diagonal);
    RUN_TEST(test_valid_factors_are_valid_on_any_scale);
    RUN_TEST(test_a_bad_entry_anywhere_makes_a_factor_invalid);
    RUN_TEST(test_a_diagonal_that_is_not_positive_is_invalid);
    RUN_TEST(test_an_upper_triangle_that_is_not_zero_is_invalid);
    return UNITY_END();
}
