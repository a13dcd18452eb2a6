/* The kernels of factor.h at their limits: rows without rank, no noise, no information, too much of either. */
#include "math/factor.h"
#include "random.h"
#include "test.h"

#include <float.h>
#include <string.h>

enum { MOST_N = 5, MOST_ROWS = FACTOR_ROWS_MOST, OUTPUTS_MOST = 4, REPEATS = 100 };

#define EPSILON ((double)FLT_EPSILON)

static random_source_t source;

void setUp(void)
{
    source.state = 20240229u;
}

static void random_floats(float *values, uint32_t count, double scale)
{
    for (uint32_t i = 0u; i < count; i++) {
        values[i] = (float)(scale * random_between(&source, -1.0, 1.0));
    }
}

/* A factor [n x n] with diagonal in [1/2, 1], and rows below it. */
static void random_factor(float *s, uint32_t rows, uint32_t n)
{
    random_floats(s, rows * n, 1.0);
    for (uint32_t i = 0u; i < (n * n); i++) {
        if ((i % n) >= (i / n)) {
            s[i] = ((i % n) == (i / n)) ? (float)random_between(&source, 0.5, 1.0) : 0.0f;
        }
    }
}

static double dot(const float *a, const float *b, uint32_t n)
{
    double sum = 0.0;
    for (uint32_t k = 0u; k < n; k++) {
        sum += (double)a[k] * (double)b[k];
    }
    return sum;
}

/* --- tria of two rows --------------------------------------------------------------------------------------------- */

static void assert_factorises(const float a[3], const float b[3], float s[4])
{
    float used_up[3];
    (void)memcpy(used_up, a, sizeof used_up);
    for (uint32_t k = 0u; k < 4u; k++) {
        s[k] = NAN; /* every entry must be written */
    }
    factor_tria_two(used_up, b, 3u, s);
    const double variance[2] = {dot(a, a, 3u), dot(b, b, 3u)};
    const double tolerance = 8.0 * EPSILON;
    TEST_ASSERT_DOUBLE_WITHIN(tolerance * variance[0], variance[0], dot(s, s, 2u));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance * variance[1], variance[1], dot(&s[2], &s[2], 2u));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance * sqrt(variance[0] * variance[1]), dot(a, b, 3u), dot(s, &s[2], 2u));
    TEST_ASSERT_TRUE((s[0] >= 0.0f) && (s[1] == 0.0f) && (s[3] >= 0.0f));
}

TEST(tria_of_dependent_or_zero_rows_is_deficient_not_nan)
{
    const float rows[3][3] = {{1.0f, 2.0f, 2.0f}, {-2.0f, -4.0f, -4.0f}, {0.0f, 0.0f, 0.0f}};
    float s[4];
    assert_factorises(rows[0], rows[1], s);
    TEST_ASSERT_DOUBLE_WITHIN(8.0 * EPSILON, 0.0, (double)s[3]);
    assert_factorises(rows[0], rows[2], s);
    TEST_ASSERT_TRUE((s[0] == 3.0f) && (s[2] == 0.0f) && (s[3] == 0.0f));
    float zero[3] = {0.0f, 0.0f, 0.0f};
    factor_tria_two(zero, rows[0], 3u, s);
    TEST_ASSERT_TRUE((s[0] == 0.0f) && (s[2] == 0.0f) && isfinite(s[3]));
}

/* --- noise -------------------------------------------------------------------------------------------------------- */

/* A millionth of the variance each time; and less than the diagonal can hold, where nothing else may drift either. */
TEST(tiny_noise_adds_up_or_leaves_the_rest_as_it_is)
{
    const float noises[] = {5.0e-4f, 1.0e-6f};
    const double tolerances[] = {5.0e-3, 1.0e-5};
    for (uint32_t k = 0u; k < 2u; k++) {
        float s[4] = {0.5f, 0.0f, 0.3f, 0.4f};
        for (uint32_t step = 0u; step < 200000u; step++) {
            float rest[1];
            factor_add_noise(s, 2u, 2u, step % 2u, noises[k], rest);
        }
        const double variance = 0.25 + (100000.0 * (double)noises[k] * (double)noises[k]); /* of each */
        TEST_ASSERT_DOUBLE_WITHIN(tolerances[k] * variance, variance, dot(s, s, 2u));
        TEST_ASSERT_DOUBLE_WITHIN(tolerances[k] * variance, variance, dot(&s[2], &s[2], 2u));
        TEST_ASSERT_DOUBLE_WITHIN(tolerances[k] * variance, 0.15, dot(s, &s[2], 2u));
    }
}

TEST(no_noise_on_a_factor_of_zero_leaves_it)
{
    float s[4] = {0.0f, 0.0f, 0.0f, 2.0f};
    factor_add_noise(s, 2u, 2u, 0u, 0.0f, NULL);
    TEST_ASSERT_TRUE((s[0] == 0.0f) && (s[2] == 0.0f) && (s[3] == 2.0f));
}

/* --- conditioning on information ---------------------------------------------------------------------------------- */

/* Information c^T c of `outputs` rows c [outputs x n] of noise 1, and what innovations nu say: c^T nu. */
typedef struct known {
    uint32_t n;
    uint32_t outputs;
    float c[OUTPUTS_MOST * MOST_N];
    float nu[OUTPUTS_MOST];
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
    random_floats(known.c, outputs * n, scale);
    random_floats(known.nu, outputs, 1.0);
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

static void assert_is_factor(const float s[9], const double mean[3])
{
    for (uint32_t i = 0u; i < 3u; i++) {
        TEST_ASSERT_TRUE((s[i * 4u] > 0.0f) && isfinite(s[i * 3u]) && isfinite(s[i * 4u]) && isfinite(mean[i]));
    }
}

/* More than a float can tell from a matrix without rank; and the same precise outputs of three elements again and
 * again: what is left is anything, but a factor. */
TEST(any_information_leaves_a_factor)
{
    for (double scale = 1.0e2; scale < 1.0e16; scale *= 3.0) {
        float s[9];
        double mean[3];
        for (uint32_t repeat = 0u; repeat < 3u * (uint32_t)REPEATS; repeat++) {
            random_factor(s, 3u, 3u);
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

TEST(a_precise_measurement_of_one_element_leaves_its_noise)
{
    float s[4] = {0.5f, 0.0f, 0.25f, 0.75f};
    double mean[2];
    known_t known = {.n = 2u, .information = {0.25e12f, 0.0f, 0.0f, 0.0f}}; /* (s / 1e-6)^2 */
    condition(known, s, 2u, mean);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-12, 1.0e-6, (double)s[0]);
    TEST_ASSERT_TRUE(s[3] == 0.75f); /* the second, given the first, is known as before */
}

/* Information of rank two: of what its rounding leaves of the third pivot, a millionth of the information counts. */
TEST(a_pivot_is_kept_above_the_rounding_of_its_information)
{
    float u[9] = {4.0e12f, 0.0f, 0.0f, NAN, 1.0e12f, 1.0e12f, NAN, NAN, 1.0e12f};
    factor_reverse(u, 3u);
    TEST_ASSERT_EQUAL_FLOAT(1.0e-6f, u[8]);
    TEST_ASSERT_EQUAL_FLOAT(1.0e-3f, u[4]);
    TEST_ASSERT_EQUAL_FLOAT(0.5e-6f, u[0]);
    float near[4] = {1199999.0f, 1.2e6f, NAN, 1.2e6f}; /* the rounding, 1.2, is more than the pivot that is left */
    factor_reverse(near, 2u);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 0.91287f, near[0]);
}

/* What is not a number is no evidence. */
TEST(a_factor_has_nothing_above_its_diagonal_and_nothing_negative_on_it)
{
    const float lower[9] = {1.0f, 0.0f, 0.0f, -2.0f, 0.0f, 0.0f, 3.0f, -4.0f, NAN};
    TEST_ASSERT_TRUE(factor_is_whole(lower, 3u));
    for (uint32_t k = 0u; k < 9u; k++) {
        const uint32_t row = k / 3u;
        const uint32_t column = k % 3u;
        float changed[9];
        (void)memcpy(changed, lower, sizeof changed);
        changed[k] = -1.0f;
        TEST_ASSERT_EQUAL(column < row, factor_is_whole(changed, 3u));
    }
}
