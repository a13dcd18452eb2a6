#include "filter/considered.h"

#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define CONSIDERED ((uint32_t)CDKF_CONSIDERED)

void considered_start_state(considered_t considered[CDKF_CONSIDERED])
{
    for (uint32_t c = 0u; c < CONSIDERED; c++) {
        (void)memset(considered[c].x, 0, sizeof considered[c].x);
    }
}

void considered_start_w(considered_t considered[CDKF_CONSIDERED])
{
    for (uint32_t c = 0u; c < CONSIDERED; c++) {
        (void)memset(considered[c].w, 0, sizeof considered[c].w);
    }
}

void considered_correct_by(considered_t considered[CDKF_CONSIDERED], uint32_t count, const gain_t *gain,
    const float seen[CDKF_CONSIDERED], const float row[MODEL_PARAMETERS], float nu, bool learn)
{
    for (uint32_t c = 0u; c < count; c++) {
        considered_t *of = &considered[c];
        const float share = gain_correct(gain, seen[c], &of->x[0], &of->x[1]);
        if (learn) {
            for (uint32_t i = 0u; i < L; i++) {
                of->cross[i] += row[i] * share;
            }
            if (c != (uint32_t)CDKF_BASE_GAIN) { /* whether the base is wrong must not depend on the force */
                of->vector += nu * share;
                of->information += share * share;
            }
        }
    }
}

void considered_drop_pending(considered_t considered[CDKF_CONSIDERED])
{
    for (uint32_t c = 0u; c < CONSIDERED; c++) {
        for (uint32_t i = 0u; i < L; i++) {
            considered[c].cross[i] = 0.0f;
        }
        considered[c].vector = 0.0f;
        considered[c].information = 0.0f;
    }
}

score_t considered_score(const considered_t *considered, const information_t *pending)
{
    const float *w = considered->w;
    const float *m = pending->matrix; /* its upper triangle */
    const float square = (w[0] * w[0] * m[0]) + (w[1] * w[1] * m[4]) + (w[2] * w[2] * m[8]);
    const float mixed = (w[0] * w[1] * m[1]) + (w[0] * w[2] * m[2]) + (w[1] * w[2] * m[5]);
    const score_t score = {considered->vector + factor_dot_three(w, pending->vector),
        considered->information + (2.0f * (factor_dot_three(w, considered->cross) + mixed)) + square};
    return score;
}

void considered_lift(cdkf_t *cdkf, considered_of_w_t of_w)
{
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        considered_t *considered = &cdkf->considered[c];
        for (uint32_t i = 0u; i < L; i++) {
            of_w[c][i] = factor_dot_three(&cdkf->s[i * L], considered->w);
        }
        for (uint32_t i = 0u; i < N; i++) {
            considered->x[i] += factor_dot_three(&cdkf->s[(L + i) * L], considered->w);
        }
    }
}

void considered_lower(cdkf_t *cdkf, considered_of_w_t of_w)
{
    const float *s = cdkf->s;
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        considered_t *considered = &cdkf->considered[c];
        float *w = considered->w; /* forward substitution */
        w[0] = of_w[c][0] / s[0];
        w[1] = (of_w[c][1] - (s[L] * w[0])) / s[L + 1u];
        w[2] = (of_w[c][2] - (s[2u * L] * w[0]) - (s[(2u * L) + 1u] * w[1])) / s[(2u * L) + 2u];
        for (uint32_t i = 0u; i < N; i++) {
            considered->x[i] -= factor_dot_three(&s[(L + i) * L], w);
        }
    }
}

void considered_learn(considered_t considered[CDKF_CONSIDERED], uint32_t count, float trust, const float *u)
{
    for (uint32_t c = 0u; c < count; c++) {
        considered_t *of = &considered[c];
        for (uint32_t i = 0u; i < L; i++) {
            of->w[i] -= trust * of->cross[i];
        }
        factor_reverse_solve(u, L, of->w, L);
    }
}

float considered_covariance(const cdkf_t *cdkf, uint32_t i, uint32_t j)
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
