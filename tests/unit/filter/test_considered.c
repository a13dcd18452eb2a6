/* Considered errors: what the filter says a calibration error makes of its estimates, against filters whose samples
 * have that error. On the linear system of pair.h the difference is exact. */
#include "pair.h"

#include <string.h>

enum { L = MODEL_PARAMETERS, N = MODEL_STATES, C = CDKF_CALIBRATION, REPEATS = 100, SAMPLES = 10, BLOCKS = 40 };

#define ERROR 0.05 /* units of each considered error */

static pair_t pair;
static cdkf_t *const cdkf = &pair.cdkf;

void setUp(void)
{
    pair = pair_random(7u);
}

void tearDown(void)
{
}

/* --- a filter with exact samples, and one for each error ---------------------------------------------------------- */

static double truth[C + 1][N]; /* the last one without error */
static cdkf_t filter[C + 1];
static double p[L];

/* All know the parameters and the state, but not how well. */
static void start(uint64_t seed)
{
    pair = pair_random(seed);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        cdkf->walk[i] = 0.01f;
        p[i] = (double)pair_prior.sigma[i] * (double)cdkf->w[i];
    }
    cdkf->growth = 0.2f;
    for (uint32_t c = 0u; c <= (uint32_t)C; c++) {
        filter[c] = *cdkf;
        truth[c][0] = (double)cdkf->x[0];
        truth[c][1] = (double)cdkf->x[1];
    }
}

/* The truth with `error` units of considered error c: base acceleration or torque are other than measured. */
static void move_truth(uint32_t c, model_step_t step, const float error[C])
{
    double slope[PAIR_Z];
    if (c < (uint32_t)C) {
        const bool of_base = (c == (uint32_t)CDKF_BASE_GAIN) || (c == (uint32_t)CDKF_BASE_DELAY);
        step.z_ddot += of_base ? ((float)ERROR * error[c]) : 0.0f;
        step.tau_m += of_base ? 0.0f : ((float)ERROR * error[c]);
    }
    pair_slopes(&step, slope);
    const double own = (slope[3] * truth[c][0]) + (slope[4] * truth[c][1]);
    const double change = own + (slope[0] * p[0]) + (slope[1] * p[1]) + (slope[2] * p[2]);
    truth[c][0] += (double)step.period * (truth[c][1] + (0.5 * change));
    truth[c][1] += change;
}

/* One sample, without noise, into all. */
static void run_sample(const bool valid[N])
{
    float error[CDKF_CONSIDERED] = {0.0f};
    const model_step_t step = {.period = PAIR_PERIOD,
        .z_ddot = (float)(30.0 * random_normal(&pair.source)),
        .tau_m = (float)(30.0 * random_normal(&pair.source)),
        .trim = (float)(30.0 * random_normal(&pair.source))};
    random_floats(&pair.source, error, (uint32_t)C, 30.0);
    for (uint32_t c = 0u; c <= (uint32_t)C; c++) {
        innovation_t innovation[CDKF_OUTPUTS];
        move_truth(c, step, error);
        const float y[N] = {(float)truth[c][0], (float)truth[c][1]};
        cdkf_time_update(&filter[c], &pair_model, NULL, &step, error, NULL);
        cdkf_measurement_update(&filter[c], y, valid, true, innovation);
    }
}

static void end_block(bool joint)
{
    static const float variance[L] = {0.0f, 0.002f, 0.0f};
    for (uint32_t c = 0u; c <= (uint32_t)C; c++) {
        correction_t correction;
        cdkf_learn(&filter[c], 0.01f, 0.1f, &correction);
        cdkf_forget(&filter[c], 0.01f, joint);
        cdkf_walk(&filter[c], 0.01f, variance, joint);
        cdkf_draw(&filter[c], &pair_model, NULL);
    }
}

/* What a unit of error c makes of row i of [w; x], true minus estimated. */
static double effect(const cdkf_t *of, uint32_t c, uint32_t i)
{
    const considered_t *considered = &of->considered[c];
    double sum = (i < (uint32_t)L) ? 0.0 : (double)considered->x[i - (uint32_t)L];
    for (uint32_t j = 0u; j < (uint32_t)L; j++) {
        sum += (double)of->s[(i * (uint32_t)L) + j] * (double)considered->w[j];
    }
    return sum;
}

static double found_effect(uint32_t c, uint32_t i)
{
    const cdkf_t *with = &filter[c];
    const cdkf_t *without = &filter[C];
    const uint32_t k = i - (uint32_t)L; /* of the state */
    const double difference = (i < (uint32_t)L)
                                  ? ((double)without->w[i] - (double)with->w[i])
                                  : ((truth[c][k] - (double)with->x[k]) - (truth[C][k] - (double)without->x[k]));
    return difference / ERROR;
}

/* Through learning in part and fully, walk and forgetting, missing outputs; in the dual filter and the joint. */
static void test_an_error_makes_of_the_estimates_what_is_said(void)
{
    const double least[PAIR_Z] = {0.05, 0.05, 0.05, 1.0e-4, 5.0e-3};
    double largest[PAIR_Z] = {0.0};
    for (uint32_t repeat = 0u; repeat < 10u; repeat++) {
        start(repeat);
        for (uint32_t block = 0u; block < (uint32_t)BLOCKS; block++) {
            for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
                const bool valid[N] = {random_unit(&pair.source) > 0.2, random_unit(&pair.source) > 0.2};
                run_sample(valid);
            }
            end_block((repeat % 2u) == 0u);
            for (uint32_t c = 0u; c < (uint32_t)C; c++) {
                for (uint32_t i = 0u; i < (uint32_t)PAIR_Z; i++) {
                    const double wanted = effect(&filter[C], c, i);
                    largest[i] = fmax(largest[i], fabs(wanted));
                    TEST_ASSERT_DOUBLE_WITHIN((1.0e-2 * largest[i]) + 4.0e-5, wanted, found_effect(c, i));
                }
            }
        }
    }
    for (uint32_t i = 0u; i < (uint32_t)PAIR_Z; i++) {
        TEST_ASSERT_TRUE(largest[i] > least[i]); /* they did make something of each */
    }
}

/* Innovations without noise are the error times what the outputs see of it: its estimate is the error. */
static void test_the_score_of_an_error_estimates_it(void)
{
    static const bool valid[N] = {true, true};
    double seen[C] = {0.0};
    start(3u);
    for (uint32_t block = 0u; block < (uint32_t)BLOCKS; block++) {
        for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
            run_sample(valid);
        }
        for (uint32_t c = 0u; c < (uint32_t)C; c++) {
            score_t score[CDKF_CONSIDERED];
            cdkf_constant_scores(&filter[c], score);
            const double wanted = ERROR * (double)score[c].information;
            TEST_ASSERT_DOUBLE_WITHIN((0.05 * wanted) + 1.0e-5, wanted, (double)score[c].vector);
            seen[c] += wanted;
            cdkf_constant_scores(&filter[C], score);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 + (1.0e-3 * wanted), 0.0, (double)score[c].vector);
        }
        if (block == 0u) { /* nothing has been learnt with it: it is as if it had come about now */
            score_t score[CDKF_CONSIDERED];
            const score_t sudden = cdkf_sudden_score(&filter[CDKF_BASE_GAIN]);
            cdkf_constant_scores(&filter[CDKF_BASE_GAIN], score);
            TEST_ASSERT_EQUAL_MEMORY(&score[CDKF_BASE_GAIN], &sudden, sizeof sudden);
        }
        end_block(false);
    }
    for (uint32_t c = 0u; c < (uint32_t)C; c++) {
        TEST_ASSERT_TRUE(seen[c] > 0.01); /* many times the rounding that is allowed for */
    }
}

/* An error that comes about when the parameters know everything: what they have learnt is not its work. */
static void test_the_sudden_score_leaves_out_what_the_parameters_have_learnt(void)
{
    static const bool valid[N] = {true, true};
    start(4u);
    run_sample(valid);
    const score_t before = cdkf_sudden_score(&filter[CDKF_BASE_GAIN]);
    filter[CDKF_BASE_GAIN].considered[CDKF_BASE_GAIN].w[1] = 5.0f;
    const score_t after = cdkf_sudden_score(&filter[CDKF_BASE_GAIN]);
    TEST_ASSERT_EQUAL_MEMORY(&before, &after, sizeof before);
    score_t score[CDKF_CONSIDERED];
    cdkf_constant_scores(&filter[CDKF_BASE_GAIN], score);
    TEST_ASSERT_TRUE(score[CDKF_BASE_GAIN].information != before.information);
    cdkf_drop_pending(&filter[CDKF_BASE_GAIN]);
    const score_t dropped = cdkf_sudden_score(&filter[CDKF_BASE_GAIN]);
    TEST_ASSERT_TRUE((dropped.vector == 0.0f) && (dropped.information == 0.0f));
}

/* --- columns of S that change, and what is dropped ---------------------------------------------------------------- */

static void random_considered(void)
{
    for (uint32_t c = 0u; c < (uint32_t)C; c++) {
        random_floats(&pair.source, cdkf->considered[c].w, (uint32_t)L, 1.0);
        random_floats(&pair.source, cdkf->considered[c].x, (uint32_t)N, 0.01);
        cdkf->considered_sigma[c] = (float)random_between(&pair.source, 0.1, 1.0);
    }
}

static void assert_same_effect(const cdkf_t *before, uint32_t first, uint32_t end)
{
    for (uint32_t c = 0u; c < (uint32_t)C; c++) {
        for (uint32_t i = first; i < end; i++) {
            const double wanted = effect(before, c, i);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 * (0.01 + fabs(wanted)), wanted, effect(cdkf, c, i));
        }
    }
}

static void test_walk_and_forgetting_leave_what_an_error_makes_of_the_estimates(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        pair = pair_random(repeat);
        random_considered();
        cdkf->growth = ((repeat % 3u) == 0u) ? 0.0f : 0.5f;
        cdkf->walk[repeat % 3u] = 0.05f;
        const cdkf_t before = *cdkf;
        pair_walk(&pair, 0.1f, 0.01f, (repeat % 2u) == 0u);
        TEST_ASSERT_TRUE(memcmp(before.s, cdkf->s, sizeof before.s) != 0);
        assert_same_effect(&before, 0u, (uint32_t)PAIR_Z);
    }
}

/* The prior does not know of them; of the state they stay. A new state does not know of them either. */
static void test_an_opened_covariance_and_a_new_state_forget_the_errors_that_were_theirs(void)
{
    const float x[N] = {0.1f, 0.2f};
    const float sigma[N] = {0.01f, 0.1f};
    random_considered();
    const cdkf_t before = *cdkf;
    cdkf_open(cdkf);
    assert_same_effect(&before, (uint32_t)L, (uint32_t)PAIR_Z);
    for (uint32_t c = 0u; c < (uint32_t)C; c++) {
        TEST_ASSERT_EACH_EQUAL_FLOAT(0.0f, cdkf->considered[c].w, L);
    }
    *cdkf = before;
    cdkf_start_state(cdkf, x, sigma);
    assert_same_effect(&before, 0u, (uint32_t)L);
    for (uint32_t c = 0u; c < (uint32_t)C; c++) {
        TEST_ASSERT_EACH_EQUAL_FLOAT(0.0f, cdkf->considered[c].x, N);
    }
}

/* --- what is reported --------------------------------------------------------------------------------------------- */

static void test_reported_covariance_is_the_filters_own_and_that_of_the_errors(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        float correlation[L];
        pair = pair_random(repeat);
        random_considered();
        matrix_t covariance = pair.reference.p;
        for (uint32_t c = 0u; c < (uint32_t)C; c++) {
            const double variance = (double)cdkf->considered_sigma[c] * (double)cdkf->considered_sigma[c];
            for (uint32_t i = 0u; i < (uint32_t)PAIR_Z; i++) {
                for (uint32_t j = 0u; j < (uint32_t)PAIR_Z; j++) {
                    covariance.at[i][j] += variance * effect(cdkf, c, i) * effect(cdkf, c, j);
                }
            }
        }
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const double sigma = (double)pair_prior.sigma[i] * sqrt(covariance.at[i][i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 * sigma, sigma, (double)cdkf_parameter_sigma(cdkf, i));
        }
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            const double sigma = sqrt(covariance.at[L + i][L + i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 * sigma, sigma, (double)cdkf_state_sigma(cdkf, i));
        }
        cdkf_correlation(cdkf, correlation);
        const double wanted = covariance.at[1][2] / sqrt(covariance.at[1][1] * covariance.at[2][2]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, wanted, (double)correlation[2]);
    }
}

/* --- the belief that is kept -------------------------------------------------------------------------------------- */

/* Parameters as they were kept; the state's uncertainty as it is now, but all its own. */
static void test_what_was_learnt_since_is_taken_back_and_the_state_stays(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        snapshot_t snapshot;
        double nis[2];
        correction_t correction;
        pair = pair_random(repeat);
        cdkf->trust = 0.6f;
        const cdkf_t kept = *cdkf;
        cdkf_keep(cdkf, &snapshot);
        pair_update(&pair, true, true, true, nis);
        cdkf_learn(cdkf, 0.01f, 0.1f, &correction);
        pair_update(&pair, true, true, true, nis);
        const matrix_t before = pair_covariance(cdkf);
        const float x[N] = {cdkf->x[0], cdkf->x[1]};
        cdkf_return(cdkf, &snapshot);
        const matrix_t after = pair_covariance(cdkf);
        TEST_ASSERT_EQUAL_MEMORY(kept.w, cdkf->w, sizeof kept.w);
        TEST_ASSERT_EQUAL_MEMORY(kept.s, cdkf->s, (size_t)(L * L) * sizeof(float));
        TEST_ASSERT_EQUAL_MEMORY(x, cdkf->x, sizeof x);
        TEST_ASSERT_TRUE((cdkf->trust == 0.6f) && (cdkf->pending.matrix[0] == 0.0f));
        for (uint32_t i = 0u; i < (uint32_t)N; i++) {
            for (uint32_t j = 0u; j < (uint32_t)PAIR_Z; j++) {
                const double scale = sqrt(before.at[L + i][L + i]) * ((j < (uint32_t)L) ? 1.0 : sqrt(before.at[j][j]));
                const double wanted = (j < (uint32_t)L) ? 0.0 : before.at[L + i][j];
                TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 * scale, wanted, after.at[L + i][j]);
            }
        }
    }
}

/* What the errors have made of parameters that were known is nearly what they make of them now; of those of the first
 * guess they have made nothing yet. */
static void test_what_an_error_makes_of_parameters_that_are_taken_back(void)
{
    for (uint32_t known = 0u; known < 2u; known++) {
        snapshot_t snapshot;
        double nis[2];
        correction_t correction;
        setUp();
        random_considered();
        cdkf->trust = (known == 1u) ? 1.0f : 0.5f;
        cdkf_keep(cdkf, &snapshot);
        pair_update(&pair, true, true, true, nis);
        cdkf_learn(cdkf, 0.01f, 0.1f, &correction);
        const cdkf_t before = *cdkf;
        cdkf_return(cdkf, &snapshot);
        assert_same_effect(&before, (known == 1u) ? 0u : (uint32_t)L, (uint32_t)PAIR_Z);
        TEST_ASSERT_EQUAL(known == 0u, effect(cdkf, 0u, 0u) == 0.0);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_error_makes_of_the_estimates_what_is_said);
    RUN_TEST(test_the_score_of_an_error_estimates_it);
    RUN_TEST(test_the_sudden_score_leaves_out_what_the_parameters_have_learnt);
    RUN_TEST(test_walk_and_forgetting_leave_what_an_error_makes_of_the_estimates);
    RUN_TEST(test_an_opened_covariance_and_a_new_state_forget_the_errors_that_were_theirs);
    RUN_TEST(test_reported_covariance_is_the_filters_own_and_that_of_the_errors);
    RUN_TEST(test_what_was_learnt_since_is_taken_back_and_the_state_stays);
    RUN_TEST(test_what_an_error_makes_of_parameters_that_are_taken_back);
    return UNITY_END();
}
