#include "app/alignment.h"

#include "math/bounds.h"
#include "math/trigonometry.h"

#include <string.h>

void alignment_start_state(estimator_t *estimator, const float y[CDKF_OUTPUTS], const bool valid[CDKF_OUTPUTS])
{
    const trim_t *trim = &estimator->trim;
    cdkf_t *cdkf = &estimator->cdkf;
    const float x[MODEL_STATES] = {valid[0] ? y[0] : (trim_angle(trim) - trim->origin[0]), valid[1] ? y[1] : 0.0f};
    const float sigma[MODEL_STATES] = {
        valid[0] ? cdkf->output_noise[0] : 0.1f, valid[1] ? cdkf->output_noise[1] : 1.0f};
    cdkf_start_state(cdkf, x, sigma);
}

void alignment_step(estimator_t *estimator, const checked_t *sample, float elapsed)
{
    const lever_settings_t *settings = estimator->setup.settings;
    alignment_t *alignment = &estimator->alignment;
    alignment->time += elapsed;
    const bool usable = sample->valid[0] || sample->valid[1];
    if (usable || (estimator->mode != LEVER_MODE_INIT)) {
        estimator->mode = LEVER_MODE_ALIGN;
    }
    if (usable) {
        float angle = (alignment->count > 0.0f) ? trim_angle(&estimator->trim) : settings->lever_preload_angle;
        if (sample->valid[0]) {
            alignment->count += 1.0f;
            angle += (sample->y[0] - angle) / greater(alignment->count, 1.0f);
        }
        trim_start(&estimator->trim, angle, settings->trim_corner, estimator->setup.constants.trim);
        estimator->rest_angle = trim_angle(&estimator->trim);
        estimator->trim_sine_cosine = sine_cosine(estimator->rest_angle);
        estimator->z_ddot = sample->z_ddot;
        estimator->tau_m = sample->tau_m;
        (void)memset(&estimator->base_motion, 0, sizeof estimator->base_motion);
        const float y[CDKF_OUTPUTS] = {sample->y[0] - estimator->trim.origin[0], sample->y[1]};
        alignment_start_state(estimator, y, sample->valid);
        if (alignment->time > (settings->align_time - (0.5f * settings->sample_period))) {
            estimator->mode = LEVER_MODE_RUN;
            learning_resume(&estimator->learning, &estimator->cdkf);
            hands_begin(&estimator->learning.evidence.hands);
        }
    }
}

void alignment_begin(estimator_t *estimator, const checked_t *sample)
{
    evidence_t *evidence = &estimator->learning.evidence;
    (void)memset(&estimator->alignment, 0, sizeof estimator->alignment);
    (void)memset(
        &evidence->motion, 0, sizeof evidence->motion); /* nothing is learnt before the lever is seen to move */
    (void)memset(&evidence->kinematics, 0, sizeof evidence->kinematics);
    evidence->paired = false; /* its last sample is one of before */
    evidence->nis_slow = 1.0f;
    alignment_step(estimator, sample, 0.0f);
}

void alignment_begin_grip(estimator_t *estimator, const checked_t *sample)
{
    static const float origin[MODEL_STATES] = {0.0f, 0.0f};
    cdkf_t *cdkf = &estimator->cdkf;
    const bool rigid = (estimator->setup.constants.seat_stiffness <= 0.0f);
    const float x[MODEL_STATES] = {
        sample->valid[0] ? sample->y[0] : cdkf->x[0], sample->valid[1] ? sample->y[1] : cdkf->x[1]};
    trim_begin(&estimator->trim, x);
    estimator->rest_angle = trim_angle(&estimator->trim);
    cdkf_start_state(cdkf, origin, cdkf->output_noise);
    cdkf_begin_step(cdkf);
    estimator->z_ddot = 0.0f;
    estimator->tau_m = 0.0f;
    if (rigid) { /* the velocity of the base until now acts as a step, too */
        estimator->base_motion.seat_dot = 0.0f;
    }
}
