/* The parameter filter by itself: scaling, sigma points, random walk, cap, update and invariant, against closed forms and
 * the textbook Kalman update in double. */
#include "filter/parameter_filter.h"

#include "kalman.h"
#include "unity.h"

#include <string.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, ROWS = PARAMETER_FILTER_ROWS, REPEATS = 200 };

static const float guess[L] = {2.5f, 42.0f, 1500.0f};
static const float sigma[L] = {0.4f, 0.6f, 0.5f};

static random_source_t source;
static parameter_filter_t filter;

void setUp(void)
{
    source.state = 17u;
    parameter_filter_init(&filter, &model_lever, guess, sigma);
}

void tearDown(void)
{
}

/* A random factor with standard deviations below the cap, and random deviations of the state. */
static void draw_factor(void)
{
    random_floats(&source, filter.s, (uint32_t)(ROWS * L), 0.1);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        filter.s[(i * L) + i] = (float)random_between(&source, 0.05, 0.2);
        for (uint32_t j = i + 1u; j < (uint32_t)L; j++) {
            filter.s[(i * L) + j] = 0.0f;
        }
    }
}

static matrix_t covariance_of_all(void)
{
    return matrix_gram(matrix_of(filter.s, (uint32_t)ROWS, (uint32_t)L));
}

/* --- start --------------------------------------------------------------------------------------------------------- */

static void test_starts_at_the_guess_with_its_relative_standard_deviations_uncorrelated(void)
{
    float p[L];
    parameter_filter_physical(&filter, p);
    const matrix_t covariance = covariance_of_all();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_EQUAL_FLOAT(guess[i], p[i]);
        TEST_ASSERT_TRUE(filter.walk[i] == 0.0f);
        for (uint32_t j = 0u; j < (uint32_t)ROWS; j++) {
            const double wanted = (i == j) ? ((double)sigma[i] * (double)sigma[i]) : 0.0;
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, wanted, covariance.at[i][j]);
        }
    }
    TEST_ASSERT_TRUE(parameter_filter_is_valid(&filter));
}

static void test_bounds_of_w_are_those_of_the_model(void)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double least = (double)model_lever.parameter[i].least / (double)guess[i];
        const double greatest = (double)model_lever.parameter[i].greatest / (double)guess[i];
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, log(least), (double)filter.least[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, log(greatest), (double)filter.greatest[i]);
    }
}

static void test_opening_keeps_the_estimate_and_forgets_what_was_learnt(void)
{
    draw_factor();
    filter.w[1] = 0.3f;
    filter.walk[1] = 0.01f;
    parameter_filter_open(&filter);
    parameter_filter_t wanted;
    parameter_filter_init(&wanted, &model_lever, guess, sigma);
    TEST_ASSERT_EQUAL_MEMORY(wanted.s, filter.s, sizeof wanted.s);
    TEST_ASSERT_TRUE(filter.w[1] == 0.3f);
    TEST_ASSERT_TRUE(filter.walk[1] == 0.01f);
}

/* --- scaling and points -------------------------------------------------------------------------------------------- */

static void test_physical_parameters_are_the_guess_times_exp_w(void)
{
    filter.w[0] = -0.7f;
    filter.w[1] = 0.4f;
    filter.w[2] = 1.1f;
    float p[L];
    parameter_filter_physical(&filter, p);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double wanted = (double)guess[i] * exp((double)filter.w[i]);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-7 * wanted, wanted, (double)p[i]);
    }
}

/* Point `index` must be at w + sign h S_j, its state at the mean + sign h T_j. */
static void assert_point(const model_points_t *points, uint32_t index, double sign, uint32_t j)
{
    const double h = sqrt(3.0);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double offset = sign * h * (double)filter.s[(i * L) + j];
        const double wanted = (double)guess[i] * exp((double)filter.w[i] + offset);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * wanted, wanted, (double)points->p[index][i]);
    }
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        const double offset = sign * h * (double)filter.s[((L + i) * L) + j];
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, (double)points->x[0][i] + offset, (double)points->x[index][i]);
    }
}

static void test_points_are_a_pair_for_each_column_with_the_state_moving_along(void)
{
    model_points_t points = {.x = {{0.35f, -0.2f}}};
    draw_factor();
    random_floats(&source, filter.w, (uint32_t)L, 0.5);
    parameter_filter_points(&filter, &points);
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        assert_point(&points, 1u + (2u * j), 1.0, j);
        assert_point(&points, 2u + (2u * j), -1.0, j);
    }
    float mean[L];
    parameter_filter_physical(&filter, mean);
    TEST_ASSERT_EQUAL_MEMORY(mean, points.p[0], sizeof mean);
}

/* --- prediction ---------------------------------------------------------------------------------------------------- */

/* Increments linear in what the points were moved by must come back as exactly that map of the columns. */
static void test_prediction_moves_the_state_deviations_by_the_model(void)
{
    const double per_w[N][L] = {{1.0e-3, 2.0e-3, -3.0e-3}, {0.1, -0.2, 0.3}};
    float increment[MODEL_POINTS][MODEL_STATES] = {{0.0f}};
    draw_factor();
    const parameter_filter_t before = filter;
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            double change = 0.0;
            for (uint32_t k = 0u; k < (uint32_t)L; k++) {
                change += per_w[i][k] * sqrt(3.0) * (double)filter.s[(k * L) + j];
            }
            increment[1u + (2u * j)][i] = (float)(5.0 + change);
            increment[2u + (2u * j)][i] = (float)(5.0 - change);
        }
    }
    parameter_filter_predict(&filter, increment, 1.0e-3f); /* no walk has been set */
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            double wanted = (double)before.s[((L + i) * L) + j];
            for (uint32_t k = 0u; k < (uint32_t)L; k++) {
                wanted += per_w[i][k] * (double)before.s[(k * L) + j];
            }
            TEST_ASSERT_DOUBLE_WITHIN(5.0e-7, wanted, (double)filter.s[((L + i) * L) + j]);
        }
    }
}

static void test_walk_adds_its_variance_and_keeps_the_covariance_with_the_state(void)
{
    draw_factor();
    matrix_t wanted = covariance_of_all();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        filter.walk[i] = 0.01f * (float)(i + 1u);
        wanted.at[i][i] += 0.5 * (double)filter.walk[i];
    }
    parameter_filter_walk(&filter, 0.5f);
    const matrix_t found = covariance_of_all();
    for (uint32_t i = 0u; i < (uint32_t)ROWS; i++) {
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, wanted.at[i][j], found.at[i][j]);
        }
    }
}

static void test_standard_deviations_never_outgrow_the_first_guess(void)
{
    draw_factor();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        filter.walk[i] = 10.0f;
    }
    for (uint32_t k = 0u; k < 1000u; k++) {
        parameter_filter_walk(&filter, 1.0e-3f);
        const matrix_t covariance = covariance_of_all();
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            TEST_ASSERT_TRUE(sqrt(covariance.at[i][i]) <= (double)sigma[i] * 1.000001);
        }
        TEST_ASSERT_TRUE(parameter_filter_is_valid(&filter));
    }
    const matrix_t covariance = covariance_of_all();
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, (double)sigma[2], sqrt(covariance.at[2][2]));
}

static void test_cap_keeps_correlations(void)
{
    draw_factor();
    for (uint32_t k = 0u; k < (uint32_t)(L * L); k++) {
        filter.s[k] *= 100.0f;
    }
    const matrix_t before = covariance_of_all();
    parameter_filter_walk(&filter, 0.0f);
    const matrix_t after = covariance_of_all();
    for (uint32_t i = 1u; i < (uint32_t)L; i++) {
        for (uint32_t j = 0u; j < i; j++) {
            const double wanted = before.at[i][j] / sqrt(before.at[i][i] * before.at[j][j]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, wanted, after.at[i][j] / sqrt(after.at[i][i] * after.at[j][j]));
        }
    }
}

/* --- update -------------------------------------------------------------------------------------------------------- */

/* The same update of [w; x] in the textbook: outputs that see w through `output`, with a full noise covariance. */
static void assert_update_is_the_textbook_one(void)
{
    float output[2 * L];
    const float noise[4] = {0.05f, 0.0f, 0.03f, 0.08f};
    float innovation[2];
    float correction[ROWS];
    draw_factor();
    random_floats(&source, output, (uint32_t)(2 * L), 0.1);
    random_floats(&source, innovation, 2u, 0.2);
    random_floats(&source, filter.w, (uint32_t)L, 0.5);
    const matrix_t s = matrix_of(filter.s, (uint32_t)ROWS, (uint32_t)L);
    const matrix_t c = matrix_of(output, 2u, (uint32_t)L);
    const matrix_t y = matrix_of(innovation, 2u, 1u);
    const matrix_t covariance = matrix_sum(matrix_gram(c), 1.0, matrix_gram(matrix_of(noise, 2u, 2u)));
    const matrix_t gain = matrix_product(matrix_product(s, matrix_transposed(c)), matrix_inverse(covariance));
    const matrix_t change = matrix_product(gain, y);
    const matrix_t posterior = matrix_sum(matrix_gram(s), -1.0, matrix_congruence(gain, covariance));
    const double nis = matrix_congruence(matrix_transposed(y), matrix_inverse(covariance)).at[0][0];
    const parameter_filter_t before = filter;

    const double found_nis = (double)parameter_filter_update(&filter, output, innovation, noise, correction);
    const matrix_t found = covariance_of_all();
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 * (1.0 + nis), nis, found_nis);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, 0.0, covariance_difference(&found, &posterior, &posterior));
    for (uint32_t r = 0u; r < (uint32_t)ROWS; r++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, change.at[r][0], (double)correction[r]);
    }
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, (double)before.w[i] + change.at[i][0], (double)filter.w[i]);
    }
}

static void test_update_is_the_textbook_one(void)
{
    for (uint32_t repeat = 0u; repeat < REPEATS; repeat++) {
        assert_update_is_the_textbook_one();
    }
}

/* --- bounds and invariant ------------------------------------------------------------------------------------------ */

static void test_estimate_is_held_at_its_bounds_and_said_to_rest_there(void)
{
    TEST_ASSERT_FALSE(parameter_filter_bound(&filter));
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        setUp();
        filter.w[i] = filter.least[i] - 0.01f;
        TEST_ASSERT_TRUE(parameter_filter_bound(&filter));
        TEST_ASSERT_TRUE(filter.w[i] == filter.least[i]);
        filter.w[i] = filter.greatest[i] + 0.01f;
        TEST_ASSERT_TRUE(parameter_filter_bound(&filter));
        TEST_ASSERT_TRUE(filter.w[i] == filter.greatest[i]);
        TEST_ASSERT_TRUE(parameter_filter_is_valid(&filter));
    }
}

/* Sets one float of the filter to `value` and expects it to be refused. */
static void assert_refused(float *entry, float value)
{
    setUp();
    *entry = value;
    TEST_ASSERT_FALSE(parameter_filter_is_valid(&filter));
}

static void test_valid_means_within_bounds_finite_and_a_valid_factor(void)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        assert_refused(&filter.w[i], NAN);
        assert_refused(&filter.w[i], 10.0f);
        assert_refused(&filter.w[i], -10.0f);
        assert_refused(&filter.walk[i], NAN);
        assert_refused(&filter.walk[i], -1.0e-9f);
        assert_refused(&filter.walk[i], INFINITY);
        assert_refused(&filter.s[(i * L) + i], 0.0f);
    }
    for (uint32_t k = 0u; k < (uint32_t)(ROWS * L); k++) {
        assert_refused(&filter.s[k], NAN);
        assert_refused(&filter.s[k], INFINITY);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_starts_at_the_guess_with_its_relative_standard_deviations_uncorrelated);
    RUN_TEST(test_bounds_of_w_are_those_of_the_model);
    RUN_TEST(test_opening_keeps_the_estimate_and_forgets_what_was_learnt);
    RUN_TEST(test_physical_parameters_are_the_guess_times_exp_w);
    RUN_TEST(test_points_are_a_pair_for_each_column_with_the_state_moving_along);
    RUN_TEST(test_prediction_moves_the_state_deviations_by_the_model);
    RUN_TEST(test_walk_adds_its_variance_and_keeps_the_covariance_with_the_state);
    RUN_TEST(test_standard_deviations_never_outgrow_the_first_guess);
    RUN_TEST(test_cap_keeps_correlations);
    RUN_TEST(test_update_is_the_textbook_one);
    RUN_TEST(test_estimate_is_held_at_its_bounds_and_said_to_rest_there);
    RUN_TEST(test_valid_means_within_bounds_finite_and_a_valid_factor);
    return UNITY_END();
}
