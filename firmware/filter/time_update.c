/* The time update, lines 5 to 8: see cdkf.h. */
#include "filter/cdkf.h"
#include "filter/grip.h"
#include "math/factor.h"
#include "math/invariant.h"

#include <math.h>
#include <stddef.h>

#define L ((uint32_t)MODEL_PARAMETERS)

/* The walk q of theta_dot, integrated by theta, has the covariance q^2 [T^3/3, T^2/2; T^2/2, T] (van Loan 1978); theta may
 * walk itself. */
static step_noise_t step_noise(const cdkf_t *cdkf, const model_response_t *response, float period)
{
    const float walk = cdkf->process_noise[1] + cdkf->disturbance;
    const float variance = walk * walk * period;
    const float own = cdkf->process_noise[0] * cdkf->process_noise[0] * period;
    const float *second = response->second_difference;
    const step_noise_t noise = {variance, (variance * (period * period * 0.0833333333f)) + own,
        (SIGMA_SECOND * SIGMA_SECOND) * factor_dot_three(second, second)};
    return noise;
}

/* The mean moves by F0 and the second differences of the parameter points. S_xw: c1 (F+ - F-), with F = X +
 * increment, is the column plus c1 times the difference of increments. */
static void predict_mean_and_parameter_columns(cdkf_t *cdkf, const model_response_t *response, float period)
{
    float *theta = &cdkf->s[L * L];
    float *theta_dot = &cdkf->s[(L + 1u) * L];
    float mean = response->mean;
    for (uint32_t j = 0u; j < L; j++) {
        const float change = SIGMA_FIRST * response->difference[j];
        theta[j] += period * (theta_dot[j] + (0.5f * change));
        theta_dot[j] += change;
        mean += SIGMA_MEAN * response->second_difference[j];
    }
    cdkf->x[0] += period * (cdkf->x[1] + (0.5f * mean));
    cdkf->x[1] += mean;
}

/* S_xx: its own columns; process noise, and second differences along the parameters in the direction [T/2; 1] of its
 * first column; what theta has beside it. As factor_tria_two() with these as columns, without their roots. */
static void predict_state_columns(
    cdkf_t *cdkf, const model_response_t *response, const step_noise_t *noise, float period)
{
    float *s = cdkf->s_xx;
    const float half = 0.5f * period;
    const float rate = noise->variance + noise->second;
    float theta[2] = {s[0], 0.0f};
    float theta_dot[2] = {s[2], s[3]};
    response_move(response, period, &theta[0], &theta_dot[0]);
    response_move(response, period, &theta[1], &theta_dot[1]);
    const float square = (theta[0] * theta[0]) + (theta[1] * theta[1]) + (half * half * rate) + noise->angle;
    const float product = (theta[0] * theta_dot[0]) + (theta[1] * theta_dot[1]) + (half * rate);
    const float own = (theta[0] * theta_dot[1]) - (theta[1] * theta_dot[0]); /* minors: of both columns, */
    const float first = theta[0] - (half * theta_dot[0]);                    /* of each with the walk */
    const float second = theta[1] - (half * theta_dot[1]);
    const float minors = (own * own) + (rate * ((first * first) + (second * second))) +
                         (noise->angle * ((theta_dot[0] * theta_dot[0]) + (theta_dot[1] * theta_dot[1]) + rate));
    const float norm = sqrtf(square);
    const float inverse = 1.0f / norm;
    s[0] = norm;
    s[2] = product * inverse;
    s[3] = sqrtf(minors) * inverse;
}

/* The first cdkf->acting of the considered errors act. */
static void predict_considered(cdkf_t *cdkf, const float input[CDKF_CONSIDERED], const model_response_t *response,
    float period, const float error[CDKF_CONSIDERED])
{
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        float *x = cdkf->considered[c].x;
        const float change = input[c] * error[c];
        response_move(response, period, &x[0], &x[1]);
        x[0] += 0.5f * (period * change);
        x[1] += change;
    }
}

void cdkf_time_update(cdkf_t *cdkf, const model_t *model, const model_constants_t *constants, const model_step_t *step,
    const float error[CDKF_CONSIDERED], const cdkf_grip_t *grip)
{
    model_points_t points;
    model_response_t response;
    float input[CDKF_CONSIDERED];
    grip_seen_t seen;
    bool taken = false;
    points.coefficients = cdkf->points;
    points.x[0] = cdkf->x[0];
    points.x[1] = cdkf->x[1];
    for (uint32_t j = 0u; j < L; j++) {
        points.offset[j][0] = SIGMA_OFFSET * cdkf->s[(L * L) + j];
        points.offset[j][1] = SIGMA_OFFSET * cdkf->s[((L + 1u) * L) + j];
    }
    model->respond(constants, step, &points, &response);
    if (grip != NULL) {
        grip_see(cdkf, &response, error, grip, step->period, &seen);
    }
    predict_mean_and_parameter_columns(cdkf, &response, step->period);
    const step_noise_t noise = step_noise(cdkf, &response, step->period);
    if (grip != NULL) {
        taken = grip_predict_state_columns(cdkf, &response, &noise, step->period, &seen);
    } else {
        predict_state_columns(cdkf, &response, &noise, step->period);
    }
    considered_inputs(&response, step->period, input);
    predict_considered(cdkf, input, &response, step->period, error);
    response_move(&response, step->period, &cdkf->response[0], &cdkf->response[1]);
    if (taken) {
        grip_take(cdkf, grip, &seen);
    }
    INVARIANT(factor_is_whole(cdkf->s_xx, MODEL_STATES));
}
