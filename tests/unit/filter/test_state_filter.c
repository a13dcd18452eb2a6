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

/* Change of theta_dot of a damped oscillator of 4 Hz. */
static const float change_of[2] = {-630.0f * PERIOD, -15.0f * PERIOD};

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
    model_response_t response = {.bend = {0.0f}}; /* parameters make no difference */
    state_filter_points(&filter, &points);
    response.mean = (change_of[0] * points.x[0]) + (change_of[1] * points.x[1]);
    for (uint32_t j = (uint32_t)MODEL_PARAMETERS; j < (uint32_t)MODEL_PAIRS; j++) {
        const float *offset = points.offset[j];
        response.difference[j] = 2.0f * ((change_of[0] * offset[0]) + (change_of[1] * offset[1]));
    }
    state_filter_predict(&filter, &response, PERIOD);
}

/* Returns the normalised innovation squared. */
static double update(const measurement_t *measurement)
{
    whitened_t whitened;
    state_filter_update(&filter, measurement, sensitivity, &whitened);
    const double first = (double)whitened.innovation[0];
    const double second = (double)whitened.innovation[1];
    return (first * first) + (second * second);
}

/* --- the reference's side ------------------------------------------------------------------------------------------ */

static matrix_t transition(void)
{
    const double period = (double)PERIOD;
    matrix_t a = matrix_identity(2u);
    for (uint32_t k = 0u; k < 2u; k++) { /* theta moves by T (theta_dot + change / 2) */
        a.at[1][k] += (double)change_of[k];
        a.at[0][k] += 0.5 * period * (double)change_of[k];
    }
    a.at[0][1] += period;
    return a;
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
        const double nis = update(&measurement);
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
        (void)update(&measurement);
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
    TEST_ASSERT_TRUE(update(&none) == 0.0);
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
        (void)update(&measurement);
        for (uint32_t i = 0u; i < 2u; i++) {
            for (uint32_t j = 0u; j < 3u; j++) {
                TEST_ASSERT_DOUBLE_WITHIN(1.0e-8, wanted.at[i][j], (double)sensitivity[(3u * i) + j]);
            }
        }
    }
}

/* [scale 0; coupling scale]: the factor by which outputs are whitened, and everything whitened with it. */
static void test_whitened_is_what_the_factor_of_the_innovation_covariance_makes_of_it(void)
{
    for (uint32_t repeat = 0u; repeat < 100u; repeat++) {
        setUp();
        source.state += repeat;
        random_floats(&source, sensitivity, (uint32_t)SENSITIVITIES, 0.01);
        random_floats(&source, filter.echo, 2u, 1.0e-3);
        const matrix_t deviations = matrix_of(sensitivity, 2u, 3u);
        const matrix_t echo = matrix_of(filter.echo, 2u, 1u);
        const measurement_t measurement = random_measurement(true, true);
        const matrix_t innovation = matrix_sum(matrix_of(measurement.y, 2u, 1u), -1.0, reference.x);
        whitened_t whitened;
        state_filter_update(&filter, &measurement, sensitivity, &whitened);

        const float factor[4] = {whitened.scale[0], 0.0f, whitened.coupling, whitened.scale[1]};
        const matrix_t l = matrix_of(factor, 2u, 2u);
        const matrix_t found = matrix_gram(l);
        const matrix_t wanted = matrix_sum(reference.p, 1.0, output_covariance());
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 0.0, covariance_difference(&found, &wanted, &wanted));
        const matrix_t inverse = matrix_inverse(l);
        const matrix_t outputs = matrix_product(inverse, deviations);
        for (uint32_t i = 0u; i < 2u; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(
                2.0e-5, matrix_product(inverse, innovation).at[i][0], (double)whitened.innovation[i]);
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-6, matrix_product(inverse, echo).at[i][0], (double)whitened.echo[i]);
            for (uint32_t j = 0u; j < 3u; j++) {
                TEST_ASSERT_DOUBLE_WITHIN(5.0e-6, outputs.at[i][j], (double)whitened.output[i][j]);
            }
        }
    }
}

static void test_of_a_missing_output_all_is_zero_and_the_other_stands_alone(void)
{
    for (uint32_t missing = 0u; missing < 2u; missing++) {
        const uint32_t left = 1u - missing;
        setUp();
        random_floats(&source, sensitivity, (uint32_t)SENSITIVITIES, 0.01);
        const double wanted = sqrt(reference.p.at[left][left] + output_covariance().at[left][left]);
        const double deviation = (double)sensitivity[3u * left];
        const measurement_t measurement = random_measurement(missing == 1u, missing == 0u);
        whitened_t whitened;
        state_filter_update(&filter, &measurement, sensitivity, &whitened);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * wanted, wanted, (double)whitened.scale[left]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, deviation / wanted, (double)whitened.output[left][0]);
        TEST_ASSERT_TRUE(whitened.innovation[missing] == 0.0f);
        TEST_ASSERT_TRUE(whitened.echo[missing] == 0.0f);
        for (uint32_t j = 0u; j < 3u; j++) {
            TEST_ASSERT_TRUE(whitened.output[missing][j] == 0.0f);
        }
    }
}

/* theta_dot grows by a theta^2; with theta ~ N(m, s^2), mean and variance of that are known for a Gaussian. In a step that takes
 * no time theta stays. */
static void test_a_quadratic_change_has_the_mean_and_variance_of_a_gaussian(void)
{
    const double a = 2.0;
    const double m = 0.3;
    const double s = 0.2;
    filter = (state_filter_t){.x = {(float)m, 0.0f}, .s = {(float)s, 0.0f, 0.0f, 0.1f}};
    model_points_t points;
    model_response_t response = {.bend = {0.0f}};
    state_filter_points(&filter, &points);
    response.mean = (float)a * points.x[0] * points.x[0];
    for (uint32_t j = (uint32_t)MODEL_PARAMETERS; j < (uint32_t)MODEL_PAIRS; j++) {
        const float plus = points.x[0] + points.offset[j][0];
        const float minus = points.x[0] - points.offset[j][0];
        model_response_pair(&response, j, (float)a * plus * plus, (float)a * minus * minus);
    }
    state_filter_predict(&filter, &response, 0.0f);
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
    const double rate = 0.1 + (a * s * s);
    const model_response_t response = {.bend = {(float)(2.0 * a * 3.0 * s * s)}};
    filter = (state_filter_t){.x = {0.3f, 0.1f}, .s = {0.1f, 0.0f, 0.0f, 0.1f}};
    state_filter_predict(&filter, &response, PERIOD);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, rate, (double)filter.x[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, 0.3 + ((double)PERIOD * 0.5 * (0.1 + rate)), (double)filter.x[0]);
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
    RUN_TEST(test_whitened_is_what_the_factor_of_the_innovation_covariance_makes_of_it);
    RUN_TEST(test_of_a_missing_output_all_is_zero_and_the_other_stands_alone);
    RUN_TEST(test_a_quadratic_change_has_the_mean_and_variance_of_a_gaussian);
    RUN_TEST(test_curvature_along_a_parameter_moves_the_mean);
    RUN_TEST(test_valid_means_finite_plausible_and_a_valid_factor);
    return UNITY_END();
}
