/* What widens the parameters: random walk, forgetting, sudden doubt, and the cap on all of them; and where the uncertainty of
 * the state goes that they no longer explain. On both scales, against sums of covariances in double. */
#include "filter/parameter_filter.h"

#include "kalman.h"
#include "revise.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, ROWS = PARAMETER_FILTER_ROWS, REPEATS = 200 };

#define TOLERANCE 1.0e-6 /* of a covariance, in standard deviations: a dozen roundings */

static const prior_t prior = {.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.5f}};
static const prior_t signed_prior = {.guess = {-465.0f, -13.7f, -2.2f}, .sigma = {180.0f, 6.0f, 0.8f}};

static random_source_t source;
static model_t model; /* with plain arms */
static dual_t dual;
static parameter_filter_t *const filter = &dual.parameters;
static float freed[N * 2 * L]; /* by forgetting, by the walk */

void setUp(void)
{
    source.state = 29u;
    model = plain_model(&model_lever);
    parameter_filter_init(filter, &model, NULL, &prior);
}

void tearDown(void)
{
}

/* On either scale: a random factor with standard deviations well below the cap, and random deviations of the state. */
static void draw(uint32_t repeat)
{
    const bool positive = ((repeat % 2u) == 0u);
    model = plain_model(positive ? &model_lever : &model_linear_black_box);
    parameter_filter_init(filter, &model, NULL, positive ? &prior : &signed_prior);
    random_floats(&source, filter->s, (uint32_t)(ROWS * L), 0.1);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        filter->s[(i * L) + i] = (float)random_between(&source, 0.05, 0.2);
        for (uint32_t j = i + 1u; j < (uint32_t)L; j++) {
            filter->s[(i * L) + j] = 0.0f;
        }
    }
}

/* A revision without anything to learn. */
static void widen(float period, const float *variance)
{
    float x[N] = {0.0f, 0.0f};
    float learnt[L];
    float parts[2][N * L] = {{0.0f}};
    revision_t *revision = &dual.revision;
    revision_take(revision, filter, period, 0.0f);
    revision_condition(revision, filter);
    (void)revision_correct(revision, filter, learnt);
    (void)revision_forget(revision, filter, period, parts[0]);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        revision_walk(revision, filter, i, period, (variance != NULL) ? variance[i] : 0.0f, parts[1]);
    }
    for (uint32_t k = 0u; k < (uint32_t)(N * 2 * L); k++) {
        const uint32_t column = k % (uint32_t)(2 * L);
        const uint32_t row = k / (uint32_t)(2 * L);
        freed[k] = parts[column / (uint32_t)L][(row * (uint32_t)L) + (column % (uint32_t)L)];
    }
    revision_cap(revision, filter);
    revision_draw_mean(revision, filter);
    revision_draw_pairs(revision, filter);
    revision_adopt(revision, filter, &model, NULL, x);
}

static void walk(float period)
{
    widen(period, NULL);
}

static matrix_t covariance_of_all(void)
{
    return matrix_gram(matrix_of(filter->s, (uint32_t)ROWS, (uint32_t)L));
}

/* Covariance of [w; x] with what has been freed: independent of w, in the rows of the state. */
static matrix_t covariance_with_freed(void)
{
    matrix_t covariance = covariance_of_all();
    const matrix_t own = matrix_gram(matrix_of(freed, (uint32_t)N, (uint32_t)(2 * L)));
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        for (uint32_t j = 0u; j < (uint32_t)N; j++) {
            covariance.at[L + i][L + j] += own.at[i][j];
        }
    }
    return covariance;
}

/* Random growth and walk, none of either one time in four. */
static void draw_walk(void)
{
    filter->growth = (random_unit(&source) > 0.25) ? (float)random_between(&source, 0.01, 1.0) : 0.0f;
    const bool walks = random_unit(&source) > 0.25;
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        filter->walk[i] = walks ? (float)random_between(&source, 0.0, 0.02) : 0.0f;
    }
}

/* --- walk and forgetting -------------------------------------------------------------------------------------------- */

/* Of w: P / lambda + q T. Between w and x: as before. Of x, with what was freed: as before. */
static void test_walk_and_forgetting_widen_the_parameters_and_nothing_else(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        draw(repeat);
        draw_walk();
        const double period = random_between(&source, 1.0e-3, 0.5);
        matrix_t wanted = covariance_of_all();
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            for (uint32_t j = 0u; j < (uint32_t)L; j++) {
                wanted.at[i][j] *= 1.0 + ((double)filter->growth * period);
            }
            wanted.at[i][i] += (double)filter->walk[i] * period;
        }
        walk((float)period);
        const matrix_t found = covariance_with_freed();
        TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE, 0.0, covariance_difference(&found, &wanted, &wanted));
        TEST_ASSERT_TRUE(parameter_filter_is_valid(filter));
    }
}

/* T T^T - P_xw (P_ww + Q)^-1 P_wx: what the wider parameters explain less. */
static void test_what_is_freed_is_what_the_parameters_no_longer_explain(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        draw(repeat);
        draw_walk();
        const matrix_t before = covariance_of_all();
        walk(0.1f);
        const matrix_t after = covariance_of_all();
        const matrix_t ww = matrix_block(&after, 0u, (uint32_t)L, 0u, (uint32_t)L);
        const matrix_t xw = matrix_block(&before, (uint32_t)L, (uint32_t)N, 0u, (uint32_t)L);
        const matrix_t xx = matrix_block(&before, (uint32_t)L, (uint32_t)N, (uint32_t)L, (uint32_t)N);
        const matrix_t wanted = matrix_sum(xx, -1.0, matrix_congruence(xw, matrix_inverse(ww)));
        const matrix_t found = matrix_gram(matrix_of(freed, (uint32_t)N, (uint32_t)(2 * L)));
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * TOLERANCE, 0.0, covariance_difference(&found, &wanted, &xx));
    }
}

static void test_forgetting_alone_scales_the_covariance_and_keeps_correlations(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        float before[L];
        float after[L];
        draw(repeat);
        const matrix_t covariance = covariance_of_all();
        parameter_filter_correlation(filter, before);
        filter->growth = 0.5f;
        walk(0.5f);
        parameter_filter_correlation(filter, after);
        const matrix_t grown = covariance_of_all();
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE * covariance.at[i][i], 1.25 * covariance.at[i][i], grown.at[i][i]);
            TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE, (double)before[i], (double)after[i]);
        }
    }
}

static void test_without_either_nothing_changes_and_nothing_is_freed(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        draw(repeat);
        const matrix_t before = covariance_of_all();
        for (uint32_t k = 0u; k < 100u; k++) {
            walk(1.0e-3f);
            for (uint32_t i = 0u; i < (uint32_t)(N * 2 * L); i++) {
                TEST_ASSERT_TRUE(freed[i] == 0.0f);
            }
        }
        const matrix_t after = covariance_of_all();
        TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE, 0.0, covariance_difference(&after, &before, &before));
    }
}

static void test_the_walk_draws_the_points_of_the_next_samples(void)
{
    for (uint32_t repeat = 0u; repeat < 2u; repeat++) {
        model_points_t points;
        draw(repeat);
        filter->walk[0] = 0.01f;
        walk(1.0f);
        parameter_filter_points(filter, &points);
        const double h = sqrt(3.0) * (double)filter->s[0];
        const double guess = (double)filter->prior.guess[0];
        const double wanted = filter->positive ? (guess * exp(h)) : (guess + ((double)filter->prior.sigma[0] * h));
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * fabs(guess), wanted, (double)points.arm[1].coefficient[0]);
    }
}

/* --- sudden doubt ---------------------------------------------------------------------------------------------------- */

static double first_sigma(uint32_t i)
{
    return filter->positive ? (double)filter->prior.sigma[i] : 1.0;
}

static void test_widening_adds_variances(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        draw(repeat);
        matrix_t wanted = covariance_of_all();
        float variance[L];
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double sigma = random_between(&source, 0.0, 0.3) * first_sigma(i);
            variance[i] = (float)(sigma * sigma);
            wanted.at[i][i] += sigma * sigma;
        }
        widen(0.0f, variance);
        const matrix_t found = covariance_of_all();
        for (uint32_t i = 0u; i < (uint32_t)ROWS; i++) {
            for (uint32_t j = 0u; j < (uint32_t)L; j++) {
                const double unit = sqrt(wanted.at[i][i] * wanted.at[j][j]);
                TEST_ASSERT_DOUBLE_WITHIN(TOLERANCE * unit, wanted.at[i][j], found.at[i][j]);
            }
        }
    }
}

static void test_widening_draws_the_points_and_keeps_the_estimate(void)
{
    model_points_t points;
    draw(0u);
    random_floats(&source, filter->w, (uint32_t)L, 0.3);
    const parameter_filter_t before = *filter;
    const float variance[L] = {0.01f, 0.02f, 0.03f};
    widen(0.0f, variance);
    parameter_filter_points(filter, &points);
    const double w = (double)filter->w[0] + (sqrt(3.0) * (double)filter->s[0]);
    const double wanted = (double)prior.guess[0] * exp(w);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * wanted, wanted, (double)points.arm[1].coefficient[0]);
    TEST_ASSERT_EQUAL_MEMORY(before.w, filter->w, sizeof filter->w);
}

/* --- cap -------------------------------------------------------------------------------------------------------------- */

static void assert_capped(void)
{
    const matrix_t covariance = covariance_of_all();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE(sqrt(covariance.at[i][i]) <= first_sigma(i) * 1.000001);
    }
    TEST_ASSERT_TRUE(parameter_filter_is_valid(filter));
}

static void test_standard_deviations_never_outgrow_the_first_guess(void)
{
    for (uint32_t kind = 0u; kind < 6u; kind++) {
        draw(kind);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            filter->walk[i] = ((kind / 2u) == 0u) ? 10.0f : 0.0f;
        }
        filter->growth = ((kind / 2u) == 1u) ? 10.0f : 0.0f;
        for (uint32_t k = 0u; k < 1000u; k++) {
            if ((kind / 2u) == 2u) {
                widen(0.0f, (const float[]){0.1f, 0.1f, 0.1f});
            } else {
                walk(1.0e-3f);
            }
            assert_capped();
        }
        const matrix_t covariance = covariance_of_all();
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, first_sigma(2u), sqrt(covariance.at[2][2])); /* and it has grown */
    }
}

static void test_cap_keeps_correlations(void)
{
    for (uint32_t repeat = 0u; repeat < 2u; repeat++) {
        float before[L];
        float after[L];
        draw(repeat);
        for (uint32_t k = 0u; k < (uint32_t)(L * L); k++) {
            filter->s[k] *= 100.0f;
        }
        parameter_filter_correlation(filter, before);
        walk(0.0f);
        parameter_filter_correlation(filter, after);
        assert_capped();
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, (double)before[i], (double)after[i]);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_walk_and_forgetting_widen_the_parameters_and_nothing_else);
    RUN_TEST(test_what_is_freed_is_what_the_parameters_no_longer_explain);
    RUN_TEST(test_forgetting_alone_scales_the_covariance_and_keeps_correlations);
    RUN_TEST(test_without_either_nothing_changes_and_nothing_is_freed);
    RUN_TEST(test_the_walk_draws_the_points_of_the_next_samples);
    RUN_TEST(test_widening_adds_variances);
    RUN_TEST(test_widening_draws_the_points_and_keeps_the_estimate);
    RUN_TEST(test_standard_deviations_never_outgrow_the_first_guess);
    RUN_TEST(test_cap_keeps_correlations);
    return UNITY_END();
}
