/* The filter on a linear system, side by side with the textbook's on z = [w; x] in double. */
#ifndef UNIT_FILTER_PAIR_H
#define UNIT_FILTER_PAIR_H

#include "filter/cdkf.h"
#include "kalman.h"
#include "unity.h"

enum { PAIR_W = MODEL_PARAMETERS, PAIR_X = MODEL_STATES, PAIR_Z = CDKF_ROWS };

#define PAIR_PERIOD 1.0e-3f

typedef struct pair {
    cdkf_t cdkf;
    kalman_t reference;
    random_source_t source;
    model_step_t step; /* the last one */
} pair_t;

/* --- the system: an oscillator of 4 Hz, driven by p, p_i = sigma_i w_i, in proportion to inputs ------------------- */

static inline void pair_prepare(
    const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_coefficients_t *coefficients)
{
    (void)constants;
    for (uint32_t i = 0u; i < (uint32_t)PAIR_W; i++) {
        coefficients->c[i] = p[i];
    }
}

/* Change of theta_dot per unit of p, theta and theta_dot. */
static inline void pair_slopes(const model_step_t *at, double slope[PAIR_Z])
{
    const double period = (double)at->period;
    slope[0] = period * (double)at->z_ddot;
    slope[1] = period * (double)at->tau_m;
    slope[2] = period * (double)at->trim;
    slope[3] = -630.0 * period;
    slope[4] = -15.0 * period;
}

static inline void pair_respond(const model_constants_t *constants, const model_step_t *at,
    const model_points_t *points, model_response_t *response)
{
    double slope[PAIR_Z];
    (void)constants;
    pair_slopes(at, slope);
    double mean = (slope[3] * (double)points->x[0]) + (slope[4] * (double)points->x[1]);
    for (uint32_t j = 0u; j < (uint32_t)PAIR_W; j++) {
        double of_pair = 0.0;
        const float *plus = points->coefficients[1u + (2u * j)].c;
        const float *minus = points->coefficients[2u + (2u * j)].c;
        mean += slope[j] * (double)points->coefficients[0].c[j];
        for (uint32_t i = 0u; i < (uint32_t)PAIR_W; i++) {
            of_pair += slope[i] * ((double)plus[i] - (double)minus[i]);
        }
        of_pair += 2.0 * ((slope[3] * (double)points->offset[j][0]) + (slope[4] * (double)points->offset[j][1]));
        response->difference[j] = (float)of_pair;
        response->second_difference[j] = 0.0f;
    }
    response->mean = (float)mean;
    response->slope[0] = (float)slope[3];
    response->slope[1] = (float)slope[4];
    response->base = at->period * points->coefficients[0].c[0];
    response->torque = at->period * points->coefficients[0].c[1];
}

static const model_t pair_model = {.name = "linear",
    .parameter = {{"a", "1", -1.0e3f, 1.0e3f}, {"b", "1", -1.0e3f, 1.0e3f}, {"c", "1", -1.0e3f, 1.0e3f}},
    .positive = false,
    .prepare = pair_prepare,
    .respond = pair_respond};

static const float pair_no_error[CDKF_CONSIDERED] = {0.0f};

static const prior_t pair_prior = {.guess = {0.0f, 0.0f, 0.0f}, .sigma = {0.4f, 0.6f, 0.5f}};

static inline matrix_t pair_transition(const model_step_t *at)
{
    const double period = (double)at->period;
    double slope[PAIR_Z];
    matrix_t a = matrix_identity((uint32_t)PAIR_Z);
    pair_slopes(at, slope);
    for (uint32_t k = 0u; k < (uint32_t)PAIR_Z; k++) { /* theta moves by T (theta_dot + change / 2) */
        const double change = slope[k] * ((k < (uint32_t)PAIR_W) ? (double)pair_prior.sigma[k] : 1.0);
        a.at[3][k] += 0.5 * period * change;
        a.at[4][k] += change;
    }
    a.at[3][4] += period;
    return a;
}

/* q^2 [T^3/3, T^2/2; T^2/2, T] of theta_dot (van Loan 1978), and a walk of theta itself. */
static inline matrix_t pair_process_noise(const cdkf_t *cdkf, double period)
{
    const double own = (double)cdkf->process_noise[0] * (double)cdkf->process_noise[0];
    const double walk = (double)cdkf->process_noise[1] + (double)cdkf->disturbance;
    const double variance = walk * walk;
    matrix_t noise = matrix_zero((uint32_t)PAIR_Z, (uint32_t)PAIR_Z);
    noise.at[3][3] = (variance * period * period * period / 3.0) + (own * period);
    noise.at[3][4] = variance * period * period / 2.0;
    noise.at[4][3] = noise.at[3][4];
    noise.at[4][4] = variance * period;
    return noise;
}

/* --- both filters ------------------------------------------------------------------------------------------------- */

/* The covariance that the factor [S_ww 0; S_xw S_xx] stands for. */
static inline matrix_t pair_covariance(const cdkf_t *cdkf)
{
    matrix_t s = matrix_zero((uint32_t)PAIR_Z, (uint32_t)PAIR_Z);
    for (uint32_t r = 0u; r < (uint32_t)PAIR_Z; r++) {
        for (uint32_t j = 0u; j < (uint32_t)PAIR_W; j++) {
            s.at[r][j] = (double)cdkf->s[(r * (uint32_t)PAIR_W) + j];
        }
    }
    s.at[3][3] = (double)cdkf->s_xx[0];
    s.at[4][3] = (double)cdkf->s_xx[2];
    s.at[4][4] = (double)cdkf->s_xx[3];
    return matrix_gram(s);
}

/* The reference takes over what the filter believes. */
static inline void pair_agree(pair_t *pair)
{
    pair->reference.p = pair_covariance(&pair->cdkf);
    pair->reference.x = matrix_zero((uint32_t)PAIR_Z, 1u);
    for (uint32_t i = 0u; i < (uint32_t)PAIR_Z; i++) {
        pair->reference.x.at[i][0] =
            (double)((i < (uint32_t)PAIR_W) ? pair->cdkf.w[i] : pair->cdkf.x[i - (uint32_t)PAIR_W]);
    }
}

static inline pair_t pair_typical(void)
{
    const float x[PAIR_X] = {0.1f, 0.0f};
    pair_t pair = {.source = {1234u}};
    cdkf_t *cdkf = &pair.cdkf;
    cdkf_init(cdkf, &pair_model, NULL, &pair_prior);
    cdkf->process_noise[1] = 0.05f;
    cdkf->output_noise[0] = 1.0e-3f;
    cdkf->output_noise[1] = 1.0e-2f;
    cdkf_start_state(cdkf, x, cdkf->output_noise);
    pair_agree(&pair);
    return pair;
}

/* As typical, but any belief, in which everything has to do with everything. */
static inline pair_t pair_random(uint64_t seed)
{
    pair_t pair = pair_typical();
    cdkf_t *cdkf = &pair.cdkf;
    pair.source.state = seed + 1u;
    random_factor(&pair.source, cdkf->s, (uint32_t)PAIR_W, (uint32_t)PAIR_W);
    for (uint32_t k = 0u; k < 9u; k++) {
        cdkf->s[k] *= 0.2f;
    }
    random_floats(&pair.source, &cdkf->s[9], 3u, 1.0e-3);
    random_floats(&pair.source, &cdkf->s[12], 3u, 1.0e-2);
    random_floats(&pair.source, &cdkf->s_xx[2], 1u, 1.0e-2);
    random_floats(&pair.source, cdkf->w, 3u, 0.5);
    random_floats(&pair.source, cdkf->response, 2u, 1.0e-2);
    cdkf->s_xx[0] = (float)random_between(&pair.source, 2.0e-4, 2.0e-3);
    cdkf->s_xx[3] = (float)random_between(&pair.source, 2.0e-3, 2.0e-2);
    cdkf_draw(cdkf, &pair_model, NULL);
    pair_agree(&pair);
    return pair;
}

static inline void pair_predict(pair_t *pair, float period)
{
    pair->step = (model_step_t){.period = period,
        .z_ddot = (float)(30.0 * random_normal(&pair->source)),
        .tau_m = (float)(30.0 * random_normal(&pair->source)),
        .trim = (float)(30.0 * random_normal(&pair->source))};
    cdkf_time_update(&pair->cdkf, &pair_model, NULL, &pair->step, pair_no_error, NULL);
    kalman_predict(&pair->reference, pair_transition(&pair->step), pair_process_noise(&pair->cdkf, (double)period));
}

/* Of the valid outputs: rows of [0 I], noise covariance, and y as a column. */
typedef struct pair_outputs {
    matrix_t h;
    matrix_t r;
    matrix_t y;
} pair_outputs_t;

static inline pair_outputs_t pair_outputs(const cdkf_t *cdkf, const float y[PAIR_X], const bool valid[PAIR_X])
{
    const uint32_t count = (valid[0] ? 1u : 0u) + (valid[1] ? 1u : 0u);
    pair_outputs_t of = {matrix_zero(count, (uint32_t)PAIR_Z), matrix_zero(count, count), matrix_zero(count, 1u)};
    uint32_t row = 0u;
    for (uint32_t i = 0u; i < (uint32_t)PAIR_X; i++) {
        if (valid[i]) {
            of.h.at[row][(uint32_t)PAIR_W + i] = 1.0;
            of.r.at[row][row] = (double)cdkf->output_noise[i] * (double)cdkf->output_noise[i];
            of.y.at[row][0] = (double)y[i];
            row++;
        }
    }
    return of;
}

/* Outputs about where the reference expects them, NaN where they are not valid, into both filters; their nis is left in
 * nis[2]. */
static inline void pair_update(pair_t *pair, bool theta_valid, bool theta_dot_valid, bool learn, double nis[2])
{
    const bool valid[PAIR_X] = {theta_valid, theta_dot_valid};
    float y[PAIR_X];
    innovation_t innovation[CDKF_OUTPUTS];
    nis[0] = 0.0;
    for (uint32_t i = 0u; i < (uint32_t)PAIR_X; i++) {
        const double noise = 1.2 * (double)pair->cdkf.output_noise[i] * random_normal(&pair->source);
        y[i] = valid[i] ? (float)(pair->reference.x.at[(uint32_t)PAIR_W + i][0] + noise) : NAN;
    }
    cdkf_measurement_update(&pair->cdkf, y, valid, learn, innovation);
    for (uint32_t i = 0u; i < (uint32_t)PAIR_X; i++) {
        const double value = (double)innovation[i].value;
        nis[0] += value * value * (double)innovation[i].inverse_variance;
    }
    const pair_outputs_t of = pair_outputs(&pair->cdkf, y, valid);
    nis[1] = (of.h.rows == 0u) ? 0.0 : kalman_update(&pair->reference, of.h, of.r, of.y);
}

/* What the reference's state loses when the covariance of w grows to `grown` and that of x and w stays: what w no
 * longer explains. */
static inline matrix_t pair_unexplained(const matrix_t *p, matrix_t grown)
{
    const matrix_t ww = matrix_block(p, 0u, (uint32_t)PAIR_W, 0u, (uint32_t)PAIR_W);
    const matrix_t xw = matrix_block(p, (uint32_t)PAIR_W, (uint32_t)PAIR_X, 0u, (uint32_t)PAIR_W);
    return matrix_congruence(xw, matrix_sum(matrix_inverse(ww), -1.0, matrix_inverse(grown)));
}

/* Forgetting and walk in the textbook: the joint filter's P_x stays, the dual's loses what w no longer explains. */
static inline void pair_reference_walk(pair_t *pair, double period, double variance, bool joint)
{
    matrix_t *p = &pair->reference.p;
    matrix_t grown = matrix_block(p, 0u, (uint32_t)PAIR_W, 0u, (uint32_t)PAIR_W);
    grown = matrix_sum(grown, (double)pair->cdkf.growth * period, grown);
    for (uint32_t i = 0u; i < (uint32_t)PAIR_W; i++) {
        grown.at[i][i] += ((double)pair->cdkf.walk[i] * period) + variance;
    }
    const matrix_t lost = pair_unexplained(p, grown);
    for (uint32_t i = 0u; i < (uint32_t)PAIR_W; i++) {
        for (uint32_t j = 0u; j < (uint32_t)PAIR_W; j++) {
            p->at[i][j] = grown.at[i][j];
            if (!joint && (i < (uint32_t)PAIR_X) && (j < (uint32_t)PAIR_X)) {
                p->at[PAIR_W + i][PAIR_W + j] -= lost.at[i][j];
            }
        }
    }
}

static inline void pair_walk(pair_t *pair, float period, float variance, bool joint)
{
    const float variances[PAIR_W] = {variance, variance, variance};
    cdkf_forget(&pair->cdkf, period, joint);
    cdkf_walk(&pair->cdkf, period, variances, joint);
    cdkf_draw(&pair->cdkf, &pair_model, NULL);
    pair_reference_walk(pair, (double)period, (double)variance, joint);
}

/* To be asked when the parameters have just learnt: estimates within `sigmas`, the covariance within `relative`. */
static inline void pair_assert_equal(const pair_t *pair, double sigmas, double relative)
{
    const cdkf_t *cdkf = &pair->cdkf;
    const matrix_t found = pair_covariance(cdkf);
    const matrix_t *wanted = &pair->reference.p;
    for (uint32_t i = 0u; i < (uint32_t)PAIR_Z; i++) {
        const float estimate = (i < (uint32_t)PAIR_W) ? cdkf->w[i] : cdkf->x[i - (uint32_t)PAIR_W];
        const double sigma = sqrt(wanted->at[i][i]);
        TEST_ASSERT_DOUBLE_WITHIN(sigmas * sigma, pair->reference.x.at[i][0], (double)estimate);
    }
    TEST_ASSERT_DOUBLE_WITHIN(relative, 0.0, covariance_difference(&found, wanted, wanted));
    TEST_ASSERT_TRUE(cdkf_is_valid(cdkf));
}

#endif
