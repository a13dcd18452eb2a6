/* What the considered errors make of the estimates' errors, and what of a step of the filter they need. */
#ifndef FILTER_CONSIDERED_H
#define FILTER_CONSIDERED_H

#include "model/model.h"

#include <stdbool.h>
#include <stdint.h>

/* A calibration error: not learnt, but considered (Schmidt 1966; Bierman 1977, chapter VIII): the estimates' errors
 * include what a unit of it makes of them. Those of w and x are the filter's own, + its standard deviation times w
 * (in coordinates of the columns of S_ww) and S_xw w + x. The gain of the filter does not know of it, so estimates are
 * what they are without. */
typedef struct considered {
    float w[MODEL_PARAMETERS];
    float x[MODEL_STATES];
    float cross[MODEL_PARAMETERS]; /* pending: sum of what the outputs see of S_ww times what they see of x */
    float vector;                  /* pending: sum of what they see of x times the innovations */
    float information;             /* pending: sum of its square */
} considered_t;

/* The last is no calibration error but a constant acceleration from one moment on, which is estimated for a while. */
enum considered_error { CDKF_BASE_GAIN, CDKF_BASE_DELAY, CDKF_TORQUE_GAIN, CDKF_FRICTION, CDKF_STEP, CDKF_CONSIDERED };

enum { CDKF_CALIBRATION = CDKF_STEP };

/* What samples say of w in coordinates of the columns of S_ww. */
typedef struct information {
    float matrix[MODEL_PARAMETERS * MODEL_PARAMETERS]; /* symmetric: its upper triangle */
    float vector[MODEL_PARAMETERS];                    /* the matrix times the correction */
} information_t;

/* Adds an innovation `nu` that sees row times the columns of S_ww, both in units of its standard deviation. */
static inline void information_add(information_t *information, const float row[MODEL_PARAMETERS], float nu)
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        information->vector[i] += row[i] * nu;
        for (uint32_t j = i; j < (uint32_t)MODEL_PARAMETERS; j++) {
            information->matrix[(i * (uint32_t)MODEL_PARAMETERS) + j] += row[i] * row[j];
        }
    }
}

/* What innovations say of a considered error b, by themselves: its estimate is vector / information, of variance
 * 1 / information (Friedland 1969). */
typedef struct score {
    float vector;
    float information;
} score_t;

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

#endif
