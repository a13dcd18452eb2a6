/* The belief by itself: how it starts and is opened, the bounds of w, and the invariant that damage breaks. */
#include "filter/cdkf.h"

#include "test.h"

#include <math.h>
#include <string.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES };

static const prior_t prior = {.guess = {2.5f, 42.0f, 1500.0f}, .sigma = {0.4f, 0.6f, 0.5f}};
static const model_constants_t constants = {.length = 0.45f};
static cdkf_t belief;
static cdkf_t *const cdkf = &belief;

/* A belief in which everything has to do with everything, and something is pending. */
void setUp(void)
{
    const float x[N] = {0.1f, -0.2f};
    const float sigma[N] = {1.0e-3f, 1.0e-2f};
    (void)memset(cdkf, 0xA5, sizeof *cdkf);
    cdkf_init(cdkf, &model_lever, &constants, &prior);
    cdkf_start_state(cdkf, x, sigma);
    for (uint32_t k = 0u; k < (uint32_t)(CDKF_ROWS * L); k++) {
        const bool above = (k < (uint32_t)(L * L)) && ((k % (uint32_t)L) > (k / (uint32_t)L));
        cdkf->s[k] = above ? 0.0f : (0.1f + (0.01f * (float)k));
    }
    cdkf->s_xx[2] = 0.004f;
    cdkf->w[0] = 0.1f;
    cdkf->w[2] = -0.3f;
    cdkf->response[0] = 0.01f;
    cdkf->pending.matrix[0] = 3.0f;
    cdkf->pending.vector[0] = 0.5f;
    cdkf_draw(cdkf, &model_lever, &constants);
}

/* --- start and opening -------------------------------------------------------------------------------------------- */

/* The state keeps its uncertainty, which is its own now. */
TEST(opening_forgets_what_was_learnt_and_keeps_estimate_and_state)
{
    correction_t correction;
    cdkf->walk[1] = 0.01f;
    cdkf->trust = 0.7f;
    const cdkf_t before = *cdkf;
    cdkf_open(cdkf);
    TEST_ASSERT_TRUE((cdkf->trust == 0.0f) && (cdkf->walk[1] == 0.01f));
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_EQUAL_FLOAT(
            prior.guess[i] * prior.sigma[i] * cdkf->p[i] / prior.guess[i], cdkf_parameter_sigma(cdkf, i));
    }
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, cdkf_state_sigma(&before, i), cdkf_state_sigma(cdkf, i));
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            TEST_ASSERT_TRUE(cdkf->s[((L + i) * (uint32_t)L) + j] == 0.0f);
        }
    }
    cdkf_learn(cdkf, 0.01f, 0.0f, &correction); /* nothing is pending */
    TEST_ASSERT_EQUAL_MEMORY(before.w, cdkf->w, sizeof before.w);
    TEST_ASSERT_EQUAL_MEMORY(before.x, cdkf->x, sizeof before.x);
    TEST_ASSERT_TRUE((correction.covariance[0] == 0.0f) && (correction.covariance[5] == 0.0f));
}

TEST(a_state_that_starts_anew_is_independent_of_w_and_drops_what_is_pending)
{
    const float x[N] = {0.3f, -0.2f};
    const float sigma[N] = {0.02f, 0.5f};
    correction_t correction;
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

TEST(an_output_that_is_not_valid_has_no_innovation)
{
    const float y[N] = {1.0f, 1.0f};
    const bool valid[N] = {false, false};
    const innovation_t none = {.inverse_variance = 1.0f};
    innovation_t innovation[N] = {{1.0f, 2.0f, 3.0f, 4.0f}, {1.0f, 2.0f, 3.0f, 4.0f}};
    cdkf_measurement_update(cdkf, y, valid, true, innovation);
    TEST_ASSERT_EQUAL_MEMORY(&none, &innovation[0], sizeof none);
    TEST_ASSERT_EQUAL_MEMORY(&none, &innovation[1], sizeof none);
}

/* --- learning and walk at their limits ---------------------------------------------------------------------------- */

TEST(w_is_held_at_its_bounds_and_said_to_rest_there)
{
    correction_t correction;
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        setUp();
        cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
        TEST_ASSERT_FALSE(scaling_bound(&cdkf->scaling, cdkf->w));
        cdkf->w[i] = 1.0e5f;
        cdkf_learn(cdkf, 0.01f, 0.0f, &correction);
        TEST_ASSERT_TRUE(correction.bounded && (cdkf->w[i] == cdkf->scaling.greatest[i]));
        TEST_ASSERT_TRUE(correction.w[i] == (cdkf->scaling.greatest[i] - 1.0e5f));
    }
}

/* The state, too, by what it sees of the step itself. */
TEST(a_step_that_is_learnt_leaves_w_within_its_bounds)
{
    const score_t score = {.vector = 1.0e6f, .information = 1.0f};
    cdkf_begin_step(cdkf);
    cdkf->considered[CDKF_STEP].w[0] = 1.0f;
    const score_t pending = cdkf_constant_score(cdkf, (uint32_t)CDKF_STEP);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, pending.vector);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, pending.information);
    TEST_ASSERT_TRUE(cdkf_learn_step(cdkf, &score));
    TEST_ASSERT_TRUE(cdkf->w[0] == cdkf->scaling.greatest[0]);
}

/* --- the invariant ------------------------------------------------------------------------------------------------ */

typedef struct damage {
    float *entry;
    float value;
    bool of_state; /* a sample notices, not only the end of a block */
} damage_t;

TEST(the_invariant_refuses_every_kind_of_damage)
{
    const damage_t damages[] = {{&cdkf->x[0], NAN, true}, {&cdkf->x[1], INFINITY, true}, {&cdkf->x[0], 25.0f, true},
        {&cdkf->x[1], -1.0e4f, true}, {&cdkf->s_xx[0], NAN, true}, {&cdkf->s_xx[0], 0.0f, false},
        {&cdkf->s_xx[2], -INFINITY, true}, {&cdkf->s_xx[2], NAN, true}, {&cdkf->s_xx[3], 0.0f, false},
        {&cdkf->s_xx[3], -1.0f, false}, {&cdkf->s_xx[3], 1.0e6f, true}, {&cdkf->response[0], NAN, false},
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
    for (uint32_t k = 0u; k < (uint32_t)(CDKF_ROWS * L); k++) {
        const float bad[] = {NAN, INFINITY, -INFINITY, 1.0e17f};
        for (uint32_t b = 0u; b < 4u; b++) {
            setUp();
            cdkf->s[k] = bad[b];
            TEST_ASSERT_FALSE(cdkf_is_valid(cdkf));
        }
    }
}
