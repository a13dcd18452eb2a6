/* Starting and opening the belief, and its invariant: what breaks it, and what must not. */
#include "pair.h"

#include <string.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, REPEATS = 200 };

static pair_t pair;
static cdkf_t *const cdkf = &pair.cdkf;

void setUp(void)
{
    pair = pair_typical();
}

void tearDown(void)
{
}

static const bool validities[4][N] = {{true, true}, {true, false}, {false, true}, {false, false}};

/* --- start and opening --- */

/* The state's uncertainty stays, but is its own now. */
static void test_opening_forgets_what_was_learnt_and_keeps_estimate_and_state(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        double nis[2];
        pair = pair_random(repeat);
        cdkf->walk[1] = 0.01f;
        cdkf->trust = 0.7f;
        pair_update(&pair, true, true, true, nis);
        TEST_ASSERT_TRUE((cdkf->pending.matrix[0] > 0.0f) && (cdkf->pending.vector[0] != 0.0f));
        const cdkf_t before = *cdkf;
        pair_agree(&pair);
        for (uint32_t i = 0u; i < (uint32_t)PAIR_Z; i++) {
            for (uint32_t j = 0u; j < (uint32_t)L; j++) {
                pair.reference.p.at[i][j] = (i == j) ? 1.0 : 0.0;
                pair.reference.p.at[j][i] = pair.reference.p.at[i][j];
            }
        }
        cdkf_open(cdkf);
        pair_assert_equal(&pair, 1.0e-9, 2.0e-6);
        TEST_ASSERT_EQUAL_MEMORY(before.w, cdkf->w, sizeof before.w);
        TEST_ASSERT_TRUE((cdkf->trust == 0.0f) && (cdkf->walk[1] == 0.01f));
        correction_t correction;
        cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
        TEST_ASSERT_EQUAL_MEMORY(before.w, cdkf->w, sizeof before.w); /* nothing is pending */
        TEST_ASSERT_TRUE((correction.variance[0] == 0.0f) && (correction.variance[2] == 0.0f));
    }
}

static void test_a_state_that_starts_anew_is_independent_of_w_and_drops_what_is_pending(void)
{
    const float x[N] = {0.3f, -0.2f};
    const float sigma[N] = {0.02f, 0.5f};
    double nis[2];
    correction_t correction;
    pair = pair_random(3u);
    pair_update(&pair, true, true, true, nis);
    const cdkf_t before = *cdkf;
    cdkf_start_state(cdkf, x, sigma);
    cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
    TEST_ASSERT_EQUAL_MEMORY(before.w, cdkf->w, sizeof before.w);
    TEST_ASSERT_EQUAL_MEMORY(before.s, cdkf->s, 9u * sizeof(float));
    TEST_ASSERT_EQUAL_MEMORY(x, cdkf->x, sizeof x);
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        TEST_ASSERT_TRUE((cdkf_state_sigma(cdkf, i) == sigma[i]) && (cdkf->response[i] == 0.0f));
    }
    TEST_ASSERT_TRUE((cdkf->s_xx[2] == 0.0f) && (cdkf->s[9] == 0.0f) && (cdkf->s[14] == 0.0f));
}

static void test_starts_at_the_guess_uncorrelated_with_the_standard_deviations_of_the_prior(void)
{
    const prior_t prior = {.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.5f}};
    const model_constants_t constants = {.length = 0.45f};
    float correlation[L];
    (void)memset(cdkf, 0xA5, sizeof *cdkf);
    cdkf_init(cdkf, &model_lever, &constants, &prior);
    cdkf_correlation(cdkf, correlation);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE((cdkf->p[i] == prior.guess[i]) && (cdkf->w[i] == 0.0f) && (cdkf->walk[i] == 0.0f));
        TEST_ASSERT_EQUAL_FLOAT(prior.guess[i] * prior.sigma[i], cdkf_parameter_sigma(cdkf, i));
        TEST_ASSERT_TRUE(correlation[i] == 0.0f);
    }
    TEST_ASSERT_TRUE((cdkf->trust == 0.0f) && (cdkf->growth == 0.0f) && (cdkf->pending.vector[2] == 0.0f));
}

/* --- the invariant ------------------------------------------------------------------------------------------------ */

typedef struct damage {
    float *entry;
    float value;
    bool of_state; /* a sample notices, not only the end of a block */
} damage_t;

static void test_the_invariant_refuses_every_kind_of_damage(void)
{
    const damage_t damages[] = {{&cdkf->x[0], NAN, true}, {&cdkf->x[1], INFINITY, true}, {&cdkf->x[0], 26.0f, true},
        {&cdkf->x[1], -1.1e4f, true}, {&cdkf->s_xx[0], NAN, true}, {&cdkf->s_xx[0], 0.0f, false},
        {&cdkf->s_xx[2], -INFINITY, true}, {&cdkf->s_xx[2], NAN, true}, {&cdkf->s_xx[3], 0.0f, false},
        {&cdkf->s_xx[3], -1.0f, false}, {&cdkf->s_xx[3], 1.1e6f, true}, {&cdkf->response[0], NAN, false},
        {&cdkf->response[1], INFINITY, false}, {&cdkf->w[0], NAN, false}, {&cdkf->w[1], 1.0e6f, false},
        {&cdkf->w[2], -1.0e6f, false}, {&cdkf->walk[0], NAN, false}, {&cdkf->walk[1], -1.0e-9f, false},
        {&cdkf->walk[2], INFINITY, false}, {&cdkf->s[0], 0.0f, false}, {&cdkf->s[4], -0.1f, false},
        {&cdkf->s[8], 0.0f, false}};
    for (uint32_t k = 0u; k < (uint32_t)(sizeof damages / sizeof damages[0]); k++) {
        setUp();
        TEST_ASSERT_TRUE(cdkf_is_valid(cdkf) && cdkf_state_is_valid(cdkf));
        *damages[k].entry = damages[k].value;
        TEST_ASSERT_FALSE(cdkf_is_valid(cdkf));
        TEST_ASSERT_EQUAL(!damages[k].of_state, cdkf_state_is_valid(cdkf));
    }
    for (uint32_t k = 0u; k < (uint32_t)(PAIR_Z * L); k++) {
        const float bad[] = {NAN, INFINITY, -INFINITY, 1.1e17f};
        for (uint32_t b = 0u; b < 4u; b++) {
            setUp();
            cdkf->s[k] = bad[b];
            TEST_ASSERT_FALSE(cdkf_is_valid(cdkf));
        }
    }
}

/* Noise from the least to the greatest that the settings allow, in every ratio, gaps and missing outputs too. */
static void test_the_invariant_holds_at_extreme_ratios_of_noise(void)
{
    const float theta[] = {1.0e-7f, 1.0e-3f, 0.2f};
    const float theta_dot[] = {1.0e-6f, 1.0e-2f, 2.0f};
    const float process[] = {0.0f, 0.05f, 10.0f};
    const float walks[] = {0.0f, 1.0e-4f, 1.0f};
    for (uint32_t k = 0u; k < 81u; k++) {
        setUp();
        cdkf->output_noise[0] = theta[k % 3u];
        cdkf->output_noise[1] = theta_dot[(k / 3u) % 3u];
        cdkf->process_noise[1] = process[(k / 9u) % 3u];
        cdkf->walk[0] = walks[k / 27u];
        cdkf->walk[2] = walks[k / 27u];
        const bool joint = ((k % 2u) == 0u);
        for (uint32_t sample = 0u; sample < 500u; sample++) {
            const model_step_t step = {.period = (sample % 100u == 99u) ? 0.02f : PAIR_PERIOD,
                .z_ddot = (float)(30.0 * random_normal(&pair.source)),
                .tau_m = (float)(30.0 * random_normal(&pair.source))};
            const float y[N] = {cdkf->x[0] + (cdkf->output_noise[0] * (float)random_normal(&pair.source)),
                cdkf->x[1] + (cdkf->output_noise[1] * (float)random_normal(&pair.source))};
            innovation_t innovation[CDKF_OUTPUTS];
            correction_t correction;
            cdkf_time_update(cdkf, &pair_model, NULL, &step, pair_no_error, NULL);
            cdkf_measurement_update(cdkf, y, validities[(sample / 7u) % 4u], true, innovation);
            TEST_ASSERT_TRUE(cdkf_state_is_valid(cdkf));
            if ((sample % 10u) == 9u) {
                cdkf_learn(cdkf, 0.01f, 0.1f, &correction);
                pair_walk(&pair, 0.01f, 0.0f, joint);
                TEST_ASSERT_TRUE(cdkf_is_valid(cdkf));
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_opening_forgets_what_was_learnt_and_keeps_estimate_and_state);
    RUN_TEST(test_a_state_that_starts_anew_is_independent_of_w_and_drops_what_is_pending);
    RUN_TEST(test_starts_at_the_guess_uncorrelated_with_the_standard_deviations_of_the_prior);
    RUN_TEST(test_the_invariant_refuses_every_kind_of_damage);
    RUN_TEST(test_the_invariant_holds_at_extreme_ratios_of_noise);
    return UNITY_END();
}
