/* The dual filter on a linear system, side by side with the textbook Kalman filter for [state; parameters] in double. The
 * parameters are w = ln p, their influence changes at random from step to step. */
#ifndef UNIT_FILTER_PAIR_H
#define UNIT_FILTER_PAIR_H

#include "filter/dual.h"
#include "kalman.h"
#include "revise.h"
#include "unity.h"

#include <stddef.h>

enum { PAIR_W = MODEL_PARAMETERS, PAIR_X = MODEL_STATES, PAIR_ALL = PAIR_W + PAIR_X };

#define PAIR_PERIOD 1.0e-3f

typedef struct pair {
    dual_t dual;
    kalman_t reference; /* elements x, then w */
    bool joint;
    random_source_t source;
    model_step_t step; /* the last one */
} pair_t;

/* --- the system: x_next = A x + B w, B from the inputs ------------------------------------------------------------ */

static inline matrix_t pair_transition(const model_step_t *at)
{
    const double period = (double)at->period;
    matrix_t a = matrix_identity((uint32_t)PAIR_ALL);
    a.at[1][0] = -630.0 * period;
    a.at[1][1] = 1.0 - (15.0 * period);
    a.at[1][2] = period * (double)at->z_ddot;
    a.at[1][3] = period * (double)at->tau_m;
    a.at[1][4] = period * (double)at->trim;
    for (uint32_t k = 0u; k < (uint32_t)PAIR_ALL; k++) { /* theta moves by T (theta_dot + change / 2) */
        const double rate = (k == 1u) ? 1.0 : 0.0;
        a.at[0][k] += period * (rate + (0.5 * (a.at[1][k] - rate)));
    }
    return a;
}

/* Change of theta_dot at x + sign offset. */
static inline double pair_change(
    const matrix_t *a, const float x[PAIR_X], const float offset[PAIR_X], double sign, const model_arm_t *arm)
{
    double change = 0.0;
    for (uint32_t k = 0u; k < (uint32_t)PAIR_X; k++) {
        change += (a->at[1][k] - ((k == 1u) ? 1.0 : 0.0)) * ((double)x[k] + (sign * (double)offset[k]));
    }
    for (uint32_t k = 0u; k < (uint32_t)PAIR_W; k++) {
        change += a->at[1][(uint32_t)PAIR_X + k] * log((double)arm->coefficient[k]);
    }
    return change;
}

static inline void pair_respond(const model_constants_t *constants, const model_step_t *at,
    const model_points_t *points, model_response_t *response)
{
    (void)constants;
    const matrix_t a = pair_transition(at);
    response->mean = (float)pair_change(&a, points->x, points->x, 0.0, &points->arm[0]);
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PAIRS; j++) {
        const bool of_w = j < (uint32_t)PAIR_W;
        const float *offset = points->offset[j];
        model_response_pair(response, j,
            (float)pair_change(&a, points->x, offset, 1.0, &points->arm[of_w ? (1u + (2u * j)) : 0u]),
            (float)pair_change(&a, points->x, offset, -1.0, &points->arm[of_w ? (2u + (2u * j)) : 0u]));
    }
}

static const model_t pair_model = {.name = "linear",
    .parameter = {{"a", "1", 1.0e-3f, 1.0e3f}, {"b", "1", 1.0e-3f, 1.0e3f}, {"c", "1", 1.0e-3f, 1.0e3f}},
    .positive = true,
    .prepare = plain_prepare,
    .respond = pair_respond};

/* --- both filters ------------------------------------------------------------------------------------------------- */

static inline pair_t pair_typical(bool joint)
{
    const prior_t prior = {.guess = {1.0f, 1.0f, 1.0f}, .sigma = {0.4f, 0.6f, 0.5f}};
    const double sigmas[PAIR_ALL] = {(double)1.0e-3f, (double)1.0e-2f, (double)0.4f, (double)0.6f, (double)0.5f};
    pair_t pair = {.joint = joint, .source = {1234u}};
    parameter_filter_init(&pair.dual.parameters, &pair_model, NULL, &prior);
    pair.dual.state = (state_filter_t){.x = {0.1f, 0.0f},
        .s = {1.0e-3f, 0.0f, 0.0f, 1.0e-2f},
        .process_noise = {0.0f, 0.05f},
        .output_noise = {1.0e-3f, 1.0e-2f}};
    pair.reference.x = matrix_zero((uint32_t)PAIR_ALL, 1u);
    pair.reference.x.at[0][0] = (double)0.1f;
    pair.reference.p = matrix_zero((uint32_t)PAIR_ALL, (uint32_t)PAIR_ALL);
    for (uint32_t i = 0u; i < (uint32_t)PAIR_ALL; i++) {
        pair.reference.p.at[i][i] = sigmas[i] * sigmas[i];
    }
    return pair;
}

static inline void pair_set_walk(pair_t *pair)
{
    for (uint32_t i = 0u; i < (uint32_t)PAIR_W; i++) {
        pair->dual.parameters.walk[i] = 0.01f * (float)(i + 1u);
    }
}

static inline void pair_predict(pair_t *pair)
{
    const state_filter_t *state = &pair->dual.state;
    pair->step = (model_step_t){.period = PAIR_PERIOD,
        .z_ddot = (float)(30.0 * random_normal(&pair->source)),
        .tau_m = (float)(30.0 * random_normal(&pair->source)),
        .trim = (float)(30.0 * random_normal(&pair->source))};
    dual_predict(&pair->dual, &pair_model, NULL, &pair->step);
    const matrix_t noise =
        kalman_process_noise((double)state->process_noise[0], (double)state->process_noise[1], (double)PAIR_PERIOD);
    kalman_predict(&pair->reference, pair_transition(&pair->step), matrix_padded(noise, (uint32_t)PAIR_ALL));
}

static inline matrix_t pair_output_covariance(const pair_t *pair)
{
    matrix_t r = matrix_zero(2u, 2u);
    for (uint32_t i = 0u; i < 2u; i++) {
        r.at[i][i] = (double)pair->dual.state.output_noise[i] * (double)pair->dual.state.output_noise[i];
    }
    return r;
}

/* Outputs about where the reference expects them; not a number where they are not valid. */
static inline measurement_t pair_measurement(pair_t *pair, bool theta_valid, bool theta_dot_valid)
{
    const bool valid[2] = {theta_valid, theta_dot_valid};
    measurement_t measurement = {.valid = {theta_valid, theta_dot_valid}};
    for (uint32_t i = 0u; i < 2u; i++) {
        const double noise = 1.2 * (double)pair->dual.state.output_noise[i] * random_normal(&pair->source);
        measurement.y[i] = valid[i] ? (float)(pair->reference.x.at[i][0] + noise) : NAN;
    }
    return measurement;
}

/* Normalised innovation squared of the reference. */
static inline double pair_reference_update(pair_t *pair, const measurement_t *measurement)
{
    const matrix_t h = kalman_outputs(measurement->valid, (uint32_t)PAIR_ALL);
    const matrix_t r = pair_output_covariance(pair);
    return (h.rows == 0u) ? 0.0
                          : kalman_update(&pair->reference, h, kalman_pick(measurement->valid, r),
                                kalman_pick(measurement->valid, matrix_of(measurement->y, 2u, 1u)));
}

/* What the state's uncertainty loses when the covariance of w grows to `grown` and that of x and w stays: the part that w no
 * longer explains. */
static inline matrix_t pair_freed(const matrix_t *p, matrix_t grown)
{
    const matrix_t ww = matrix_block(p, (uint32_t)PAIR_X, (uint32_t)PAIR_W, (uint32_t)PAIR_X, (uint32_t)PAIR_W);
    const matrix_t xw = matrix_block(p, 0u, (uint32_t)PAIR_X, (uint32_t)PAIR_X, (uint32_t)PAIR_W);
    return matrix_congruence(xw, matrix_sum(matrix_inverse(ww), -1.0, matrix_inverse(grown)));
}

/* The walk and forgetting of `period` seconds. A joint filter only gets noise on w; a dual one loses what that frees. */
static inline void pair_reference_walk(pair_t *pair, double period)
{
    const parameter_filter_t *parameters = &pair->dual.parameters;
    matrix_t *p = &pair->reference.p;
    matrix_t grown = matrix_block(p, (uint32_t)PAIR_X, (uint32_t)PAIR_W, (uint32_t)PAIR_X, (uint32_t)PAIR_W);
    grown = matrix_sum(grown, (double)parameters->growth * period, grown);
    for (uint32_t i = 0u; i < (uint32_t)PAIR_W; i++) {
        grown.at[i][i] += (double)parameters->walk[i] * period;
    }
    const matrix_t freed = matrix_padded(pair_freed(p, grown), (uint32_t)PAIR_ALL);
    if (!pair->joint) {
        *p = matrix_sum(*p, -1.0, freed);
    }
    for (uint32_t i = 0u; i < (uint32_t)PAIR_W; i++) {
        for (uint32_t j = 0u; j < (uint32_t)PAIR_W; j++) {
            p->at[PAIR_X + i][PAIR_X + j] = grown.at[i][j];
        }
    }
}

/* The parameters gather `samples`, each output missing with the given probability, learn, and walk for their time. Of the
 * first sample both filters know as much before it, so its normalised innovation squared must be the same for both. */
static inline void pair_block(pair_t *pair, uint32_t samples, double missing, float correction[PAIR_W])
{
    const float period = PAIR_PERIOD * (float)samples;
    for (uint32_t k = 0u; k < samples; k++) {
        pair_predict(pair);
        const bool theta_valid = random_unit(&pair->source) >= missing;
        const measurement_t measurement = pair_measurement(pair, theta_valid, random_unit(&pair->source) >= missing);
        const double nis = (double)dual_update(&pair->dual, &measurement, true);
        const double wanted = pair_reference_update(pair, &measurement);
        if (k == 0u) {
            TEST_ASSERT_DOUBLE_WITHIN(5.0e-3 * (1.0 + wanted), wanted, nis);
        }
    }
    TEST_ASSERT_FALSE(revise(&pair->dual, &pair_model, NULL, period, 0.0f, pair->joint, correction));
    pair_reference_walk(pair, (double)period);
}

/* --- comparison --------------------------------------------------------------------------------------------------- */

/* The covariance of [x; w] that the factors of the dual filter stand for: columns of w move the state, too. */
static inline matrix_t pair_covariance(const dual_t *dual)
{
    const matrix_t s = matrix_of(dual->state.s, (uint32_t)PAIR_X, (uint32_t)PAIR_X);
    const matrix_t all = matrix_of(dual->parameters.s, (uint32_t)PAIR_ALL, (uint32_t)PAIR_W); /* rows w, then x */
    matrix_t columns = matrix_padded(s, (uint32_t)PAIR_ALL);
    for (uint32_t i = 0u; i < (uint32_t)PAIR_ALL; i++) {
        const uint32_t row = (i < (uint32_t)PAIR_W) ? (i + (uint32_t)PAIR_X) : (i - (uint32_t)PAIR_W);
        for (uint32_t j = 0u; j < (uint32_t)PAIR_W; j++) {
            columns.at[row][PAIR_X + j] = all.at[i][j];
        }
    }
    return matrix_gram(columns);
}

/* To be asked when the parameters have just learnt. The bound on covariances is relative. */
static inline void pair_assert_equal(const pair_t *pair, double covariance)
{
    const dual_t *dual = &pair->dual;
    const matrix_t found = pair_covariance(dual);
    const matrix_t *wanted = &pair->reference.p;
    for (uint32_t i = 0u; i < (uint32_t)PAIR_ALL; i++) {
        const double estimate =
            (i < (uint32_t)PAIR_X) ? (double)dual->state.x[i] : (double)dual->parameters.w[i - (uint32_t)PAIR_X];
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-3 * sqrt(wanted->at[i][i]), pair->reference.x.at[i][0], estimate);
    }
    TEST_ASSERT_DOUBLE_WITHIN(covariance, 0.0, covariance_difference(&found, wanted, wanted));
    TEST_ASSERT_TRUE(dual_is_valid(dual));
}

#endif
