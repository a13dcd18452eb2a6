#include "filter/grip.h"

#include "math/factor.h"

#define L ((uint32_t)MODEL_PARAMETERS)
#define SPIKE 8.0f /* standard deviations */

void grip_see(const cdkf_t *cdkf, const model_response_t *response, const float error[CDKF_CONSIDERED],
    const cdkf_grip_t *grip, float period, grip_seen_t *seen)
{
    const float slope[MODEL_STATES] = {response->slope[0] + grip->own[0], response->slope[1] + grip->own[1]};
    const float *theta = &cdkf->s[L * L];
    const float *theta_dot = &cdkf->s[(L + 1u) * L];
    const float *own = cdkf->s_xx;
    float mean = response->mean;
    for (uint32_t j = 0u; j < L; j++) {
        mean += SIGMA_MEAN * response->second_difference[j];
        seen->row[j] =
            (SIGMA_FIRST * response->difference[j]) + (grip->own[0] * theta[j]) + (grip->own[1] * theta_dot[j]);
    }
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        const float *x = cdkf->considered[c].x;
        seen->considered[c] = (slope[0] * x[0]) + (slope[1] * x[1]) +
                              ((considered_input(response, period, c) * error[c]) - grip->error[c]);
    }
    seen->column[0] = (slope[0] * own[0]) + (slope[1] * own[2]);
    seen->column[1] = slope[1] * own[3];
    seen->walk = 1.0f - (grip->torque / response->torque);
    seen->response = (slope[0] * cdkf->response[0]) + (slope[1] * cdkf->response[1]);
    seen->innovation = grip->change - mean;
    seen->noise = grip->noise;
}

void grip_condition(grip_seen_t *seen, float theta[GRIP_COLUMNS + 1], float theta_dot[GRIP_COLUMNS + 1])
{
    const float column[GRIP_COLUMNS] = {
        seen->column[0], seen->column[1], seen->walk * theta_dot[2], 0.0f, theta_dot[4]};
    const float noise = seen->noise;
    float variance = noise * noise;
    float k[MODEL_STATES] = {0.0f, 0.0f};
    for (uint32_t j = 0u; j < (uint32_t)GRIP_COLUMNS; j++) {
        variance += column[j] * column[j];
        k[0] += theta[j] * column[j];
        k[1] += theta_dot[j] * column[j];
    }
    const float spread = variance + factor_dot_three(seen->row, seen->row);
    seen->taken = ((seen->innovation * seen->innovation) < ((SPIKE * SPIKE) * spread));
    if (seen->taken) {
        const float inverse = 1.0f / sqrtf(variance);
        seen->gain.inverse = inverse;
        seen->gain.k[0] = k[0] * (inverse * inverse);
        seen->gain.k[1] = k[1] * (inverse * inverse);
        for (uint32_t j = 0u; j < (uint32_t)GRIP_COLUMNS; j++) {
            theta[j] -= seen->gain.k[0] * column[j];
            theta_dot[j] -= seen->gain.k[1] * column[j];
        }
        theta[GRIP_COLUMNS] = seen->gain.k[0] * noise;
        theta_dot[GRIP_COLUMNS] = seen->gain.k[1] * noise;
    }
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
