/* The joint filter on a linear system against the textbook Kalman filter for [state; parameters] in double, in which the
 * parameters simply have process noise; and what the dual filter leaves out of it. */
#include "filter/dual.h"

#include "pair.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, STEPS = 3000 };

#define FORGETTING 2.0f /* [1/s]: what is older than half a second hardly counts */

static pair_t pair;

void setUp(void)
{
    pair = pair_typical(true);
}

void tearDown(void)
{
}

/* Blocks of `samples`, each output missing with the given probability. */
static void assert_is_the_kalman_filter(uint32_t samples, double missing)
{
    for (uint32_t block = 0u; block < ((uint32_t)STEPS / samples); block++) {
        float correction[L];
        pair_block(&pair, samples, missing, correction);
        pair_assert_equal(&pair, 1.0e-3);
    }
}

static void test_with_walking_parameters_it_is_the_kalman_filter(void)
{
    pair_set_walk(&pair);
    assert_is_the_kalman_filter(1u, 0.0);
}

static void test_so_it_is_with_outputs_missing_at_random(void)
{
    pair_set_walk(&pair);
    assert_is_the_kalman_filter(1u, 0.5);
}

static void test_so_it_is_when_it_learns_from_several_samples_at_once(void)
{
    const uint32_t samples[] = {4u, 25u};
    for (uint32_t k = 0u; k < 2u; k++) {
        setUp();
        pair_set_walk(&pair);
        assert_is_the_kalman_filter(samples[k], 0.3);
    }
}

/* Forgetting is process noise in proportion to the covariance. */
static void test_so_it_is_when_parameters_are_forgotten(void)
{
    pair.dual.parameters.growth = FORGETTING;
    assert_is_the_kalman_filter(4u, 0.2);
    setUp();
    pair_set_walk(&pair);
    pair.dual.parameters.growth = FORGETTING;
    assert_is_the_kalman_filter(4u, 0.2);
}

static void test_a_dual_filter_that_forgets_leaves_out_what_that_frees(void)
{
    pair = pair_typical(false);
    pair.dual.parameters.growth = FORGETTING;
    assert_is_the_kalman_filter(4u, 0.2);
}

static void test_with_constant_parameters_dual_and_joint_are_equal(void)
{
    pair_t dual = pair_typical(false);
    for (uint32_t block = 0u; block < ((uint32_t)STEPS / 4u); block++) {
        float of_joint[L];
        float of_dual[L];
        pair_block(&pair, 4u, 0.2, of_joint);
        pair_block(&dual, 4u, 0.2, of_dual);
        const matrix_t joint = pair_covariance(&pair.dual);
        const matrix_t found = pair_covariance(&dual.dual);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-4, 0.0, covariance_difference(&found, &joint, &joint));
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double sigma = sqrt(joint.at[N + i][N + i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-4 * sigma, (double)of_joint[i], (double)of_dual[i]);
        }
    }
}

/* One walk, from the same belief: of the parameters both know the same, of the state the joint filter as much as before, the
 * dual one less uncertainty by what the wider parameters no longer explain. */
static void test_the_dual_filter_is_surer_of_the_state_by_what_a_walk_frees(void)
{
    float correction[L];
    for (uint32_t block = 0u; block < 100u; block++) {
        pair_set_walk(&pair);
        pair_block(&pair, 4u, 0.0, correction);
    }
    dual_t joint = pair.dual;
    dual_t dual = pair.dual;
    const matrix_t before = pair_covariance(&pair.dual);
    (void)revise(&joint, &pair_model, NULL, 0.1f, 0.0f, true, correction);
    (void)revise(&dual, &pair_model, NULL, 0.1f, 0.0f, false, correction);
    const matrix_t of_joint = pair_covariance(&joint);
    const matrix_t of_dual = pair_covariance(&dual);
    const matrix_t grown = matrix_block(&of_joint, (uint32_t)N, (uint32_t)L, (uint32_t)N, (uint32_t)L);
    const matrix_t freed = matrix_padded(pair_freed(&before, grown), (uint32_t)PAIR_ALL);
    const matrix_t wanted = matrix_sum(of_joint, -1.0, freed);
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-6, 0.0, covariance_difference(&of_dual, &wanted, &of_joint));
    TEST_ASSERT_TRUE(freed.at[1][1] > 0.01 * before.at[1][1]); /* it is something */
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        for (uint32_t j = 0u; j < (uint32_t)PAIR_ALL; j++) {
            const double unit = sqrt(before.at[i][i]) * sqrt(of_joint.at[j][j]);
            TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * unit, before.at[i][j], of_joint.at[i][j]);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_with_walking_parameters_it_is_the_kalman_filter);
    RUN_TEST(test_so_it_is_with_outputs_missing_at_random);
    RUN_TEST(test_so_it_is_when_it_learns_from_several_samples_at_once);
    RUN_TEST(test_so_it_is_when_parameters_are_forgotten);
    RUN_TEST(test_a_dual_filter_that_forgets_leaves_out_what_that_frees);
    RUN_TEST(test_with_constant_parameters_dual_and_joint_are_equal);
    RUN_TEST(test_the_dual_filter_is_surer_of_the_state_by_what_a_walk_frees);
    return UNITY_END();
}
