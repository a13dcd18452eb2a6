/* The scaling of the parameters and their sigma points in double, and what is derived from them against the analytic
 * gradient and Monte Carlo on the linearised plant. */
#include "filter/derived.h"

#include "../math/dense.h"
#include "../model/constants.h"
#include "model/scaling.h"
#include "unity.h"

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

/* A belief of the lever with a correlated factor of about `scale`; or with everything in common. */
static derived_t derive(float scale, bool common)
{
    const float s[L * L] = {0.8f, 0.0f, 0.0f, -0.5f, 0.9f, 0.0f, 0.6f, 0.4f, 0.7f};
    plant = plant_typical();
    const model_constants_t constants = constants_of(&plant);
    const model_step_t step = {
        .trim = (float)plant.trim, .trim_sine = (float)sin(plant.trim), .trim_cosine = (float)cos(plant.trim)};
    derived_t derived;
    cdkf_init(&cdkf, &model_lever, &constants, &priors[0]);
    for (uint32_t k = 0u; k < (uint32_t)(L * L); k++) {
        cdkf.s[k] = common ? (((k % (uint32_t)L) == 0u) ? scale : 0.0f) : (scale * s[k]);
    }
    cdkf.w[0] = 0.2f;
    cdkf.w[1] = -0.1f;
    cdkf.w[2] = 0.3f;
    cdkf_draw(&cdkf, &model_lever, &constants);
    derived_compute(&derived, &cdkf, &model_lever, &constants, &step);
    return derived;
}

/* Frequency and damping ratio of the plant at w + offset. */
static void dynamics_at(const double offset[L], double dynamics[2])
{
    plant_t moved = plant;
    moved.m_p = 2.5 * exp((double)cdkf.w[0] + offset[0]);
    moved.c_p = 42.0 * exp((double)cdkf.w[1] + offset[1]);
    moved.k_p = 1500.0 * exp((double)cdkf.w[2] + offset[2]);
    dynamics[0] = plant_natural_frequency(&moved);
    dynamics[1] = plant_damping_ratio(&moved);
}

/* Standard deviations of the plant's dynamics over draws of w ~ N(w, S S^T). */
static void monte_carlo(double sigma[2])
{
    double sum[2] = {0.0, 0.0};
    double square[2] = {0.0, 0.0};
    for (uint32_t k = 0u; k < (uint32_t)DRAWS; k++) {
        double offset[L] = {0.0, 0.0, 0.0};
        double drawn[2];
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const double unit = random_normal(&source);
            for (uint32_t i = j; i < (uint32_t)L; i++) {
                offset[i] += (double)cdkf.s[(i * L) + j] * unit;
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

static void test_derived_values_and_small_standard_deviations_are_those_of_the_linearised_plant(void)
{
    const double none[L] = {0.0, 0.0, 0.0};
    const derived_t found = derive(1.0e-3f, false);
    const double variance[2] = {(double)found.variance.natural_frequency, (double)found.variance.damping_ratio};
    double at[2];
    double sum[2] = {0.0, 0.0};
    dynamics_at(none, at);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * at[0], at[0], (double)found.mean.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * at[1], at[1], (double)found.mean.damping_ratio);
    for (uint32_t j = 0u; j < (uint32_t)L; j++) { /* along each column of S */
        const double along[L] = {(double)cdkf.s[j], (double)cdkf.s[L + j], (double)cdkf.s[(2 * L) + j]};
        double moved[2];
        dynamics_at(along, moved);
        sum[0] += (moved[0] - at[0]) * (moved[0] - at[0]);
        sum[1] += (moved[1] - at[1]) * (moved[1] - at[1]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(4.0e-3 * sum[0], sum[0], variance[0]);
    TEST_ASSERT_DOUBLE_WITHIN(4.0e-3 * sum[1], sum[1], variance[1]);
}

static void test_derived_standard_deviations_of_a_quarter_agree_with_monte_carlo_within_five_per_cent(void)
{
    double wanted[2];
    const derived_t found = derive(0.25f, false);
    monte_carlo(wanted);
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * wanted[0], wanted[0], sqrt((double)found.variance.natural_frequency));
    TEST_ASSERT_DOUBLE_WITHIN(0.05 * wanted[1], wanted[1], sqrt((double)found.variance.damping_ratio));
}

/* m_p, c_p and k_p scaled alike change the frequency hardly: only the lever's own inertia and spring tell. */
static void test_a_common_scale_that_is_unknown_hardly_shows_in_the_frequency(void)
{
    const derived_t found = derive(0.3f, true);
    TEST_ASSERT_TRUE(sqrtf(found.variance.natural_frequency) < 0.03f * found.mean.natural_frequency);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bounds_are_those_of_the_model_on_either_scale_or_the_guess_where_that_is_outside);
    RUN_TEST(test_w_is_kept_within_its_bounds);
    RUN_TEST(test_parameters_slopes_and_sigma_points_are_those_of_the_scale);
    RUN_TEST(test_the_prior_has_standard_deviation_sigma_on_a_logarithmic_scale_and_1_on_a_linear_one);
    RUN_TEST(test_derived_values_and_small_standard_deviations_are_those_of_the_linearised_plant);
    RUN_TEST(test_derived_standard_deviations_of_a_quarter_agree_with_monte_carlo_within_five_per_cent);
    RUN_TEST(test_a_common_scale_that_is_unknown_hardly_shows_in_the_frequency);
    return UNITY_END();
}
