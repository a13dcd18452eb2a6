/* The parameter filter by itself, on both scales: sigma points, what is known, learning and invariant, against closed forms
 * and the textbook Kalman update in double. */
#include "filter/parameter_filter.h"

#include "kalman.h"
#include "revise.h"
#include "unity.h"

#include <string.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, ROWS = PARAMETER_FILTER_ROWS, REPEATS = 200 };

static const prior_t prior = {.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.5f}};
static const prior_t signed_prior = {.guess = {-465.0f, 13.7f, -2.2f}, .sigma = {180.0f, 6.0f, 0.8f}};

static random_source_t source;
static model_t model; /* with plain arms */
static dual_t dual;
static parameter_filter_t *const filter = &dual.parameters;

void setUp(void)
{
    source.state = 17u;
    dual.state.x[0] = 0.0f;
    dual.state.x[1] = 0.0f;
    model = plain_model(&model_lever);
    parameter_filter_init(filter, &model, NULL, &prior);
}

void tearDown(void)
{
}

/* A random factor with standard deviations below the cap, and random deviations of the state. */
static void draw_factor(void)
{
    random_floats(&source, filter->s, (uint32_t)(ROWS * L), 0.1);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        filter->s[(i * L) + i] = (float)random_between(&source, 0.05, 0.2);
        for (uint32_t j = i + 1u; j < (uint32_t)L; j++) {
            filter->s[(i * L) + j] = 0.0f;
        }
    }
}

/* The correction of [w; x] is left in `correction`. Without a walk set, the parameters only learn. */
static bool learn(float period, float caution, float correction[ROWS], float learnt[L])
{
    const float before[N] = {dual.state.x[0], dual.state.x[1]};
    const bool bounded = revise_prepare(&dual, period, caution, NULL, false, learnt);
    revision_correction(&dual.revision, filter, correction);
    revision_adopt(&dual.revision, filter, &model, NULL, dual.state.x);
    revision_carry_score(&dual.revision, filter);
    revision_carry_information(&dual.revision, filter);
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        correction[L + i] = dual.state.x[i] - before[i];
    }
    return bounded;
}

static matrix_t covariance_of_all(void)
{
    return matrix_gram(matrix_of(filter->s, (uint32_t)ROWS, (uint32_t)L));
}

/* --- start --------------------------------------------------------------------------------------------------------- */

static void test_starts_at_the_guess_with_its_relative_standard_deviations_uncorrelated(void)
{
    const matrix_t covariance = covariance_of_all();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_EQUAL_FLOAT(prior.guess[i], filter->p[i]);
        TEST_ASSERT_TRUE(filter->walk[i] == 0.0f);
        for (uint32_t j = 0u; j < (uint32_t)ROWS; j++) {
            const double wanted = (i == j) ? ((double)prior.sigma[i] * (double)prior.sigma[i]) : 0.0;
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, wanted, covariance.at[i][j]);
        }
    }
    TEST_ASSERT_TRUE(parameter_filter_is_valid(filter));
}

static void test_bounds_of_w_are_those_of_the_model(void)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double least = (double)model_lever.parameter[i].least / (double)prior.guess[i];
        const double greatest = (double)model_lever.parameter[i].greatest / (double)prior.guess[i];
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, log(least), (double)filter->least[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, log(greatest), (double)filter->greatest[i]);
    }
}

static void start_signed(void)
{
    model = plain_model(&model_linear_black_box);
    parameter_filter_init(filter, &model, NULL, &signed_prior);
}

static void test_signed_parameters_start_at_the_guess_one_sigma_being_one(void)
{
    float sigma[L];
    start_signed();
    parameter_filter_sigma(filter, sigma);
    const matrix_t covariance = covariance_of_all();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_EQUAL_FLOAT(signed_prior.guess[i], filter->p[i]);
        TEST_ASSERT_EQUAL_FLOAT(signed_prior.sigma[i], sigma[i]);
        TEST_ASSERT_TRUE(filter->w[i] == 0.0f);
        for (uint32_t j = 0u; j < (uint32_t)ROWS; j++) {
            TEST_ASSERT_TRUE(covariance.at[i][j] == ((i == j) ? 1.0 : 0.0));
        }
    }
    TEST_ASSERT_TRUE(parameter_filter_is_valid(filter));
}

static void test_bounds_of_signed_parameters_are_those_of_the_model_in_sigmas(void)
{
    start_signed();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const model_parameter_t *parameter = &model_linear_black_box.parameter[i];
        const double least = ((double)parameter->least - (double)signed_prior.guess[i]) / (double)signed_prior.sigma[i];
        const double greatest =
            ((double)parameter->greatest - (double)signed_prior.guess[i]) / (double)signed_prior.sigma[i];
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * fabs(least), least, (double)filter->least[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * fabs(greatest), greatest, (double)filter->greatest[i]);
    }
}

static void test_opening_keeps_the_estimate_and_forgets_what_was_learnt(void)
{
    draw_factor();
    filter->w[1] = 0.3f;
    filter->walk[1] = 0.01f;
    parameter_filter_open(filter, &model, NULL);
    parameter_filter_t wanted;
    parameter_filter_init(&wanted, &model, NULL, &prior);
    TEST_ASSERT_EQUAL_MEMORY(wanted.s, filter->s, sizeof wanted.s);
    TEST_ASSERT_TRUE(filter->w[1] == 0.3f);
    TEST_ASSERT_TRUE(filter->walk[1] == 0.01f);
}

/* --- scaling and points -------------------------------------------------------------------------------------------- */

static void test_physical_parameters_are_the_guess_times_exp_w(void)
{
    filter->w[0] = -0.7f;
    filter->w[1] = 0.4f;
    filter->w[2] = 1.1f;
    float p[L];
    parameter_filter_at(filter, filter->w, p);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double wanted = (double)prior.guess[i] * exp((double)filter->w[i]);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-7 * wanted, wanted, (double)p[i]);
    }
}

static void test_signed_parameters_are_the_guess_plus_w_sigmas(void)
{
    start_signed();
    filter->w[0] = -0.7f;
    filter->w[1] = -2.5f; /* crosses zero */
    filter->w[2] = 1.1f;
    float p[L];
    parameter_filter_at(filter, filter->w, p);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double step = (double)signed_prior.sigma[i] * (double)filter->w[i];
        const double size = fabs((double)signed_prior.guess[i]) + fabs(step);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-7 * size, (double)signed_prior.guess[i] + step, (double)p[i]);
    }
    TEST_ASSERT_TRUE(p[1] < 0.0f);
}

/* d p / d w sqrt(P_ii), and P_ij / sqrt(P_ii P_jj), in double. */
static void assert_sigma_and_correlation(const double slope[L])
{
    const uint32_t pairs[3][2] = {{0u, 1u}, {0u, 2u}, {1u, 2u}};
    float sigma[L];
    float correlation[L];
    parameter_filter_sigma(filter, sigma);
    parameter_filter_correlation(filter, correlation);
    const matrix_t p = covariance_of_all();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double wanted = slope[i] * sqrt(p.at[i][i]);
        const uint32_t a = pairs[i][0];
        const uint32_t b = pairs[i][1];
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * wanted, wanted, (double)sigma[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, p.at[a][b] / sqrt(p.at[a][a] * p.at[b][b]), (double)correlation[i]);
    }
}

static void test_sigma_and_correlation_are_those_of_the_covariance(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        double slope[L];
        setUp();
        source.state += repeat;
        draw_factor();
        random_floats(&source, filter->w, (uint32_t)L, 0.5);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            slope[i] = (double)prior.guess[i] * exp((double)filter->w[i]);
        }
        parameter_filter_at(filter, filter->w, filter->p);
        assert_sigma_and_correlation(slope);
        start_signed();
        draw_factor();
        random_floats(&source, filter->w, (uint32_t)L, 5.0);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            slope[i] = (double)signed_prior.sigma[i];
        }
        assert_sigma_and_correlation(slope);
    }
}

/* Point `index` must be at w + sign h S_j, its state at the mean + sign h T_j. */
static void assert_point(const model_points_t *points, uint32_t index, double sign, uint32_t j)
{
    const double h = sqrt(3.0);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double w = (double)filter->w[i] + (sign * h * (double)filter->s[(i * L) + j]);
        const double guess = (double)filter->prior.guess[i];
        const double wanted = filter->positive ? (guess * exp(w)) : (guess + ((double)filter->prior.sigma[i] * w));
        TEST_ASSERT_DOUBLE_WITHIN(
            1.0e-6 * (fabs(guess) + fabs(wanted)), wanted, (double)points->arm[index].coefficient[i]);
    }
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        const double offset = h * (double)filter->s[((L + i) * L) + j];
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, offset, (double)points->offset[j][i]);
    }
}

static void assert_points(void)
{
    model_points_t points;
    float correction[ROWS];
    float learnt[L];
    draw_factor();
    random_floats(&source, filter->w, (uint32_t)L, 0.5);
    (void)learn(0.0f, 0.0f, correction, learnt); /* draws the points */
    parameter_filter_points(filter, &points);
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        assert_point(&points, 1u + (2u * j), 1.0, j);
        assert_point(&points, 2u + (2u * j), -1.0, j);
    }
    float mean[L];
    parameter_filter_at(filter, filter->w, mean);
    TEST_ASSERT_EQUAL_MEMORY(mean, points.arm[0].coefficient, sizeof mean);
    TEST_ASSERT_EQUAL_MEMORY(mean, filter->p, sizeof mean);
}

static void test_points_are_a_pair_for_each_column_with_the_state_moving_along(void)
{
    assert_points();
    start_signed();
    assert_points();
}

/* --- prediction ---------------------------------------------------------------------------------------------------- */

/* A change of theta_dot that is linear in w must come back as exactly that map of the columns; theta moves along. */
static void test_prediction_moves_the_state_deviations_by_the_model(void)
{
    const double per_w[L] = {0.1, -0.2, 0.3};
    const double period = 0.01;
    model_response_t response = {.mean = 5.0f};
    draw_factor();
    const parameter_filter_t before = *filter;
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        double change = 0.0;
        for (uint32_t k = 0u; k < (uint32_t)L; k++) {
            change += per_w[k] * sqrt(3.0) * (double)filter->s[(k * L) + j];
        }
        response.difference[j] = (float)(2.0 * change);
    }
    parameter_filter_predict(filter, &response, (float)period);
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        const double theta_dot = (double)before.s[((L + 1) * L) + j];
        double change = 0.0;
        for (uint32_t k = 0u; k < (uint32_t)L; k++) {
            change += per_w[k] * (double)before.s[(k * L) + j];
        }
        const double theta = (double)before.s[(L * L) + j] + (period * (theta_dot + (0.5 * change)));
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-7, theta, (double)filter->s[(L * L) + j]);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-7, theta_dot + change, (double)filter->s[((L + 1) * L) + j]);
    }
}

/* --- learning ------------------------------------------------------------------------------------------------------ */

/* [w; x] in the textbook, where the outputs C of the columns are C S^-1 of w; and everything there is to compare. */
typedef struct textbook {
    kalman_t w;
    matrix_t inverse; /* S_w^-1 */
    matrix_t states;  /* T S_w^-1: how x follows w */
} textbook_t;

static textbook_t textbook_of_filter(void)
{
    const matrix_t all = matrix_of(filter->s, (uint32_t)ROWS, (uint32_t)L);
    const matrix_t s = matrix_block(&all, 0u, (uint32_t)L, 0u, (uint32_t)L);
    const matrix_t t = matrix_block(&all, (uint32_t)L, (uint32_t)N, 0u, (uint32_t)L);
    textbook_t textbook = {.w = {.x = matrix_of(filter->w, (uint32_t)L, 1u), .p = matrix_gram(s)}};
    textbook.inverse = matrix_inverse(s);
    textbook.states = matrix_product(t, textbook.inverse);
    return textbook;
}

/* Makes outputs independent and of variance 1, by the factor of their covariance; the filter gathers that. */
static void whiten_and_gather(matrix_t output, matrix_t innovation, matrix_t factor)
{
    const matrix_t inverse = matrix_inverse(factor);
    const matrix_t white = matrix_product(inverse, output);
    whitened_t whitened = {.scale = {1.0f, 1.0f}};
    for (uint32_t i = 0u; i < 2u; i++) {
        whitened.innovation[i] = (float)matrix_product(inverse, innovation).at[i][0];
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            whitened.output[i][j] = (float)white.at[i][j];
        }
    }
    parameter_filter_gather(filter, &whitened);
}

/* A sample with a random output and innovation, of which the filter knows the state's part of the noise; the textbook learns
 * from it at once. The innovation is that from the w the block began with, `start`. */
static void gather(textbook_t *textbook, matrix_t start)
{
    const float noise[4] = {0.05f, 0.0f, (float)random_between(&source, -0.05, 0.05), 0.08f};
    float output[2 * L];
    float innovation[2];
    random_floats(&source, output, (uint32_t)(2 * L), 0.1);
    random_floats(&source, innovation, 2u, 0.2);
    const matrix_t r = matrix_gram(matrix_of(noise, 2u, 2u));
    const matrix_t c = matrix_of(output, 2u, (uint32_t)L);
    const matrix_t y = matrix_of(innovation, 2u, 1u);
    const matrix_t h = matrix_product(c, textbook->inverse);
    whiten_and_gather(c, y, matrix_of(noise, 2u, 2u));
    (void)kalman_update(&textbook->w, h, r, matrix_sum(y, 1.0, matrix_product(h, start)));
}

static void assert_learns_as_the_textbook(uint32_t samples)
{
    draw_factor();
    random_floats(&source, filter->w, (uint32_t)L, 0.5);
    textbook_t textbook = textbook_of_filter();
    const matrix_t start = textbook.w.x;
    for (uint32_t k = 0u; k < samples; k++) {
        gather(&textbook, start);
    }
    float correction[ROWS];
    float learnt[L];
    TEST_ASSERT_FALSE(learn(1.0e-2f, 0.0f, correction, learnt));

    matrix_t everything = matrix_zero((uint32_t)ROWS, (uint32_t)L); /* [w; x] from w */
    for (uint32_t i = 0u; i < (uint32_t)ROWS; i++) {
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            everything.at[i][j] = (i >= (uint32_t)L) ? textbook.states.at[i - (uint32_t)L][j] : ((i == j) ? 1.0 : 0.0);
        }
    }
    const matrix_t posterior = matrix_congruence(everything, textbook.w.p);
    const matrix_t change = matrix_product(everything, matrix_sum(textbook.w.x, -1.0, start));
    const matrix_t found = covariance_of_all();
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, 0.0, covariance_difference(&found, &posterior, &posterior));
    for (uint32_t i = 0u; i < (uint32_t)ROWS; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, change.at[i][0], (double)correction[i]);
    }
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, textbook.w.x.at[i][0], (double)filter->w[i]);
    }
}

static void test_a_sample_teaches_what_the_textbook_update_does(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        setUp();
        source.state += repeat;
        assert_learns_as_the_textbook(1u);
    }
}

static void test_a_block_teaches_what_its_samples_do_one_by_one(void)
{
    const uint32_t samples[] = {2u, 4u, 7u, 50u};
    for (uint32_t k = 0u; k < 4u; k++) {
        for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
            setUp();
            source.state += repeat;
            assert_learns_as_the_textbook(samples[k]);
        }
    }
}

static void test_signed_parameters_learn_alike(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        start_signed();
        source.state += repeat;
        assert_learns_as_the_textbook(4u);
    }
}

/* With caution, the k-th block of ten counts by k tenths: in the textbook, its outputs are that much noisier. */
static void test_at_first_what_was_gathered_counts_in_part(void)
{
    draw_factor();
    for (uint32_t block = 1u; block <= 12u; block++) {
        const float noise[4] = {0.05f, 0.0f, 0.02f, 0.08f};
        const double trust = fmin(0.1 * (double)block, 1.0);
        textbook_t textbook = textbook_of_filter();
        float output[2 * L];
        float innovation[2];
        random_floats(&source, output, (uint32_t)(2 * L), 0.1);
        random_floats(&source, innovation, 2u, 0.2);
        const matrix_t h = matrix_product(matrix_of(output, 2u, (uint32_t)L), textbook.inverse);
        const matrix_t y = matrix_sum(matrix_of(innovation, 2u, 1u), 1.0, matrix_product(h, textbook.w.x));
        const matrix_t given = matrix_gram(matrix_of(noise, 2u, 2u));
        (void)kalman_update(&textbook.w, h, matrix_sum(matrix_zero(2u, 2u), 1.0 / trust, given), y);

        float correction[ROWS];
        float learnt[L];
        whiten_and_gather(matrix_of(output, 2u, (uint32_t)L), matrix_of(innovation, 2u, 1u), matrix_of(noise, 2u, 2u));
        (void)learn(0.01f, 0.1f, correction, learnt);
        const matrix_t all = covariance_of_all();
        const matrix_t found = matrix_block(&all, 0u, (uint32_t)L, 0u, (uint32_t)L);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-5, 0.0, covariance_difference(&found, &textbook.w.p, &textbook.w.p));
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, textbook.w.x.at[i][0], (double)filter->w[i]);
        }
    }
}

static void test_time_in_which_nothing_was_gathered_is_no_reason_to_trust(void)
{
    float correction[ROWS];
    float learnt[L];
    draw_factor();
    (void)learn(0.01f, 0.1f, correction, learnt); /* draws the points */
    const parameter_filter_t before = *filter;
    for (uint32_t k = 0u; k < 100u; k++) {
        (void)learn(0.01f, 0.1f, correction, learnt);
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, filter, sizeof *filter);
}

static void test_what_was_learnt_is_what_the_variances_have_lost(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        setUp();
        source.state += repeat;
        draw_factor();
        textbook_t textbook = textbook_of_filter();
        const matrix_t before = covariance_of_all();
        gather(&textbook, textbook.w.x);
        float correction[ROWS];
        float learnt[L];
        (void)learn(0.01f, 0.0f, correction, learnt);
        const matrix_t after = covariance_of_all();
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double wanted = before.at[i][i] - after.at[i][i];
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * before.at[i][i], wanted, (double)learnt[i]);
        }
    }
}

/* Nothing gathered is learnt twice. */
static void test_learning_again_changes_nothing(void)
{
    draw_factor();
    textbook_t textbook = textbook_of_filter();
    gather(&textbook, textbook.w.x);
    float correction[ROWS];
    float learnt[L];
    (void)learn(1.0e-2f, 0.0f, correction, learnt);
    const parameter_filter_t before = *filter;
    TEST_ASSERT_FALSE(learn(1.0e-2f, 0.0f, correction, learnt));
    TEST_ASSERT_EQUAL_MEMORY(&before, filter, sizeof *filter);
    for (uint32_t i = 0u; i < (uint32_t)ROWS; i++) {
        TEST_ASSERT_TRUE(correction[i] == 0.0f);
    }
}

static void test_a_state_that_starts_anew_drops_what_was_gathered(void)
{
    draw_factor();
    textbook_t textbook = textbook_of_filter();
    gather(&textbook, textbook.w.x);
    parameter_filter_forget_state(filter);
    const parameter_filter_t before = *filter;
    float correction[ROWS];
    float learnt[L];
    (void)learn(1.0e-2f, 0.0f, correction, learnt);
    TEST_ASSERT_EQUAL_MEMORY(before.s, filter->s, sizeof filter->s);
    TEST_ASSERT_EQUAL_MEMORY(before.w, filter->w, sizeof filter->w);
    for (uint32_t k = 0u; k < (uint32_t)(N * L); k++) {
        TEST_ASSERT_TRUE(parameter_filter_sensitivity(filter)[k] == 0.0f);
    }
}

/* --- bounds and invariant ------------------------------------------------------------------------------------------ */

static void test_estimate_is_held_at_its_bounds_and_said_to_rest_there(void)
{
    float correction[ROWS];
    float learnt[L];
    TEST_ASSERT_FALSE(learn(1.0e-2f, 0.0f, correction, learnt));
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        setUp();
        filter->w[i] = filter->least[i] - 0.01f;
        TEST_ASSERT_TRUE(learn(1.0e-2f, 0.0f, correction, learnt));
        TEST_ASSERT_TRUE(filter->w[i] == filter->least[i]);
        filter->w[i] = filter->greatest[i] + 0.01f;
        TEST_ASSERT_TRUE(learn(1.0e-2f, 0.0f, correction, learnt));
        TEST_ASSERT_TRUE(filter->w[i] == filter->greatest[i]);
        TEST_ASSERT_TRUE(parameter_filter_is_valid(filter));
    }
}

/* Sets one float of the filter to `value` and expects it to be refused. */
static void assert_refused(float *entry, float value)
{
    setUp();
    *entry = value;
    TEST_ASSERT_FALSE(parameter_filter_is_valid(filter));
}

static void test_valid_means_within_bounds_finite_and_a_valid_factor(void)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        assert_refused(&filter->w[i], NAN);
        assert_refused(&filter->w[i], 10.0f);
        assert_refused(&filter->w[i], -10.0f);
        assert_refused(&filter->walk[i], NAN);
        assert_refused(&filter->walk[i], -1.0e-9f);
        assert_refused(&filter->walk[i], INFINITY);
        assert_refused(&filter->s[(i * L) + i], 0.0f);
    }
    for (uint32_t k = 0u; k < (uint32_t)(ROWS * L); k++) {
        assert_refused(&filter->s[k], NAN);
        assert_refused(&filter->s[k], INFINITY);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_starts_at_the_guess_with_its_relative_standard_deviations_uncorrelated);
    RUN_TEST(test_bounds_of_w_are_those_of_the_model);
    RUN_TEST(test_signed_parameters_start_at_the_guess_one_sigma_being_one);
    RUN_TEST(test_bounds_of_signed_parameters_are_those_of_the_model_in_sigmas);
    RUN_TEST(test_opening_keeps_the_estimate_and_forgets_what_was_learnt);
    RUN_TEST(test_physical_parameters_are_the_guess_times_exp_w);
    RUN_TEST(test_signed_parameters_are_the_guess_plus_w_sigmas);
    RUN_TEST(test_sigma_and_correlation_are_those_of_the_covariance);
    RUN_TEST(test_points_are_a_pair_for_each_column_with_the_state_moving_along);
    RUN_TEST(test_prediction_moves_the_state_deviations_by_the_model);
    RUN_TEST(test_a_sample_teaches_what_the_textbook_update_does);
    RUN_TEST(test_a_block_teaches_what_its_samples_do_one_by_one);
    RUN_TEST(test_signed_parameters_learn_alike);
    RUN_TEST(test_at_first_what_was_gathered_counts_in_part);
    RUN_TEST(test_time_in_which_nothing_was_gathered_is_no_reason_to_trust);
    RUN_TEST(test_what_was_learnt_is_what_the_variances_have_lost);
    RUN_TEST(test_learning_again_changes_nothing);
    RUN_TEST(test_a_state_that_starts_anew_drops_what_was_gathered);
    RUN_TEST(test_estimate_is_held_at_its_bounds_and_said_to_rest_there);
    RUN_TEST(test_valid_means_within_bounds_finite_and_a_valid_factor);
    return UNITY_END();
}
