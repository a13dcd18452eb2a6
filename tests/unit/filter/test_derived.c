/* Natural frequency, damping ratio and their standard deviations against the analytic gradient and against Monte Carlo on
 * the plant linearised in double. */
#include "filter/derived.h"

#include "../model/constants.h"
#include "kalman.h"
#include "revise.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS, DRAWS = 200000 };

static random_source_t source;
static dual_t dual;
static plant_t plant;

void setUp(void)
{
    const prior_t prior = {.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.6f}};
    source.state = 31u;
    plant = plant_typical();
    const model_constants_t constants = constants_of(&plant);
    parameter_filter_init(&dual.parameters, &model_lever, &constants, &prior);
    dual.parameters.w[0] = 0.2f;
    dual.parameters.w[1] = -0.1f;
    dual.parameters.w[2] = 0.3f;
}

void tearDown(void)
{
}

/* A correlated factor with standard deviations of about `scale`. */
static void set_factor(float scale)
{
    const float s[L * L] = {0.8f, 0.0f, 0.0f, -0.5f, 0.9f, 0.0f, 0.6f, 0.4f, 0.7f};
    for (uint32_t k = 0u; k < (uint32_t)(L * L); k++) {
        dual.parameters.s[k] = scale * s[k];
    }
}

static void derive(model_dynamics_t *dynamics, model_dynamics_t *sigma)
{
    float correction[L];
    derived_t derived;
    const model_constants_t constants = constants_of(&plant);
    const model_step_t step = {
        .trim = (float)plant.trim, .trim_sine = (float)sin(plant.trim), .trim_cosine = (float)cos(plant.trim)};
    (void)revise(&dual, &model_lever, &constants, 0.0f, 0.0f, false, correction); /* draws the points */
    derived_begin(&derived, &dual.parameters, &model_lever, &constants, &step);
    derived_end(&derived, &dual.parameters, &model_lever, &constants, &step);
    *dynamics = derived.mean;
    sigma->natural_frequency = sqrtf(derived.variance.natural_frequency);
    sigma->damping_ratio = sqrtf(derived.variance.damping_ratio);
}

/* Frequency and damping ratio of the plant at w + offset. */
static void dynamics_at(const double offset[L], double dynamics[2])
{
    plant_t moved = plant;
    moved.m_p = 2.5 * exp((double)dual.parameters.w[0] + offset[0]);
    moved.c_p = 42.0 * exp((double)dual.parameters.w[1] + offset[1]);
    moved.k_p = 1500.0 * exp((double)dual.parameters.w[2] + offset[2]);
    dynamics[0] = plant_natural_frequency(&moved);
    dynamics[1] = plant_damping_ratio(&moved);
}

static void test_values_are_those_of_the_linearised_plant_at_the_estimate(void)
{
    const double none[L] = {0.0, 0.0, 0.0};
    double wanted[2];
    model_dynamics_t found;
    model_dynamics_t sigma;
    set_factor(0.1f);
    derive(&found, &sigma);
    dynamics_at(none, wanted);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * wanted[0], wanted[0], (double)found.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * wanted[1], wanted[1], (double)found.damping_ratio);
}

static void test_small_standard_deviations_follow_the_gradient(void)
{
    model_dynamics_t found;
    model_dynamics_t sigma;
    set_factor(1.0e-3f);
    derive(&found, &sigma);
    matrix_t gradient = matrix_zero(2u, (uint32_t)L);
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        double offset[L] = {0.0, 0.0, 0.0};
        double above[2];
        double below[2];
        offset[j] = 1.0e-3;
        dynamics_at(offset, above);
        offset[j] = -1.0e-3;
        dynamics_at(offset, below);
        gradient.at[0][j] = (above[0] - below[0]) / 2.0e-3;
        gradient.at[1][j] = (above[1] - below[1]) / 2.0e-3;
    }
    const matrix_t covariance =
        matrix_gram(matrix_product(gradient, matrix_of(dual.parameters.s, (uint32_t)L, (uint32_t)L)));
    const double frequency = sqrt(covariance.at[0][0]);
    const double damping = sqrt(covariance.at[1][1]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * frequency, frequency, (double)sigma.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * damping, damping, (double)sigma.damping_ratio);
}

/* Standard deviations of the plant's dynamics over draws of w ~ N(w, S S^T). */
static void monte_carlo(double sigma[2])
{
    double sum[2] = {0.0, 0.0};
    double square[2] = {0.0, 0.0};
    for (uint32_t k = 0u; k < DRAWS; k++) {
        double offset[L] = {0.0, 0.0, 0.0};
        double drawn[2];
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const double unit = random_normal(&source);
            for (uint32_t i = j; i < (uint32_t)L; i++) {
                offset[i] += (double)dual.parameters.s[(i * L) + j] * unit;
            }
        }
        dynamics_at(offset, drawn);
        for (uint32_t i = 0u; i < 2u; i++) {
            sum[i] += drawn[i];
            square[i] += drawn[i] * drawn[i];
        }
    }
    for (uint32_t i = 0u; i < 2u; i++) {
        const double mean = sum[i] / (double)DRAWS;
        sigma[i] = sqrt((square[i] / (double)DRAWS) - (mean * mean));
    }
}

static void test_standard_deviations_of_a_quarter_agree_with_monte_carlo_within_five_per_cent(void)
{
    double wanted[2];
    model_dynamics_t found;
    model_dynamics_t sigma;
    set_factor(0.25f);
    derive(&found, &sigma);
    monte_carlo(wanted);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * wanted[0], wanted[0], (double)sigma.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * wanted[1], wanted[1], (double)sigma.damping_ratio);
}

/* m_p, c_p and k_p scaled alike change the frequency hardly: only the lever's own inertia and spring tell. */
static void test_a_common_scale_that_is_unknown_hardly_shows_in_the_frequency(void)
{
    model_dynamics_t found;
    model_dynamics_t sigma;
    set_factor(0.0f);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        dual.parameters.s[i * L] = 0.3f;
    }
    derive(&found, &sigma);
    TEST_ASSERT_TRUE(sigma.natural_frequency < 0.03f * found.natural_frequency);
}

static void test_parameters_come_in_their_units_with_sigma_to_first_order(void)
{
    const double guess[L] = {2.5, 42.0, 1500.0};
    float sigma[L];
    set_factor(0.1f);
    parameter_filter_at(&dual.parameters, dual.parameters.w, dual.parameters.p);
    parameter_filter_sigma(&dual.parameters, sigma);
    const matrix_t covariance = matrix_gram(matrix_of(dual.parameters.s, (uint32_t)L, (uint32_t)L));
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double wanted = guess[i] * exp((double)dual.parameters.w[i]);
        const double wanted_sigma = wanted * sqrt(covariance.at[i][i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * wanted, wanted, (double)dual.parameters.p[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * wanted_sigma, wanted_sigma, (double)sigma[i]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_values_are_those_of_the_linearised_plant_at_the_estimate);
    RUN_TEST(test_small_standard_deviations_follow_the_gradient);
    RUN_TEST(test_standard_deviations_of_a_quarter_agree_with_monte_carlo_within_five_per_cent);
    RUN_TEST(test_a_common_scale_that_is_unknown_hardly_shows_in_the_frequency);
    RUN_TEST(test_parameters_come_in_their_units_with_sigma_to_first_order);
    return UNITY_END();
}
