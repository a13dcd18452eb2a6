#include "app/learning.h"
#include "math/bounds.h"
#include "math/invariant.h"
#include "math/share.h"

#include <string.h>

#define KEEP_PERIOD 1.0f      /* between two copies of the belief [s] */
#define DISTURBANCE 2.0f      /* process noise when the torque is unknown, in noise_range times the one that is set */
#define DISTURBANCE_TIME 0.4f /* its time constant [s] [hands_off] */
#define NOISE_WINDOW 0.15f    /* of noise_window while noise has grown [rough_begins] */

/* --- actions ------------------------------------------------------------------------------------------------------ */

/* The belief of now is the only one to return to. */
static void keep_only(learning_t *learning, const cdkf_t *cdkf)
{
    cdkf_keep(cdkf, &learning->kept[0]);
    learning->kept[1] = learning->kept[0];
    learning->kept_ago = 0.0f;
}

/* `now`: not in a block that ends a window of noise, to bound the worst step. */
static void keep(learning_t *learning, const cdkf_t *cdkf, float period, bool now)
{
    learning->kept_ago += period;
    if (now && (learning->kept_ago >= KEEP_PERIOD)) {
        learning->kept_ago = 0.0f;
        learning->kept[1] = learning->kept[0];
        cdkf_keep(cdkf, &learning->kept[0]);
    }
}

/* Rolls the parameters back to the belief of 1–2 s ago: the data since then were bad. */
static void restore(learning_t *learning, cdkf_t *cdkf)
{
    cdkf_return(cdkf, &learning->kept[1]);
    cdkf_end_step(cdkf); /* nor was it a change of the arm */
    learning->kept[0] = learning->kept[1];
    learning->kept_ago = 0.0f;
    noise_estimation_begin(&learning->noise);
    whiteness_start(&learning->evidence.whiteness);
}

/* For a while the state is moved by unknown torque. */
static void disturb(const lever_settings_t *s, cdkf_t *cdkf, float part)
{
    cdkf->disturbance = (part * DISTURBANCE) * (s->noise_range * s->theta_dot_process_noise);
}

static bool is_known(const learning_t *learning)
{
    return learning->kept[1].trust >= 1.0f;
}

/* Leaves one verdict and enters the next. Returns seconds of the walk that are due at once. */
static float turn(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, uint8_t next)
{
    const lever_settings_t *s = setup->settings;
    const uint32_t actions = (next == learning->verdict)
                                 ? (uint32_t)ACTION_NOTHING
                                 : ((uint32_t)verdict_rows[learning->verdict].exit | verdict_rows[next].entry);
    learning->verdict = next;
    if ((actions & (uint32_t)ACTION_OPEN) != 0u) {
        cdkf_open(cdkf);
        keep_only(learning, cdkf);
        evidence_begin_change(&learning->evidence, true, true);
        learning->verdict = verdict_of(learning->evidence.present);
    }
    INVARIANT(learning->verdict < (uint8_t)VERDICT_COUNT);
    if ((actions & (uint32_t)ACTION_RESTORE) != 0u) {
        restore(learning, cdkf);
    }
    if ((actions & (uint32_t)ACTION_LEVELS) != 0u) {
        const float part = evidence_of_torque(&learning->evidence);
        learning->levels = setup->constants.trim && (learning->evidence.opened || (part > 0.0f));
        if (!learning->levels && (part > 0.0f)) {
            disturb(s, cdkf, part);
        }
        learning->evidence.nis_fast = 1.0f; /* from now on innovations tell whether the change explains them */
    }
    return ((actions & (uint32_t)ACTION_INFLATE) != 0u) ? s->change_walk : 0.0f;
}

/* --- learning ----------------------------------------------------------------------------------------------------- */

/* While innovations are those of a known arm, or of noise that has grown. */
static void estimate_noise(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float period)
{
    const bool grown = (learning->verdict == (uint8_t)VERDICT_NOISE);
    noise_setting_t noise = setup_noise(setup);
    noise.window *= grown ? NOISE_WINDOW : 1.0f;
    if (!grown && !verdict_rows[learning->verdict].adapt) {
        noise_estimation_begin(&learning->noise);
    } else if (noise_estimation_step(&learning->noise, cdkf, &noise, period)) {
        evidence_start_calibration(&learning->evidence);
        if (!grown && !is_known(learning)) { /* what was learnt from the start with noise that was far too small */
            restore(learning, cdkf);
        }
    } else {
        /* the noise is about right */
    }
}

/* A change of an arm that is not known yet: far from the truth, or with noise set far too small, torque is unknown. */
static float disturb_unknown(const learning_t *learning, const lever_settings_t *s, cdkf_t *cdkf)
{
    const float part = evidence_of_torque(&learning->evidence);
    if (part > 0.0f) {
        disturb(s, cdkf, part);
    }
    return s->change_walk;
}

/* The parameters take what the block says, and walk. */
static void learn(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const evidence_block_t *block, float more)
{
    const float period = block->period;
    const bool joint = (setup->estimator == (uint8_t)LEVER_ESTIMATOR_JOINT);
    const bool learns = verdict_rows[learning->verdict].learn;
    const bool rests = (learning->verdict == (uint8_t)VERDICT_REST);
    const adaptation_t adaptation = setup_adaptation(setup);
    const score_t step = cdkf_constant_score(cdkf, (uint32_t)CDKF_STEP);
    float walk = more; /* seconds of it at once */
    float variance[MODEL_PARAMETERS];
    correction_t correction;
    cdkf_learn(cdkf, period, setup->settings->caution_time, &correction);
    if (learns) {
        if (cdkf->acting > (uint32_t)CDKF_STEP) {
            correction.bounded = cdkf_learn_step(cdkf, &step);
        }
        if (evidence_of_change(&learning->evidence, cdkf, &correction, block)) {
            evidence_begin_change(&learning->evidence, block->known, false);
            walk = block->known ? turn(learning, setup, cdkf, verdict_of(learning->evidence.present))
                                : disturb_unknown(learning, setup->settings, cdkf);
        }
    }
    evidence_note_bound(&learning->evidence, correction.bounded);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        variance[i] = adaptation.floor[i] * walk;
    }
    cdkf_forget(cdkf, period, joint);
    cdkf_walk(cdkf, period, variance, joint);
    if (learning->evidence.since_change < CHANGE_REPORTED) {
        adaptation_start(&adaptation, cdkf);                /* the jump is no drift */
    } else if (learns || (rests && (cdkf->trust > 0.0f))) { /* before anything is learnt, it starts later */
        adaptation_step(&adaptation, period, correction.w, !rests, cdkf);
    } else {
        cdkf->growth = 0.0f; /* what cannot be learnt again is not forgotten */
    }
}

/* The end of a block. */
static void end_block(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, bool held)
{
    evidence_t *evidence = &learning->evidence;
    const evidence_block_t block = {.setup = setup,
        .period = learning->elapsed,
        .known = is_known(learning),
        .held = held,
        .verdict = learning->verdict};
    const bool forced = grip_force_is_used(&evidence->force);
    learning->elapsed = 0.0f;
    evidence->since_change = held ? EVIDENCE_LONG_AGO : evidence->since_change;
    evidence_end_block(evidence, cdkf, &block);
    const float more = turn(learning, setup, cdkf, verdict_of(evidence->present));
    if (learning->verdict == (uint8_t)VERDICT_NOISE) {
        evidence->since_change = EVIDENCE_LONG_AGO; /* it was none */
    }
    if (forced && evidence_has(evidence, EVIDENCE_FORCE)) {
        restore(learning, cdkf);
    }
    if (learning->verdict == (uint8_t)VERDICT_HANDS_OFF) {
        disturb(setup->settings, cdkf, 1.0f);
    }
    cdkf->disturbance -= cdkf->disturbance * share_of(block.period, DISTURBANCE_TIME);
    if (held || (evidence->since_change >= CHANGE_REPORTED)) {
        cdkf_end_step(cdkf);
    }
    learning->levels = learning->levels && !held;
    if (held || !verdict_rows[learning->verdict].learn) {
        cdkf_drop_pending(cdkf);
    }
    if (held) {
        noise_estimation_begin(&learning->noise);
        evidence_note_bound(evidence, scaling_bound(&cdkf->scaling, cdkf->w));
        keep(learning, cdkf, block.period, true);
    } else {
        if ((learning->verdict == (uint8_t)VERDICT_SETTLING) && (cdkf->trust > 0.0f) && !is_known(learning)) {
            cdkf_open(cdkf); /* what little there was before an outage moves the estimate, and is not certain */
            keep_only(learning, cdkf);
        }
        estimate_noise(learning, setup, cdkf, block.period);
        if (verdict_rows[learning->verdict].adapt ||
            (evidence->opened && verdict_rows[learning->verdict].learn)) { /* nothing else is left to return to */
            keep(learning, cdkf, block.period, evidence->opened || (learning->noise.elapsed > 0.0f));
        }
        learn(learning, setup, cdkf, &block, more);
    }
    evidence_show(evidence);
    cdkf_draw(cdkf, setup->model_in_use, &setup->constants);
}

/* --- blocks ------------------------------------------------------------------------------------------------------- */

void learning_start(learning_t *learning, const setup_t *setup, cdkf_t *cdkf)
{
    const adaptation_t adaptation = setup_adaptation(setup);
    adaptation_start(&adaptation, cdkf);
    evidence_start(&learning->evidence);
    noise_estimation_begin(&learning->noise);
    keep_only(learning, cdkf);
    learning->elapsed = 0.0f;
    learning->verdict = (uint8_t)VERDICT_REST;
    learning->levels = false;
}

bool learning_step(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, bool held, float elapsed)
{
    const lever_settings_t *s = setup->settings;
    learning->elapsed += elapsed;
    const bool due = (learning->elapsed > (s->learn_period - (0.5f * s->sample_period)));
    if (due) {
        end_block(learning, setup, cdkf, held);
    }
    return due;
}

void learning_resume(learning_t *learning, cdkf_t *cdkf)
{
    learning->elapsed = 0.0f;
    cdkf_drop_pending(cdkf);
    evidence_resume(&learning->evidence);
}

void learning_skip(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float elapsed)
{
    evidence_note(&learning->evidence, EVIDENCE_MISSING, false);
    (void)memset(&learning->evidence.motion, 0, sizeof learning->evidence.motion); /* it rests */
    learning->elapsed += elapsed;
    end_block(learning, setup, cdkf, false);
}
