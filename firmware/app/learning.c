#include "app/learning.h"

#define REPORTED 1.0f /* time for which a change is reported, and not followed by another [s] */

void learning_start(learning_t *learning, const setup_t *setup, cdkf_t *cdkf)
{
    const adaptation_t adaptation = setup_adaptation(setup);
    adaptation_start(&adaptation, cdkf);
    change_detection_init(&learning->change);
    noise_estimation_begin(&learning->noise);
    learning->elapsed = 0.0f;
    learning->changed = 0.0f;
    learning->bounded = false;
}

/* A sudden change of the pilot counts as change_walk seconds of the walk, once: a disturbance that only looks like
 * one would widen the covariance again and again. What it did to the innovations is not noise. Returns those
 * seconds. */
static float detect_change(
    learning_t *learning, const lever_settings_t *s, const correction_t *correction, float period)
{
    const bool detected =
        change_detection_step(&learning->change, correction, period, s->change_memory, s->change_threshold);
    const bool changed = detected && (learning->changed <= 0.0f);
    if (changed) {
        noise_estimation_begin(&learning->noise);
        learning->changed = REPORTED;
    }
    return changed ? s->change_walk : 0.0f;
}

static void learn(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, bool teaches, bool excited)
{
    const lever_settings_t *s = setup->settings;
    const bool joint = (setup->estimator == (uint8_t)LEVER_ESTIMATOR_JOINT);
    const adaptation_t adaptation = setup_adaptation(setup);
    const noise_setting_t noise = setup_noise(setup);
    const float period = learning->elapsed;
    float variance[MODEL_PARAMETERS];
    correction_t correction;
    learning->elapsed = 0.0f;
    learning->changed = (learning->changed > period) ? (learning->changed - period) : 0.0f;
    if (teaches && excited && noise_estimation_step(&learning->noise, cdkf, &noise, period)) {
        cdkf_open(cdkf); /* learnt with noise that was far too small, the parameters seem more certain than they are */
    }
    cdkf_learn(cdkf, period, s->caution_time, &correction);
    learning->bounded = correction.bounded;
    const float more = (teaches && excited) ? detect_change(learning, s, &correction, period) : 0.0f;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        variance[i] = adaptation.floor[i] * more;
    }
    cdkf_forget(cdkf, period, joint);
    cdkf_walk(cdkf, period, variance, joint);
    if (teaches) {
        adaptation_step(&adaptation, period, correction.w, excited, cdkf);
    } else {
        cdkf->growth = 0.0f; /* what cannot be learnt again is not forgotten */
    }
    cdkf_draw(cdkf, setup->model_in_use, &setup->constants);
}

bool learning_step(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const lesson_t *lesson, float elapsed)
{
    const lever_settings_t *s = setup->settings;
    bool due = false;
    if (lesson->walks) {
        learning->elapsed += elapsed;
        due = (learning->elapsed > (s->learn_period - (0.5f * s->sample_period)));
    } else {
        learning->elapsed = 0.0f;
        learning->changed = 0.0f;
        learning->bounded = false;
    }
    if (due) {
        learn(learning, setup, cdkf, lesson->teaches, lesson->excited);
    }
    return due;
}

void learning_skip(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float elapsed)
{
    learning->elapsed += elapsed;
    learn(learning, setup, cdkf, false, false);
}
