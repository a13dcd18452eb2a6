#include "filter/considered.h"

#include "math/factor.h"

#include <string.h>

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
