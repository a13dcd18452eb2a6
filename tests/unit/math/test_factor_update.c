/* factor_update() against the textbook Kalman update of full covariances in double: P - P H^T (H P H^T + I)^-1 H P for
 * all rows, carried ones too, and the gain times each innovation. Errors are in units of the prior standard deviations. */
#include "dense.h"
#include "math/factor.h"
#include "unity.h"

#include <string.h>

enum { MOST_N = 5, MOST_CARRIED = 2, MOST_ROWS = MOST_N + MOST_CARRIED, MOST_OUTPUTS = 2, MOST_SETS = 4, REPEATS = 30 };

#define EPSILON ((double)FLT_EPSILON)

/* One update: what goes in, what comes out. */
typedef struct update {
    uint32_t rows;
    uint32_t n;
    uint32_t p;
    uint32_t m;
    float s[MOST_ROWS * MOST_N];
    float c[MOST_OUTPUTS * MOST_N];
    float innovation[MOST_OUTPUTS * MOST_SETS];
    float updated[MOST_ROWS * MOST_N];
    float correction[MOST_ROWS * MOST_SETS];
    double nis;
} update_t;

static random_source_t source;
static update_t update;

void setUp(void)
{
    source.state = 7u;
}

void tearDown(void)
{
}

/* A random factor with diagonal in [scale / 2, scale], carried rows, and outputs of variance about c_scale^2. */
static void draw(uint32_t n, uint32_t carried, uint32_t p, uint32_t m, double c_scale)
{
    update.n = n;
    update.rows = n + carried;
    update.p = p;
    update.m = m;
    random_factor(&source, update.s, update.rows, n);
    random_floats(&source, update.c, p * n, c_scale);
    random_floats(&source, update.innovation, p * m, 3.0 * c_scale);
}

static void run(void)
{
    update_t in = update; /* c and innovation are used up */
    float work[MOST_ROWS + MOST_OUTPUTS];
    (void)memcpy(update.updated, update.s, sizeof update.updated);
    for (uint32_t k = 0u; k < (uint32_t)(MOST_ROWS * MOST_SETS); k++) {
        update.correction[k] = NAN; /* every entry must be written */
    }
    update.nis =
        (double)factor_update(update.updated, in.rows, in.n, in.c, in.p, in.innovation, in.m, update.correction, work);
}

/* --- the textbook: with P = S S^T of all rows and C = H S, P H^T is S C^T ------------------------------------------- */

static matrix_t prior(void)
{
    return matrix_gram(matrix_of(update.s, update.rows, update.n));
}

static matrix_t innovation_covariance(void)
{
    return matrix_sum(matrix_gram(matrix_of(update.c, update.p, update.n)), 1.0, matrix_identity(update.p));
}

static matrix_t gain(void)
{
    const matrix_t cross = matrix_product(
        matrix_of(update.s, update.rows, update.n), matrix_transposed(matrix_of(update.c, update.p, update.n)));
    return matrix_product(cross, matrix_inverse(innovation_covariance()));
}

static matrix_t posterior(void)
{
    return matrix_sum(prior(), -1.0, matrix_congruence(gain(), innovation_covariance()));
}

static void assert_covariance(double tolerance)
{
    const matrix_t found = matrix_gram(matrix_of(update.updated, update.rows, update.n));
    const matrix_t wanted = posterior();
    const matrix_t scale = prior();
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, covariance_difference(&found, &wanted, &scale));
}

static void assert_corrections(double tolerance)
{
    const matrix_t wanted = matrix_product(gain(), matrix_of(update.innovation, update.p, update.m));
    for (uint32_t r = 0u; r < update.rows; r++) {
        for (uint32_t set = 0u; set < update.m; set++) {
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, wanted.at[r][set], (double)update.correction[(r * update.m) + set]);
        }
    }
}

static double textbook_nis(void)
{
    const matrix_t all = matrix_of(update.innovation, update.p, update.m);
    const matrix_t first = matrix_block(&all, 0u, update.p, 0u, 1u);
    return matrix_congruence(matrix_transposed(first), matrix_inverse(innovation_covariance())).at[0][0];
}

/* Runs `check` on random updates of every size. */
static void for_every_size(void (*check)(void))
{
    for (uint32_t n = 1u; n <= MOST_N; n++) {
        for (uint32_t carried = 0u; carried <= MOST_CARRIED; carried++) {
            for (uint32_t p = 1u; p <= MOST_OUTPUTS; p++) {
                for (uint32_t m = 1u; m <= MOST_SETS; m++) {
                    for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
                        draw(n, carried, p, m, 1.0);
                        run();
                        check();
                    }
                }
            }
        }
    }
}

/* --- facts --------------------------------------------------------------------------------------------------------- */

static void check_covariance(void)
{
    assert_covariance(16.0 * EPSILON);
}

static void test_covariance_of_all_rows_is_the_textbook_posterior(void)
{
    for_every_size(check_covariance);
}

static void check_corrections(void)
{
    assert_corrections(64.0 * EPSILON);
}

static void test_every_innovation_set_is_corrected_by_the_textbook_gain(void)
{
    for_every_size(check_corrections);
}

static void check_nis(void)
{
    const double wanted = textbook_nis();
    TEST_ASSERT_DOUBLE_WITHIN(64.0 * EPSILON * (1.0 + wanted), wanted, update.nis);
}

static void test_returns_the_normalised_innovation_squared_of_the_first_set(void)
{
    for_every_size(check_nis);
}

static void check_triangular(void)
{
    TEST_ASSERT_TRUE(factor_is_valid(update.updated, update.n));
}

static void test_factor_stays_triangular_with_positive_diagonal(void)
{
    for_every_size(check_triangular);
}

static void test_an_output_that_sees_nothing_changes_nothing(void)
{
    draw(3u, 2u, 2u, 4u, 0.0);
    random_floats(&source, update.innovation, 8u, 1.0);
    run();
    TEST_ASSERT_EQUAL_MEMORY(update.s, update.updated, 5u * 3u * sizeof(float));
    for (uint32_t k = 0u; k < 20u; k++) {
        TEST_ASSERT_TRUE(update.correction[k] == 0.0f);
    }
}

static void test_measurements_a_million_times_more_precise_than_the_prior_keep_the_diagonal_positive(void)
{
    for (uint32_t n = 1u; n <= MOST_N; n++) {
        for (uint32_t repeat = 0u; repeat < (uint32_t)(10 * REPEATS); repeat++) {
            draw(n, 2u, 2u, 1u, 1.0e6);
            run();
            TEST_ASSERT_TRUE(factor_is_valid(update.updated, n));
        }
    }
}

static void test_measurement_a_million_times_more_precise_than_the_prior_is_accurate(void)
{
    for (uint32_t n = 1u; n <= MOST_N; n++) {
        for (uint32_t repeat = 0u; repeat < (uint32_t)(10 * REPEATS); repeat++) {
            draw(n, 2u, 1u, 1u, 1.0e6);
            run();
            assert_covariance(64.0 * EPSILON);
        }
    }
}

static void test_precise_measurement_of_one_element_leaves_its_noise_as_its_standard_deviation(void)
{
    draw(2u, 0u, 1u, 1u, 0.0);
    update.c[0] = 1.0e6f * update.s[0]; /* theta alone, noise 1e-6 */
    run();
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-12, 1.0e-6, (double)update.updated[0]);
    TEST_ASSERT_TRUE(update.updated[3] == update.s[3]); /* the rest, given theta, is known as before */
}

/* c = H S in float, as a filter would do it. */
static void set_outputs(const float h[MOST_OUTPUTS * 3], uint32_t n)
{
    for (uint32_t i = 0u; i < MOST_OUTPUTS; i++) {
        for (uint32_t j = 0u; j < n; j++) {
            update.c[(i * n) + j] = 0.0f;
            for (uint32_t k = j; k < n; k++) {
                update.c[(i * n) + j] += h[(i * n) + k] * update.s[(k * n) + j];
            }
        }
    }
}

static void test_ten_thousand_precise_updates_with_the_same_outputs_keep_the_factor_valid(void)
{
    const float h[MOST_OUTPUTS * 3] = {1.0e6f, 2.0e5f, -7.0e5f, 3.0e5f, -1.0e6f, 4.0e5f};
    draw(3u, 2u, 2u, 1u, 1.0);
    for (uint32_t k = 0u; k < 10000u; k++) {
        set_outputs(h, 3u);
        run();
        TEST_ASSERT_TRUE(factor_is_valid(update.updated, 3u));
        for (uint32_t r = 0u; r < 15u; r++) {
            update.s[r] = update.updated[r];
        }
    }
}

static void test_scale_of_the_factor_scales_the_result_and_nothing_else(void)
{
    draw(5u, 2u, 2u, 2u, 1.0);
    run();
    const update_t reference = update;
    for (int32_t exponent = -40; exponent <= 40; exponent += 80) {
        for (uint32_t k = 0u; k < 35u; k++) {
            update.s[k] = ldexpf(reference.s[k], exponent);
        }
        run();
        for (uint32_t k = 0u; k < 35u; k++) {
            TEST_ASSERT_TRUE(update.updated[k] == ldexpf(reference.updated[k], exponent));
        }
        for (uint32_t k = 0u; k < 14u; k++) {
            TEST_ASSERT_TRUE(update.correction[k] == ldexpf(reference.correction[k], exponent));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_covariance_of_all_rows_is_the_textbook_posterior);
    RUN_TEST(test_every_innovation_set_is_corrected_by_the_textbook_gain);
    RUN_TEST(test_returns_the_normalised_innovation_squared_of_the_first_set);
    RUN_TEST(test_factor_stays_triangular_with_positive_diagonal);
    RUN_TEST(test_an_output_that_sees_nothing_changes_nothing);
    RUN_TEST(test_measurements_a_million_times_more_precise_than_the_prior_keep_the_diagonal_positive);
    RUN_TEST(test_measurement_a_million_times_more_precise_than_the_prior_is_accurate);
    RUN_TEST(test_precise_measurement_of_one_element_leaves_its_noise_as_its_standard_deviation);
    RUN_TEST(test_ten_thousand_precise_updates_with_the_same_outputs_keep_the_factor_valid);
    RUN_TEST(test_scale_of_the_factor_scales_the_result_and_nothing_else);
    return UNITY_END();
}
