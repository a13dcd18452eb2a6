/* The limits of the scaling of the parameters, and of what is derived from them. */
#include "filter/derived.h"

#include "model/scaling.h"
#include "test.h"

#include <math.h>

enum { L = MODEL_PARAMETERS };

static const prior_t priors[2] = {{.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.5f}},
    {.guess = {-465.0f, 13.7f, -2.2f}, .sigma = {180.0f, 6.0f, 0.8f}}};
static const model_t *const models[2] = {&model_lever, &model_linear_black_box};

static scaling_t scaling;
static model_t plain;

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

TEST(bounds_are_those_of_the_model_on_either_scale_or_the_guess_where_that_is_outside)
{
    for (uint32_t scale = 0u; scale < 2u; scale++) {
        start(scale);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double least = (double)plain.parameter[i].least;
            const double greatest = (double)plain.parameter[i].greatest;
            TEST_ASSERT_DOUBLE_WITHIN(3.0e-6 * fabs(greatest), least, parameter_at(i, (double)scaling.least[i]));
            TEST_ASSERT_DOUBLE_WITHIN(3.0e-6 * fabs(greatest), greatest, parameter_at(i, (double)scaling.greatest[i]));
        }
        prior_t near = priors[scale]; /* less than a unit of w from the bounds */
        near.guess[0] = plain.parameter[0].greatest * 0.9f;
        near.sigma[0] = 4000.0f;
        scaling_init(&scaling, &plain, &near);
        TEST_ASSERT_DOUBLE_WITHIN(3.0e-6 * (double)fabsf(plain.parameter[0].greatest),
            (double)plain.parameter[0].greatest, parameter_at(0u, (double)scaling.greatest[0]));
        prior_t outside = priors[scale];
        outside.guess[0] = plain.parameter[0].greatest * 1.1f;
        outside.guess[1] = plain.parameter[1].least * ((scale == 0u) ? 0.9f : 1.1f);
        scaling_init(&scaling, &plain, &outside);
        TEST_ASSERT_TRUE((scaling.greatest[0] == 0.0f) && (scaling.least[0] < 0.0f));
        TEST_ASSERT_TRUE((scaling.least[1] == 0.0f) && (scaling.greatest[1] > 0.0f));
    }
}

TEST(a_pair_is_so_far_from_the_parameters_on_either_side)
{
    static const float offset[L] = {0.0f, 1.0f, -0.25f};
    for (uint32_t scale = 0u; scale < 2u; scale++) {
        float plus[L];
        float minus[L];
        start(scale);
        scaling_pair(&scaling, priors[scale].guess, offset, plus, minus);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double tolerance = 3.0e-6 * fabs((double)priors[scale].guess[i]) * ((scale == 0u) ? 3.0 : 100.0);
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, parameter_at(i, (double)offset[i]), (double)plus[i]);
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, parameter_at(i, -(double)offset[i]), (double)minus[i]);
        }
    }
}

TEST(w_is_kept_within_its_bounds)
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
        TEST_ASSERT_TRUE(scaling_bound(&scaling, w) && (w[i] == scaling.least[i])); /* it rests there */
        w[i] += 0.01f;
        TEST_ASSERT_FALSE(scaling_bound(&scaling, w));
    }
}

/* --- derived ------------------------------------------------------------------------------------------------------ */

/* A falling lever, or one without a spring, has no natural frequency, but answers the base. */
TEST_EACH(2, without_stiffness_there_is_no_natural_frequency)
{
    const model_constants_t constants = {.trim = true};
    const model_step_t step = {.trim_cosine = 1.0f};
    static cdkf_t cdkf;
    const prior_t prior = {.guess = {(test_round == 0u) ? 20.0f : 0.0f, -4.0f, -2.0f}, .sigma = {1.0f, 1.0f, 1.0f}};
    cdkf_init(&cdkf, &model_linear_black_box, &constants, &prior);
    cdkf_draw(&cdkf, &model_linear_black_box, &constants);
    const derived_dynamics_t dynamics = derived_dynamics(&cdkf, &model_linear_black_box, &constants, &step);
    TEST_ASSERT_TRUE((dynamics.natural_frequency == 0.0f) && (dynamics.damping_ratio == 0.0f));
    const float frequency = (test_round == 0u) ? 0.0f : (0.5f / 3.14159265f); /* of 1 rad/s */
    const derived_feedthrough_t feedthrough =
        derived_feedthrough(&cdkf, &model_linear_black_box, &constants, &step, frequency);
    TEST_ASSERT_EQUAL_FLOAT((test_round == 0u) ? 0.1f : (2.0f / 17.0f), feedthrough.real);
    for (uint32_t k = 1u; k < (uint32_t)MODEL_POINTS; k++) {
        cdkf.points[k] = cdkf.points[0];
    }
    const derived_feedthrough_t certain =
        derived_feedthrough(&cdkf, &model_linear_black_box, &constants, &step, frequency);
    TEST_ASSERT_TRUE((certain.gain_sigma == 0.0f) && (certain.correlation == 0.0f));
}
