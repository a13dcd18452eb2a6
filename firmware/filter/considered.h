/* What the considered errors make of the estimates' errors (considered_t in cdkf.h), and what of a step of the filter
 * they need. Only the files of the filter include this.
 */
#ifndef FILTER_CONSIDERED_H
#define FILTER_CONSIDERED_H

#include "filter/cdkf.h"

/* Gain of one output on the state for given w, and the innovation's standard deviation; 0 when it is not valid. */
typedef struct gain {
    float k[MODEL_STATES];
    float inverse; /* 1 / S_y */
    float kept;    /* R / S_y^2, what is left of a deviation of the output itself; 1 when it is not valid */
} gain_t;

/* Takes from a deviation of the state what the correction by an output takes, I - K H; returns what the output saw of
 * it, divided by S_y. */
static inline float gain_correct(const gain_t *gain, float seen, float *theta, float *theta_dot)
{
    *theta -= gain->k[0] * seen;
    *theta_dot -= gain->k[1] * seen;
    return gain->inverse * seen;
}

/* The same by an output that is `own` of the states `own` and `other`, whose gain is `k`. */
static inline float gain_correct_own(const gain_t *gain, float k, float *own, float *other)
{
    const float seen = *own;
    *own = gain->kept * seen;
    *other -= k * seen;
    return gain->inverse * seen;
}

/* A deviation of the state, moved by the slope of the step. Sigma points of S_xx would give the same to 5e-5
 * standard deviations: the model is nearly linear over the state's own uncertainty. */
static inline void response_move(const model_response_t *response, float period, float *theta, float *theta_dot)
{
    const float change = (response->slope[0] * *theta) + (response->slope[1] * *theta_dot);
    *theta += period * (*theta_dot + (0.5f * change));
    *theta_dot += change;
}

/* What each considered error acts through: change of theta_dot over a step by a unit of it. */
static inline void considered_inputs(const model_response_t *response, float period, float input[CDKF_CONSIDERED])
{
    input[CDKF_BASE_GAIN] = response->base;
    input[CDKF_BASE_DELAY] = response->base;
    input[CDKF_TORQUE_GAIN] = response->torque;
    input[CDKF_FRICTION] = response->torque;
    input[CDKF_STEP] = period;
}

/* The state, or the parameters, start anew: no error of theirs is made by the considered ones. */
void considered_start_state(considered_t considered[CDKF_CONSIDERED]);
void considered_start_w(considered_t considered[CDKF_CONSIDERED]);

/* Measurement update by an output that sees `seen` of each, not yet divided by S_y; `row` and `nu` are. */
void considered_correct_by(considered_t considered[CDKF_CONSIDERED], uint32_t count, const gain_t *gain,
    const float seen[CDKF_CONSIDERED], const float row[MODEL_PARAMETERS], float nu, bool learn);

void considered_drop_pending(considered_t considered[CDKF_CONSIDERED]);

/* The pending score of an error as if it had always been: the outputs see x + S_xw w. */
score_t considered_score(const considered_t *considered, const information_t *pending);

/* The parameters learn: u is the reverse factor of I + information (math/factor.h). */
void considered_learn(considered_t considered[CDKF_CONSIDERED], uint32_t count, float trust, const float *u);

/* Before and after the columns of S change: S_ww w, which is kept in between, and S_xw w + x stay. */
typedef float considered_of_w_t[CDKF_CONSIDERED][MODEL_PARAMETERS];
void considered_lift(cdkf_t *cdkf, considered_of_w_t of_w);
void considered_lower(cdkf_t *cdkf, considered_of_w_t of_w);

/* Covariance of rows i and j of [S_ww; S_xw], with what the considered errors make of both. */
float considered_covariance(const cdkf_t *cdkf, uint32_t i, uint32_t j);

#endif
