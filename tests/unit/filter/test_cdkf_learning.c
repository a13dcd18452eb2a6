/* What the parameters learn, walk and forget against the joint Kalman filter of the textbook in double. */
#include "pair.h"

#include <string.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, REPEATS = 200, SAMPLES = 2000 };

static pair_t pair;
static cdkf_t *const cdkf = &pair.cdkf;

void setUp(void)
{
    pair = pair_typical();
}

void tearDown(void)
{
}

/* --- learning ----------------------------------------------------------------------------------------------------- */

/* A block of samples, each output missing with the given probability; then both learn and walk. What is learnt is the
 * change of w and what its variances have lost. Of the first sample both know as much before it, so nis is the same. */
static void run_block(uint32_t samples, double missing, bool joint)
{
    const matrix_t before = pair.reference.x;
    const matrix_t p_before = pair.reference.p;
    correction_t correction;
    for (uint32_t k = 0u; k < samples; k++) {
        double nis[2];
        pair_predict(&pair, PAIR_PERIOD);
        const bool theta_valid = random_unit(&pair.source) >= missing;
        pair_update(&pair, theta_valid, random_unit(&pair.source) >= missing, true, nis);
        TEST_ASSERT_TRUE((k > 0u) || (fabs(nis[0] - nis[1]) < (5.0e-3 * (1.0 + nis[1]))));
    }
    cdkf_learn(cdkf, PAIR_PERIOD * (float)samples, 0.0f, &correction);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const double variance = p_before.at[i][i];
        const double lost = variance - pair.reference.p.at[i][i];
        const double change = pair.reference.x.at[i][0] - before.at[i][0];
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3 * sqrt(variance), change, (double)correction.w[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * variance, lost, (double)correction.variance[i]);
    }
    TEST_ASSERT_FALSE(correction.bounded);
    pair_assert_equal(&pair, 2.0e-3, 5.0e-4);
    pair_walk(&pair, PAIR_PERIOD * (float)samples, 0.0f, joint);
}

static void assert_is_the_textbook(uint32_t samples, double missing, bool joint, float walk_of_w, float growth)
{
    setUp();
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        cdkf->walk[i] = walk_of_w * (float)(i + 1u);
    }
    cdkf->growth = growth;
    for (uint32_t block = 0u; block < ((uint32_t)SAMPLES / samples); block++) {
        run_block(samples, missing, joint);
        pair_assert_equal(&pair, 2.0e-3, 5.0e-4);
    }
}

/* The sum of the information of a block is the joint update of each of its samples: blocks of 1 are the textbook's
 * joint filter. */
static void test_it_is_the_joint_kalman_filter_for_parameters_and_state(void)
{
    const uint32_t samples[] = {1u, 2u, 4u, 25u, 100u};
    for (uint32_t k = 0u; k < 5u; k++) {
        assert_is_the_textbook(samples[k], 0.0, true, 0.0f, 0.0f);
        assert_is_the_textbook(samples[k], 0.4, true, 0.01f, 0.0f);
        assert_is_the_textbook(samples[k], 0.2, true, 0.01f, 0.2f);
    }
}

static void test_the_dual_filter_differs_by_what_the_walk_leaves_unexplained(void)
{
    const uint32_t samples[] = {1u, 10u};
    for (uint32_t k = 0u; k < 2u; k++) {
        assert_is_the_textbook(samples[k], 0.0, false, 0.0f, 0.0f);
        assert_is_the_textbook(samples[k], 0.3, false, 0.01f, 0.0f);
        assert_is_the_textbook(samples[k], 0.0, false, 0.01f, 0.2f);
    }
}

/* One bit of theta is 0.1 of its standard deviation there. */
static void test_noise_near_the_resolution_of_float_costs_less_than_five_per_cent_of_the_covariance(void)
{
    cdkf->process_noise[1] = 5.0e-4f;
    cdkf->output_noise[0] = 1.0e-6f;
    cdkf->output_noise[1] = 1.0e-5f;
    for (uint32_t block = 0u; block < 500u; block++) {
        correction_t correction;
        for (uint32_t k = 0u; k < 10u; k++) {
            double nis[2];
            pair_predict(&pair, PAIR_PERIOD);
            pair_update(&pair, true, true, true, nis);
        }
        cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
        cdkf_draw(cdkf, &pair_model, NULL);
        pair_assert_equal(&pair, 0.3, 5.0e-2);
    }
}

/* d x / d w = (I - K H) (A d x / d w + B) goes on while frozen, or unfreezing would start from a wrong covariance. */
static void test_without_learning_w_stays_and_the_sensitivity_of_the_state_goes_on(void)
{
    pair_t learning = pair;
    double nis[2];
    correction_t correction;
    for (uint32_t k = 0u; k < 50u; k++) {
        pair_predict(&pair, PAIR_PERIOD);
        pair_update(&pair, true, (k % 3u) != 0u, false, nis);
    }
    const cdkf_t frozen = *cdkf;
    cdkf_learn(cdkf, 0.05f, 0.0f, &correction);
    TEST_ASSERT_EQUAL_MEMORY(frozen.s, cdkf->s, sizeof frozen.s);
    TEST_ASSERT_EQUAL_MEMORY(learning.cdkf.w, cdkf->w, sizeof frozen.w);
    pair = learning;
    for (uint32_t k = 0u; k < 50u; k++) {
        pair_predict(&pair, PAIR_PERIOD);
        pair_update(&pair, true, (k % 3u) != 0u, true, nis);
    }
    TEST_ASSERT_EQUAL_MEMORY(frozen.s, cdkf->s, sizeof frozen.s);
    TEST_ASSERT_EQUAL_MEMORY(frozen.s_xx, cdkf->s_xx, sizeof frozen.s_xx);
}

/* The k-th block of ten counts by k tenths: in the textbook its outputs are that much noisier. */
static void test_from_the_start_information_counts_in_part(void)
{
    pair = pair_random(5u);
    for (uint32_t block = 1u; block <= 12u; block++) {
        kalman_t of_w = {.x = matrix_of(cdkf->w, 3u, 1u), .p = matrix_gram(matrix_of(cdkf->s, 3u, 3u))};
        const matrix_t s_inverse = matrix_inverse(matrix_of(cdkf->s, 3u, 3u));
        float row[L];
        random_floats(&pair.source, row, (uint32_t)L, 1.0);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            cdkf->pending.vector[i] = 0.7f * row[i];
            for (uint32_t j = i; j < (uint32_t)L; j++) {
                cdkf->pending.matrix[(i * (uint32_t)L) + j] = row[i] * row[j];
            }
        }
        const matrix_t h = matrix_product(matrix_of(row, 1u, 3u), s_inverse);
        matrix_t y = matrix_product(h, of_w.x);
        y.at[0][0] += (double)0.7f;
        matrix_t r = matrix_identity(1u);
        r.at[0][0] = 1.0 / fmin(0.1 * (double)block, 1.0);
        (void)kalman_update(&of_w, h, r, y);
        correction_t correction;
        cdkf_learn(cdkf, 0.01f, 0.1f, &correction);
        const matrix_t found = matrix_gram(matrix_of(cdkf->s, 3u, 3u));
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, 0.0, covariance_difference(&found, &of_w.p, &of_w.p));
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, of_w.x.at[i][0], (double)cdkf->w[i]);
        }
        const float trust = cdkf->trust;
        cdkf_learn(cdkf, 0.01f, 0.1f, &correction); /* time without information is no reason to trust */
        TEST_ASSERT_TRUE((cdkf->trust == trust) && (correction.w[0] == 0.0f) && (correction.variance[0] == 0.0f));
    }
    TEST_ASSERT_TRUE(cdkf->trust == 1.0f);
}

static void test_w_is_held_at_its_bounds_and_said_to_rest_there(void)
{
    correction_t correction;
    cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
    TEST_ASSERT_FALSE(correction.bounded);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        cdkf->w[i] = 1.0e5f;
        cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
        TEST_ASSERT_TRUE(correction.bounded && (cdkf->w[i] == cdkf->scaling.greatest[i]));
        TEST_ASSERT_TRUE(correction.w[i] == (cdkf->scaling.greatest[i] - 1.0e5f));
        cdkf->w[i] = 0.0f;
    }
}

/* --- walk, forgetting, opening, starting -------------------------------------------------------------------------- */

/* Of w: P / lambda + q T + v. Between x and w: as before. Of x: as before in the joint filter. In the dual filter S_xx,
 * and so the uncertainty of x for given w, is not touched. */
static void test_walk_and_forgetting_widen_w_and_keep_the_rest(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)(2 * REPEATS); repeat++) {
        const bool joint = ((repeat % 2u) == 0u);
        pair = pair_random(repeat);
        cdkf->growth = (random_unit(&pair.source) > 0.3) ? 0.5f : 0.0f;
        random_floats(&pair.source, cdkf->walk, (uint32_t)L, 0.1);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            cdkf->walk[i] = (random_unit(&pair.source) > 0.3) ? fabsf(cdkf->walk[i]) : 0.0f;
        }
        const cdkf_t before = *cdkf;
        pair_walk(&pair, (float)random_between(&pair.source, 1.0e-3, 0.5), (repeat % 3u == 0u) ? 0.02f : 0.0f, joint);
        pair_assert_equal(&pair, 1.0e-9, 4.0e-6);
        TEST_ASSERT_TRUE(joint || (memcmp(before.s_xx, cdkf->s_xx, sizeof before.s_xx) == 0));
    }
}

static void test_without_walk_or_forgetting_nothing_changes(void)
{
    pair = pair_random(1u);
    const cdkf_t before = *cdkf;
    for (uint32_t k = 0u; k < 10000u; k++) {
        pair_walk(&pair, 0.01f, 0.0f, false);
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, cdkf, sizeof before);
}

/* An hour of blocks of 10 ms: information r and walk q a block balance at P = 1 / (1 / P + r) + q, far below the
 * rounding of a single millisecond's. */
static void test_an_hour_of_walk_and_information_balance_as_in_double(void)
{
    const double q = 1.0e-10;
    const double r = 1.0e-5;
    const float none[L] = {0.0f, 0.0f, 0.0f};
    double wanted = 1.0;
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        cdkf->walk[i] = (float)(q / 0.01);
    }
    for (uint32_t block = 0u; block < 360000u; block++) {
        correction_t correction;
        for (uint32_t i = 0u; i < (uint32_t)L; i++) { /* in coordinates of S_ww */
            const float s = cdkf->s[4u * i];
            cdkf->pending.matrix[4u * i] = (float)r * s * s;
        }
        cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
        cdkf_walk(cdkf, 0.01f, none, false);
        wanted = (1.0 / ((1.0 / wanted) + r)) + q;
    }
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        const float s = cdkf->s[4u * i];
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * wanted, wanted, (double)(s * s));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_it_is_the_joint_kalman_filter_for_parameters_and_state);
    RUN_TEST(test_the_dual_filter_differs_by_what_the_walk_leaves_unexplained);
    RUN_TEST(test_noise_near_the_resolution_of_float_costs_less_than_five_per_cent_of_the_covariance);
    RUN_TEST(test_without_learning_w_stays_and_the_sensitivity_of_the_state_goes_on);
    RUN_TEST(test_from_the_start_information_counts_in_part);
    RUN_TEST(test_w_is_held_at_its_bounds_and_said_to_rest_there);
    RUN_TEST(test_walk_and_forgetting_widen_w_and_keep_the_rest);
    RUN_TEST(test_without_walk_or_forgetting_nothing_changes);
    RUN_TEST(test_an_hour_of_walk_and_information_balance_as_in_double);
    return UNITY_END();
}
