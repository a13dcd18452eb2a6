#include "filter/revision.h"

#include "math/factor.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)

/* Row i of a lower-triangular matrix times a vector. */
static inline float row_times(const float *lower, uint32_t i, const float *vector)
{
    float sum = lower[i * L] * vector[0];
    for (uint32_t k = 1u; k <= i; k++) {
        sum += lower[(i * L) + k] * vector[k];
    }
    return sum;
}

/* A row of three times a column of a matrix. */
static float times_column(const float *row, const float *column)
{
    return (row[0] * column[0]) + (row[1] * column[L]) + (row[2] * column[2u * L]);
}

/* --- learning ------------------------------------------------------------------------------------------------------ */

/* What was gathered is put aside, weighted, and nothing left there. */
static void put_aside(information_t *gathered, information_t *aside, float weight)
{
    for (uint32_t i = 0u; i < L; i++) {
        aside->score[i] = weight * gathered->score[i];
        gathered->score[i] = 0.0f;
    }
    for (uint32_t k = 0u; k < (uint32_t)INFORMATION_SIZE; k++) {
        aside->upper[k] = weight * gathered->upper[k];
        gathered->upper[k] = 0.0f;
    }
}

/* By how much it counts: more, when there is something. */
static float trust_after(const parameter_filter_t *filter, float period, float caution)
{
    const float more = filter->trust + ((period < caution) ? (period / caution) : 1.0f);
    const float most = (more < 1.0f) ? more : 1.0f;
    return (filter->gathered.upper[0] > 0.0f) ? most : filter->trust;
}

static void unpack(const float upper[INFORMATION_SIZE], float matrix[])
{
    uint32_t next = 0u;
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t j = i; j < L; j++) {
            matrix[(i * L) + j] = upper[next];
            matrix[(j * L) + i] = upper[next];
            next++;
        }
    }
}

void revision_take(revision_t *revision, parameter_filter_t *filter, float period, float caution)
{
    filter->trust = trust_after(filter, period, caution);
    put_aside(&filter->gathered, &revision->information, filter->trust);
    unpack(revision->information.upper, revision->work);
    factor_reverse(revision->work, L);
}

void revision_condition(revision_t *revision, const parameter_filter_t *filter)
{
    (void)memcpy(revision->s, filter->s, sizeof revision->s);
    factor_condition(revision->s, revision->map, L, revision->work, revision->information.score);
}

void revision_open(revision_t *revision, parameter_filter_t *filter)
{
    filter->trust = 0.0f;
    for (uint32_t i = 0u; i < L; i++) {
        revision->information.score[i] = 0.0f;
        for (uint32_t j = 0u; j < L; j++) {
            revision->s[(i * L) + j] = (i == j) ? parameter_filter_prior_sigma(filter, i) : 0.0f;
            revision->map[(i * L) + j] = 0.0f;
        }
    }
}

bool revision_correct(revision_t *revision, const parameter_filter_t *filter, float learnt[MODEL_PARAMETERS])
{
    const float *score = revision->information.score;
    for (uint32_t i = 0u; i < L; i++) {
        revision->shift[i] = row_times(revision->map, i, score);
        revision->w[i] = filter->w[i] + row_times(revision->s, i, score);
        learnt[i] = factor_variance(filter->s, L, i) - factor_variance(revision->s, L, i);
    }
    return parameter_filter_bound(filter, revision->w);
}

void revision_correction(
    const revision_t *revision, const parameter_filter_t *filter, float correction[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < L; i++) {
        correction[i] = revision->w[i] - filter->w[i];
    }
}

/* --- walking ------------------------------------------------------------------------------------------------------- */

/* P_w / lambda with 1 / lambda = 1 + growth, by noise independent of the rest: the covariance M S_w^T stays, so M shrinks as
 * S_w grows; the rest of M is freed. */
bool revision_forget(
    revision_t *revision, const parameter_filter_t *filter, float period, float freed[MODEL_STATES * MODEL_PARAMETERS])
{
    const float growth = filter->growth * period;
    const bool forgets = !(growth == 0.0f); /* a NaN is to show */
    if (forgets) {
        const float stretch = sqrtf(1.0f + growth);
        const float shrink = 1.0f / stretch;
        const float rest = sqrtf(growth) * shrink;
        for (uint32_t k = 0u; k < (N * L); k++) { /* T M */
            freed[k] = rest * times_column(&filter->s[(L + (k / L)) * L], &revision->map[k % L]);
        }
        for (uint32_t k = 0u; k < (L * L); k++) {
            revision->s[k] *= stretch;
            revision->map[k] *= shrink;
        }
    }
    return forgets;
}

void revision_walk(revision_t *revision, const parameter_filter_t *filter, uint32_t i, float period, float variance,
    float freed[MODEL_STATES * MODEL_PARAMETERS])
{
    float rest[L];
    const float noise = sqrtf((filter->walk[i] * period) + variance);
    factor_add_noise(revision->s, revision->map, L, i, noise, rest);
    for (uint32_t k = 0u; k < N; k++) {
        const float *row = &filter->s[(L + k) * L];
        freed[(k * L) + i] = (row[0] * rest[0]) + (row[1] * rest[1]) + (row[2] * rest[2]);
    }
}

/* --- sigma points -------------------------------------------------------------------------------------------------- */

/* Scales the rows of S_w whose standard deviation has outgrown that of the prior. */
void revision_cap(revision_t *revision, const parameter_filter_t *filter)
{
    for (uint32_t i = 0u; i < L; i++) {
        const float most = parameter_filter_prior_sigma(filter, i);
        const float square = factor_variance(revision->s, L, i);
        const float shrink = (square > (most * most)) ? (most / sqrtf(square)) : 1.0f;
        for (uint32_t j = 0u; j <= i; j++) {
            revision->s[(i * L) + j] *= shrink;
        }
    }
}

void revision_draw_mean(revision_t *revision, const parameter_filter_t *filter)
{
    parameter_filter_at(filter, revision->w, revision->p);
}

void revision_draw_pairs(revision_t *revision, const parameter_filter_t *filter)
{
    for (uint32_t j = 0u; j < L; j++) {
        parameter_filter_spread(filter, revision->s, j, &revision->work[j * L]);
    }
}

/* --- in the filter's place ----------------------------------------------------------------------------------------- */

void revision_adopt(revision_t *revision, parameter_filter_t *filter, const model_t *model,
    const model_constants_t *constants, float x[MODEL_STATES])
{
    for (uint32_t i = 0u; i < N; i++) {
        float *row = &filter->s[(L + i) * L];
        const float old[L] = {row[0], row[1], row[2]};
        for (uint32_t j = 0u; j < L; j++) {
            x[i] += old[j] * revision->shift[j];
            row[j] = times_column(old, &revision->map[j]);
        }
    }
    (void)memcpy(filter->w, revision->w, sizeof filter->w);
    (void)memcpy(filter->p, revision->p, sizeof filter->p);
    for (uint32_t k = 0u; k < (L * L); k++) {
        const float old = filter->s[k];
        filter->s[k] = revision->s[k];
        revision->s[k] = old;
    }
    parameter_filter_arm(filter, model, constants, filter->p, revision->work);
    put_aside(&filter->gathered, &revision->information, 1.0f);
}

/* The samples since were about w after its walk, so what they say of w stays: of information I and score s about old
 * coordinates, N^T I N and N^T (s - I shift) about new ones, with N = S_old^-1 S_new. */
void revision_carry_score(revision_t *revision, parameter_filter_t *filter)
{
    float *change = revision->work;
    float *score = revision->information.score;
    (void)memcpy(change, filter->s, sizeof revision->work);
    factor_solve(revision->s, L, change, L);
    unpack(revision->information.upper, revision->map);
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t j = 0u; j < L; j++) {
            score[i] -= revision->map[(i * L) + j] * revision->shift[j];
        }
    }
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t k = i; k < L; k++) { /* N is lower triangular */
            filter->gathered.score[i] += change[(k * L) + i] * score[k];
        }
    }
}

void revision_carry_information(const revision_t *revision, parameter_filter_t *filter)
{
    information_t *gathered = &filter->gathered;
    const float *change = revision->work;
    float product[L * L]; /* I N */
    for (uint32_t i = 0u; i < L; i++) {
        const float *row = &revision->map[i * L];
        for (uint32_t j = 0u; j < L; j++) {
            product[(i * L) + j] = times_column(row, &change[j]);
        }
    }
    uint32_t next = 0u;
    for (uint32_t i = 0u; i < L; i++) {
        for (uint32_t j = i; j < L; j++) {
            for (uint32_t k = i; k < L; k++) {
                gathered->upper[next] += change[(k * L) + i] * product[(k * L) + j];
            }
            next++;
        }
    }
}
