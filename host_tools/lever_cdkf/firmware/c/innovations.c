/* The likelihood by the prediction error decomposition (Schweppe 1965): the density of all samples is the product of
 * what was predicted for each, given those before it. The prediction for a sample is normal about x, with the
 * covariance
 *     S_xx S_xx^T + S_xw S_xw^T + R
 * of the belief in filter/cdkf.h and the noise of the outputs. Samples from which the parameters learn together
 * (learn_period) count as if each were predicted by itself, as the firmware's own NIS has it; what they have in common
 * is second order.
 */
#include "innovations.h"

#include "app/instance.h"
#include "filter/cdkf.h"
#include "lever_cdkf.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* cdkf_measurement_update() and cdkf_learn() of filter/, which are built with these names here (CMakeLists.txt), so
 * that their callers in app/ come to the ones below instead. */
void firmware_update(cdkf_t *cdkf, const float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS], bool learn,
    innovation_t innovation[CDKF_OUTPUTS]);
void firmware_learn(cdkf_t *cdkf, float period, float caution, correction_t *correction);

#define PARAMETERS ((uint32_t)MODEL_PARAMETERS)
#define BOTH ((uint32_t)INNOVATION_OUTPUTS)
#define LN_TURN 1.8378770664093453 /* ln 2 pi */

static sample_innovation_t *current; /* of the sample that the estimator is taking; NULL: nobody asks */
static sample_innovation_t *block;   /* of the first sample from which the parameters have not learnt yet */

static double squared(double x)
{
    return x * x;
}

static double squared_of(float x)
{
    return squared((double)x);
}

/* Notes what is predicted for a sample. An output that was not measured has no innovation, and counts in units of its
 * own, so that it has no part in determinants. */
static void note_prediction(
    const cdkf_t *cdkf, const float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS], sample_innovation_t *innovation)
{
    const float *own = cdkf->s_xx;
    const float *t = &cdkf->s[PARAMETERS * PARAMETERS]; /* S_xw */
    const bool both = valid[0] && valid[1];
    double a = squared_of(own[0]) + squared_of(cdkf->output_noise[0]);
    double b = (double)own[0] * (double)own[2];
    double d = squared_of(own[2]) + squared_of(own[3]) + squared_of(cdkf->output_noise[1]);
    for (uint32_t j = 0u; j < PARAMETERS; j++) {
        a += squared_of(t[j]);
        b += (double)t[j] * (double)t[PARAMETERS + j];
        d += squared_of(t[PARAMETERS + j]);
    }
    double nu[INNOVATION_OUTPUTS];
    const double variance[INNOVATION_OUTPUTS] = {a, d};
    for (uint32_t i = 0u; i < BOTH; i++) {
        nu[i] = valid[i] ? ((double)y[i] - (double)cdkf->x[i]) : 0.0;
        innovation->value[i] = (float)nu[i];
        innovation->sigma[i] = valid[i] ? (float)sqrt(variance[i]) : 0.0f;
        innovation->size = (uint8_t)(innovation->size + (valid[i] ? 1u : 0u));
    }
    a = valid[0] ? a : 1.0;
    b = both ? b : 0.0;
    d = valid[1] ? d : 1.0;
    const double determinant = (a * d) - squared(b);
    const double nis = ((d * squared(nu[0])) - (2.0 * b * nu[0] * nu[1]) + (a * squared(nu[1]))) / determinant;
    innovation->nis = (float)nis;
    innovation->log_likelihood = -0.5 * (nis + log(determinant) + (LN_TURN * (double)innovation->size));
}

void cdkf_measurement_update(cdkf_t *cdkf, const float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS], bool learn,
    innovation_t innovation[CDKF_OUTPUTS])
{
    if (current != NULL) {
        note_prediction(cdkf, y, valid, current);
    }
    firmware_update(cdkf, y, valid, learn, innovation);
}

/* The end of a block: what it says of the parameters is pending, unless app/ has dropped it. */
void cdkf_learn(cdkf_t *cdkf, float period, float caution, correction_t *correction)
{
    const bool learns = (cdkf->pending.matrix[0] > 0.0f);
    for (; (current != NULL) && (block <= current); block++) {
        block->learns = learns && (block->size != 0u);
    }
    firmware_learn(cdkf, period, caution, correction);
}

bool innovation_run(
    const lever_config_t *config, const lever_sample_t *samples, uint32_t count, sample_innovation_t *innovations)
{
    static lever_memory_t memory;
    lever_t *lever = lever_init(&memory, config);
    (void)memset(innovations, 0, (size_t)count * sizeof innovations[0]);
    block = innovations;
    for (uint32_t k = 0u; (lever != NULL) && (k < count); k++) {
        current = &innovations[k];
        (void)lever_update(lever, &samples[k]);
        current->changed = ((lever->estimator.faults & (uint32_t)LEVER_FAULT_CHANGE) != 0u);
    }
    current = NULL;
    return lever != NULL;
}

uint32_t innovation_samples(const lever_frame_t *frames, uint32_t count, lever_sample_t *samples,
    lever_config_t *config, lever_health_t *health)
{
    static lever_memory_t memory;
    uint32_t taken = 0u;
    lever_t *lever = lever_init(&memory, config);
    for (uint32_t k = 0u; k < count; k++) {
        if (lever_on_frame(lever, &frames[k]) == LEVER_FRAME_SAMPLE) {
            samples[taken] = lever->link.sample;
            taken++;
            (void)lever_step(lever);
        }
    }
    const setup_t *setup = &lever->estimator.setup; /* as COMMAND frames have left it */
    config->model = setup->model;
    config->preload = setup->preload;
    config->estimator = setup->estimator;
    config->adaptation = setup->adaptation;
    config->mitigation = lever->bounce.chosen;
    lever_health(lever, health);
    return taken;
}
