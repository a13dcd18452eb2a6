#include "app/learning.h"
#include "math/bounds.h"
#include "math/share.h"

#define REPORTED 3.0f         /* time for which a change is reported [s] */
#define HELD 0.7f             /* hands_t.residual over change: with less nobody may hold the lever any more */
#define TRANSIENT 2.0f        /* left of it when innovations are noise again, and not of the change [s] */
#define KEEP_PERIOD 1.0f      /* [s] */
#define UNSURPRISED 1.2f      /* monitor_t.surprise at a change from which on torque is thought to have changed, too, */
#define SURPRISED 2.0f        /* and is as large as can be */
#define GRIP 0.038f           /* two blocks: a new grip is complete, and nothing is learnt before [s] */
#define AWAKE 0.3f            /* after a rest [s] */
#define DISTURBANCE 2.0f      /* process noise after a change, in noise_range times the one that is set */
#define DISTURBANCE_TIME 0.4f /* its time constant [s] */

/* The belief of now is the only one to return to. */
static void keep_only(learning_t *learning, const cdkf_t *cdkf)
{
    cdkf_keep(cdkf, &learning->kept[0]);
    learning->kept[1] = learning->kept[0];
    learning->kept_ago = 0.0f;
}

void learning_start(learning_t *learning, const setup_t *setup, cdkf_t *cdkf)
{
    const adaptation_t adaptation = setup_adaptation(setup);
    adaptation_start(&adaptation, cdkf);
    change_detection_init(&learning->change);
    noise_estimation_begin(&learning->noise);
    whiteness_start(&learning->whiteness);
    calibration_start(&learning->calibration);
    monitor_start(&learning->monitor);
    hands_start(&learning->hands);
    grip_force_start(&learning->force);
    keep_only(learning, cdkf);
    learning->elapsed = 0.0f;
    learning->wait = 0.0f;
    learning->changed = 0.0f;
    learning->gripping = 0.0f;
    learning->calm = false;
    learning->held_again = false;
    learning->moved = false;
    learning->bounded = false;
}

/* The lesson teaches the parameters: besides, the sensors are right and somebody holds the lever. */
static bool teaches(const learning_t *learning, const lesson_t *lesson)
{
    return lesson->measured && lesson->excited && !learning->monitor.base_wrong && !learning->monitor.torque_wrong &&
           !monitor_has_stuck(&learning->monitor) && !learning->hands.off && (learning->wait <= 0.0f);
}

/* What was learnt in the last one to two seconds: they were not what they seemed. */
static void take_back(learning_t *learning, cdkf_t *cdkf)
{
    cdkf_return(cdkf, &learning->kept[1]);
    learning->kept[0] = learning->kept[1];
    learning->kept_ago = 0.0f;
    noise_estimation_begin(&learning->noise);
}

static void keep(learning_t *learning, const cdkf_t *cdkf, float period)
{
    learning->kept_ago += period;
    if (learning->kept_ago >= KEEP_PERIOD) {
        learning->kept_ago = 0.0f;
        learning->kept[1] = learning->kept[0];
        cdkf_keep(cdkf, &learning->kept[0]);
    }
}

/* For a while the state is moved by torque that nobody knows. */
static void disturb(const lever_settings_t *s, cdkf_t *cdkf, float part)
{
    cdkf->disturbance = (part * DISTURBANCE) * (s->noise_range * s->theta_dot_process_noise);
}

static bool is_known(const learning_t *learning)
{
    return learning->kept[1].trust >= 1.0f;
}

/* How much torque the lever is moved by that nobody knows, 0 to 1: as far as innovations are larger than expected. */
static float unknown_part(const learning_t *learning)
{
    return lesser((learning->monitor.surprise - UNSURPRISED) / (SURPRISED - UNSURPRISED), 1.0f);
}

/* The pilot grips anew. */
static void begin_grip(learning_t *learning, bool held_again)
{
    learning->changed = REPORTED;
    learning->gripping = GRIP;
    learning->wait = GRIP;
    learning->held_again = held_again;
}

/* With his grip the pilot mostly moves the lever: from then on it rests at another angle, for the model a constant
 * torque that nobody knows. */
static void follow_grip(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float period)
{
    if (learning->changed <= 0.0f) {
        cdkf_end_step(cdkf);
    }
    if (learning->gripping > 0.0f) {
        learning->gripping -= period;
        if (learning->gripping <= 0.0f) {
            const bool moved = learning->held_again || (unknown_part(learning) > 0.0f);
            learning->gripping = 0.0f;
            learning->moved = moved && setup->constants.trim;
        }
    }
}

/* Another change soon after one is followed as well, if innovations were as expected in between: otherwise it may be
 * noise that has grown. But not while it may be that nobody holds the lever any more: then the hands are to be judged
 * first. */
static bool may_follow(const learning_t *learning, const lever_settings_t *s)
{
    const hands_t *hands = &learning->hands;
    return (learning->changed <= 0.0f) || ((learning->changed <= (REPORTED - s->change_memory)) && learning->calm &&
                                              is_known(learning) && (hands->residual > (HELD * hands->change)));
}

/* A sudden change of the pilot counts as change_walk seconds of the walk, once: a disturbance that only looks like
 * one would widen the covariance again and again. Returns those seconds. */
static float detect_change(
    learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const correction_t *correction, float period)
{
    const lever_settings_t *s = setup->settings;
    const bool detected =
        change_detection_step(&learning->change, correction, period, s->change_memory, s->change_threshold);
    learning->calm = learning->calm || (learning->monitor.surprise < UNSURPRISED);
    const bool changed = detected && may_follow(learning, s);
    if (changed) {
        learning->changed = REPORTED;
        learning->calm = false;
        if (is_known(learning) && setup->constants.trim) {
            begin_grip(learning, false);
        } else if (unknown_part(learning) > 0.0f) { /* far from the truth, or noise set far too small */
            disturb(s, cdkf, unknown_part(learning));
        } else {
            /* the arm alone */
        }
    }
    return changed ? s->change_walk : 0.0f;
}

/* Noise, unless the innovations are those of a start or a change. What was learnt with noise that was far too small is
 * taken back. */
static void estimate_noise(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float period)
{
    const noise_setting_t noise = setup_noise(setup);
    const bool started = !is_known(learning);
    const bool opened = learning->held_again && (learning->changed > 0.0f); /* too uncertain to tell of noise */
    if (opened || (cdkf->trust < 1.0f) || (learning->changed > TRANSIENT)) {
        noise_estimation_begin(&learning->noise);
        if (opened) {
            keep(learning, cdkf, period);
        }
    } else if (noise_estimation_step(&learning->noise, cdkf, &noise, period) &&
               (started || (learning->changed <= 0.0f))) {
        take_back(learning, cdkf);
    } else {
        keep(learning, cdkf, period);
    }
}

/* What the block says against sensors, settings and model, before it is learnt, and of a step. Returns true when it
 * teaches. */
static bool judge(
    learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const lesson_t *lesson, float period, score_t *step)
{
    const bool held = !learning->hands.off;
    const bool counts = lesson->measured && lesson->excited;
    const score_t sudden = cdkf_sudden_score(cdkf);
    score_t constant[CDKF_CONSIDERED];
    cdkf_constant_scores(cdkf, constant);
    const bool on_lever = counts && (setup->model == (uint8_t)LEVER_MODEL_LEVER);
    const bool stands = !lesson->walks; /* parameters that are held are compared with as they are */
    *step = constant[CDKF_STEP];
    hands_step(&learning->hands, &setup->constants, cdkf->x[1], period, on_lever);
    const bool force_wrong = grip_force_judge(&learning->force, setup, &learning->hands);
    bool base_wrong = false;
    if ((is_known(learning) || stands) && !learning->hands.off) {
        base_wrong = monitor_step(&learning->monitor, &sudden, period);
    } else {
        monitor_trust_base(&learning->monitor);
    }
    const bool torque_wrong = monitor_judge_torque(&learning->monitor, period, setup->settings->sample_period);
    const bool fails = monitor_has_just_stuck(&learning->monitor) || base_wrong || torque_wrong || force_wrong;
    if (fails || (held && learning->hands.off)) {
        whiteness_start(&learning->whiteness);
        take_back(learning, cdkf);
    } else if (!held && !learning->hands.off) { /* another grip, by whomever */
        cdkf_open(cdkf);
        keep_only(learning, cdkf);
        begin_grip(learning, true);
    } else {
        /* as before */
    }
    const bool taught = teaches(learning, lesson);
    const bool settled = taught && ((cdkf->trust >= 1.0f) || stands) && (learning->changed <= TRANSIENT);
    whiteness_step(&learning->whiteness, period, settled);
    if (settled && !stands) { /* of an arm that has changed meanwhile it would say the same */
        calibration_step(&learning->calibration, cdkf, constant, period);
    }
    if (!taught) {
        cdkf_drop_pending(cdkf);
    }
    return taught;
}

/* The parameters take what the block says, and walk. */
static void adapt(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const score_t *step, float period,
    bool taught, bool excited)
{
    const lever_settings_t *s = setup->settings;
    const bool joint = (setup->estimator == (uint8_t)LEVER_ESTIMATOR_JOINT);
    const adaptation_t adaptation = setup_adaptation(setup);
    float variance[MODEL_PARAMETERS];
    correction_t correction;
    if (taught) {
        estimate_noise(learning, setup, cdkf, period);
    } else {
        noise_estimation_begin(&learning->noise);
    }
    cdkf_learn(cdkf, period, s->caution_time, &correction);
    float more = 0.0f;
    if (taught) {
        if (cdkf->acting > (uint32_t)CDKF_STEP) {
            cdkf_learn_step(cdkf, step);
        }
        more = detect_change(learning, setup, cdkf, &correction, period);
    }
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        variance[i] = adaptation.floor[i] * more;
    }
    cdkf_forget(cdkf, period, joint);
    cdkf_walk(cdkf, period, variance, joint);
    if (learning->changed > 0.0f) {
        adaptation_start(&adaptation, cdkf);                   /* the jump is no drift */
    } else if (taught || (!excited && (cdkf->trust > 0.0f))) { /* before anything is learnt, it starts later */
        adaptation_step(&adaptation, period, correction.w, excited, cdkf);
    } else {
        cdkf->growth = 0.0f; /* what cannot be learnt again is not forgotten */
    }
}

/* The parameters stay as they are. What they learnt in the last two seconds can still be taken back. */
static void hold(learning_t *learning, cdkf_t *cdkf, float period)
{
    learning->changed = 0.0f;
    learning->gripping = 0.0f;
    noise_estimation_begin(&learning->noise);
    cdkf_drop_pending(cdkf);
    cdkf_end_step(cdkf);
    keep(learning, cdkf, period);
}

/* The end of a block. */
static void end_block(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const lesson_t *lesson)
{
    const float period = learning->elapsed;
    score_t step;
    learning->elapsed = 0.0f;
    learning->wait = (learning->wait > period) ? (learning->wait - period) : 0.0f;
    if (!lesson->excited) {
        learning->wait = AWAKE;
    }
    learning->changed = (learning->changed > period) ? (learning->changed - period) : 0.0f;
    if (learning->hands.off) {
        disturb(setup->settings, cdkf, 1.0f);
    }
    cdkf->disturbance -= cdkf->disturbance * share_of(period, DISTURBANCE_TIME);
    follow_grip(learning, setup, cdkf, period);
    monitor_end_jumps(&learning->monitor, period, setup->settings->sample_period);
    const bool taught = judge(learning, setup, cdkf, lesson, period, &step);
    if (lesson->walks) {
        adapt(learning, setup, cdkf, &step, period, taught, lesson->excited);
    } else {
        hold(learning, cdkf, period);
    }
    learning->bounded = scaling_bound(&cdkf->scaling, cdkf->w);
    cdkf_draw(cdkf, setup->model_in_use, &setup->constants);
}

bool learning_step(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const lesson_t *lesson, float elapsed)
{
    const lever_settings_t *s = setup->settings;
    learning->elapsed += elapsed;
    const bool due = (learning->elapsed > (s->learn_period - (0.5f * s->sample_period)));
    if (due) {
        end_block(learning, setup, cdkf, lesson);
    }
    return due;
}

void learning_resume(learning_t *learning, cdkf_t *cdkf)
{
    learning->elapsed = 0.0f;
    cdkf_drop_pending(cdkf);
    monitor_trust_base(&learning->monitor);
    whiteness_start(&learning->whiteness);
}

void learning_skip(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float elapsed)
{
    static const lesson_t none = {true, false, false};
    learning->elapsed += elapsed;
    end_block(learning, setup, cdkf, &none);
}
