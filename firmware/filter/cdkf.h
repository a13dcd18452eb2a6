/* Square-root central difference Kalman filter for the state x and the scaled parameters w of a model, together.
 *
 * The belief is a Gaussian over z = [w; x] with the lower-triangular factor S = [S_ww 0; S_xw S_xx], P = S S^T,
 * parameters first: a time update then changes the two rows of the state only. Algorithm 1 of the dual estimator
 * (van der Merwe 2004, algorithms 3.4 and 3.8; Wan & Nelson 2001), by the lines of Algorithm 1 in Aresi, Zanoni and
 * Masarati (THEORY.md, 9), which has the parameters only, and the function that does it here:
 *
 *   paper   step                                                here
 *   1, 3    S_w- = tria[S_w, sqrt(R_r)] or S_w / sqrt(lambda)   cdkf_walk, cdkf_forget: random walk, or forgetting
 *   4       Cholesky factor of P_w                              none: S_w is carried
 *   5       W = [w, w + h S_w,j, w - h S_w,j]                   cdkf_draw: sigma points of the parameters, each block
 *   6       F = f(x, u, W), x moved by S_xw with each point     cdkf_time_update, model_t.respond
 *   7       x- = F0 + m sum (F+ + F- - 2 F0)                    cdkf_time_update: predicted mean
 *   8       S- = tria[c1 (F+ - F-), c2 (F+ + F- - 2 F0), S_v]   cdkf_time_update: predicted factor. S_xx has no sigma
 *                                                               points: it moves by the slope of the step
 *   8       y- = h(x-), C = H S-, S_y = tria[C, S_n]            cdkf_measurement_update: outputs are states, so D = 0
 *   9, 10   K = (S- C^T / S_y^T) / S_y                          cdkf_measurement_update: gain
 *   11      x = x- + K (y - y-), S = tria[S- - K C, K S_n]      cdkf_measurement_update, in Carlson's form
 *   9 - 11  the same for w, with S_e = S_y                      cdkf_learn, each block
 *   2, 12   loop over the samples                               app/estimator.c
 *   -       R_r, S_n, S_v adapted                               adaptation.h, noise_estimation.h
 *
 * The step for w is not done with x held fixed, as dual filters are often written: a parameter error would show in one step
 * only, and standard deviations come out four times too large. S_xw S_ww^-1 is the recurrent derivative dx/dw
 * (Nelson 2000), also the blending matrix of the two-stage filter (Friedland 1969). The joint filter differs in one
 * line: see cdkf_walk.
 *
 * Blocks. To learn takes twice as long as a step, and the walk of a millisecond is near the rounding of S_ww. So what
 * samples say of w is summed up as information in coordinates of the columns of S_ww, and the parameters learn it, and
 * walk, once a learn_period. The sum loses nothing, and float stays within 0.1 % of a standard deviation of double over
 * an hour (0.6 %, and standard deviations off by 2 %, when learning at each sample). Within a block S_ww and its
 * sigma points stand still; S_xw does not.
 */
#ifndef FILTER_CDKF_H
#define FILTER_CDKF_H

#include "filter/considered.h"
#include "model/model.h"
#include "model/scaling.h"

#include <stdbool.h>

/* Central difference sigma points (Norgaard, Poulsen, Ravn 2000), for a Gaussian: h^2 = 3. With f(0) at the mean and
 * f(+), f(-) at a pair, the mean is m0 f(0) + m sum f = f(0) + m sum_j (f(+) + f(-) - 2 f(0)), m0 = (h^2 - L) / h^2. */
#define SIGMA_OFFSET 1.73205081f  /* h */
#define SIGMA_FIRST 0.288675135f  /* c1 = 1 / (2 h): of columns f(+) - f(-) */
#define SIGMA_SECOND 0.235702260f /* c2 = sqrt(h^2 - 1) / (2 h^2): of columns f(+) + f(-) - 2 f(0) */
#define SIGMA_MEAN 0.166666667f   /* m = 1 / (2 h^2) */

enum { CDKF_OUTPUTS = MODEL_STATES, CDKF_ROWS = MODEL_PARAMETERS + MODEL_STATES };

typedef struct cdkf {
    float w[MODEL_PARAMETERS]; /* scaled parameters (model/scaling.h) */
    float x[MODEL_STATES];     /* theta [rad], theta_dot [rad/s] */
    /* cppcheck-suppress misra-c2012-10.4 ; D6 */
    float s[CDKF_ROWS * MODEL_PARAMETERS];   /* [S_ww; S_xw] */
    float s_xx[MODEL_STATES * MODEL_STATES]; /* factor of the covariance of x when w is given */
    float process_noise[MODEL_STATES];       /* random walk of each state [unit / sqrt(s)] */
    float disturbance;                       /* more of theta_dot's, for a while [rad/s / sqrt(s)] */
    float output_noise[CDKF_OUTPUTS];        /* standard deviation of each output [unit] */
    float walk[MODEL_PARAMETERS];            /* variance of the random walk of w, per second [1/s] */
    float drift[MODEL_PARAMETERS];           /* of w: see adaptation.h */
    float growth;                            /* forgetting: relative growth of the covariance of w [1/s] */
    float response[MODEL_STATES];            /* of the state to past corrections (noise_estimation.h) */
    information_t pending;                   /* not learnt yet */
    considered_t considered[CDKF_CONSIDERED];
    float considered_sigma[CDKF_CONSIDERED];   /* [1], [sample periods], [1], [N m], [rad/s^2] */
    uint32_t acting;                           /* how many of them act: with CDKF_STEP or without */
    float trust;                               /* the part of the information that counts: see cdkf_learn */
    float p[MODEL_PARAMETERS];                 /* the parameters at w, in the units of the model */
    model_coefficients_t points[MODEL_POINTS]; /* at the sigma points of S_ww */
    scaling_t scaling;
} cdkf_t;

/* An innovation and the inverse of its variance, the uncertainty of the parameters included: theta, then theta_dot
 * given theta. All is in units of the innovation's standard deviation for given parameters. */
typedef struct innovation {
    float value;
    float inverse_variance;
    float noise_variance; /* the part of the variance that is measurement noise */
    float response;       /* to past corrections, as this output sees it */
} innovation_t;

/* Starts at the prior, without a walk, all noise zero. Then set the noise, and cdkf_start_state(). */
void cdkf_init(cdkf_t *cdkf, const model_t *model, const model_constants_t *constants, const prior_t *prior);

/* The state starts anew, independent of w: mean [rad, rad/s] and standard deviations. Drops pending information. */
void cdkf_start_state(cdkf_t *cdkf, const float x[MODEL_STATES], const float sigma[MODEL_STATES]);

/* Drops what has not been learnt yet. */
void cdkf_drop_pending(cdkf_t *cdkf);

/* The grip force as a third output: the change of theta_dot over a step that the lever alone makes of it, of known
 * torque and of the base. What the hand does that the model lacks moves the lever through this force, so the process
 * noise of the step is part of what is measured. */
typedef struct cdkf_grip {
    float change;                 /* [rad/s] */
    float noise;                  /* its standard deviation [rad/s] */
    float torque;                 /* of it to a torque on the lever [rad/s / N m] */
    float own[MODEL_STATES];      /* the part of it that the lever's own spring and damper take: - d change / d x */
    float error[CDKF_CONSIDERED]; /* what a unit of each considered error adds to it */
    bool learn;                   /* as in cdkf_measurement_update() */
} cdkf_grip_t;

/* Lines 6 to 8: one step of the model. The parameters stand still. `error`: what a unit of each considered error takes
 * from the inputs, [m/s^2] per unit for those of the base, [N m] per unit for the others; of CDKF_STEP what it adds to
 * the acceleration. `grip` is NULL where the force is not measured; a force beyond 8 standard deviations is not
 * taken. */
void cdkf_time_update(cdkf_t *cdkf, const model_t *model, const model_constants_t *constants, const model_step_t *step,
    const float error[CDKF_CONSIDERED], const cdkf_grip_t *grip);

/* Lines 8 to 11 for the outputs that are valid, one scalar at a time; y in the units of the state. With `learn` what
 * the sample says of w is added to the pending information. An output that is not valid has the innovation 0. */
void cdkf_measurement_update(cdkf_t *cdkf, const float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS], bool learn,
    innovation_t innovation[CDKF_OUTPUTS]);

enum { CDKF_TRIANGLE = (MODEL_PARAMETERS * (MODEL_PARAMETERS + 1)) / 2 };

/* What a block has taught: the change of w, and by how much its covariance has become smaller (lower triangle). */
typedef struct correction {
    float w[MODEL_PARAMETERS];
    float covariance[CDKF_TRIANGLE];
    bool bounded; /* a parameter rests on a bound */
} correction_t;

/* The pending scores: of an error of CDKF_BASE_GAIN that has just come about, and of each considered error as if it had
 * always been. */
score_t cdkf_sudden_score(const cdkf_t *cdkf);
score_t cdkf_constant_score(const cdkf_t *cdkf, uint32_t c);

/* From now on there is a step that nothing is known of; or none any more. */
void cdkf_begin_step(cdkf_t *cdkf);
void cdkf_end_step(cdkf_t *cdkf);

/* Corrects w and x for the step by its score (Friedland 1969), after cdkf_learn(); its part in their standard
 * deviations shrinks with it. Returns true when a parameter rests on a bound. */
bool cdkf_learn_step(cdkf_t *cdkf, const score_t *score);

/* Lines 9 to 11 for w: conditions w, and x with it, on the pending information of the last `period` seconds. From the start, or
 * an opened covariance, on it counts in part only, and fully after `caution` seconds of information: far from the
 * truth the sensitivities are wrong, and would make the filter certain of what the samples do not tell (the common
 * scale of the parameters). */
void cdkf_learn(cdkf_t *cdkf, float period, float caution, correction_t *correction);

/* Opens the covariance of w to the prior's again and drops pending information. What w explained of the state's
 * uncertainty stays with the state. */
void cdkf_open(cdkf_t *cdkf);

/* The belief of the parameters alone, kept to return to. */
typedef struct snapshot {
    float w[MODEL_PARAMETERS];
    float s_ww[CDKF_TRIANGLE]; /* row by row to the diagonal */
    float trust;
} snapshot_t;

void cdkf_keep(const cdkf_t *cdkf, snapshot_t *snapshot);

/* Takes back what was learnt since, and drops pending information. What w explained of the state's uncertainty stays
 * with the state. What the considered errors make of w is taken to be what it is now: they change slowly. */
void cdkf_return(cdkf_t *cdkf, const snapshot_t *snapshot);

/* Forgetting for `period` seconds: P_w / lambda, 1 / lambda = 1 + growth period. The covariance of x and w stays. */
void cdkf_forget(cdkf_t *cdkf, float period, bool joint);

/* Random walk for `period` seconds, and `variance` on top. After it w explains less of the state's uncertainty. The
 * joint filter adds the difference to S_xx, so that P_x stays what it was; the dual filter leaves it out. */
void cdkf_walk(cdkf_t *cdkf, float period, const float variance[MODEL_PARAMETERS], bool joint);

/* Draws the sigma points of w: after all of the above. Standard deviations of w stay at or below the prior's. */
void cdkf_draw(cdkf_t *cdkf, const model_t *model, const model_constants_t *constants);

/* Variance with which output i is expected about its prediction. */
float cdkf_output_variance(const cdkf_t *cdkf, uint32_t i);

/* Standard deviation of state i, and of parameter i in the units of the model (to first order). */
float cdkf_state_sigma(const cdkf_t *cdkf, uint32_t i);
float cdkf_parameter_sigma(const cdkf_t *cdkf, uint32_t i);

/* Correlations of w: first and second, first and third, second and third parameter. */
void cdkf_correlation(const cdkf_t *cdkf, float correlation[MODEL_PARAMETERS]);

/* The invariant: all finite, diagonals positive, w within its bounds. The first looks only at x and S_xx, which
 * whatever is not finite reaches within a sample; it is for every sample, the second for the end of a block. */
bool cdkf_state_is_valid(const cdkf_t *cdkf);
bool cdkf_is_valid(const cdkf_t *cdkf);

#endif
