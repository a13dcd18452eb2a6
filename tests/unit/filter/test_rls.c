/* Recursive least squares is a special case: with the state known at every sample and a constant forgetting factor, the
 * parameter filter on a linear black box is the textbook's RLS (Haykin 2002, table 9.1), here in double. */
#include "filter/dual.h"

#include "kalman.h"
#include "revise.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS, STEPS = 20000 };

#define PERIOD 1.0e-3f
#define SHARE 0.1f /* of the prior to start with: room for the covariance to grow without meeting its cap */

static const prior_t prior = {.guess = {-465.0f, -13.7f, -2.2f}, .sigma = {180.0f, 6.0f, 0.8f}};
static const double truth[L] = {-520.0, -12.5, -2.4};

/* --- the textbook --------------------------------------------------------------------------------------------------- */

/* Exponentially weighted regression of y on phi. */
typedef struct rls {
    double lambda;
    matrix_t w; /* estimate, column */
    matrix_t p; /* inverse of the weighted correlation of the regressors */
} rls_t;

static void rls_update(rls_t *rls, matrix_t phi, double y)
{
    const matrix_t row = matrix_transposed(phi);
    const matrix_t seen = matrix_product(rls->p, phi);
    const double scale = rls->lambda + matrix_product(row, seen).at[0][0];
    const matrix_t gain = matrix_sum(matrix_zero((uint32_t)L, 1u), 1.0 / scale, seen);
    const double innovation = y - matrix_product(row, rls->w).at[0][0];
    const matrix_t left = matrix_sum(rls->p, -1.0, matrix_product(gain, matrix_product(row, rls->p)));
    rls->w = matrix_sum(rls->w, innovation, gain);
    rls->p = matrix_sum(matrix_zero((uint32_t)L, (uint32_t)L), 1.0 / rls->lambda, left);
}

/* --- the system ----------------------------------------------------------------------------------------------------- */

/* x_ddot = a21 x + a22 x_dot + b21 z_ddot by Euler's rule, in which the parameters are exactly linear. */
static void respond_euler(const model_constants_t *constants, const model_step_t *at, const model_points_t *points,
    model_response_t *response)
{
    (void)constants;
    for (uint32_t i = 0u; i < (uint32_t)(1 + (2 * MODEL_PAIRS)); i++) {
        const uint32_t j = (i - 1u) / 2u;
        const bool of_w = (i >= 1u) && (j < (uint32_t)L);
        const float *p = points->arm[of_w ? i : 0u].coefficient;
        const float sign = (i == 0u) ? 0.0f : (((i % 2u) == 1u) ? 1.0f : -1.0f);
        const float *offset = points->offset[(i == 0u) ? 0u : j];
        const float x[2] = {points->x[0] + (sign * offset[0]), points->x[1] + (sign * offset[1])};
        const float change = at->period * ((p[0] * x[0]) + (p[1] * x[1]) + (p[2] * at->z_ddot));
        static float plus;
        if (i == 0u) {
            response->mean = change;
        } else if (sign > 0.0f) {
            plus = change;
        } else {
            model_response_pair(response, j, plus, change);
        }
    }
}

/* What a step changes theta_dot by, and its derivatives by the parameters. `implicit`: the firmware's own rule, midpoint and
 * damping taken implicitly; otherwise Euler's. */
static double increment_of(const double p[L], const double x[2], double u, bool implicit, double derivative[L])
{
    const double period = (double)PERIOD;
    const double half = implicit ? (0.5 * period) : 0.0;
    const double middle = x[0] + (half * x[1]);
    const double scale = period / (1.0 - (half * p[1]));
    const double change = scale * ((p[0] * middle) + (p[1] * x[1]) + (p[2] * u));
    derivative[0] = scale * middle;
    derivative[1] = scale * (x[1] + (half / period * change));
    derivative[2] = scale * u;
    return change;
}

/* --- both estimators -------------------------------------------------------------------------------------------------- */

static const model_constants_t constants = {.trim = true};
static model_t model;
static random_source_t source;
static dual_t dual;
static rls_t reference;
static double noise;   /* of the equation: standard deviation of what it adds to theta_dot in a step [rad/s] */
static float state[2]; /* known, before the step */

static void start(bool implicit, float growth)
{
    source.state = 61u;
    float correction[L];
    model = implicit ? model_linear_black_box : plain_model(&model_linear_black_box);
    model.respond = implicit ? model_linear_black_box.respond : respond_euler;
    parameter_filter_init(&dual.parameters, &model, &constants, &prior);
    for (uint32_t k = 0u; k < (uint32_t)(L * L); k++) {
        dual.parameters.s[k] *= SHARE;
    }
    (void)revise(&dual, &model, &constants, 0.0f, 0.0f, false, correction); /* draws the points */
    dual.parameters.growth = growth;
    dual.state = (state_filter_t){.process_noise = {0.0f, 0.05f}, .output_noise = {1.0f, 1.0e-6f}};
    noise = 0.05 * sqrt((double)PERIOD);
    reference.lambda = 1.0 / (1.0 + ((double)growth * (double)PERIOD));
    reference.w = matrix_zero((uint32_t)L, 1u);
    reference.p = matrix_zero((uint32_t)L, (uint32_t)L);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) { /* the textbook forgets before it learns, the filter after it */
        reference.p.at[i][i] = reference.lambda * (double)(SHARE * SHARE) / (noise * noise);
    }
    state[0] = 0.0f;
    state[1] = 0.0f;
}

void setUp(void)
{
}

void tearDown(void)
{
}

/* The state is known, the next rate measured: both exactly. */
static void filter_step(const model_step_t *step, float next_rate)
{
    const measurement_t measurement = {.y = {NAN, next_rate}, .valid = {false, true}};
    float correction[L];
    for (uint32_t i = 0u; i < 2u; i++) {
        dual.state.x[i] = state[i];
        dual.state.s[i] = (i == 0u) ? 1.0e-9f : 0.0f;
        dual.state.s[2u + i] = (i == 1u) ? 1.0e-9f : 0.0f;
    }
    parameter_filter_forget_state(&dual.parameters);
    dual_predict(&dual, &model, &constants, step);
    (void)dual_update(&dual, &measurement, true);
    TEST_ASSERT_FALSE(revise(&dual, &model, &constants, PERIOD, 0.0f, false, correction));
}

/* Regression of the change of the rate, as a function of w that is linear about the estimate. */
static void reference_step(double u, bool implicit, double change)
{
    const double x[2] = {(double)state[0], (double)state[1]};
    matrix_t phi = matrix_zero((uint32_t)L, 1u);
    double p[L];
    double derivative[L];
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        p[i] = (double)prior.guess[i] + ((double)prior.sigma[i] * reference.w.at[i][0]);
    }
    double y = change - increment_of(p, x, u, implicit, derivative);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        phi.at[i][0] = derivative[i] * (double)prior.sigma[i];
        y += phi.at[i][0] * reference.w.at[i][0];
    }
    rls_update(&reference, phi, y);
}

static void assert_equal(void)
{
    const matrix_t found = matrix_gram(matrix_of(dual.parameters.s, (uint32_t)L, (uint32_t)L));
    const matrix_t wanted =
        matrix_sum(matrix_zero((uint32_t)L, (uint32_t)L), noise * noise / reference.lambda, reference.p);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 0.0, covariance_difference(&found, &wanted, &wanted));
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double sigma = sqrt(wanted.at[i][i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * sigma, reference.w.at[i][0], (double)dual.parameters.w[i]);
    }
}

static void assert_is_rls(bool implicit, float growth)
{
    start(implicit, growth);
    for (uint32_t k = 0u; k < (uint32_t)STEPS; k++) {
        const double t = (double)PERIOD * (double)k;
        const model_step_t step = {.period = PERIOD, .z_ddot = (float)(sin(8.0 * t) + sin(19.0 * t) + sin(33.0 * t))};
        const double x[2] = {(double)state[0], (double)state[1]};
        double derivative[L];
        const double change = increment_of(truth, x, (double)step.z_ddot, implicit, derivative);
        const float rate = (float)(x[1] + change + (noise * random_normal(&source)));
        filter_step(&step, rate);
        reference_step((double)step.z_ddot, implicit, (double)rate - x[1]);
        assert_equal();
        state[0] = (float)(x[0] + ((double)PERIOD * (x[1] + (implicit ? (0.5 * change) : 0.0))));
        state[1] = rate;
    }
}

/* It has learnt: surer than at the start, and right within that. */
static void assert_found(double sigmas)
{
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double sigma = noise * sqrt(reference.p.at[i][i]);
        const double wanted = (truth[i] - (double)prior.guess[i]) / (double)prior.sigma[i];
        TEST_ASSERT_TRUE(sigma < 0.6 * (double)SHARE);
        TEST_ASSERT_DOUBLE_WITHIN(sigmas * sigma, wanted, (double)dual.parameters.w[i]);
    }
}

static void test_without_forgetting_it_is_least_squares(void)
{
    assert_is_rls(false, 0.0f);
    assert_found(3.0);
}

static void test_with_forgetting_it_is_recursive_least_squares(void)
{
    assert_is_rls(false, 0.5f);
    assert_found(3.0);
    assert_is_rls(false, 2.0f);
}

/* The firmware's rule has the damping in a denominator: RLS with the regressors at the estimate. */
static void test_so_it_is_with_the_black_box_of_the_firmware(void)
{
    assert_is_rls(true, 0.0f);
    assert_found(3.0);
    assert_is_rls(true, 0.5f);
    assert_found(3.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_forgetting_it_is_least_squares);
    RUN_TEST(test_with_forgetting_it_is_recursive_least_squares);
    RUN_TEST(test_so_it_is_with_the_black_box_of_the_firmware);
    return UNITY_END();
}
