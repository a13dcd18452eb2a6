/* Learning of the parameters, once a block: see cdkf.h. */
#include "filter/cdkf.h"
#include "math/bounds.h"
#include "math/factor.h"
#include "math/invariant.h"
#include "math/share.h"

#include <math.h>
#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define ROWS ((uint32_t)CDKF_ROWS)
#define FINITE_MOST 1.0e17f /* squares stay inside the range of float */

/* --- considered errors while the columns of S change --------------------------------------------------------------- */

typedef struct lifted {
    uint32_t acting;
    float of_w[CDKF_CONSIDERED][MODEL_PARAMETERS];
} lifted_t;

/* Before they change: S_ww w, which is kept in between, and S_xw w + x stay. */
static void lift(cdkf_t *cdkf, lifted_t *lifted)
{
    lifted->acting = cdkf->acting;
    for (uint32_t c = 0u; c < lifted->acting; c++) {
        considered_t *considered = &cdkf->considered[c];
        for (uint32_t i = 0u; i < L; i++) {
            lifted->of_w[c][i] = factor_dot_three(&cdkf->s[i * L], considered->w);
        }
        for (uint32_t i = 0u; i < N; i++) {
            considered->x[i] += factor_dot_three(&cdkf->s[(L + i) * L], considered->w);
        }
    }
}

/* After it. */
static void lower(cdkf_t *cdkf, const lifted_t *lifted)
{
    const float *s = cdkf->s;
    for (uint32_t c = 0u; c < lifted->acting; c++) {
        const float *of_w = lifted->of_w[c];
        considered_t *considered = &cdkf->considered[c];
        float *w = considered->w; /* forward substitution */
        w[0] = of_w[0] / s[0];
        w[1] = (of_w[1] - (s[L] * w[0])) / s[L + 1u];
        w[2] = (of_w[2] - (s[2u * L] * w[0]) - (s[(2u * L) + 1u] * w[1])) / s[(2u * L) + 2u];
        for (uint32_t i = 0u; i < N; i++) {
            considered->x[i] -= factor_dot_three(&s[(L + i) * L], w);
        }
    }
}

/* Covariance of rows i and j of [S_ww; S_xw], with what the considered errors make of both. */
static float covariance_of(const cdkf_t *cdkf, uint32_t i, uint32_t j)
{
    const float *a = &cdkf->s[i * L];
    const float *b = &cdkf->s[j * L];
    float covariance = factor_dot_three(a, b);
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        const considered_t *considered = &cdkf->considered[c];
        const float sigma = cdkf->considered_sigma[c];
        const float of_a = factor_dot_three(a, considered->w) + ((i < L) ? 0.0f : considered->x[i - L]);
        const float of_b = factor_dot_three(b, considered->w) + ((j < L) ? 0.0f : considered->x[j - L]);
        covariance += (sigma * of_a) * (sigma * of_b);
    }
    return covariance;
}

/* --- learning ------------------------------------------------------------------------------------------------------ */

void cdkf_init(cdkf_t *cdkf, const model_t *model, const model_constants_t *constants, const prior_t *prior)
{
    (void)memset(cdkf, 0, sizeof *cdkf);
    scaling_init(&cdkf->scaling, model, prior);
    cdkf->acting = (uint32_t)CDKF_CALIBRATION;
    cdkf_open(cdkf);
    cdkf_draw(cdkf, model, constants);
}

void cdkf_drop_pending(cdkf_t *cdkf)
{
    (void)memset(&cdkf->pending, 0, sizeof cdkf->pending);
    considered_drop_pending(cdkf->considered);
}

score_t cdkf_sudden_score(const cdkf_t *cdkf)
{
    const considered_t *considered = &cdkf->considered[CDKF_BASE_GAIN];
    const score_t score = {considered->vector, considered->information};
    return score;
}

score_t cdkf_constant_score(const cdkf_t *cdkf, uint32_t c)
{
    return considered_score(&cdkf->considered[c], &cdkf->pending);
}

/* Adds `factor` times P_ww to a lower triangle. */
static void add_covariance(const cdkf_t *cdkf, float factor, float covariance[CDKF_TRIANGLE])
{
    uint32_t k = 0u;
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t j = 0u; j <= i; j++) {
            covariance[k] += factor * factor_dot_three(&cdkf->s[i * L], &cdkf->s[j * L]);
            k++;
        }
    }
}

void cdkf_learn(cdkf_t *cdkf, float period, float caution, correction_t *correction)
{
    float *u = cdkf->pending.matrix;
    float *step = cdkf->pending.vector; /* of w in coordinates of the columns of S_ww */
    (void)memset(correction, 0, sizeof *correction);
    add_covariance(cdkf, 1.0f, correction->covariance);
    if (u[0] > 0.0f) { /* there is information */
        cdkf->trust = lesser(cdkf->trust + share_of(period, caution), 1.0f);
    }
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t j = i; j < L; j++) {
            u[(i * L) + j] *= cdkf->trust;
        }
        step[i] *= cdkf->trust;
        correction->w[i] = cdkf->w[i];
    }
    factor_reverse(u, L);
    factor_reverse_solve(u, L, step, L);
    for (uint32_t r = 0u; r < ROWS; r++) { /* S (I + information)^-1/2; rows of S_ww end at their diagonal */
        float *row = &cdkf->s[r * L];
        factor_reverse_solve(u, L, row, lesser_count(r + 1u, L));
        float *mean = (r < L) ? &cdkf->w[r] : &cdkf->x[r - L];
        *mean += factor_dot_three(row, step);
    }
    considered_learn(cdkf->considered, cdkf->acting, cdkf->trust, u);
    cdkf_drop_pending(cdkf);
    correction->bounded = scaling_bound(&cdkf->scaling, cdkf->w);
    add_covariance(cdkf, -1.0f, correction->covariance);
    for (uint32_t i = 0u; i < L; i++) {
        correction->w[i] = cdkf->w[i] - correction->w[i];
    }
    INVARIANT(factor_is_whole(cdkf->s, L));
}

#define STEP_SIGMA 100.0f /* [rad/s^2]: a lever that rests 10 degrees from where it was */

void cdkf_begin_step(cdkf_t *cdkf)
{
    (void)memset(&cdkf->considered[CDKF_STEP], 0, sizeof cdkf->considered[CDKF_STEP]);
    cdkf->considered_sigma[CDKF_STEP] = STEP_SIGMA;
    cdkf->acting = (uint32_t)CDKF_CONSIDERED;
}

void cdkf_end_step(cdkf_t *cdkf)
{
    cdkf->acting = (uint32_t)CDKF_CALIBRATION;
}

bool cdkf_learn_step(cdkf_t *cdkf, const score_t *score)
{
    const considered_t *of = &cdkf->considered[CDKF_STEP];
    const float before = cdkf->considered_sigma[CDKF_STEP];
    const float variance = (before * before) / (1.0f + (before * before * score->information));
    const float step = variance * score->vector;
    cdkf->considered_sigma[CDKF_STEP] = sqrtf(variance);
    for (uint32_t r = 0u; r < ROWS; r++) {
        const float of_w = factor_dot_three(&cdkf->s[r * L], of->w);
        if (r < L) {
            cdkf->w[r] += step * of_w;
        } else {
            cdkf->x[r - L] += step * (of_w + of->x[r - L]);
        }
    }
    return scaling_bound(&cdkf->scaling, cdkf->w);
}

/* Adds independent deviations of the state, columns [MODEL_STATES x MODEL_PARAMETERS], to its own uncertainty. */
static void add_to_state(cdkf_t *cdkf, const float deviations[MODEL_STATES * MODEL_PARAMETERS])
{
    float theta[N + L] = {cdkf->s_xx[0], 0.0f, deviations[0], deviations[1], deviations[2]};
    const float theta_dot[N + L] = {cdkf->s_xx[2], cdkf->s_xx[3], deviations[3], deviations[4], deviations[5]};
    factor_tria_two(theta, theta_dot, N + L, cdkf->s_xx);
}

static void open_parameters(cdkf_t *cdkf)
{
    add_to_state(cdkf, &cdkf->s[L * L]);
    (void)memset(cdkf->s, 0, sizeof cdkf->s);
    for (uint32_t i = 0u; i < L; i++) {
        cdkf->s[(i * L) + i] = scaling_prior_sigma(&cdkf->scaling, i);
    }
    cdkf_drop_pending(cdkf);
    cdkf->trust = 0.0f;
}

void cdkf_open(cdkf_t *cdkf)
{
    lifted_t unused; /* what the prior says of w is not of these errors */
    lift(cdkf, &unused);
    open_parameters(cdkf);
    considered_start_w(cdkf->considered);
}

void cdkf_keep(const cdkf_t *cdkf, snapshot_t *snapshot)
{
    (void)memcpy(snapshot->w, cdkf->w, sizeof snapshot->w);
    uint32_t k = 0u;
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t j = 0u; j <= i; j++) {
            snapshot->s_ww[k] = cdkf->s[(i * L) + j];
            k++;
        }
    }
    snapshot->trust = cdkf->trust;
}

void cdkf_return(cdkf_t *cdkf, const snapshot_t *snapshot)
{
    lifted_t lifted;
    lift(cdkf, &lifted);
    open_parameters(cdkf);
    (void)memcpy(cdkf->w, snapshot->w, sizeof snapshot->w);
    uint32_t k = 0u;
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t j = 0u; j <= i; j++) {
            cdkf->s[(i * L) + j] = snapshot->s_ww[k];
            k++;
        }
    }
    cdkf->trust = snapshot->trust;
    if (snapshot->trust >= 1.0f) { /* what the considered errors made of w then was nearly the same */
        lower(cdkf, &lifted);
    } else {
        considered_start_w(cdkf->considered);
    }
}

void cdkf_forget(cdkf_t *cdkf, float period, bool joint)
{
    const float growth = cdkf->growth * period;
    if (growth != 0.0f) { /* a NaN is to show */
        lifted_t lifted;
        lift(cdkf, &lifted);
        const float stretch = sqrtf(1.0f + growth);
        const float shrink = 1.0f / stretch;
        const float rest = sqrtf(growth) * shrink;
        float unexplained[N * L];
        for (uint32_t k = 0u; k < (N * L); k++) { /* S_xw S_ww^T stays, so S_xw shrinks as S_ww grows */
            unexplained[k] = rest * cdkf->s[(L * L) + k];
            cdkf->s[(L * L) + k] *= shrink;
        }
        for (uint32_t k = 0u; k < (L * L); k++) {
            cdkf->s[k] *= stretch;
        }
        lower(cdkf, &lifted);
        if (joint) {
            add_to_state(cdkf, unexplained);
        }
    }
}

void cdkf_walk(cdkf_t *cdkf, float period, const float variance[MODEL_PARAMETERS], bool joint)
{
    float unexplained[N * L];
    lifted_t lifted;
    lift(cdkf, &lifted);
    for (uint32_t i = 0u; i < L; i++) {
        float rest[N];
        factor_add_noise(cdkf->s, ROWS, L, i, sqrtf((cdkf->walk[i] * period) + variance[i]), rest);
        unexplained[i] = rest[0];
        unexplained[L + i] = rest[1];
    }
    lower(cdkf, &lifted);
    if (joint) {
        add_to_state(cdkf, unexplained);
    }
}

/* Standard deviations of w stay at or below those of the prior (wind-up). */
static void cap(cdkf_t *cdkf)
{
    for (uint32_t i = 0u; i < L; i++) {
        const float most = scaling_prior_sigma(&cdkf->scaling, i);
        const float square = factor_variance(cdkf->s, L, i);
        const float shrink = (square > (most * most)) ? (most / sqrtf(square)) : 1.0f;
        for (uint32_t j = 0u; j <= i; j++) {
            cdkf->s[(i * L) + j] *= shrink;
        }
    }
}

void cdkf_draw(cdkf_t *cdkf, const model_t *model, const model_constants_t *constants)
{
    cap(cdkf);
    scaling_parameters(&cdkf->scaling, cdkf->w, cdkf->p);
    model->prepare(constants, cdkf->p, &cdkf->points[0]);
    for (uint32_t j = 0u; j < L; j++) {
        const float offset[L] = {
            SIGMA_OFFSET * cdkf->s[j], SIGMA_OFFSET * cdkf->s[L + j], SIGMA_OFFSET * cdkf->s[(2u * L) + j]};
        float plus[L];
        float minus[L];
        scaling_pair(&cdkf->scaling, cdkf->p, offset, plus, minus);
        model->prepare(constants, plus, &cdkf->points[1u + (2u * j)]);
        model->prepare(constants, minus, &cdkf->points[2u + (2u * j)]);
    }
}

float cdkf_state_sigma(const cdkf_t *cdkf, uint32_t i)
{
    const float *own = &cdkf->s_xx[i * N];
    return sqrtf(covariance_of(cdkf, L + i, L + i) + (own[0] * own[0]) + (own[1] * own[1]));
}

float cdkf_parameter_sigma(const cdkf_t *cdkf, uint32_t i)
{
    return scaling_slope(&cdkf->scaling, cdkf->p, i) * sqrtf(covariance_of(cdkf, i, i));
}

void cdkf_correlation(const cdkf_t *cdkf, float correlation[MODEL_PARAMETERS])
{
    const float sigma[L] = {
        sqrtf(covariance_of(cdkf, 0u, 0u)), sqrtf(covariance_of(cdkf, 1u, 1u)), sqrtf(covariance_of(cdkf, 2u, 2u))};
    correlation[0] = covariance_of(cdkf, 0u, 1u) / (sigma[0] * sigma[1]);
    correlation[1] = covariance_of(cdkf, 0u, 2u) / (sigma[0] * sigma[2]);
    correlation[2] = covariance_of(cdkf, 1u, 2u) / (sigma[1] * sigma[2]);
}

bool cdkf_is_valid(const cdkf_t *cdkf)
{
    const scaling_t *scaling = &cdkf->scaling;
    bool valid = cdkf_state_is_valid(cdkf) && (cdkf->s_xx[0] > 0.0f) && (cdkf->s_xx[3] > 0.0f);
    float size = fabsf(cdkf->response[0]) + fabsf(cdkf->response[1]);
    for (uint32_t i = 0u; i < L; i++) {
        valid = valid && (cdkf->s[(i * L) + i] > 0.0f) && (cdkf->walk[i] >= 0.0f);
        valid = valid && (cdkf->w[i] >= scaling->least[i]) && (cdkf->w[i] <= scaling->greatest[i]);
        size += cdkf->walk[i];
    }
    for (uint32_t k = 0u; k < (ROWS * L); k++) {
        size += fabsf(cdkf->s[k]);
    }
    return valid && (size < FINITE_MOST);
}
