/* Learning of the parameters, in steps of about equal cost: one for each of the next samples.
 *
 * What the filter has gathered is put aside, and new values of w, S_w and the sigma points are made from it beside the old
 * ones, with which the filter goes on meanwhile: condition on the information, let w walk, draw the points. What that does to
 * coordinates of the columns of S_w is made with them, a map M: x = shift + M y for old ones x and new ones y. Then the filter
 * adopts all of it at once: T <- T M, and the state moves by T shift. What it has gathered meanwhile, in the old coordinates, is
 * carried over, so that nothing is lost; only the point about which the model is linearised is older by the time that the
 * steps take. What a walk frees of the state is known, and the state's, those few samples before the walk is adopted.
 */
#ifndef FILTER_REVISION_H
#define FILTER_REVISION_H

#include "filter/parameter_filter.h"

#include <stdbool.h>

typedef struct revision {
    /* what is to be: S_w, w, and w in the units of the model; once that is adopted, s is the old S_w */
    float s[MODEL_PARAMETERS * MODEL_PARAMETERS];
    float w[MODEL_PARAMETERS];
    float p[MODEL_PARAMETERS];
    /* one after the other: factor of the information that is learnt; pairs of sigma points; S_old^-1 S_new */
    float work[MODEL_PARAMETERS * MODEL_PARAMETERS];
    /* M, and the shift; at last the information that is carried over */
    float map[MODEL_PARAMETERS * MODEL_PARAMETERS];
    float shift[MODEL_PARAMETERS];
    /* put aside: the score of what is learnt; later, what was gathered meanwhile */
    information_t information;
} revision_t;

/* Puts aside what was gathered in `period` seconds, factorised. From the start, or an opened covariance, on it counts
 * in part only, in proportion to the time that was learnt in, and fully after `caution` seconds: far from the truth the
 * sensitivities are wrong, and would make the filter certain of what the samples do not tell (the common scale of the
 * parameters). */
void revision_take(revision_t *revision, parameter_filter_t *filter, float period, float caution);

/* Conditions on it. */
void revision_condition(revision_t *revision, const parameter_filter_t *filter);

/* Instead of revision_condition(): drops it, and goes back to the covariance of the prior, uncorrelated with the state. */
void revision_open(revision_t *revision, parameter_filter_t *filter);

/* Corrects w by it, within the bounds of the model, and says by how much the variances of w have become smaller. Returns true
 * when w rests on a bound. */
bool revision_correct(revision_t *revision, const parameter_filter_t *filter, float learnt[MODEL_PARAMETERS]);

/* By how much w was corrected; until it is adopted. */
void revision_correction(
    const revision_t *revision, const parameter_filter_t *filter, float correction[MODEL_PARAMETERS]);

/* Forgetting over `period` seconds. Both here and when w walks, something of the state becomes independent of w, and is still
 * uncertain: it is left in `freed` [MODEL_STATES x MODEL_PARAMETERS], columns of deviations of the state. Returns false when
 * nothing is forgotten, and so nothing freed. */
bool revision_forget(
    revision_t *revision, const parameter_filter_t *filter, float period, float freed[MODEL_STATES * MODEL_PARAMETERS]);

/* Random walk of w_i over `period` seconds, and `variance` on top; for each i, one after the other. What is freed is left in
 * column i of `freed`. */
void revision_walk(revision_t *revision, const parameter_filter_t *filter, uint32_t i, float period, float variance,
    float freed[MODEL_STATES * MODEL_PARAMETERS]);

/* Keeps standard deviations at or below those of the prior (wind-up). */
void revision_cap(revision_t *revision, const parameter_filter_t *filter);

/* Draw the mean of the sigma points; then the pairs. */
void revision_draw_mean(revision_t *revision, const parameter_filter_t *filter);
void revision_draw_pairs(revision_t *revision, const parameter_filter_t *filter);

/* The filter takes all of it over; x, the state, moves along. */
void revision_adopt(revision_t *revision, parameter_filter_t *filter, const model_t *model,
    const model_constants_t *constants, float x[MODEL_STATES]);

/* Carry over what was gathered since revision_take(), so that it can be learnt next: both, in this order, after revision_adopt(),
 * which leaves the old S_w here for that. */
void revision_carry_score(revision_t *revision, parameter_filter_t *filter);
void revision_carry_information(const revision_t *revision, parameter_filter_t *filter);

#endif
