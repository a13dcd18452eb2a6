/* The grip force in a time update (cdkf_grip_t in cdkf.h): it sees the change of theta_dot over the step, of which the
 * process noise of the step is a part. So it is taken between the mean and the factor (cdkf.h), before the columns of the
 * state's factor are compressed. Only the files of the filter include this.
 */
#ifndef FILTER_GRIP_H
#define FILTER_GRIP_H

#include "filter/cdkf.h"

/* Process noise of a step. */
typedef struct step_noise {
    float variance; /* of theta_dot [rad^2/s^2]; theta has T/2 of it in common */
    float angle;    /* of theta beside that [rad^2] */
    float second;   /* sum of the squares of the second differences along the parameters [rad^2/s^2] */
} step_noise_t;

typedef struct grip_seen {
    float row[MODEL_PARAMETERS]; /* of the columns of S_xw and S_ww, */
    float column[MODEL_STATES];  /* of those of S_xx, */
    float considered[CDKF_CONSIDERED];
    float walk;     /* of the walk of theta_dot, */
    float response; /* and of the response to past corrections */
    float innovation;
    float noise;
    gain_t gain;
} grip_seen_t;

/* What the force sees before the step. */
void grip_see(const cdkf_t *cdkf, const model_response_t *response, const float error[CDKF_CONSIDERED],
    const cdkf_grip_t *grip, float period, grip_seen_t *seen);

/* Line 5 for the state, conditioned on the force; false when it is too far from what is expected. */
bool grip_predict_state_columns(
    cdkf_t *cdkf, const model_response_t *response, const step_noise_t *noise, float period, grip_seen_t *seen);

/* Corrects the rest of the belief. */
void grip_take(cdkf_t *cdkf, const cdkf_grip_t *grip, const grip_seen_t *seen);

#endif
