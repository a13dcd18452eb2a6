/* The state filter against the textbook Kalman filter in double on a linear system, with its exact discrete process
 * noise and with outputs missing; and against Gaussian moments on a quadratic one. */
#include "filter/state_filter.h"

#include "kalman.h"
#include "unity.h"

enum { STEPS = 5000, SENSITIVITIES = MODEL_STATES * MODEL_PARAMETERS };

#define PERIOD 1.0e-3f

static random_source_t source;
static state_filter_t filter;
static kalman_t reference;
static float sensitivity[SENSITIVITIES];

/* x_next - x of a damped oscillator of 4 Hz. */
static const float increment_matrix[4] = {0.0f, PERIOD, -630.0f * PERIOD, -15.0f * PERIOD};

void setUp(void)
{
    source.state = 99u;
    filter = (state_filter_t){.x = {0.35f, 0.0f},
        .s = {1.0e-3f, 0.0f, 2.0e-3f, 1.0e-2f},
        .process_noise = {0.0f, 0.05f},
        .output_noise = {1.0e-3f, 1.0e-2f}};
    reference.x = matrix_of(filter.x, 2u, 1u);
    reference.p = matrix_gram(matrix_of(filter.s, 2u, 2u));
    for (uint32_t k = 0u; k < (uint32_t)SENSITIVITIES; k++) {
        sensitivity[k] = 0.0f;
    }
}

void tearDown(void)
{
}

/* --- the filter's side --------------------------------------------------------------------------------------------- */

static void predict_linear(void)
{
    model_points_t points;
    float increment[MODEL_POINTS][MODEL_STATES];
    state_filter_points(&filter, &points);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_POINTS; i++) {
        const uint32_t from = (i < (uint32_t)MODEL_PARAMETER_POINTS) ? 0u : i; /* parameters make no difference */
        for (uint32_t row = 0u; row < 2u; row++) {
            const float *a = &increment_matrix[2u * row];
            increment[i][row] = (a[0] * points.x[from][0]) + (a[1] * points.x[from][1]);
        }
    }
    state_filter_predict(&filter, increment, PERIOD);
}

/* --- the reference's side ------------------------------------------------------------------------------------------ */

static matrix_t transition(void)
{
    return matrix_sum(matrix_of(increment_matrix, 2u, 2u), 1.0, matrix_identity(2u));
}

static void reference_predict(void)
{
    kalman_predict(&reference, transition(),
        kalman_process_noise((double)filter.process_noise[0], (double)filter.process_noise[1], (double)PERIOD));
}

static matrix_t output_covariance(void)
{
    matrix_t r = matrix_zero(2u, 2u);
    r.at[0][0] = (double)filter.output_noise[0] * (double)filter.output_noise[0];
    r.at[1][1] = (double)filter.output_noise[1] * (double)filter.output_noise[1];
    return r;
}

static double reference_update(const measurement_t *measurement)
{
    const matrix_t h = kalman_outputs(measurement->valid, 2u);
    return (h.rows == 0u) ? 0.0
                          : kalman_update(&reference, h, kalman_pick(measurement->valid, output_covariance()),
                                kalman_pick(measurement->valid, matrix_of(measurement->y, 2u, 1u)));
}

static measurement_t random_measurement(bool theta_valid, bool theta_dot_valid)
{
    const measurement_t measurement = {
        .y = {theta_valid ? (float)(reference.x.at[0][0] + (2.0e-3 * random_normal(&source))) : NAN,
            theta_dot_valid ? (float)(reference.x.at[1][0] + (2.0e-2 * random_normal(&source))) : NAN},
        .valid = {theta_valid, theta_dot_valid}};
    return measurement;
}

/* Estimate within `sigmas` standard deviations of the reference's, covariance within `relative`. */
static void assert_equals_reference(double sigmas, double relative)
{
    const matrix_t p = matrix_gram(matrix_of(filter.s, 2u, 2u));
    for (uint32_t i = 0u; i < 2u; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(sigmas * sqrt(reference.p.at[i][i]), reference.x.at[i][0], (double)filter.x[i]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(relative, 0.0, covariance_difference(&p, &reference.p, &reference.p));
    TEST_ASSERT_TRUE(state_filter_is_valid(&filter));
}

/* Both filters over many steps, outputs missing with the given probability. */
static void assert_same_run(double missing)
{
    for (uint32_t k = 0u; k < STEPS; k++) {
        predict_linear();
        reference_predict();
        assert_equals_reference(2.0e-3, 1.0e-4);
        const measurement_t measurement =
            random_measurement(random_unit(&source) >= missing, random_unit(&source) >= missing);
        const double nis = (double)state_filter_update(&filter, &measurement, sensitivity);
        const double wanted = reference_update(&measurement);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3 * (1.0 + wanted), wanted, nis);
        assert_equals_reference(2.0e-3, 1.0e-4);
    }
}

/* --- facts --------------------------------------------------------------------------------------------------------- */

static void test_equals_the_kalman_filter_on_a_linear_system(void)
{
    assert_same_run(0.0);
}

static void test_equals_the_kalman_filter_with_outputs_missing_at_random(void)
{
    assert_same_run(0.6);
}

static void test_walk_of_theta_itself_adds_to_its_process_noise(void)
{
    filter.process_noise[0] = 0.02f;
    assert_same_run(0.2);
}

static void test_outputs_near_float_resolution_cost_less_than_five_per_cent_of_the_covariance(void)
{
    filter.process_noise[1] = 5.0e-4f;
    filter.output_noise[0] = 1.0e-6f;
    filter.output_noise[1] = 1.0e-5f;
    for (uint32_t k = 0u; k < STEPS; k++) {
        predict_linear();
        reference_predict();
        measurement_t measurement = {.valid = {true, true}};
        measurement.y[0] = (float)(reference.x.at[0][0] + (1.0e-6 * random_normal(&source)));
        measurement.y[1] = (float)(reference.x.at[1][0] + (1.0e-5 * random_normal(&source)));
        (void)state_filter_update(&filter, &measurement, sensitivity);
        (void)reference_update(&measurement);
        assert_equals_reference(0.3, 5.0e-2); /* one bit of theta is 0.3 of its standard deviation */
    }
}

static void test_without_measurement_nothing_changes(void)
{
    const measurement_t none = {.y = {NAN, NAN}, .valid = {false, false}};
    const state_filter_t before = filter;
    for (uint32_t k = 0u; k < (uint32_t)SENSITIVITIES; k++) {
        sensitivity[k] = 0.1f;
    }
    TEST_ASSERT_TRUE(state_filter_update(&filter, &none, sensitivity) == 0.0f);
    TEST_ASSERT_EQUAL_MEMORY(&before, &filter, sizeof filter);
    TEST_ASSERT_TRUE((sensitivity[0] == 0.1f) && (sensitivity[SENSITIVITIES - 1] == 0.1f));
}

static void test_sensitivity_shrinks_by_what_the_gain_leaves(void)
{
    const bool valid[3][2] = {{true, true}, {true, false}, {false, true}};
    for (uint32_t c = 0u; c < 3u; c++) {
        setUp();
        random_floats(&source, sensitivity, (uint32_t)SENSITIVITIES, 0.01);
        const matrix_t before = matrix_of(sensitivity, 2u, 3u);
        const measurement_t measurement = random_measurement(valid[c][0], valid[c][1]);
        const matrix_t h = kalman_outputs(measurement.valid, 2u);
        const matrix_t gain = kalman_gain(&reference, h, kalman_pick(measurement.valid, output_covariance()));
        const matrix_t left = matrix_sum(matrix_identity(2u), -1.0, matrix_product(gain, h));
        const matrix_t wanted = matrix_product(left, before);
        (void)state_filter_update(&filter, &measurement, sensitivity);
        for (uint32_t i = 0u; i < 2u; i++) {
            for (uint32_t j = 0u; j < 3u; j++) {
                TEST_ASSERT_DOUBLE_WITHIN(1.0e-8, wanted.at[i][j], (double)sensitivity[(3u * i) + j]);
            }
        }
    }
}

static void test_innovation_covariance_is_that_of_the_state_and_the_noise(void)
{
    const measurement_t both = {.valid = {true, true}};
    float factor[4];
    state_filter_innovation(&filter, &both, factor);
    const matrix_t found = matrix_gram(matrix_of(factor, 2u, 2u));
    const matrix_t wanted = matrix_sum(reference.p, 1.0, output_covariance());
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 0.0, covariance_difference(&found, &wanted, &wanted));
    TEST_ASSERT_TRUE(factor[1] == 0.0f);
}

static void test_a_missing_output_has_a_row_of_the_identity_in_the_innovation_covariance(void)
{
    for (uint32_t missing = 0u; missing < 2u; missing++) {
        const uint32_t left = 1u - missing;
        measurement_t measurement = {.valid = {true, true}};
        measurement.valid[missing] = false;
        float factor[4];
        state_filter_innovation(&filter, &measurement, factor);
        const double wanted = sqrt(reference.p.at[left][left] + output_covariance().at[left][left]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * wanted, wanted, (double)factor[3u * left]);
        TEST_ASSERT_TRUE(factor[3u * missing] == 1.0f);
        TEST_ASSERT_TRUE((factor[1] == 0.0f) && (factor[2] == 0.0f));
    }
}

/* theta_dot grows by a theta^2; with theta ~ N(m, s^2), mean and variance of that are known for a Gaussian. */
static void test_a_quadratic_increment_has_the_mean_and_variance_of_a_gaussian(void)
{
    const double a = 2.0;
    const double m = 0.3;
    const double s = 0.2;
    filter = (state_filter_t){.x = {(float)m, 0.0f}, .s = {(float)s, 0.0f, 0.0f, 0.1f}};
    model_points_t points;
    float increment[MODEL_POINTS][MODEL_STATES];
    state_filter_points(&filter, &points);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_POINTS; i++) {
        const float theta = points.x[(i < (uint32_t)MODEL_PARAMETER_POINTS) ? 0u : i][0];
        increment[i][0] = 0.0f;
        increment[i][1] = (float)a * theta * theta;
    }
    state_filter_predict(&filter, increment, PERIOD);
    const matrix_t p = matrix_gram(matrix_of(filter.s, 2u, 2u));
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, a * ((m * m) + (s * s)), (double)filter.x[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 0.01 + (4.0 * a * a * m * m * s * s) + (2.0 * a * a * s * s * s * s), p.at[1][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 2.0 * a * m * s * s, p.at[0][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, s * s, p.at[0][0]);
}

/* theta_dot grows by a w^2 with a parameter w ~ N(0, s^2), whose first pair of points is at +- sqrt(3) s. */
static void test_curvature_along_a_parameter_moves_the_mean(void)
{
    const double a = 2.0;
    const double s = 0.2;
    float increment[MODEL_POINTS][MODEL_STATES] = {{0.0f}};
    filter = (state_filter_t){.x = {0.3f, 0.1f}, .s = {0.1f, 0.0f, 0.0f, 0.1f}};
    increment[1][1] = (float)(a * 3.0 * s * s);
    increment[2][1] = (float)(a * 3.0 * s * s);
    state_filter_predict(&filter, increment, PERIOD);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 0.1 + (a * s * s), (double)filter.x[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, 0.3, (double)filter.x[0]);
}

static void test_valid_means_finite_plausible_and_a_valid_factor(void)
{
    const float bad[] = {NAN, INFINITY, 1.0e5f};
    TEST_ASSERT_TRUE(state_filter_is_valid(&filter));
    for (uint32_t b = 0u; b < 3u; b++) {
        for (uint32_t i = 0u; i < 2u; i++) {
            setUp();
            filter.x[i] = bad[b];
            TEST_ASSERT_FALSE(state_filter_is_valid(&filter));
        }
    }
    setUp();
    filter.s[3] = 0.0f;
    TEST_ASSERT_FALSE(state_filter_is_valid(&filter));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_equals_the_kalman_filter_on_a_linear_system);
    RUN_TEST(test_equals_the_kalman_filter_with_outputs_missing_at_random);
    RUN_TEST(test_walk_of_theta_itself_adds_to_its_process_noise);
    RUN_TEST(test_outputs_near_float_resolution_cost_less_than_five_per_cent_of_the_covariance);
    RUN_TEST(test_without_measurement_nothing_changes);
    RUN_TEST(test_sensitivity_shrinks_by_what_the_gain_leaves);
    RUN_TEST(test_innovation_covariance_is_that_of_the_state_and_the_noise);
    RUN_TEST(test_a_missing_output_has_a_row_of_the_identity_in_the_innovation_covariance);
    RUN_TEST(test_a_quadratic_increment_has_the_mean_and_variance_of_a_gaussian);
    RUN_TEST(test_curvature_along_a_parameter_moves_the_mean);
    RUN_TEST(test_valid_means_finite_plausible_and_a_valid_factor);
    return UNITY_END();
}
