#include "app/learning.h"

#define REPORTED 1.0f /* time for which a change is reported, and not followed by another [s] */

/* The steps of a revision, one after the other. */
enum step {
    STEP_TAKE,
    STEP_CONDITION,
    STEP_JUDGE,
    STEP_WALK_FIRST,
    STEP_WALK_OTHERS,
    STEP_DRAW_MEAN,
    STEP_DRAW_PAIRS,
    STEP_ADOPT,
    STEP_CARRY_SCORE,
    STEP_CARRY_INFORMATION,
    STEPS
};

/* How many steps a sample must do for all to be done in the samples of a learn_period. */
static uint8_t pace_of(const lever_settings_t *settings)
{
    const float rounded = (settings->learn_period / settings->sample_period) + 0.5f;
    const uint32_t samples = (rounded > 1.0f) ? (uint32_t)rounded : 1u;
    return (uint8_t)(((uint32_t)STEPS + samples - 1u) / samples);
}

void learning_start(learning_t *learning, const setup_t *setup, dual_t *dual)
{
    learning_adapt(setup, dual);
    change_init(&learning->change);
    learning->changed = 0.0f;
    learning->unlearnt = 0.0f;
    learning->step = (uint8_t)STEPS;
    learning->pace = pace_of(setup->settings);
    learning->opens = false;
    learning->bounded = false;
}

void learning_adapt(const setup_t *setup, dual_t *dual)
{
    const adaptation_t adaptation = adaptation_of(setup, dual->parameters.positive);
    adaptation_start(&adaptation, &dual->parameters);
}

static bool is_joint(const setup_t *setup)
{
    return setup->estimator == (uint8_t)LEVER_ESTIMATOR_JOINT;
}

/* --- the steps --------------------------------------------------------------------------------------------------- */

/* Was that a sudden change of the pilot? It opens the parameters' covariance, once: a disturbance that only looks like one
 * would open it ever wider. What it did to the innovations is not noise. */
static void judge(learning_t *learning, const lever_settings_t *settings, dual_t *dual)
{
    float correction[MODEL_PARAMETERS];
    float learnt[MODEL_PARAMETERS];
    learning->bounded = revision_correct(&dual->revision, &dual->parameters, learnt);
    learning->widens = false;
    if (learning->teaches && learning->excited) {
        revision_correction(&dual->revision, &dual->parameters, correction);
        const bool changed = change_step(&learning->change, correction, learnt, learning->period,
            settings->change_memory, settings->change_threshold);
        learning->widens = changed && (learning->changed <= 0.0f);
    }
    if (learning->widens) {
        noise_begin(&dual->noise);
        learning->changed = REPORTED;
    }
}

static void walk(const learning_t *learning, const setup_t *setup, dual_t *dual, uint32_t first, uint32_t count)
{
    float variance[MODEL_PARAMETERS] = {0.0f}; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    if (learning->widens) {
        const adaptation_t adaptation = adaptation_of(setup, dual->parameters.positive);
        for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
            variance[i] = adaptation.floor[i] * setup->settings->change_walk;
        }
    }
    dual_walk(dual, first, count, learning->period, variance, is_joint(setup));
}

static void adapt(const learning_t *learning, const setup_t *setup, dual_t *dual)
{
    if (learning->teaches) {
        const adaptation_t adaptation = adaptation_of(setup, dual->parameters.positive);
        float correction[MODEL_PARAMETERS];
        revision_correction(&dual->revision, &dual->parameters, correction);
        adaptation_step(&adaptation, learning->period, correction, learning->excited, &dual->parameters);
    } else {
        dual->parameters.growth = 0.0f; /* what cannot be learnt again is not forgotten */
    }
}

/* Parameters that were learnt with noise that was far too small seem more certain than they are: they start anew. */
static void fit_noise(learning_t *learning, const lever_settings_t *s, dual_t *dual)
{
    const noise_setting_t noise = {
        s->noise_window, s->noise_range, {s->theta_noise, s->theta_dot_noise}, s->theta_dot_process_noise};
    if (learning->teaches && learning->excited && noise_step(&dual->noise, &dual->state, &noise, learning->period)) {
        learning->opens = true;
    }
}

static void take_step(
    learning_t *learning, const setup_t *setup, dual_t *dual, const model_t *model, const model_constants_t *constants)
{
    const lever_settings_t *settings = setup->settings;
    revision_t *revision = &dual->revision;
    parameter_filter_t *parameters = &dual->parameters;
    switch ((enum step)learning->step) {
    case STEP_TAKE:
        revision_take(revision, parameters, learning->period, settings->caution_time);
        fit_noise(learning, settings, dual);
        break;
    case STEP_CONDITION:
        if (learning->opens) {
            dual_open(dual);
            learning->opens = false;
        } else {
            revision_condition(revision, parameters);
        }
        break;
    case STEP_JUDGE:
        judge(learning, settings, dual);
        dual_forget(dual, learning->period, is_joint(setup));
        break;
    case STEP_WALK_FIRST:
        walk(learning, setup, dual, 0u, 1u);
        break;
    case STEP_WALK_OTHERS:
        walk(learning, setup, dual, 1u, 2u);
        break;
    case STEP_DRAW_MEAN:
        adapt(learning, setup, dual);
        revision_draw_mean(revision, parameters);
        break;
    case STEP_DRAW_PAIRS:
        revision_cap(revision, parameters);
        revision_draw_pairs(revision, parameters);
        break;
    case STEP_ADOPT:
        revision_adopt(revision, parameters, model, constants, dual->state.x);
        break;
    case STEP_CARRY_SCORE:
        revision_carry_score(revision, parameters);
        break;
    case STEP_CARRY_INFORMATION:
        revision_carry_information(revision, parameters);
        break;
    case STEPS:
    default:
        break;
    }
    learning->step++;
}

/* --- their time --------------------------------------------------------------------------------------------------- */

/* Up to `count` of the steps that are left. */
static void go_on(learning_t *learning, const setup_t *setup, dual_t *dual, const model_t *model,
    const model_constants_t *constants, uint8_t count)
{
    for (uint8_t i = 0u; (i < count) && (learning->step < (uint8_t)STEPS); i++) {
        take_step(learning, setup, dual, model, constants);
    }
}

static void begin(learning_t *learning, bool teaches, bool excited)
{
    learning->period = learning->unlearnt;
    learning->unlearnt = 0.0f;
    learning->teaches = teaches;
    learning->excited = excited;
    learning->step = (uint8_t)STEP_TAKE;
}

void learning_step(learning_t *learning, const setup_t *setup, dual_t *dual, const model_t *model,
    const model_constants_t *constants, const lesson_t *lesson, float elapsed)
{
    const lever_settings_t *settings = setup->settings;
    learning->changed = (learning->changed > elapsed) ? (learning->changed - elapsed) : 0.0f;
    if (lesson->walks) {
        learning->unlearnt += elapsed;
        if (learning->unlearnt > (settings->learn_period - (0.5f * settings->sample_period))) {
            go_on(learning, setup, dual, model, constants, (uint8_t)STEPS);
            begin(learning, lesson->teaches, lesson->excited);
        }
        go_on(learning, setup, dual, model, constants, learning->pace);
    } else {
        learning->unlearnt = 0.0f;
        learning->bounded = false;
    }
}

void learning_skip(learning_t *learning, const setup_t *setup, dual_t *dual, const model_t *model,
    const model_constants_t *constants, float elapsed)
{
    go_on(learning, setup, dual, model, constants, (uint8_t)STEPS);
    learning->unlearnt += elapsed;
    begin(learning, false, false);
    go_on(learning, setup, dual, model, constants, (uint8_t)STEPS);
}

bool learning_is_done(const learning_t *learning)
{
    return learning->step == (uint8_t)STEPS;
}

bool learning_has_changed(const learning_t *learning)
{
    return learning->changed > 0.0f;
}
