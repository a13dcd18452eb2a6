#include "app/learning.h"

#include "app/prior.h"

#define REPORTED 1.0f /* time for which a change is reported, and not followed by another [s] */

void learning_start(learning_t *learning, const lever_config_t *config, dual_t *dual)
{
    learning_adapt(config, dual);
    change_init(&learning->change);
    learning->changed = 0.0f;
    learning->unlearnt = 0.0f;
    learning->bounded = false;
}

void learning_adapt(const lever_config_t *config, dual_t *dual)
{
    const adaptation_t adaptation = adaptation_of(config, dual->parameters.positive);
    adaptation_start(&adaptation, &dual->parameters);
}

static bool is_joint(const lever_config_t *config)
{
    return config->estimator == (uint8_t)LEVER_ESTIMATOR_JOINT;
}

/* A sudden change of the pilot opens the parameters' covariance, once: a disturbance that only looks like one would open it
 * ever wider. What it did to the innovations is not noise. */
static void follow_change(
    learning_t *learning, const adaptation_t *adaptation, const lever_config_t *config, dual_t *dual)
{
    if (learning->changed <= 0.0f) {
        float variance[MODEL_PARAMETERS];
        for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
            variance[i] = adaptation->floor[i] * config->settings.change_walk;
        }
        dual_widen(dual, variance, is_joint(config));
        noise_begin(&dual->noise);
        learning->changed = REPORTED;
    }
}

static void learn(learning_t *learning, const lever_config_t *config, dual_t *dual, const lesson_t *lesson)
{
    const lever_settings_t *settings = &config->settings;
    const adaptation_t adaptation = adaptation_of(config, dual->parameters.positive);
    const bool joint = is_joint(config);
    const float period = learning->unlearnt;
    float correction[MODEL_PARAMETERS];
    float learnt[MODEL_PARAMETERS];
    learning->bounded = dual_learn(dual, period, settings->caution_time, joint, correction, learnt);
    if (lesson->teaches) {
        adaptation_step(&adaptation, period, correction, lesson->excited, &dual->parameters);
    } else {
        dual->parameters.growth = 0.0f; /* what cannot be learnt again is not forgotten */
    }
    if (lesson->teaches && lesson->excited) {
        const bool changed = change_step(
            &learning->change, correction, learnt, period, settings->change_memory, settings->change_threshold);
        if (changed) {
            follow_change(learning, &adaptation, config, dual);
        }
    }
    learning->unlearnt = 0.0f;
}

/* Parameters that were learnt with noise that was far too small seem more certain than they are: they start anew. */
static void adapt_noise(const lever_settings_t *s, dual_t *dual, float elapsed)
{
    const noise_setting_t noise = {
        s->noise_window, s->noise_range, {s->theta_noise, s->theta_dot_noise}, s->theta_dot_process_noise};
    if (noise_step(&dual->noise, &dual->state, &noise, elapsed)) {
        dual_open(dual);
    }
}

void learning_step(
    learning_t *learning, const lever_config_t *config, dual_t *dual, const lesson_t *lesson, float elapsed)
{
    const lever_settings_t *settings = &config->settings;
    learning->changed = (learning->changed > elapsed) ? (learning->changed - elapsed) : 0.0f;
    learning->unlearnt += elapsed;
    if (!lesson->walks) {
        learning->unlearnt = 0.0f;
        learning->bounded = false;
    } else if (learning->unlearnt > (settings->learn_period - (0.5f * settings->sample_period))) {
        learn(learning, config, dual, lesson);
    } else {
        /* gathered only */
    }
    if (lesson->teaches && lesson->excited) {
        adapt_noise(settings, dual, elapsed);
    }
}

bool learning_has_changed(const learning_t *learning)
{
    return learning->changed > 0.0f;
}
