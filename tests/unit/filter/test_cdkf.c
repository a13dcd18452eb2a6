/* Time and measurement update against the textbook in double, on a linear system, where the central difference filter
 * is the Kalman filter; and what they say of their uncertainty. */
#include "pair.h"

#include <string.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, REPEATS = 200 };

static pair_t pair;
static cdkf_t *const cdkf = &pair.cdkf;

void setUp(void)
{
    pair = pair_typical();
}

void tearDown(void)
{
}

/* --- time update -------------------------------------------------------------------------------------------------- */

static void test_time_update_is_the_prediction_of_the_textbook_with_its_process_noise(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        pair = pair_random(repeat);
        cdkf->process_noise[0] = (float)random_between(&pair.source, 0.0, 0.02);
        cdkf->process_noise[1] = (float)random_between(&pair.source, 0.0, 0.5);
        cdkf->disturbance = ((repeat % 2u) == 0u) ? 0.3f : 0.0f;
        const float before[N] = {cdkf->response[0], cdkf->response[1]};
        pair_predict(&pair, (float)random_between(&pair.source, 1.0e-4, 2.0e-2));
        pair_assert_equal(&pair, 2.0e-3, 5.0e-6);
        const matrix_t a = pair_transition(&pair.step);
        for (uint32_t i = 0u; i < (uint32_t)N; i++) { /* the response to past corrections moves as the state does */
            const double wanted = (a.at[L + i][L] * (double)before[0]) + (a.at[L + i][L + 1] * (double)before[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, wanted, (double)cdkf->response[i]);
        }
    }
}

/* theta_dot changes by a w^2, w ~ N(0, s^2), whose points are at +- sqrt(3) s: a Gaussian has the mean a s^2 and the
 * variance 2 a^2 s^4 of that; theta gets half a period of it. */
static void respond_quadratic(const model_constants_t *constants, const model_step_t *step,
    const model_points_t *points, model_response_t *response)
{
    (void)constants;
    (void)step;
    const float w = points->coefficients[1].c[0];
    (void)memset(response, 0, sizeof *response);
    response->second_difference[0] = 2.0f * (2.0f * w * w);
}

static void test_curvature_along_a_parameter_has_the_moments_of_a_gaussian(void)
{
    const double period = 0.01;
    const double variance = 2.0 * 2.0 * 2.0 * pow(0.4, 4.0);
    model_t model = pair_model;
    model.respond = respond_quadratic;
    cdkf->process_noise[1] = 0.0f;
    const matrix_t before = pair_covariance(cdkf);
    const model_step_t step = {.period = (float)period};
    cdkf_time_update(cdkf, &model, NULL, &step, pair_no_error, NULL);
    const matrix_t after = pair_covariance(cdkf);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 2.0 * 0.16, (double)cdkf->x[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, 0.1 + (0.5 * period * 0.32), (double)cdkf->x[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, before.at[4][4] + variance, after.at[4][4]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-8, (before.at[4][4] + (0.5 * variance)) * period, after.at[3][4]);
    const double theta = before.at[3][3] + (period * period * (before.at[4][4] + (0.25 * variance)));
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-9, theta, after.at[3][3]);
}

/* --- measurement update ------------------------------------------------------------------------------------------- */

static const bool validities[4][N] = {{true, true}, {true, false}, {false, true}, {false, false}};

/* For given w it is the textbook's on x alone; what x does when w changes, S_xw S_ww^-1, shrinks by
 * I - K H, and so does the response to past corrections, to which this one is added. */
static void assert_updates_the_state(const bool valid[N], float theta_noise, float theta_dot_noise)
{
    cdkf->output_noise[0] = theta_noise;
    cdkf->output_noise[1] = theta_dot_noise;
    const matrix_t s_xx = matrix_of(cdkf->s_xx, 2u, 2u);
    const matrix_t s_xw = matrix_of(&cdkf->s[L * L], 2u, 3u);
    kalman_t given = {.x = matrix_of(cdkf->x, 2u, 1u), .p = matrix_gram(s_xx)};
    const matrix_t prior = given.p;
    const float y[N] = {cdkf->x[0] + (2.0f * theta_noise), cdkf->x[1] - theta_dot_noise};
    const pair_outputs_t of = pair_outputs(cdkf, y, valid);
    const matrix_t h = matrix_block(&of.h, 0u, of.h.rows, (uint32_t)L, (uint32_t)N);
    matrix_t rest = matrix_identity(2u);
    matrix_t response = matrix_of(cdkf->response, 2u, 1u);
    if (h.rows > 0u) {
        const matrix_t gain = kalman_gain(&given, h, of.r);
        const matrix_t innovation_of_x = matrix_sum(of.y, -1.0, matrix_product(h, given.x));
        rest = matrix_sum(rest, -1.0, matrix_product(gain, h));
        response = matrix_sum(matrix_product(rest, response), 1.0, matrix_product(gain, innovation_of_x));
        (void)kalman_update(&given, h, of.r, of.y);
    }
    innovation_t innovation[CDKF_OUTPUTS];
    cdkf_measurement_update(cdkf, y, valid, false, innovation);
    const matrix_t found = matrix_gram(matrix_of(cdkf->s_xx, 2u, 2u));
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 0.0, covariance_difference(&found, &given.p, &prior));
    const matrix_t wanted = matrix_product(rest, s_xw);
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        const double unit = sqrt(prior.at[i][i]) + 0.1; /* of rounding: x is up to 0.1 */
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * unit, given.x.at[i][0], (double)cdkf->x[i]);
        if (!valid[0] || !valid[1]) {
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * unit, response.at[i][0], (double)cdkf->response[i]);
        }
        TEST_ASSERT_TRUE(valid[i] || ((innovation[i].value == 0.0f) && (innovation[i].inverse_variance == 1.0f)));
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const float column = cdkf->s[((L + i) * L) + j];
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-5 * sqrt(prior.at[i][i]), wanted.at[i][j], (double)column);
        }
    }
    TEST_ASSERT_TRUE(cdkf_state_is_valid(cdkf) && (cdkf->pending.matrix[0] == 0.0f));
}

static void test_measurement_update_is_that_of_the_textbook_for_both_one_or_no_output(void)
{
    const float noises[4][2] = {{1.0e-3f, 1.0e-2f}, {1.0e-6f, 1.0e-5f}, {1.0e-6f, 2.0f}, {0.2f, 1.0e-5f}};
    for (uint32_t repeat = 0u; repeat < (uint32_t)(4 * REPEATS); repeat++) {
        pair = pair_random(repeat);
        assert_updates_the_state(validities[repeat % 4u], noises[(repeat / 4u) % 4u][0], noises[(repeat / 4u) % 4u][1]);
    }
}

/* With w as uncertain as it is: nis, and for each output its noise's part and the response to past corrections in
 * proportion to the innovation. The second output is given the first. */
static void test_innovations_have_the_covariance_of_the_whole_belief(void)
{
    const double nu[N] = {1.0e-5, -2.0e-2}; /* with the first, the second sees hardly any correction by the first */
    const double r[N] = {1.0e-6, 1.0e-4};
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        pair = pair_random(repeat);
        const bool *valid = validities[repeat % 3u];
        const matrix_t p = pair.reference.p;
        const float y[N] = {cdkf->x[0] + (float)nu[0], cdkf->x[1] + (float)nu[1]};
        const double response[N] = {(double)cdkf->response[0], (double)cdkf->response[1]};
        const pair_outputs_t of = pair_outputs(cdkf, y, valid);
        const double wanted = kalman_update(&pair.reference, of.h, of.r, of.y);
        innovation_t found[CDKF_OUTPUTS];
        cdkf_measurement_update(cdkf, y, valid, false, found);
        double nis = 0.0;
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            const double inverse = (double)found[i].inverse_variance;
            const double cross = ((i == 1u) && valid[0]) ? p.at[L + 1][L] : 0.0;
            const double given = cross / (p.at[L][L] + r[0]);
            nis += (double)found[i].value * (double)found[i].value * inverse;
            if (valid[i]) {
                const double variance = p.at[L + i][L + i] + r[i] - (given * cross);
                const double ratio = (response[i] - (given * response[0])) / (nu[i] - (given * nu[0]));
                TEST_ASSERT_DOUBLE_WITHIN(2.0e-5, r[i] / variance, (double)found[i].noise_variance * inverse);
                TEST_ASSERT_DOUBLE_WITHIN(
                    2.0e-2 * (0.1 + fabs(ratio)), ratio, (double)found[i].response / (double)found[i].value);
            }
        }
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-4 * (1.0 + wanted), wanted, nis);
    }
}

/* --- what is known ------------------------------------------------------------------------------------------------ */

static void test_standard_deviations_and_correlations_are_those_of_the_covariance(void)
{
    const uint32_t pairs[L][2] = {{0u, 1u}, {0u, 2u}, {1u, 2u}};
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        float correlation[L];
        pair = pair_random(repeat);
        const matrix_t *p = &pair.reference.p;
        cdkf_correlation(cdkf, correlation);
        for (uint32_t k = 0u; k < (uint32_t)L; k++) {
            const uint32_t i = pairs[k][0];
            const uint32_t j = pairs[k][1];
            const double sigma = (double)pair_prior.sigma[k] * sqrt(p->at[k][k]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, p->at[i][j] / sqrt(p->at[i][i] * p->at[j][j]), (double)correlation[k]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * sigma, sigma, (double)cdkf_parameter_sigma(cdkf, k));
        }
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            const double sigma = sqrt(p->at[L + i][L + i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * sigma, sigma, (double)cdkf_state_sigma(cdkf, i));
        }
    }
}

/* Rows of S_ww shrink to the prior's standard deviation, correlations stay, and the points are drawn from what
 * is left. */
static void test_drawing_caps_standard_deviations_at_the_prior_and_draws_the_points(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        float before[L];
        float after[L];
        pair = pair_random(repeat);
        for (uint32_t k = 0u; k < 9u; k++) {
            cdkf->s[k] *= ((repeat % 2u) == 0u) ? 100.0f : 1.0f;
        }
        cdkf_correlation(cdkf, before);
        const matrix_t s = matrix_of(cdkf->s, 3u, 3u);
        cdkf_draw(cdkf, &pair_model, NULL);
        cdkf_correlation(cdkf, after);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double sigma = sqrt(matrix_gram(s).at[i][i]);
            const double kept = fmin(sigma, 1.0) / sigma;
            TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, before[i], after[i]);
            for (uint32_t j = 0u; j < (uint32_t)L; j++) {
                const double offset = (double)pair_prior.sigma[i] * sqrt(3.0) * kept * s.at[i][j];
                const double mean = (double)pair_prior.sigma[i] * (double)cdkf->w[i];
                TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, mean + offset, (double)cdkf->points[1u + (2u * j)].c[i]);
                TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, mean - offset, (double)cdkf->points[2u + (2u * j)].c[i]);
                TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, mean, (double)cdkf->points[0].c[i]);
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_time_update_is_the_prediction_of_the_textbook_with_its_process_noise);
    RUN_TEST(test_curvature_along_a_parameter_has_the_moments_of_a_gaussian);
    RUN_TEST(test_measurement_update_is_that_of_the_textbook_for_both_one_or_no_output);
    RUN_TEST(test_innovations_have_the_covariance_of_the_whole_belief);
    RUN_TEST(test_standard_deviations_and_correlations_are_those_of_the_covariance);
    RUN_TEST(test_drawing_caps_standard_deviations_at_the_prior_and_draws_the_points);
    return UNITY_END();
}
