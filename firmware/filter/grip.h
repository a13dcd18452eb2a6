/* The grip force in a time update (cdkf_grip_t in cdkf.h): it sees the change of theta_dot over the step, of which the
 * process noise of the step is a part. So it is taken between lines 4 and 5 of Algorithm 1, before the columns of the
 * state's factor are compressed. Only the files of the filter include this.
 */
#ifndef FILTER_GRIP_H
#define FILTER_GRIP_H

#include "filter/cdkf.h"
#include "filter/considered.h"

/* Columns of S-_xx before it is compressed: its own, the walk of theta_dot, that of theta, second differences. */
enum { GRIP_COLUMNS = 5 };

typedef struct grip_seen {
    float row[MODEL_PARAMETERS]; /* of the columns of S_xw and S_ww, */
    float column[MODEL_STATES];  /* of those of S_xx, */
    float considered[CDKF_CONSIDERED];
    float walk;     /* of the walk of theta_dot, */
    float response; /* and of the response to past corrections */
    float innovation;
    float noise;
    gain_t gain;
    bool taken;
} grip_seen_t;

/* What the force sees before the step. A force that is far from what is expected is not taken. */
void grip_see(const cdkf_t *cdkf, const model_response_t *response, const float error[CDKF_CONSIDERED],
    const cdkf_grip_t *grip, float period, grip_seen_t *seen);

/* Conditions the columns of the state on the force: it adds one. */
void grip_condition(grip_seen_t *seen, float theta[GRIP_COLUMNS + 1], float theta_dot[GRIP_COLUMNS + 1]);

/* Corrects the rest of the belief. */
void grip_take(cdkf_t *cdkf, const cdkf_grip_t *grip, const grip_seen_t *seen);

#endif
