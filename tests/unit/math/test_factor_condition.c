/* factor_condition() against the information form in double, P+ = (P^-1 + H^T H)^-1 and P+ H^T nu, with carried rows by
 * regression on the first n; and against factor_update() with the same outputs one after the other. */
#include "dense.h"
#include "math/factor.h"
#include "unity.h"

#include <string.h>

enum { MOST_N = 5, MOST_CARRIED = 2, MOST_ROWS = MOST_N + MOST_CARRIED, MOST_OUTPUTS = DENSE_MOST, REPEATS = 30 };

#define EPSILON ((double)FLT_EPSILON)

/* A factor, outputs of it with noise covariance I, and what comes of both. */
typedef struct conditioning {
    uint32_t rows;
    uint32_t n;
    uint32_t outputs;
    float s[MOST_ROWS * MOST_N];
    float c[MOST_OUTPUTS * MOST_N]; /* C = H S */
    float innovation[MOST_OUTPUTS];
    float information[MOST_N * MOST_N];
    float score[MOST_N];
    float conditioned[MOST_ROWS * MOST_N];
    float correction[MOST_ROWS];
} conditioning_t;

static random_source_t source;
static conditioning_t now;

void setUp(void)
{
    source.state = 23u;
}

void tearDown(void)
{
}

/* --- one conditioning --------------------------------------------------------------------------------------------- */

/* C^T C and C^T nu, as a filter gathers them. */
static void gather(void)
{
    (void)memset(now.information, 0, sizeof now.information);
    (void)memset(now.score, 0, sizeof now.score);
    for (uint32_t o = 0u; o < now.outputs; o++) {
        const float *row = &now.c[o * now.n];
        for (uint32_t i = 0u; i < now.n; i++) {
            now.score[i] += row[i] * now.innovation[o];
            for (uint32_t j = 0u; j < now.n; j++) {
                now.information[(i * now.n) + j] += row[i] * row[j];
            }
        }
    }
}

static void draw(uint32_t n, uint32_t carried, uint32_t outputs, double c_scale)
{
    now.n = n;
    now.rows = n + carried;
    now.outputs = outputs;
    random_factor(&source, now.s, now.rows, n);
    random_floats(&source, now.c, outputs * n, c_scale);
    random_floats(&source, now.innovation, outputs, 3.0 * (1.0 + c_scale));
    gather();
}

static void run(void)
{
    conditioning_t in = now; /* information and score are used up */
    (void)memcpy(now.conditioned, now.s, sizeof now.conditioned);
    for (uint32_t r = 0u; r < (uint32_t)MOST_ROWS; r++) {
        now.correction[r] = NAN; /* every entry must be written */
    }
    factor_condition(now.conditioned, now.rows, now.n, in.information, in.score, now.correction);
}

/* --- the textbook ------------------------------------------------------------------------------------------------- */

static matrix_t prior(void)
{
    return matrix_gram(matrix_of(now.s, now.rows, now.n));
}

static matrix_t first_factor(void)
{
    const matrix_t all = matrix_of(now.s, now.rows, now.n);
    return matrix_block(&all, 0u, now.n, 0u, now.n);
}

/* H = C S^-1, of the first n elements. */
static matrix_t outputs(void)
{
    return matrix_product(matrix_of(now.c, now.outputs, now.n), matrix_inverse(first_factor()));
}

/* How all rows follow from the first n: [I; T S^-1]. */
static matrix_t regression(void)
{
    return matrix_product(matrix_of(now.s, now.rows, now.n), matrix_inverse(first_factor()));
}

static matrix_t posterior_of_first(void)
{
    const matrix_t information = matrix_inverse(matrix_gram(first_factor()));
    return matrix_inverse(matrix_sum(information, 1.0, matrix_gram(matrix_transposed(outputs()))));
}

/* Greatest trace of what a float adds up without losing all it has: errors grow with it. */
static double trace_of_information(void)
{
    double trace = 0.0;
    for (uint32_t i = 0u; i < now.n; i++) {
        trace += (double)now.information[(i * now.n) + i];
    }
    return trace;
}

/* Covariance and correction of all rows, in units of the prior standard deviations; rounding of the information counts
 * against 1, the prior's own. */
static void assert_textbook(void)
{
    const double tolerance = 16.0 * EPSILON * (1.0 + trace_of_information());
    const matrix_t scale = prior();
    const matrix_t found = matrix_gram(matrix_of(now.conditioned, now.rows, now.n));
    const matrix_t wanted = matrix_congruence(regression(), posterior_of_first());
    const matrix_t seen = matrix_product(matrix_transposed(outputs()), matrix_of(now.innovation, now.outputs, 1u));
    const matrix_t correction = matrix_product(regression(), matrix_product(posterior_of_first(), seen));
    double size = 1.0;
    for (uint32_t r = 0u; r < now.rows; r++) {
        size += fabs(correction.at[r][0]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, covariance_difference(&found, &wanted, &scale));
    for (uint32_t r = 0u; r < now.rows; r++) {
        TEST_ASSERT_DOUBLE_WITHIN(tolerance * size, correction.at[r][0], (double)now.correction[r]);
    }
    TEST_ASSERT_TRUE(factor_is_valid(now.conditioned, now.n));
}

/* Runs `check` for every size, with as many outputs as given, and with information up to about c_scale^2. */
static void for_every_size(uint32_t least_outputs, uint32_t most_outputs, double c_scale, void (*check)(void))
{
    for (uint32_t n = 1u; n <= (uint32_t)MOST_N; n++) {
        for (uint32_t carried = 0u; carried <= (uint32_t)MOST_CARRIED; carried++) {
            for (uint32_t count = least_outputs; count <= most_outputs; count++) {
                for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
                    draw(n, carried, count, c_scale);
                    run();
                    check();
                }
            }
        }
    }
}

/* --- facts -------------------------------------------------------------------------------------------------------- */

static void test_is_the_information_form_of_the_textbook(void)
{
    for_every_size(1u, (uint32_t)MOST_OUTPUTS, 1.0, assert_textbook);
}

static void test_also_when_there_are_fewer_outputs_than_elements(void)
{
    for_every_size(1u, 2u, 30.0, assert_textbook);
}

static void test_also_when_there_is_much_or_hardly_any_information(void)
{
    for_every_size(1u, 4u, 100.0, assert_textbook);
    for_every_size(1u, 4u, 1.0e-3, assert_textbook);
    for_every_size(1u, 4u, 1.0e-18, assert_textbook);
}

static void check_valid(void)
{
    TEST_ASSERT_TRUE(factor_is_valid(now.conditioned, now.n));
    for (uint32_t r = 0u; r < now.rows; r++) {
        TEST_ASSERT_TRUE(isfinite(now.correction[r]));
    }
}

/* More than a float can tell from a matrix without rank: what is left then is anything, but a factor. */
static void test_any_information_leaves_a_valid_factor(void)
{
    for (double c_scale = 1.0e3; c_scale < 1.0e16; c_scale *= 10.0) {
        for_every_size(1u, 6u, c_scale, check_valid);
    }
}

static void test_no_information_changes_nothing_to_the_bit(void)
{
    for (uint32_t n = 1u; n <= (uint32_t)MOST_N; n++) {
        draw(n, (uint32_t)MOST_CARRIED, 0u, 1.0);
        run();
        TEST_ASSERT_EQUAL_MEMORY(now.s, now.conditioned, now.rows * n * sizeof(float));
        for (uint32_t r = 0u; r < now.rows; r++) {
            TEST_ASSERT_TRUE(now.correction[r] == 0.0f);
        }
    }
}

/* The same outputs one by one, each corrected for what the earlier ones have taught. */
static void check_against_updates(void)
{
    float s[MOST_ROWS * MOST_N];
    float correction[MOST_ROWS];
    float sum[MOST_ROWS] = {0.0f};
    const matrix_t h = outputs();
    (void)memcpy(s, now.s, sizeof s);
    for (uint32_t o = 0u; o < now.outputs; o++) {
        float c[MOST_N] = {0.0f};
        double innovation = (double)now.innovation[o];
        float work[MOST_ROWS + 1];
        for (uint32_t k = 0u; k < now.n; k++) {
            innovation -= h.at[o][k] * (double)sum[k];
            for (uint32_t j = 0u; j < now.n; j++) {
                c[j] += (float)h.at[o][k] * s[(k * now.n) + j];
            }
        }
        float left = (float)innovation;
        (void)factor_update(s, now.rows, now.n, c, 1u, &left, 1u, correction, work);
        for (uint32_t r = 0u; r < now.rows; r++) {
            sum[r] += correction[r];
        }
    }
    const double tolerance = 64.0 * EPSILON * (1.0 + trace_of_information());
    const matrix_t scale = prior();
    const matrix_t found = matrix_gram(matrix_of(now.conditioned, now.rows, now.n));
    const matrix_t wanted = matrix_gram(matrix_of(s, now.rows, now.n));
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, covariance_difference(&found, &wanted, &scale));
    for (uint32_t r = 0u; r < now.rows; r++) {
        TEST_ASSERT_DOUBLE_WITHIN(tolerance * (1.0 + fabs((double)sum[r])), (double)sum[r], (double)now.correction[r]);
    }
}

static void test_is_what_updates_with_the_same_outputs_come_to(void)
{
    for_every_size(1u, 6u, 1.0, check_against_updates);
    for_every_size(1u, 6u, 10.0, check_against_updates);
}

static void test_scale_of_the_factor_scales_the_result_and_nothing_else(void)
{
    draw((uint32_t)MOST_N, (uint32_t)MOST_CARRIED, 4u, 3.0);
    run();
    const conditioning_t reference = now;
    for (int32_t exponent = -40; exponent <= 40; exponent += 80) {
        for (uint32_t k = 0u; k < (now.rows * now.n); k++) {
            now.s[k] = ldexpf(reference.s[k], exponent);
        }
        run();
        for (uint32_t k = 0u; k < (now.rows * now.n); k++) {
            TEST_ASSERT_TRUE(now.conditioned[k] == ldexpf(reference.conditioned[k], exponent));
        }
        for (uint32_t r = 0u; r < now.rows; r++) {
            TEST_ASSERT_TRUE(now.correction[r] == ldexpf(reference.correction[r], exponent));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_is_the_information_form_of_the_textbook);
    RUN_TEST(test_also_when_there_are_fewer_outputs_than_elements);
    RUN_TEST(test_also_when_there_is_much_or_hardly_any_information);
    RUN_TEST(test_any_information_leaves_a_valid_factor);
    RUN_TEST(test_no_information_changes_nothing_to_the_bit);
    RUN_TEST(test_is_what_updates_with_the_same_outputs_come_to);
    RUN_TEST(test_scale_of_the_factor_scales_the_result_and_nothing_else);
    return UNITY_END();
}
