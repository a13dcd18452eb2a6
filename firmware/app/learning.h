/* What follows from a block of samples: evidence, the verdict on it, the actions of the verdict (verdict.def), and then
 * what the parameters learn of the block and how they walk.
 */
#ifndef APP_LEARNING_H
#define APP_LEARNING_H

#include "app/evidence.h"
#include "app/setup.h"
#include "filter/cdkf.h"
#include "filter/noise_estimation.h"

#include <stdbool.h>

typedef struct learning {
    evidence_t evidence;
    noise_estimation_t noise;
    snapshot_t kept[2]; /* the belief one and two KEEP_PERIODs ago, to be restored */
    float kept_ago;     /* time since the first [s] */
    float elapsed;      /* since the parameters learnt last [s] */
    uint8_t verdict;    /* enum verdict */
    bool levels;        /* levels and state are to begin anew */
} learning_t;

/* Starts, for parameters at their first guess. */
void learning_start(learning_t *learning, const setup_t *setup, cdkf_t *cdkf);

/* What samples say counts for the parameters, as far as inputs and motion are concerned. */
static inline bool learning_informs(const learning_t *learning)
{
    return !evidence_has(&learning->evidence, EVIDENCE_MISSING) &&
           !evidence_has(&learning->evidence, EVIDENCE_UNSETTLED);
}

/* After the measurement update with a sample, `elapsed` seconds after the last one. Evidence is judged in every mode, once
 * a learn_period; while `held` (FROZEN, or aligning) the parameters stay. Returns true at the end of a block. */
bool learning_step(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, bool held, float elapsed);

/* The parameters learn again, from now on, after they were held. */
void learning_resume(learning_t *learning, cdkf_t *cdkf);

/* After `elapsed` seconds without samples: what is pending is dropped, and the parameters walk for that time. */
void learning_skip(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float elapsed);

#endif
