/* All steps of a revision at once, and models whose arms are simply their parameters. */
#ifndef UNIT_FILTER_REVISE_H
#define UNIT_FILTER_REVISE_H

#include "filter/dual.h"
#include "filter/revision.h"

#include <stddef.h>

enum { REVISE_W = MODEL_PARAMETERS };

static inline void plain_prepare(const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_arm_t *arm)
{
    (void)constants;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_COEFFICIENTS; i++) {
        arm->coefficient[i] = (i < (uint32_t)MODEL_PARAMETERS) ? p[i] : 0.0f;
    }
}

/* A model of the given scale and bounds, with plain arms. */
static inline model_t plain_model(const model_t *model)
{
    model_t plain = *model;
    plain.prepare = plain_prepare;
    return plain;
}

/* From the information gathered to what is to be adopted. `variance`: of w on top of the walk; NULL: none. Returns whether w
 * rests on a bound. */
static inline bool revise_prepare(
    dual_t *dual, float period, float caution, const float *variance, bool joint, float learnt[REVISE_W])
{
    const float none[REVISE_W] = {0.0f, 0.0f, 0.0f};
    revision_take(&dual->revision, &dual->parameters, period, caution);
    revision_condition(&dual->revision, &dual->parameters);
    const bool bounded = revision_correct(&dual->revision, &dual->parameters, learnt);
    dual_forget(dual, period, joint);
    dual_walk(dual, 0u, REVISE_W, period, (variance != NULL) ? variance : none, joint);
    revision_cap(&dual->revision, &dual->parameters);
    revision_draw_mean(&dual->revision, &dual->parameters);
    revision_draw_pairs(&dual->revision, &dual->parameters);
    return bounded;
}

/* All of it, as both filters together do it. */
static inline bool revise(dual_t *dual, const model_t *model, const model_constants_t *constants, float period,
    float caution, bool joint, float correction[REVISE_W])
{
    float learnt[REVISE_W];
    const bool bounded = revise_prepare(dual, period, caution, NULL, joint, learnt);
    revision_correction(&dual->revision, &dual->parameters, correction);
    revision_adopt(&dual->revision, &dual->parameters, model, constants, dual->state.x);
    revision_carry_score(&dual->revision, &dual->parameters);
    revision_carry_information(&dual->revision, &dual->parameters);
    return bounded;
}

#endif
