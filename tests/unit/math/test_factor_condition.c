/* factor_condition() against the information form in double, P+ = (P^-1 + H^T H)^-1 and P+ H^T nu, and against Kalman's
 * of the same outputs. Rows that belong to other quantities with those columns are carried along by the map; they follow
 * by regression on the first n. */
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
    float conditioned[MOST_N * MOST_N];
    float map[MOST_N * MOST_N];
    float shift[MOST_N]; /* U^-1 score */
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
    for (uint32_t i = 0u; i < now.n; i++) {
        for (uint32_t j = 0u; j < now.n; j++) {
            in.information[(i * now.n) + j] = (i <= j) ? now.information[(i * now.n) + j] : NAN; /* not to be read */
            now.map[(i * now.n) + j] = NAN;                                                      /* to be written */
        }
    }
    factor_reverse(in.information, now.n);
    factor_condition(now.conditioned, now.map, now.n, in.information, in.score);
    (void)memcpy(now.shift, in.score, sizeof now.shift);
}

/* The factor after, and carried rows as the map makes them. */
static matrix_t after(void)
{
    const matrix_t conditioned = matrix_of(now.conditioned, now.n, now.n);
    matrix_t all = matrix_product(matrix_of(now.s, now.rows, now.n), matrix_of(now.map, now.n, now.n));
    for (uint32_t i = 0u; i < now.n; i++) {
        for (uint32_t j = 0u; j < now.n; j++) {
            all.at[i][j] = conditioned.at[i][j];
        }
    }
    return all;
}

/* Of all rows: those after, times U^-1 score. */
static matrix_t correction(void)
{
    return matrix_product(after(), matrix_of(now.shift, now.n, 1u));
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

/* Rounding of the information counts against 1, the prior's own. */
static double tolerance(void)
{
    return 16.0 * EPSILON * (1.0 + trace_of_information());
}

/* Covariance and correction of all rows, in units of the prior standard deviations. */
static void assert_posterior(matrix_t wanted, matrix_t wanted_correction)
{
    const matrix_t scale = prior();
    const matrix_t found = matrix_gram(after());
    const matrix_t found_correction = correction();
    double size = 1.0;
    for (uint32_t r = 0u; r < now.rows; r++) {
        size += fabs(wanted_correction.at[r][0]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(tolerance(), 0.0, covariance_difference(&found, &wanted, &scale));
    for (uint32_t r = 0u; r < now.rows; r++) {
        TEST_ASSERT_DOUBLE_WITHIN(tolerance() * size, wanted_correction.at[r][0], found_correction.at[r][0]);
    }
    TEST_ASSERT_TRUE(factor_is_valid(now.conditioned, now.n));
}

static void assert_information_form(void)
{
    const matrix_t wanted = matrix_congruence(regression(), posterior_of_first());
    const matrix_t seen = matrix_product(matrix_transposed(outputs()), matrix_of(now.innovation, now.outputs, 1u));
    assert_posterior(wanted, matrix_product(regression(), matrix_product(posterior_of_first(), seen)));
}

/* P - K (H P H^T + I) K^T and K nu; with P = S S^T of all rows and C = H S, P H^T is S C^T. */
static void assert_kalman(void)
{
    const matrix_t c = matrix_of(now.c, now.outputs, now.n);
    const matrix_t innovation_covariance = matrix_sum(matrix_gram(c), 1.0, matrix_identity(now.outputs));
    const matrix_t cross = matrix_product(matrix_of(now.s, now.rows, now.n), matrix_transposed(c));
    const matrix_t gain = matrix_product(cross, matrix_inverse(innovation_covariance));
    assert_posterior(matrix_sum(prior(), -1.0, matrix_congruence(gain, innovation_covariance)),
        matrix_product(gain, matrix_of(now.innovation, now.outputs, 1u)));
}

/* The map by itself: M M^T = (I + C^T C)^-1, M (U^-1 score) = (I + C^T C)^-1 score, and what it makes of the factor
 * before, entry by entry. */
static void assert_map(void)
{
    const matrix_t map = matrix_of(now.map, now.n, now.n);
    const matrix_t c = matrix_of(now.c, now.outputs, now.n);
    const matrix_t one = matrix_identity(now.n);
    const matrix_t wanted = matrix_inverse(matrix_sum(one, 1.0, matrix_gram(matrix_transposed(c))));
    const matrix_t found = matrix_gram(map);
    TEST_ASSERT_DOUBLE_WITHIN(tolerance(), 0.0, covariance_difference(&found, &wanted, &one));
    TEST_ASSERT_TRUE(factor_is_valid(now.map, now.n));

    const matrix_t seen = matrix_product(matrix_transposed(c), matrix_of(now.innovation, now.outputs, 1u));
    const matrix_t wanted_shift = matrix_product(wanted, seen);
    const matrix_t shift = matrix_product(map, matrix_of(now.shift, now.n, 1u));
    const matrix_t mapped = matrix_product(first_factor(), map);
    double size = 1.0;
    for (uint32_t i = 0u; i < now.n; i++) {
        size += fabs(wanted_shift.at[i][0]);
    }
    for (uint32_t i = 0u; i < now.n; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(tolerance() * size, wanted_shift.at[i][0], shift.at[i][0]);
        const double sigma = sqrt(prior().at[i][i]);
        for (uint32_t j = 0u; j < now.n; j++) {
            const double entry = (double)now.conditioned[(i * now.n) + j];
            TEST_ASSERT_DOUBLE_WITHIN(tolerance() * sigma, mapped.at[i][j], entry);
        }
    }
}

static void assert_textbook(void)
{
    assert_information_form();
    assert_map();
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
    TEST_ASSERT_TRUE(factor_is_valid(now.map, now.n));
    for (uint32_t i = 0u; i < now.n; i++) {
        TEST_ASSERT_TRUE(isfinite(now.shift[i]));
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
        draw(n, 0u, 0u, 1.0);
        run();
        TEST_ASSERT_EQUAL_MEMORY(now.s, now.conditioned, n * n * sizeof(float));
        for (uint32_t i = 0u; i < n; i++) {
            TEST_ASSERT_TRUE(now.shift[i] == 0.0f);
            for (uint32_t j = 0u; j < n; j++) {
                TEST_ASSERT_TRUE(now.map[(i * n) + j] == ((i == j) ? 1.0f : 0.0f));
            }
        }
    }
}

static void test_is_the_kalman_update_of_the_textbook(void)
{
    for_every_size(1u, 6u, 1.0, assert_kalman);
    for_every_size(1u, 6u, 10.0, assert_kalman);
}

static void test_precise_measurement_of_one_element_leaves_its_noise_as_its_standard_deviation(void)
{
    draw(2u, 0u, 1u, 0.0);
    now.c[0] = 1.0e6f * now.s[0]; /* the first alone, noise 1e-6 */
    gather();
    run();
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-12, 1.0e-6, (double)now.conditioned[0]);
    TEST_ASSERT_TRUE(now.conditioned[3] == now.s[3]); /* the second, given the first, is known as before */
}

/* c = H S in float, as a filter would do it. */
static void set_outputs(const float *h)
{
    for (uint32_t o = 0u; o < now.outputs; o++) {
        for (uint32_t j = 0u; j < now.n; j++) {
            now.c[(o * now.n) + j] = 0.0f;
            for (uint32_t k = j; k < now.n; k++) {
                now.c[(o * now.n) + j] += h[(o * now.n) + k] * now.s[(k * now.n) + j];
            }
        }
    }
}

static void test_ten_thousand_times_the_same_precise_outputs_keep_the_factor_valid(void)
{
    const float h[6] = {1.0e6f, 2.0e5f, -7.0e5f, 3.0e5f, -1.0e6f, 4.0e5f};
    draw(3u, 0u, 2u, 1.0);
    for (uint32_t k = 0u; k < 10000u; k++) {
        set_outputs(h);
        gather();
        run();
        check_valid();
        (void)memcpy(now.s, now.conditioned, 9u * sizeof(float));
    }
}

static void test_scale_of_the_factor_scales_the_result_and_nothing_else(void)
{
    draw((uint32_t)MOST_N, 0u, 4u, 3.0);
    run();
    const conditioning_t reference = now;
    for (int32_t exponent = -40; exponent <= 40; exponent += 80) {
        for (uint32_t k = 0u; k < (now.n * now.n); k++) {
            now.s[k] = ldexpf(reference.s[k], exponent);
        }
        run();
        for (uint32_t k = 0u; k < (now.n * now.n); k++) {
            TEST_ASSERT_TRUE(now.conditioned[k] == ldexpf(reference.conditioned[k], exponent));
        }
        TEST_ASSERT_EQUAL_MEMORY(reference.map, now.map, now.n * now.n * sizeof(float));
        TEST_ASSERT_EQUAL_MEMORY(reference.shift, now.shift, now.n * sizeof(float));
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
    RUN_TEST(test_is_the_kalman_update_of_the_textbook);
    RUN_TEST(test_precise_measurement_of_one_element_leaves_its_noise_as_its_standard_deviation);
    RUN_TEST(test_ten_thousand_times_the_same_precise_outputs_keep_the_factor_valid);
    RUN_TEST(test_scale_of_the_factor_scales_the_result_and_nothing_else);
    return UNITY_END();
}
