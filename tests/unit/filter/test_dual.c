/* The dual filter on a linear system against the textbook Kalman filter for [state; parameters] in double. Without a walk
 * of the parameters the two are the same filter (Friedland 1969), whatever outputs are missing. */
#include "filter/dual.h"

#include "kalman.h"
#include "math/factor.h"
#include "unity.h"

#include <stddef.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, ALL = N + L, STEPS = 3000 };

#define PERIOD 1.0e-3f

static random_source_t source;
static dual_t dual;
static kalman_t reference;
static model_step_t step;

/* --- a linear system: x_next = A x + B w with w = ln p, B from the inputs, which change at random -------------------- */

static matrix_t transition(const model_step_t *at)
{
    const double period = (double)at->period;
    matrix_t a = matrix_identity((uint32_t)ALL);
    a.at[0][1] = period;
    a.at[1][0] = -630.0 * period;
    a.at[1][1] = 1.0 - (15.0 * period);
    a.at[1][2] = period * (double)at->z_ddot;
    a.at[1][3] = period * (double)at->tau_m;
    a.at[1][4] = period * (double)at->trim;
    return a;
}

static void propagate_linear(const model_constants_t *constants, const model_step_t *at, const model_points_t *points,
    float increment[MODEL_POINTS][MODEL_STATES])
{
    (void)constants;
    const matrix_t a = transition(at);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_POINTS; i++) {
        const float *p = points->p[(i < (uint32_t)MODEL_PARAMETER_POINTS) ? i : 0u];
        for (uint32_t row = 0u; row < (uint32_t)N; row++) {
            double change = 0.0;
            for (uint32_t k = 0u; k < (uint32_t)ALL; k++) {
                const double from = (k < (uint32_t)N) ? (double)points->x[i][k] : log((double)p[k - (uint32_t)N]);
                change += (a.at[row][k] - ((row == k) ? 1.0 : 0.0)) * from;
            }
            increment[i][row] = (float)change;
        }
    }
}

static const model_t linear = {.name = "linear",
    .parameter = {{"a", "1", 1.0e-3f, 1.0e3f}, {"b", "1", 1.0e-3f, 1.0e3f}, {"c", "1", 1.0e-3f, 1.0e3f}},
    .propagate = propagate_linear};

/* --- both filters ---------------------------------------------------------------------------------------------------- */

void setUp(void)
{
    const float guess[L] = {1.0f, 1.0f, 1.0f};
    const float sigma[L] = {0.4f, 0.6f, 0.5f};
    source.state = 1234u;
    parameter_filter_init(&dual.parameters, &linear, guess, sigma);
    dual.state = (state_filter_t){.x = {0.1f, 0.0f},
        .s = {1.0e-3f, 0.0f, 0.0f, 1.0e-2f},
        .process_noise = {0.0f, 0.05f},
        .output_noise = {1.0e-3f, 1.0e-2f}};
    reference.x = matrix_zero((uint32_t)ALL, 1u);
    reference.x.at[0][0] = (double)0.1f;
    reference.p = matrix_zero((uint32_t)ALL, (uint32_t)ALL);
    const double sigmas[ALL] = {(double)1.0e-3f, (double)1.0e-2f, (double)0.4f, (double)0.6f, (double)0.5f};
    for (uint32_t i = 0u; i < (uint32_t)ALL; i++) {
        reference.p.at[i][i] = sigmas[i] * sigmas[i];
    }
}

void tearDown(void)
{
}

static void draw_step(void)
{
    step = (model_step_t){.period = PERIOD,
        .z_ddot = (float)(30.0 * random_normal(&source)),
        .tau_m = (float)(30.0 * random_normal(&source)),
        .trim = (float)(30.0 * random_normal(&source))};
}

/* What the walk of the parameters does: their covariance grows, that with the state stays, and so does the covariance of
 * the state when the parameters are given. */
static void reference_walk(void)
{
    const matrix_t ww = matrix_block(&reference.p, (uint32_t)N, (uint32_t)L, (uint32_t)N, (uint32_t)L);
    const matrix_t xw = matrix_block(&reference.p, 0u, (uint32_t)N, (uint32_t)N, (uint32_t)L);
    matrix_t grown = ww;
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        grown.at[i][i] += (double)dual.parameters.walk[i] * (double)PERIOD;
        reference.p.at[N + i][N + i] = grown.at[i][i];
    }
    const matrix_t explained = matrix_congruence(xw, matrix_inverse(ww));
    const matrix_t left = matrix_congruence(xw, matrix_inverse(grown));
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        for (uint32_t j = 0u; j < (uint32_t)N; j++) {
            reference.p.at[i][j] += left.at[i][j] - explained.at[i][j];
        }
    }
}

static void predict_both(bool learn)
{
    draw_step();
    dual_predict(&dual, &linear, NULL, &step, learn);
    matrix_t q = matrix_zero((uint32_t)ALL, (uint32_t)ALL);
    const matrix_t state =
        kalman_process_noise((double)dual.state.process_noise[0], (double)dual.state.process_noise[1], (double)PERIOD);
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        for (uint32_t j = 0u; j < (uint32_t)N; j++) {
            q.at[i][j] = state.at[i][j];
        }
    }
    kalman_predict(&reference, transition(&step), q);
    if (learn) {
        reference_walk();
    }
}

static matrix_t output_covariance(void)
{
    matrix_t r = matrix_zero(2u, 2u);
    r.at[0][0] = (double)dual.state.output_noise[0] * (double)dual.state.output_noise[0];
    r.at[1][1] = (double)dual.state.output_noise[1] * (double)dual.state.output_noise[1];
    return r;
}

static measurement_t random_measurement(bool theta_valid, bool theta_dot_valid)
{
    const double theta = reference.x.at[0][0] + (1.2 * (double)dual.state.output_noise[0] * random_normal(&source));
    const double rate = reference.x.at[1][0] + (1.2 * (double)dual.state.output_noise[1] * random_normal(&source));
    const measurement_t measurement = {.y = {theta_valid ? (float)theta : NAN, theta_dot_valid ? (float)rate : NAN},
        .valid = {theta_valid, theta_dot_valid}};
    return measurement;
}

static double reference_update(const measurement_t *measurement)
{
    const matrix_t h = kalman_outputs(measurement->valid, (uint32_t)ALL);
    return (h.rows == 0u) ? 0.0
                          : kalman_update(&reference, h, kalman_pick(measurement->valid, output_covariance()),
                                kalman_pick(measurement->valid, matrix_of(measurement->y, 2u, 1u)));
}

/* The joint covariance that the factors of the dual filter stand for: columns of w move the state, too. */
static matrix_t joint_covariance(void)
{
    const matrix_t s = matrix_of(dual.state.s, (uint32_t)N, (uint32_t)N);
    const matrix_t all = matrix_of(dual.parameters.s, (uint32_t)ALL, (uint32_t)L); /* rows w, then state */
    matrix_t columns = matrix_zero((uint32_t)ALL, (uint32_t)ALL);
    for (uint32_t i = 0u; i < (uint32_t)ALL; i++) {
        const uint32_t row = (i < (uint32_t)L) ? (i + (uint32_t)N) : (i - (uint32_t)L);
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            columns.at[row][j] = all.at[i][j];
        }
        for (uint32_t j = 0u; (j < (uint32_t)N) && (row < (uint32_t)N); j++) {
            columns.at[row][L + j] = s.at[row][j];
        }
    }
    return matrix_gram(columns);
}

static void assert_equals_reference(void)
{
    const matrix_t p = joint_covariance();
    for (uint32_t i = 0u; i < (uint32_t)ALL; i++) {
        const double estimate =
            (i < (uint32_t)N) ? (double)dual.state.x[i] : (double)dual.parameters.w[i - (uint32_t)N];
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3 * sqrt(reference.p.at[i][i]), reference.x.at[i][0], estimate);
    }
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-4, 0.0, covariance_difference(&p, &reference.p, &reference.p));
    TEST_ASSERT_TRUE(dual_is_valid(&dual));
}

static void assert_same_run(double missing)
{
    for (uint32_t k = 0u; k < STEPS; k++) {
        predict_both(true);
        assert_equals_reference();
        const measurement_t measurement =
            random_measurement(random_unit(&source) >= missing, random_unit(&source) >= missing);
        const matrix_t before = reference.x;
        float correction[L];
        const double nis = (double)dual_update(&dual, &measurement, true, correction);
        const double wanted = reference_update(&measurement);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-3 * (1.0 + wanted), wanted, nis);
        assert_equals_reference();
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double change = reference.x.at[N + i][0] - before.at[N + i][0];
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * sqrt(reference.p.at[N + i][N + i]), change, (double)correction[i]);
        }
    }
}

/* --- facts --------------------------------------------------------------------------------------------------------- */

static void test_without_a_walk_it_is_the_kalman_filter_for_state_and_parameters(void)
{
    assert_same_run(0.0);
}

static void test_so_it_is_with_outputs_missing_at_random(void)
{
    assert_same_run(0.5);
}

static void test_a_walk_widens_the_parameters_and_not_the_state_given_them(void)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        dual.parameters.walk[i] = 0.01f * (float)(i + 1u);
    }
    assert_same_run(0.2);
}

static void learn_for(uint32_t steps)
{
    for (uint32_t k = 0u; k < steps; k++) {
        float correction[L];
        predict_both(true);
        const measurement_t measurement = random_measurement(true, true);
        (void)dual_update(&dual, &measurement, true, correction);
        (void)reference_update(&measurement);
    }
}

static void test_it_learns_the_parameters(void)
{
    learn_for(STEPS);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE(factor_sigma(dual.parameters.s, (uint32_t)L, i) < 0.1f);
    }
}

static void test_state_sigma_includes_what_the_parameters_do_to_the_state(void)
{
    for (uint32_t k = 0u; k < 200u; k++) {
        predict_both(true);
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            const double wanted = sqrt(reference.p.at[i][i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-4 * wanted, wanted, (double)dual_state_sigma(&dual, i));
        }
    }
}

static void test_frozen_keeps_the_parameters_and_their_covariance_to_the_bit(void)
{
    learn_for(500u);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        dual.parameters.walk[i] = 0.01f;
    }
    const dual_t before = dual;
    for (uint32_t k = 0u; k < 500u; k++) {
        float correction[L];
        predict_both(false);
        const measurement_t measurement = random_measurement(true, (k % 3u) != 0u);
        (void)dual_update(&dual, &measurement, false, correction);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            TEST_ASSERT_TRUE(correction[i] == 0.0f);
        }
    }
    TEST_ASSERT_EQUAL_MEMORY(before.parameters.w, dual.parameters.w, sizeof before.parameters.w);
    TEST_ASSERT_EQUAL_MEMORY(before.parameters.s, dual.parameters.s, sizeof(float) * (size_t)(L * L));
    TEST_ASSERT_EQUAL_MEMORY(before.parameters.walk, dual.parameters.walk, sizeof before.parameters.walk);
}

/* Frozen, the state filter takes the parameters as given; how far the state is wrong if they are wrong must go on being
 * carried, d x / d w = (I - K H) (A d x / d w + B), or unfreezing would start from a wrong covariance. */
static void test_frozen_carries_the_sensitivity_of_the_state_on(void)
{
    kalman_t given = {.x = matrix_of(dual.state.x, 2u, 1u), .p = matrix_gram(matrix_of(dual.state.s, 2u, 2u))};
    matrix_t sensitivity = matrix_zero((uint32_t)N, (uint32_t)L);
    for (uint32_t k = 0u; k < 500u; k++) {
        float correction[L];
        predict_both(false);
        const measurement_t measurement = random_measurement(true, true);
        (void)dual_update(&dual, &measurement, false, correction);

        const matrix_t full = transition(&step);
        const matrix_t a = matrix_block(&full, 0u, (uint32_t)N, 0u, (uint32_t)N);
        const matrix_t b = matrix_block(&full, 0u, (uint32_t)N, (uint32_t)N, (uint32_t)L);
        kalman_predict(&given, a, kalman_process_noise(0.0, (double)dual.state.process_noise[1], (double)PERIOD));
        const matrix_t gain = kalman_gain(&given, matrix_identity(2u), output_covariance());
        const matrix_t rest = matrix_sum(matrix_identity(2u), -1.0, gain);
        sensitivity = matrix_product(rest, matrix_sum(matrix_product(a, sensitivity), 1.0, b));
        (void)kalman_update(&given, matrix_identity(2u), output_covariance(), matrix_of(measurement.y, 2u, 1u));
    }
    const matrix_t s_w = matrix_of(dual.parameters.s, (uint32_t)L, (uint32_t)L);
    const matrix_t wanted = matrix_product(sensitivity, s_w);
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3 * sqrt(given.p.at[i][i]), given.x.at[i][0], (double)dual.state.x[i]);
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const float found = parameter_filter_sensitivity(&dual.parameters)[(i * (uint32_t)L) + j];
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * sqrt(given.p.at[i][i]), wanted.at[i][j], (double)found);
        }
    }
}

static void test_valid_means_both_filters_are(void)
{
    TEST_ASSERT_TRUE(dual_is_valid(&dual));
    dual.state.x[0] = NAN;
    TEST_ASSERT_FALSE(dual_is_valid(&dual));
    setUp();
    dual.parameters.w[0] = NAN;
    TEST_ASSERT_FALSE(dual_is_valid(&dual));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_a_walk_it_is_the_kalman_filter_for_state_and_parameters);
    RUN_TEST(test_so_it_is_with_outputs_missing_at_random);
    RUN_TEST(test_a_walk_widens_the_parameters_and_not_the_state_given_them);
    RUN_TEST(test_it_learns_the_parameters);
    RUN_TEST(test_state_sigma_includes_what_the_parameters_do_to_the_state);
    RUN_TEST(test_frozen_keeps_the_parameters_and_their_covariance_to_the_bit);
    RUN_TEST(test_frozen_carries_the_sensitivity_of_the_state_on);
    RUN_TEST(test_valid_means_both_filters_are);
    return UNITY_END();
}
