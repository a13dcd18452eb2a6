/* The kernels of factor.h against plain algebra on covariances in double. Errors are in units of sigma_i sigma_j. */
#include "dense.h"
#include "math/factor.h"
#include "unity.h"

#include <string.h>

enum { MOST_N = 5, MOST_ROWS = FACTOR_ROWS_MOST, MOST_COLUMNS = 10, REPEATS = 100 };

#define EPSILON ((double)FLT_EPSILON)

static random_source_t source;

void setUp(void)
{
    source.state = 20240229u;
}

void tearDown(void)
{
}

/* Covariance that `rows` of n columns stand for. */
static matrix_t covariance_of(const float *s, uint32_t rows, uint32_t n)
{
    return matrix_gram(matrix_of(s, rows, n));
}

static void assert_covariance(double tolerance, matrix_t wanted, matrix_t found)
{
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, covariance_difference(&found, &wanted, &wanted));
}

/* --- tria of two rows --------------------------------------------------------------------------------------------- */

static void assert_factorises(const float *a, const float *b, uint32_t m, float s[4])
{
    float both[2 * MOST_COLUMNS];
    float used_up[MOST_COLUMNS];
    for (uint32_t k = 0u; k < m; k++) {
        both[k] = a[k];
        both[m + k] = b[k];
        used_up[k] = a[k];
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        s[k] = NAN; /* every entry must be written */
    }
    factor_tria_two(used_up, b, m, s);
    assert_covariance(8.0 * EPSILON, covariance_of(both, 2u, m), covariance_of(s, 2u, 2u));
    TEST_ASSERT_TRUE((s[0] >= 0.0f) && (s[1] == 0.0f) && (s[3] >= 0.0f));
}

/* Rows, and entries of a row, of very different size. */
static void test_tria_of_rows_of_any_scale_has_their_covariance(void)
{
    const double row_decades[] = {0.0, 8.0, 0.0};
    const double entry_decades[] = {0.0, 0.0, 8.0};
    for (uint32_t repeat = 0u; repeat < 30u * (uint32_t)REPEATS; repeat++) {
        const uint32_t kind = repeat % 3u;
        const uint32_t m = 2u + (repeat % 9u);
        float rows[2][MOST_COLUMNS];
        float s[4];
        for (uint32_t r = 0u; r < 2u; r++) {
            const double scale = pow(10.0, row_decades[kind] * random_between(&source, -1.0, 1.0));
            for (uint32_t k = 0u; k < m; k++) {
                const double entry = pow(10.0, entry_decades[kind] * random_between(&source, -1.0, 1.0));
                random_floats(&source, &rows[r][k], 1u, scale * entry);
            }
        }
        assert_factorises(rows[0], rows[1], m, s);
    }
}

/* What is left of a row beside the other comes from a sum of squares, so it is right to its own last digits. */
static void test_tria_of_nearly_dependent_rows_keeps_what_is_different(void)
{
    for (double difference = 1.0e-1; difference > 1.0e-6; difference *= 0.1) {
        const float a[3] = {1.0f, 0.0f, 0.0f};
        const float b[3] = {2.0f, (float)difference, 0.0f};
        float s[4];
        assert_factorises(a, b, 3u, s);
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * EPSILON * difference, difference, (double)s[3]);
    }
}

static void test_tria_of_dependent_or_zero_rows_is_deficient_not_nan(void)
{
    const float rows[3][3] = {{1.0f, 2.0f, 2.0f}, {-2.0f, -4.0f, -4.0f}, {0.0f, 0.0f, 0.0f}};
    float s[4];
    assert_factorises(rows[0], rows[1], 3u, s);
    TEST_ASSERT_DOUBLE_WITHIN(8.0 * EPSILON, 0.0, (double)s[3]);
    assert_factorises(rows[0], rows[2], 3u, s);
    TEST_ASSERT_TRUE((s[0] == 3.0f) && (s[2] == 0.0f) && (s[3] == 0.0f));
    float zero[3] = {0.0f, 0.0f, 0.0f};
    factor_tria_two(zero, rows[0], 3u, s);
    TEST_ASSERT_TRUE((s[0] == 0.0f) && (s[2] == 0.0f) && isfinite(s[3]));
}

/* --- noise -------------------------------------------------------------------------------------------------------- */

/* Covariance of all rows, with what a noise column leaves in those below the factor. */
static matrix_t covariance_with(const float *s, uint32_t rows, uint32_t n, const float *rest)
{
    matrix_t column = matrix_zero(rows, 1u);
    for (uint32_t r = n; r < rows; r++) {
        column.at[r][0] = (double)rest[r - n];
    }
    return matrix_sum(covariance_of(s, rows, n), 1.0, matrix_gram(column));
}

static void test_noise_adds_to_one_variance_and_the_rest_is_what_other_rows_lose(void)
{
    const double scales[] = {1.0e-3, 1.0, 1.0e3, 1.0e12};
    for (uint32_t repeat = 0u; repeat < 20u * (uint32_t)REPEATS; repeat++) {
        const uint32_t n = 1u + (repeat % (uint32_t)MOST_N);
        const uint32_t rows = n + (repeat % (1u + (uint32_t)MOST_ROWS - n));
        float s[MOST_ROWS * MOST_N];
        random_factor(&source, s, rows, n);
        for (uint32_t i = 0u; i < n; i++) {
            float rest[MOST_ROWS];
            const float noise = (float)(scales[repeat % 4u] * random_unit(&source));
            matrix_t wanted = covariance_of(s, rows, n);
            wanted.at[i][i] += (double)noise * (double)noise;
            factor_add_noise(s, rows, n, i, noise, rest);
            assert_covariance(16.0 * EPSILON, wanted, covariance_with(s, rows, n, rest));
            for (uint32_t j = i + 1u; j < n; j++) {
                TEST_ASSERT_TRUE(s[(i * n) + j] == 0.0f);
            }
        }
    }
}

/* As for parameters that do not walk, for minutes. */
static void test_no_noise_changes_nothing_to_the_bit(void)
{
    float s[MOST_ROWS * MOST_N];
    float before[MOST_ROWS * MOST_N];
    float rest[MOST_ROWS - MOST_N];
    random_factor(&source, s, (uint32_t)MOST_ROWS, (uint32_t)MOST_N);
    (void)memcpy(before, s, sizeof before);
    for (uint32_t k = 0u; k < 100000u; k++) {
        factor_add_noise(s, (uint32_t)MOST_ROWS, (uint32_t)MOST_N, k % (uint32_t)MOST_N, 0.0f, rest);
    }
    TEST_ASSERT_EQUAL_MEMORY(before, s, sizeof before);
    TEST_ASSERT_TRUE((rest[0] == 0.0f) && (rest[1] == 0.0f) && (rest[2] == 0.0f));
}

/* Where nothing was known, other rows have nothing to do with what is known now. */
static void test_noise_on_nothing_is_the_noise(void)
{
    float s[8] = {0.0f, 0.0f, 0.0f, 0.0f, 0.75f, -2.0f, 0.5f, 3.0f};
    float rest[2][2];
    factor_add_noise(s, 4u, 2u, 0u, 1.0e-12f, rest[0]);
    factor_add_noise(s, 4u, 2u, 1u, 1.0e12f, rest[1]);
    TEST_ASSERT_TRUE((s[0] == 1.0e-12f) && (s[2] == 0.0f) && (s[3] == 1.0e12f));
    for (uint32_t k = 4u; k < 8u; k++) {
        TEST_ASSERT_TRUE(s[k] == 0.0f);
    }
    TEST_ASSERT_TRUE((fabsf(rest[0][0]) == 0.75f) && (fabsf(rest[1][0]) == 2.0f) && (fabsf(rest[1][1]) == 3.0f));
}

/* A millionth of the variance each time; and less than the diagonal can hold, where nothing else may drift either. */
static void test_tiny_noise_adds_up_or_leaves_the_rest_as_it_is(void)
{
    const float noises[] = {5.0e-4f, 1.0e-6f};
    for (uint32_t k = 0u; k < 2u; k++) {
        float s[4] = {0.5f, 0.0f, 0.3f, 0.4f};
        matrix_t wanted = covariance_of(s, 2u, 2u);
        for (uint32_t step = 0u; step < 200000u; step++) {
            float rest[1];
            factor_add_noise(s, 2u, 2u, step % 2u, noises[k], rest);
            wanted.at[step % 2u][step % 2u] += (double)noises[k] * (double)noises[k];
        }
        assert_covariance((k == 0u) ? 5.0e-3 : 1.0e-5, wanted, covariance_of(s, 2u, 2u));
    }
}

/* --- conditioning on information ---------------------------------------------------------------------------------- */

/* Information c^T c of `outputs` rows c [outputs x n] of noise 1, and what innovations nu say: c^T nu. */
typedef struct known {
    uint32_t n;
    uint32_t outputs;
    float c[DENSE_MOST * MOST_N];
    float nu[DENSE_MOST];
    float information[MOST_N * MOST_N];
    float vector[MOST_N];
} known_t;

static void sum_up(known_t *known)
{
    const uint32_t n = known->n;
    for (uint32_t i = 0u; i < n; i++) {
        known->vector[i] = 0.0f;
        for (uint32_t j = 0u; j < n; j++) {
            float sum = 0.0f;
            for (uint32_t o = 0u; o < known->outputs; o++) {
                sum += known->c[(o * n) + i] * known->c[(o * n) + j];
                known->vector[i] += (j == 0u) ? (known->c[(o * n) + i] * known->nu[o]) : 0.0f;
            }
            known->information[(i * n) + j] = (j >= i) ? sum : NAN; /* the lower triangle is not to be read */
        }
    }
}

static known_t draw_known(uint32_t n, uint32_t outputs, double scale)
{
    known_t known = {.n = n, .outputs = outputs};
    random_floats(&source, known.c, outputs * n, scale);
    random_floats(&source, known.nu, outputs, 1.0);
    sum_up(&known);
    return known;
}

/* Rows s [rows x n], the first n a factor, conditioned; `mean` [rows] of what the rows stand for, from 0. */
static void condition(known_t known, float *s, uint32_t rows, double *mean)
{
    const uint32_t n = known.n;
    factor_reverse(known.information, n);
    factor_reverse_solve(known.information, n, known.vector, n);
    for (uint32_t r = 0u; r < rows; r++) {
        factor_reverse_solve(known.information, n, &s[r * n], (r < n) ? (r + 1u) : n);
        mean[r] = 0.0;
        for (uint32_t k = 0u; k < n; k++) {
            mean[r] += (double)s[(r * n) + k] * (double)known.vector[k];
        }
    }
}

/* P - P H^T (H P H^T + I)^-1 H P and the gain times nu, where H P H^T = c c^T and P H^T = s c^T. */
static void assert_is_the_textbook_update(uint32_t n, uint32_t rows, uint32_t outputs, double scale)
{
    float s[MOST_ROWS * MOST_N];
    double mean[MOST_ROWS];
    const known_t known = draw_known(n, outputs, scale);
    random_factor(&source, s, rows, n);
    const matrix_t prior = covariance_of(s, rows, n);
    const matrix_t c = matrix_of(known.c, outputs, n);
    const matrix_t covariance = matrix_sum(matrix_gram(c), 1.0, matrix_identity(outputs));
    const matrix_t cross = matrix_product(matrix_of(s, rows, n), matrix_transposed(c));
    const matrix_t gain = matrix_product(cross, matrix_inverse(covariance));
    const matrix_t wanted = matrix_sum(prior, -1.0, matrix_congruence(gain, covariance));
    const matrix_t wanted_mean = matrix_product(gain, matrix_of(known.nu, outputs, 1u));
    condition(known, s, rows, mean);
    const matrix_t found = covariance_of(s, rows, n);
    const double tolerance = 32.0 * EPSILON * (1.0 + (scale * scale * (double)(n * outputs)));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, covariance_difference(&found, &wanted, &prior));
    for (uint32_t r = 0u; r < rows; r++) {
        const double unit = sqrt(prior.at[r][r]) * (1.0 + fabs(wanted_mean.at[r][0]));
        TEST_ASSERT_DOUBLE_WITHIN(tolerance * unit, wanted_mean.at[r][0], mean[r]);
    }
    for (uint32_t i = 0u; i < n; i++) {
        TEST_ASSERT_TRUE(s[(i * n) + i] > 0.0f);
        for (uint32_t j = i + 1u; j < n; j++) {
            TEST_ASSERT_TRUE(s[(i * n) + j] == 0.0f);
        }
    }
}

static void test_conditioning_is_the_kalman_update_of_the_textbook(void)
{
    const double scales[] = {1.0e-18, 1.0e-3, 1.0, 10.0, 100.0};
    for (uint32_t repeat = 0u; repeat < 60u * (uint32_t)REPEATS; repeat++) {
        const uint32_t n = 1u + (repeat % (uint32_t)MOST_N);
        const uint32_t rows = n + (repeat % 3u);
        assert_is_the_textbook_update(n, rows, 1u + (repeat % 7u), scales[(repeat / 7u) % 5u]);
    }
}

static void test_no_information_changes_nothing_to_the_bit(void)
{
    float s[MOST_ROWS * MOST_N];
    float before[MOST_ROWS * MOST_N];
    double mean[MOST_ROWS];
    random_factor(&source, s, (uint32_t)MOST_ROWS, (uint32_t)MOST_N);
    (void)memcpy(before, s, sizeof before);
    condition(draw_known((uint32_t)MOST_N, 0u, 1.0), s, (uint32_t)MOST_ROWS, mean);
    TEST_ASSERT_EQUAL_MEMORY(before, s, sizeof before);
    for (uint32_t r = 0u; r < (uint32_t)MOST_ROWS; r++) {
        TEST_ASSERT_TRUE(mean[r] == 0.0);
    }
}

static void assert_is_factor(const float s[9], const double mean[3])
{
    for (uint32_t i = 0u; i < 3u; i++) {
        TEST_ASSERT_TRUE((s[i * 4u] > 0.0f) && isfinite(s[i * 3u]) && isfinite(s[i * 4u]) && isfinite(mean[i]));
    }
}

/* More than a float can tell from a matrix without rank; and the same precise outputs of three elements again and
 * again: what is left is anything, but a factor. */
static void test_any_information_leaves_a_factor(void)
{
    for (double scale = 1.0e2; scale < 1.0e16; scale *= 3.0) {
        float s[9];
        double mean[3];
        for (uint32_t repeat = 0u; repeat < 3u * (uint32_t)REPEATS; repeat++) {
            random_factor(&source, s, 3u, 3u);
            condition(draw_known(3u, 1u + (repeat % 4u), scale), s, 3u, mean);
            assert_is_factor(s, mean);
        }
        for (uint32_t repeat = 0u; repeat < 1000u; repeat++) {
            known_t known = {.n = 3u, .outputs = 2u, .nu = {1.0f, -1.0f}};
            for (uint32_t j = 0u; j < 3u; j++) {
                known.c[j] = (float)scale * s[3u + j];
                known.c[3u + j] = (float)scale * (s[6u + j] - s[j]);
            }
            sum_up(&known);
            condition(known, s, 3u, mean);
            assert_is_factor(s, mean);
        }
    }
}

static void test_a_precise_measurement_of_one_element_leaves_its_noise(void)
{
    float s[4] = {0.5f, 0.0f, 0.25f, 0.75f};
    double mean[2];
    known_t known = {.n = 2u, .information = {0.25e12f, 0.0f, 0.0f, 0.0f}}; /* (s / 1e-6)^2 */
    condition(known, s, 2u, mean);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-12, 1.0e-6, (double)s[0]);
    TEST_ASSERT_TRUE(s[3] == 0.75f); /* the second, given the first, is known as before */
}

/* --- sigma -------------------------------------------------------------------------------------------------------- */

static void test_sigma_is_the_norm_of_the_row_up_to_the_diagonal(void)
{
    const float s[9] = {2.0f, 9.0f, 9.0f, 3.0f, 4.0f, 9.0f, 1.0e-12f, 2.0e-12f, 2.0e-12f};
    TEST_ASSERT_TRUE(factor_sigma(s, 3u, 0u) == 2.0f);
    TEST_ASSERT_TRUE((factor_sigma(s, 3u, 1u) == 5.0f) && (factor_variance(s, 3u, 1u) == 25.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-18f, 3.0e-12f, factor_sigma(s, 3u, 2u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_tria_of_rows_of_any_scale_has_their_covariance);
    RUN_TEST(test_tria_of_nearly_dependent_rows_keeps_what_is_different);
    RUN_TEST(test_tria_of_dependent_or_zero_rows_is_deficient_not_nan);
    RUN_TEST(test_noise_adds_to_one_variance_and_the_rest_is_what_other_rows_lose);
    RUN_TEST(test_no_noise_changes_nothing_to_the_bit);
    RUN_TEST(test_noise_on_nothing_is_the_noise);
    RUN_TEST(test_tiny_noise_adds_up_or_leaves_the_rest_as_it_is);
    RUN_TEST(test_conditioning_is_the_kalman_update_of_the_textbook);
    RUN_TEST(test_no_information_changes_nothing_to_the_bit);
    RUN_TEST(test_any_information_leaves_a_factor);
    RUN_TEST(test_a_precise_measurement_of_one_element_leaves_its_noise);
    RUN_TEST(test_sigma_is_the_norm_of_the_row_up_to_the_diagonal);
    return UNITY_END();
}
