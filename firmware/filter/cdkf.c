#include "filter/cdkf.h"

#include "math/factor.h"
#include "math/invariant.h"

#include <string.h>

#define N ((uint32_t)MODEL_STATES)
#define L ((uint32_t)MODEL_PARAMETERS)
#define ROWS ((uint32_t)CDKF_ROWS)

/* --- start ------------------------------------------------------------------------------------------------------ */

void cdkf_start_state(cdkf_t *cdkf, const float x[MODEL_STATES], const float sigma[MODEL_STATES])
{
    for (uint32_t k = L * L; k < (ROWS * L); k++) {
        cdkf->s[k] = 0.0f;
    }
    cdkf_drop_pending(cdkf);
    considered_start_state(cdkf->considered);
    for (uint32_t i = 0u; i < N; i++) {
        cdkf->x[i] = x[i];
        cdkf->response[i] = 0.0f;
    }
    cdkf->s_xx[0] = sigma[0];
    cdkf->s_xx[1] = 0.0f;
    cdkf->s_xx[2] = 0.0f;
    cdkf->s_xx[3] = sigma[1];
}

/* --- measurement update ------------------------------------------------------------------------------------------ */

/* Conditions S_xx on output i of standard deviation `noise`, by Carlson's triangular form (1973) for
 * lower-triangular factors: column by column from the output's own to the first. There is no downdate; the diagonal
 * is only ever multiplied by factors in (0, 1], so it cannot fail. */
static inline gain_t condition_on(float *s, uint32_t i, float noise)
{
    gain_t gain = {{0.0f, 0.0f}, 0.0f, 1.0f};
    float root = noise; /* of the variance of the output, in the columns so far */
    for (uint32_t left = i + 1u; left > 0u; left--) {
        const uint32_t j = left - 1u;
        const float seen = s[(i * N) + j];
        const float next = sqrtf((root * root) + (seen * seen));
        const float inverse = 1.0f / next;
        const float keep = root * inverse;
        const float share = seen * inverse * gain.inverse; /* of what the columns so far have given to the gain */
        for (uint32_t r = j; r < N; r++) {
            const float old = s[(r * N) + j];
            s[(r * N) + j] = (keep * old) - (share * gain.k[r]);
            gain.k[r] += old * seen;
        }
        root = next;
        gain.inverse = inverse;
    }
    gain.k[0] *= gain.inverse * gain.inverse;
    gain.k[1] *= gain.inverse * gain.inverse;
    gain.kept = (noise * gain.inverse) * (noise * gain.inverse);
    return gain;
}

/* Takes output i, or nothing when it is not valid: row = H S_xw / S_y is what the output sees of each column of S_ww.
 * `step` adds up the correction of the state. Returns the gain. */
static inline gain_t take_output(cdkf_t *cdkf, uint32_t i, float y, bool valid, float row[MODEL_PARAMETERS],
    innovation_t *innovation, float step[MODEL_STATES])
{
    gain_t gain = {{0.0f, 0.0f}, 0.0f, 1.0f};
    if (valid) {
        gain = condition_on(cdkf->s_xx, i, cdkf->output_noise[i]);
        const uint32_t j = N - 1u - i; /* the other state */
        float *own = &cdkf->s[(L + i) * L];
        float *other = &cdkf->s[(L + j) * L];
        for (uint32_t k = 0u; k < L; k++) {
            row[k] = gain_correct_own(&gain, gain.k[j], &own[k], &other[k]);
        }
        const float nu = y - cdkf->x[i];
        innovation->value = gain.inverse * nu;
        innovation->noise_variance = gain.kept;
        innovation->response = gain_correct_own(&gain, gain.k[j], &cdkf->response[i], &cdkf->response[j]);
        for (uint32_t k = 0u; k < N; k++) {
            cdkf->x[k] += gain.k[k] * nu;
            step[k] += gain.k[k] * nu;
        }
    } else {
        (void)memset(row, 0, L * sizeof row[0]);
        (void)memset(innovation, 0, sizeof *innovation);
    }
    return gain;
}

/* After the update of the filter: gain, what each output saw of S_ww, innovation. */
static void correct_considered(cdkf_t *cdkf, const gain_t gain[CDKF_OUTPUTS], float row[CDKF_OUTPUTS][MODEL_PARAMETERS],
    const innovation_t innovation[CDKF_OUTPUTS], bool learn)
{
    for (uint32_t c = 0u; c < cdkf->acting; c++) {
        considered_t *of = &cdkf->considered[c];
        const float first = gain_correct_own(&gain[0], gain[0].k[1], &of->x[0], &of->x[1]);
        const float second = gain_correct_own(&gain[1], gain[1].k[0], &of->x[1], &of->x[0]);
        if (learn) {
            for (uint32_t i = 0u; i < L; i++) {
                of->cross[i] += (row[0][i] * first) + (row[1][i] * second);
            }
            of->vector += (innovation[0].value * first) + (innovation[1].value * second);
            of->information += (first * first) + (second * second);
        }
    }
}

void cdkf_measurement_update(cdkf_t *cdkf, const float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS], bool learn,
    innovation_t innovation[CDKF_OUTPUTS])
{
    float row[2][L];
    float step[N] = {0.0f, 0.0f};
    gain_t gain[2];
    gain[0] = take_output(cdkf, 0u, y[0], valid[0], row[0], &innovation[0], step);
    gain[1] = take_output(cdkf, 1u, y[1], valid[1], row[1], &innovation[1], step);
    cdkf->response[0] += step[0]; /* from now on it includes the response to this correction */
    cdkf->response[1] += step[1];
    if (learn) {
        information_add(&cdkf->pending, row[0], innovation[0].value);
        information_add(&cdkf->pending, row[1], innovation[1].value);
    }
    correct_considered(cdkf, gain, row, innovation, learn);
    /* w makes both uncertain together: I + R R^T = L D L^T, and the second innovation is then given the first */
    const float covariance = factor_dot_three(row[0], row[1]);
    innovation[0].inverse_variance = 1.0f / (1.0f + factor_dot_three(row[0], row[0]));
    const float coupling = covariance * innovation[0].inverse_variance;
    const float variance = (1.0f + factor_dot_three(row[1], row[1])) - (coupling * covariance);
    innovation[1].value -= coupling * innovation[0].value;
    innovation[1].response -= coupling * innovation[0].response;
    innovation[1].inverse_variance = (variance > 1.0f) ? (1.0f / variance) : 1.0f; /* it is at least 1 */
    INVARIANT(factor_is_whole(cdkf->s_xx, N));
}

float cdkf_output_variance(const cdkf_t *cdkf, uint32_t i)
{
    const float *row = &cdkf->s[(L + i) * L];
    const float *own = &cdkf->s_xx[i * N];
    return factor_dot_three(row, row) + (own[0] * own[0]) + (own[1] * own[1]) +
           (cdkf->output_noise[i] * cdkf->output_noise[i]);
}

#define THETA_DOT_MOST 1.0e4f /* [rad/s] */
#define SIGMA_MOST 1.0e6f     /* beyond it nothing is known */

bool cdkf_state_is_valid(const cdkf_t *cdkf)
{
    const float *s = cdkf->s_xx;
    return ((s[0] + fabsf(s[2]) + s[3]) < SIGMA_MOST) && (fabsf(cdkf->x[0]) < MODEL_THETA_MOST) &&
           (fabsf(cdkf->x[1]) < THETA_DOT_MOST);
}
