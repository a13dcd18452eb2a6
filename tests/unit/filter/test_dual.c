/* The dual filter on a linear system against the textbook Kalman filter for [state; parameters] in double. Without a walk
 * of the parameters the two are the same filter (Friedland 1969), whatever outputs are missing, however many samples the
 * parameters gather before they learn. */
#include "filter/dual.h"

#include "math/factor.h"
#include "pair.h"
#include "unity.h"

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, STEPS = 3000 };

static pair_t pair;

void setUp(void)
{
    pair = pair_typical(false);
}

void tearDown(void)
{
}

/* --- learning ----------------------------------------------------------------------------------------------------- */

/* Blocks of `samples`, each output missing with the given probability. */
static void assert_same_run(uint32_t samples, double missing)
{
    for (uint32_t block = 0u; block < ((uint32_t)STEPS / samples); block++) {
        const matrix_t before = pair.reference.x;
        float correction[L];
        pair_block(&pair, samples, missing, correction);
        pair_assert_equal(&pair, 5.0e-4);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double change = pair.reference.x.at[N + i][0] - before.at[N + i][0];
            const double sigma = sqrt(pair.reference.p.at[N + i][N + i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * sigma, change, (double)correction[i]);
        }
    }
}

static void test_without_a_walk_it_is_the_kalman_filter_for_state_and_parameters(void)
{
    assert_same_run(1u, 0.0);
}

static void test_so_it_is_with_outputs_missing_at_random(void)
{
    assert_same_run(1u, 0.5);
}

static void test_so_it_is_when_it_learns_from_several_samples_at_once(void)
{
    const uint32_t samples[] = {2u, 4u, 25u, 100u};
    for (uint32_t k = 0u; k < 4u; k++) {
        setUp();
        assert_same_run(samples[k], 0.3);
    }
}

/* Samples that come while a revision is under way are not lost: what they said is carried over. */
static void test_so_it_is_when_what_was_learnt_is_adopted_some_samples_later(void)
{
    revision_t *revision = &pair.dual.revision;
    parameter_filter_t *parameters = &pair.dual.parameters;
    float correction[L];
    float learnt[L];
    for (uint32_t block = 0u; block < ((uint32_t)STEPS / 10u); block++) {
        (void)revise_prepare(&pair.dual, 0.01f, 0.0f, NULL, false, learnt);
        for (uint32_t k = 0u; k < 10u; k++) {
            pair_predict(&pair);
            const measurement_t measurement = pair_measurement(&pair, (k % 4u) != 1u, (k % 3u) != 0u);
            (void)dual_update(&pair.dual, &measurement, true);
            (void)pair_reference_update(&pair, &measurement);
            if (k == 6u) {
                revision_adopt(revision, parameters, &pair_model, NULL, pair.dual.state.x);
            }
            if (k == 8u) {
                revision_carry_score(revision, parameters);
                revision_carry_information(revision, parameters);
            }
        }
    }
    (void)revise(&pair.dual, &pair_model, NULL, 0.01f, 0.0f, false, correction);
    pair_assert_equal(&pair, 5.0e-4);
}

static void test_a_walk_widens_the_parameters_and_not_the_state_given_them(void)
{
    pair_set_walk(&pair);
    assert_same_run(1u, 0.2);
    setUp();
    pair_set_walk(&pair);
    assert_same_run(4u, 0.2);
}

static void learn_for(uint32_t steps)
{
    for (uint32_t k = 0u; k < steps; k++) {
        float correction[L];
        pair_block(&pair, 1u, 0.0, correction);
    }
}

static void test_it_learns_the_parameters(void)
{
    learn_for(STEPS);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE(factor_sigma(pair.dual.parameters.s, (uint32_t)L, i) < 0.1f);
    }
}

static void test_state_sigma_includes_what_the_parameters_do_to_the_state(void)
{
    for (uint32_t k = 0u; k < 200u; k++) {
        pair_predict(&pair);
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            const double wanted = sqrt(pair.reference.p.at[i][i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-4 * wanted, wanted, (double)dual_state_sigma(&pair.dual, i));
        }
    }
}

/* --- frozen ------------------------------------------------------------------------------------------------------- */

static void test_frozen_keeps_the_parameters_and_their_covariance_to_the_bit(void)
{
    learn_for(500u);
    pair_set_walk(&pair);
    const parameter_filter_t before = pair.dual.parameters;
    for (uint32_t k = 0u; k < 500u; k++) {
        pair_predict(&pair);
        const measurement_t measurement = pair_measurement(&pair, true, (k % 3u) != 0u);
        (void)dual_update(&pair.dual, &measurement, false);
    }
    const parameter_filter_t *after = &pair.dual.parameters;
    TEST_ASSERT_EQUAL_MEMORY(before.w, after->w, sizeof before.w);
    TEST_ASSERT_EQUAL_MEMORY(before.s, after->s, sizeof(float) * (size_t)(L * L));
    TEST_ASSERT_EQUAL_MEMORY(before.walk, after->walk, sizeof before.walk);
    TEST_ASSERT_EQUAL_MEMORY(&before.gathered, &after->gathered, sizeof before.gathered);
}

/* Frozen, the state filter takes the parameters as given; how far the state is wrong if they are wrong must go on being
 * carried, d x / d w = (I - K H) (A d x / d w + B), or unfreezing would start from a wrong covariance. */
static void test_frozen_carries_the_sensitivity_of_the_state_on(void)
{
    const state_filter_t *state = &pair.dual.state;
    kalman_t given = {.x = matrix_of(state->x, 2u, 1u), .p = matrix_gram(matrix_of(state->s, 2u, 2u))};
    matrix_t sensitivity = matrix_zero((uint32_t)N, (uint32_t)L);
    const matrix_t r = pair_output_covariance(&pair);
    for (uint32_t k = 0u; k < 500u; k++) {
        pair_predict(&pair);
        const measurement_t measurement = pair_measurement(&pair, true, true);
        (void)dual_update(&pair.dual, &measurement, false);

        const matrix_t full = pair_transition(&pair.step);
        const matrix_t a = matrix_block(&full, 0u, (uint32_t)N, 0u, (uint32_t)N);
        const matrix_t b = matrix_block(&full, 0u, (uint32_t)N, (uint32_t)N, (uint32_t)L);
        kalman_predict(&given, a, kalman_process_noise(0.0, (double)state->process_noise[1], (double)PAIR_PERIOD));
        const matrix_t gain = kalman_gain(&given, matrix_identity(2u), r);
        const matrix_t rest = matrix_sum(matrix_identity(2u), -1.0, gain);
        sensitivity = matrix_product(rest, matrix_sum(matrix_product(a, sensitivity), 1.0, b));
        (void)kalman_update(&given, matrix_identity(2u), r, matrix_of(measurement.y, 2u, 1u));
    }
    const matrix_t s_w = matrix_of(pair.dual.parameters.s, (uint32_t)L, (uint32_t)L);
    const matrix_t wanted = matrix_product(sensitivity, s_w);
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3 * sqrt(given.p.at[i][i]), given.x.at[i][0], (double)state->x[i]);
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const float found = parameter_filter_sensitivity(&pair.dual.parameters)[(i * (uint32_t)L) + j];
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-3 * sqrt(given.p.at[i][i]), wanted.at[i][j], (double)found);
        }
    }
}

static void test_valid_means_both_filters_are(void)
{
    TEST_ASSERT_TRUE(dual_is_valid(&pair.dual));
    pair.dual.state.x[0] = NAN;
    TEST_ASSERT_FALSE(dual_is_valid(&pair.dual));
    setUp();
    pair.dual.parameters.w[0] = NAN;
    TEST_ASSERT_FALSE(dual_is_valid(&pair.dual));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_a_walk_it_is_the_kalman_filter_for_state_and_parameters);
    RUN_TEST(test_so_it_is_with_outputs_missing_at_random);
    RUN_TEST(test_so_it_is_when_it_learns_from_several_samples_at_once);
    RUN_TEST(test_so_it_is_when_what_was_learnt_is_adopted_some_samples_later);
    RUN_TEST(test_a_walk_widens_the_parameters_and_not_the_state_given_them);
    RUN_TEST(test_it_learns_the_parameters);
    RUN_TEST(test_state_sigma_includes_what_the_parameters_do_to_the_state);
    RUN_TEST(test_frozen_keeps_the_parameters_and_their_covariance_to_the_bit);
    RUN_TEST(test_frozen_carries_the_sensitivity_of_the_state_on);
    RUN_TEST(test_valid_means_both_filters_are);
    return UNITY_END();
}
