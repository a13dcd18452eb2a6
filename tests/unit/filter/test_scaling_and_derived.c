/* The scaling of the parameters and their sigma points in double, and what is derived from them against the analytic
 * gradient and Monte Carlo on the linearised plant. */
#include "filter/derived.h"

#include "../math/dense.h"
#include "../model/constants.h"
#include "model/scaling.h"
#include "unity.h"

#include <complex.h>

enum { L = MODEL_PARAMETERS, DRAWS = 100000 };

static const prior_t priors[2] = {{.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.5f}},
    {.guess = {-465.0f, 13.7f, -2.2f}, .sigma = {180.0f, 6.0f, 0.8f}}};
static const model_t *const models[2] = {&model_lever, &model_linear_black_box};

static random_source_t source;
static scaling_t scaling;
static model_t plain;

void setUp(void)
{
    source.state = 31u;
}

void tearDown(void)
{
}

/* --- scale -------------------------------------------------------------------------------------------------------- */

/* Logarithmic (0) or linear (1). */
static void start(uint32_t scale)
{
    plain = *models[scale];
    scaling_init(&scaling, &plain, &priors[scale]);
}

static double parameter_at(uint32_t i, double w)
{
    const double guess = (double)scaling.prior.guess[i];
    return scaling.positive ? (guess * exp(w)) : (guess + ((double)scaling.prior.sigma[i] * w));
}

static void test_bounds_are_those_of_the_model_on_either_scale_or_the_guess_where_that_is_outside(void)
{
    for (uint32_t scale = 0u; scale < 2u; scale++) {
        start(scale);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double least = (double)plain.parameter[i].least;
            const double greatest = (double)plain.parameter[i].greatest;
            TEST_ASSERT_DOUBLE_WITHIN(3.0e-6 * fabs(greatest), least, parameter_at(i, (double)scaling.least[i]));
            TEST_ASSERT_DOUBLE_WITHIN(3.0e-6 * fabs(greatest), greatest, parameter_at(i, (double)scaling.greatest[i]));
        }
        prior_t outside = priors[scale];
        outside.guess[0] = plain.parameter[0].greatest * 1.1f;
        outside.guess[1] = plain.parameter[1].least * ((scale == 0u) ? 0.9f : 1.1f);
        scaling_init(&scaling, &plain, &outside);
        TEST_ASSERT_TRUE((scaling.greatest[0] == 0.0f) && (scaling.least[0] < 0.0f));
        TEST_ASSERT_TRUE((scaling.least[1] == 0.0f) && (scaling.greatest[1] > 0.0f));
    }
}

static void test_w_is_kept_within_its_bounds(void)
{
    start(0u);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        float w[L] = {0.1f, -0.1f, 0.2f};
        TEST_ASSERT_FALSE(scaling_bound(&scaling, w));
        TEST_ASSERT_TRUE((w[0] == 0.1f) && (w[1] == -0.1f) && (w[2] == 0.2f));
        w[i] = scaling.greatest[i] + 0.01f;
        TEST_ASSERT_TRUE(scaling_bound(&scaling, w) && (w[i] == scaling.greatest[i]));
        w[i] = scaling.least[i] - 0.01f;
        TEST_ASSERT_TRUE(scaling_bound(&scaling, w) && (w[i] == scaling.least[i]));
        TEST_ASSERT_FALSE(scaling_bound(&scaling, w));
    }
}

static void test_parameters_slopes_and_sigma_points_are_those_of_the_scale(void)
{
    for (uint32_t repeat = 0u; repeat < 400u; repeat++) {
        float w[L];
        float s[L * L];
        float p[L];
        float plus[L];
        float minus[L];
        start(repeat % 2u);
        random_floats(&source, w, (uint32_t)L, 3.0);
        random_factor(&source, s, (uint32_t)L, (uint32_t)L);
        scaling_parameters(&scaling, w, p);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double at = parameter_at(i, (double)w[i]);
            const double slope = parameter_at(i, (double)w[i] + 1.0e-6) - parameter_at(i, (double)w[i] - 1.0e-6);
            const double size = fabs((double)scaling.prior.guess[i]) + fabs(at);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-6 * size, at, (double)p[i]);
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * size, slope / 2.0e-6, (double)scaling_slope(&scaling, p, i));
        }
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const float offset[L] = {SIGMA_OFFSET * s[j], SIGMA_OFFSET * s[L + j], SIGMA_OFFSET * s[(2 * L) + j]};
            scaling_pair(&scaling, p, offset, plus, minus);
            for (uint32_t i = 0u; i < (uint32_t)L; i++) {
                const double above = parameter_at(i, (double)w[i] + (double)offset[i]);
                const double below = parameter_at(i, (double)w[i] - (double)offset[i]);
                const double size = fabs((double)scaling.prior.guess[i]) + fabs(parameter_at(i, (double)w[i]));
                TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * (size + fabs(above)), above, (double)plus[i]);
                TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * (size + fabs(below)), below, (double)minus[i]);
            }
        }
    }
}

static void test_the_prior_has_standard_deviation_sigma_on_a_logarithmic_scale_and_1_on_a_linear_one(void)
{
    start(0u);
    TEST_ASSERT_TRUE(scaling_prior_sigma(&scaling, 1u) == 0.6f);
    start(1u);
    TEST_ASSERT_TRUE(scaling_prior_sigma(&scaling, 1u) == 1.0f);
}

/* --- derived ------------------------------------------------------------------------------------------------------ */

static cdkf_t cdkf;
static plant_t plant;
static derived_dynamics_t dynamics;
static derived_feedthrough_t feedthrough;

#define FREQUENCY 3.0 /* of the feedthrough [Hz], near the resonance */

/* Natural frequency, damping ratio, and of the feedthrough the real and imaginary part. */
enum { QUANTITIES = 4 };

/* A belief of the lever with a correlated factor of about `scale`, or with everything in common; and what follows. */
static void derive(float scale, bool common)
{
    const float s[L * L] = {0.8f, 0.0f, 0.0f, -0.5f, 0.9f, 0.0f, 0.6f, 0.4f, 0.7f};
    plant = plant_typical();
    const model_constants_t constants = constants_of(&plant);
    const model_step_t step = {
        .trim = (float)plant.trim, .trim_sine = (float)sin(plant.trim), .trim_cosine = (float)cos(plant.trim)};
    cdkf_init(&cdkf, &model_lever, &constants, &priors[0]);
    for (uint32_t k = 0u; k < (uint32_t)(L * L); k++) {
        cdkf.s[k] = common ? (((k % (uint32_t)L) == 0u) ? scale : 0.0f) : (scale * s[k]);
    }
    cdkf.w[0] = 0.2f;
    cdkf.w[1] = -0.1f;
    cdkf.w[2] = 0.3f;
    cdkf_draw(&cdkf, &model_lever, &constants);
    dynamics = derived_dynamics(&cdkf, &model_lever, &constants, &step);
    feedthrough = derived_feedthrough(&cdkf, &model_lever, &constants, &step, (float)FREQUENCY);
}

/* The same of the plant at w + offset. */
static void quantities_at(const double offset[L], double quantity[QUANTITIES])
{
    plant_t moved = plant;
    moved.m_p = 2.5 * exp((double)cdkf.w[0] + offset[0]);
    moved.c_p = 42.0 * exp((double)cdkf.w[1] + offset[1]);
    moved.k_p = 1500.0 * exp((double)cdkf.w[2] + offset[2]);
    const double omega = 6.283185307179586 * FREQUENCY;
    const double complex s = omega * (double complex)I;
    const double complex response =
        plant_forcing(&moved) / ((s * s) + (plant_damping(&moved) * s) + plant_stiffness(&moved));
    quantity[0] = plant_natural_frequency(&moved);
    quantity[1] = plant_damping_ratio(&moved);
    quantity[2] = creal(response);
    quantity[3] = cimag(response);
}

/* From the means and the covariance of the four: standard deviations of the first two, then of the feedthrough's gain
 * (relative) and phase, by ln z = ln gain + i phase to first order; and the correlation of those two. */
static void assert_deviations(const double at[QUANTITIES], double covariance[QUANTITIES][QUANTITIES], double tolerance)
{
    const double size = (at[2] * at[2]) + (at[3] * at[3]);
    const double by_gain[2] = {at[2] / size, at[3] / size};
    const double by_phase[2] = {-at[3] / size, at[2] / size};
    double gain = 0.0;
    double phase = 0.0;
    double both = 0.0;
    for (uint32_t i = 0u; i < 2u; i++) {
        for (uint32_t j = 0u; j < 2u; j++) {
            gain += by_gain[i] * covariance[2u + i][2u + j] * by_gain[j];
            phase += by_phase[i] * covariance[2u + i][2u + j] * by_phase[j];
            both += by_gain[i] * covariance[2u + i][2u + j] * by_phase[j];
        }
    }
    const double wanted[QUANTITIES] = {sqrt(covariance[0][0]), sqrt(covariance[1][1]), sqrt(gain), sqrt(phase)};
    const double found[QUANTITIES] = {(double)dynamics.natural_frequency_sigma, (double)dynamics.damping_ratio_sigma,
        (double)feedthrough.gain_sigma, (double)feedthrough.phase_sigma};
    for (uint32_t i = 0u; i < (uint32_t)QUANTITIES; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(tolerance * wanted[i], wanted[i], found[i]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, both / (wanted[2] * wanted[3]), (double)feedthrough.correlation);
}

/* Covariance of the plant's quantities over draws of w ~ N(w, S S^T). */
static void monte_carlo(double covariance[QUANTITIES][QUANTITIES])
{
    double sum[QUANTITIES] = {0.0};
    for (uint32_t k = 0u; k < (uint32_t)DRAWS; k++) {
        double offset[L] = {0.0, 0.0, 0.0};
        double drawn[QUANTITIES];
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const double unit = random_normal(&source);
            for (uint32_t i = j; i < (uint32_t)L; i++) {
                offset[i] += (double)cdkf.s[(i * L) + j] * unit;
            }
        }
        quantities_at(offset, drawn);
        for (uint32_t i = 0u; i < (uint32_t)QUANTITIES; i++) {
            sum[i] += drawn[i] / (double)DRAWS;
            for (uint32_t j = 0u; j < (uint32_t)QUANTITIES; j++) {
                covariance[i][j] += drawn[i] * drawn[j] / (double)DRAWS;
            }
        }
    }
    for (uint32_t i = 0u; i < (uint32_t)QUANTITIES; i++) {
        for (uint32_t j = 0u; j < (uint32_t)QUANTITIES; j++) {
            covariance[i][j] -= sum[i] * sum[j];
        }
    }
}

static void test_derived_values_and_small_standard_deviations_are_those_of_the_linearised_plant(void)
{
    const double none[L] = {0.0, 0.0, 0.0};
    double at[QUANTITIES];
    double covariance[QUANTITIES][QUANTITIES] = {{0.0}};
    derive(1.0e-3f, false);
    quantities_at(none, at);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * at[0], at[0], (double)dynamics.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * at[1], at[1], (double)dynamics.damping_ratio);
    TEST_ASSERT_DOUBLE_WITHIN(4.0e-6 * fabs(at[2]), at[2], (double)feedthrough.real);
    TEST_ASSERT_DOUBLE_WITHIN(4.0e-6 * fabs(at[3]), at[3], (double)feedthrough.imaginary);
    for (uint32_t j = 0u; j < (uint32_t)L; j++) { /* along each column of S */
        const double along[L] = {(double)cdkf.s[j], (double)cdkf.s[L + j], (double)cdkf.s[(2 * L) + j]};
        double moved[QUANTITIES];
        quantities_at(along, moved);
        for (uint32_t i = 0u; i < (uint32_t)QUANTITIES; i++) {
            for (uint32_t k = 0u; k < (uint32_t)QUANTITIES; k++) {
                covariance[i][k] += (moved[i] - at[i]) * (moved[k] - at[k]);
            }
        }
    }
    assert_deviations(at, covariance, 4.0e-3);
}

static void test_derived_standard_deviations_agree_with_monte_carlo_within_five_per_cent(void)
{
    const double none[L] = {0.0, 0.0, 0.0};
    double at[QUANTITIES];
    double covariance[QUANTITIES][QUANTITIES] = {{0.0}};
    derive(0.1f, false);
    quantities_at(none, at);
    monte_carlo(covariance);
    assert_deviations(at, covariance, 0.05);
}

/* m_p, c_p and k_p scaled alike change the frequency hardly: only the lever's own inertia and spring tell. */
static void test_a_common_scale_that_is_unknown_hardly_shows_in_frequency_and_feedthrough(void)
{
    derive(0.3f, true);
    TEST_ASSERT_TRUE(dynamics.natural_frequency_sigma < 0.03f * dynamics.natural_frequency);
    TEST_ASSERT_TRUE((feedthrough.gain_sigma < 0.08f) && (feedthrough.phase_sigma < 0.05f));
}

/* A falling lever has no natural frequency, but answers the base. */
static void test_without_stiffness_there_is_no_natural_frequency(void)
{
    const model_constants_t constants = {.trim = true};
    const model_step_t step = {.trim_cosine = 1.0f};
    const prior_t prior = {.guess = {20.0f, -4.0f, -2.0f}, .sigma = {1.0f, 1.0f, 1.0f}};
    cdkf_init(&cdkf, &model_linear_black_box, &constants, &prior);
    cdkf_draw(&cdkf, &model_linear_black_box, &constants);
    dynamics = derived_dynamics(&cdkf, &model_linear_black_box, &constants, &step);
    feedthrough = derived_feedthrough(&cdkf, &model_linear_black_box, &constants, &step, 0.0f);
    TEST_ASSERT_TRUE((dynamics.natural_frequency == 0.0f) && (dynamics.damping_ratio == 0.0f));
    TEST_ASSERT_EQUAL_FLOAT(0.1f, feedthrough.real);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bounds_are_those_of_the_model_on_either_scale_or_the_guess_where_that_is_outside);
    RUN_TEST(test_w_is_kept_within_its_bounds);
    RUN_TEST(test_parameters_slopes_and_sigma_points_are_those_of_the_scale);
    RUN_TEST(test_the_prior_has_standard_deviation_sigma_on_a_logarithmic_scale_and_1_on_a_linear_one);
    RUN_TEST(test_derived_values_and_small_standard_deviations_are_those_of_the_linearised_plant);
    RUN_TEST(test_derived_standard_deviations_agree_with_monte_carlo_within_five_per_cent);
    RUN_TEST(test_a_common_scale_that_is_unknown_hardly_shows_in_frequency_and_feedthrough);
    RUN_TEST(test_without_stiffness_there_is_no_natural_frequency);
    return UNITY_END();
}
