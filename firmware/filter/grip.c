#include "filter/grip.h"

#include "math/factor.h"

#define L ((uint32_t)MODEL_PARAMETERS)
#define SPIKE 8.0f /* standard deviations */
#define COLUMNS 5u /* of S-_xx: its own, the walk of theta_dot, second differences, theta beside it */

void grip_see(const cdkf_t *cdkf, const model_response_t *response, const float error[CDKF_CONSIDERED],
    const cdkf_grip_t *grip, float period, grip_seen_t *seen)
{
    const float slope[MODEL_STATES] = {response->slope[0] + grip->own[0], response->slope[1] + grip->own[1]};
    const float *theta = &cdkf->s[L * L];
    const float *theta_dot = &cdkf->s[(L + 1u) * L];
    const float *own = cdkf->s_xx;
    float input[CDKF_CONSIDERED];
    float mean = response->mean;
    for (uint32_t j = 0u; j < L; j++) {
        mean += SIGMA_MEAN * response->second_difference[j];
        seen->row[j] =
            (SIGMA_FIRST * response->difference[j]) + (grip->own[0] * theta[j]) + (grip->own[1] * theta_dot[j]);
    }
    considered_inputs(response, period, input);
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        const float *x = cdkf->considered[c].x;
        seen->considered[c] = (slope[0] * x[0]) + (slope[1] * x[1]) + ((input[c] * error[c]) - grip->error[c]);
    }
    seen->column[0] = (slope[0] * own[0]) + (slope[1] * own[2]);
    seen->column[1] = slope[1] * own[3];
    seen->walk = 1.0f - (grip->torque / response->torque);
    seen->response = (slope[0] * cdkf->response[0]) + (slope[1] * cdkf->response[1]);
    seen->innovation = grip->change - mean;
    seen->noise = grip->noise;
}

/* Gain of the force on COLUMNS columns of the state, of which it sees `column`; false when the force is too far off. */
static bool weigh(grip_seen_t *seen, const float *theta, const float *theta_dot, const float column[COLUMNS])
{
    float variance = seen->noise * seen->noise;
    float k[MODEL_STATES] = {0.0f, 0.0f};
    for (uint32_t j = 0u; j < COLUMNS; j++) {
        variance += column[j] * column[j];
        k[0] += theta[j] * column[j];
        k[1] += theta_dot[j] * column[j];
    }
    const float inverse = 1.0f / sqrtf(variance);
    seen->gain.inverse = inverse;
    seen->gain.k[0] = k[0] * (inverse * inverse);
    seen->gain.k[1] = k[1] * (inverse * inverse);
    const float spread = variance + factor_dot_three(seen->row, seen->row);
    return (seen->innovation * seen->innovation) < ((SPIKE * SPIKE) * spread);
}

bool grip_predict_state_columns(
    cdkf_t *cdkf, const model_response_t *response, const step_noise_t *noise, float period, grip_seen_t *seen)
{
    const float rate = sqrtf(noise->variance);
    const float second = sqrtf(noise->second);
    const float column[COLUMNS] = {seen->column[0], seen->column[1], seen->walk * rate, second, 0.0f};
    float theta[COLUMNS + 1u] = {
        cdkf->s_xx[0], 0.0f, 0.5f * period * rate, 0.5f * period * second, sqrtf(noise->angle), 0.0f};
    float theta_dot[COLUMNS + 1u] = {cdkf->s_xx[2], cdkf->s_xx[3], rate, second, 0.0f, 0.0f};
    response_move(response, period, &theta[0], &theta_dot[0]);
    response_move(response, period, &theta[1], &theta_dot[1]);
    const bool taken = weigh(seen, theta, theta_dot, column);
    if (taken) {
        for (uint32_t j = 0u; j < COLUMNS; j++) {
            theta[j] -= seen->gain.k[0] * column[j];
            theta_dot[j] -= seen->gain.k[1] * column[j];
        }
        theta[COLUMNS] = seen->gain.k[0] * seen->noise;
        theta_dot[COLUMNS] = seen->gain.k[1] * seen->noise;
    }
    factor_tria_two(theta, theta_dot, COLUMNS + 1u, cdkf->s_xx);
    return taken;
}

void grip_take(cdkf_t *cdkf, const cdkf_grip_t *grip, const grip_seen_t *seen)
{
    float *theta = &cdkf->s[L * L];
    float *theta_dot = &cdkf->s[(L + 1u) * L];
    const gain_t *gain = &seen->gain;
    const float nu = gain->inverse * seen->innovation;
    float row[L];
    for (uint32_t j = 0u; j < L; j++) {
        row[j] = gain_correct(gain, seen->row[j], &theta[j], &theta_dot[j]);
    }
    (void)gain_correct(gain, seen->response, &cdkf->response[0], &cdkf->response[1]);
    for (uint32_t k = 0u; k < (uint32_t)MODEL_STATES; k++) {
        const float step = gain->k[k] * seen->innovation;
        cdkf->x[k] += step;
        cdkf->response[k] += step;
    }
    if (grip->learn) {
        information_add(&cdkf->pending, row, nu);
    }
    considered_correct_by(cdkf->considered, cdkf->acting, gain, seen->considered, row, nu, grip->learn);
}
