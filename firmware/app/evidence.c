#include "app/evidence.h"

#include "lever_cdkf.h"
#include "math/bounds.h"
#include "math/share.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define NIS_TIME 0.1f           /* of nis_fast, and of motion.fast [s] */
#define NOISE_LIKE_MOTION 0.2f  /* of the noise of theta_dot, in squares: a mean of products by chance */
#define SURPRISED 1.3f          /* nis_fast with which a signal that stands still is stuck; in flight it is 1 +- 0.07 */
#define ALIVE 0.4f              /* a base acceleration that changed for so long never stands still [s] */
#define BASE_MEMORY 0.5f        /* [s], */
#define BASE_MEMORY_WRONG 0.2f  /* and while it is wrong */
#define BASE_USUAL 1.0f         /* of the mean that the base goes on as [s], */
#define BASE_LESS 0.1f          /* or by less than so much of it, in squares */
#define BASE_DOUBT 0.35f        /* standard deviation of the gain up to which there may be doubt, */
#define BASE_SURE 0.1f          /* standard deviation of the gain up to which it counts, */
#define BASE_SURE_WRONG 0.2f    /* and while the base is wrong, when the state hardly follows it */
#define AGREEMENT_MEMORY 0.5f   /* of motor and kinematics [s] */
#define MOTOR_LAG 0.003f        /* motors lag by 1 to 5 ms [s] */
#define TORQUE_MIN 4e-4f        /* mean square of the command from which on it says anything [N^2 m^2] */
#define TORQUE_SURE 1.6f        /* torque of other origin over the command, both rms, that this is allowed times, */
#define TORQUE_GAIN_SURE 1.4f   /* and where it forbids nothing */
#define KINEMATICS_CORNER 5.0f  /* of the high-pass [rad/s] */
#define KINEMATICS_STEP 0.03f   /* of the angle from sample to sample, from which on it is none of the lever [rad] */
#define KINEMATICS_LINE 0.0105f /* the rate is on a straight line between samples that are so close [s] */
#define KINEMATICS_MIN 1e-6f    /* mean square of the integral from which on it says anything [rad^2] */
#define KINEMATICS_BLOCK 0.02f  /* more often than this the sums hardly get new information [s] */
#define KINEMATICS_BLOCKS 6.0f  /* from which on the gain has a standard deviation */
#define KINEMATICS_SURE 2.0f    /* standard deviations that the gain may be off */
#define CLOCK_MEMORY 0.25f      /* [s] */
#define LEVEL_SHARE 0.02f       /* of a torque's level, by one sample in EVIDENCE_TORQUE_EVERY */
#define OTHER_SHARE 0.01f       /* of its mean, by one sample in EVIDENCE_TORQUE_EVERY */
#define OTHER_LEAST 2.5e-3f     /* mean square that is more than noise of the sensor [N^2 m^2] */
#define OFFSET_MAX 0.02f        /* of theta: f_n, which is that at the angle shown, is off by its sigma [rad] */
#define LAPSE 30.0f             /* what nothing has confirmed for so long holds no more [s] */
#define AWAKE 0.3f              /* a rest lasts so much longer than the lack of motion [s] [rest_120s, freed] */
#define REGRIP_TIME 0.038f      /* two blocks: a new grip is complete [s] [grip_step] */
#define PROBATION 0.29f         /* until then a change has to explain the innovations [s] [rough_begins] */
#define EXPLAINED 0.6f          /* and leave no more of EVIDENCE_NOISE at its end */
#define TRANSIENT 1.0f          /* innovations are noise again, and not of the change [s] */
#define CHANGE_WAITS 0.6f       /* of EVIDENCE_BASE from which on the sensor is to be judged before a change */
#define HELD 0.043f             /* EVIDENCE_HANDS above which nobody may hold the lever any more */
#define TORQUE_UNKNOWN 1.2f     /* nis_fast at a change from which on torque is thought to have changed, too, */
#define TORQUE_ALL 2.0f         /* and by as much as can be */

typedef struct evidence_row {
    float inverse; /* of the threshold */
    float off;
    uint32_t fault;
} evidence_row_t;

static const evidence_row_t rows[EVIDENCE_COUNT] = {
#define EVIDENCE(name, threshold, off, fault, meaning) {1.0f / (threshold), (off), (uint32_t)(fault)},
#include "app/evidence.def"
};

/* The names without "EVIDENCE_". */
static const char *const names[EVIDENCE_COUNT] = {
#define EVIDENCE(name, threshold, off, fault, meaning) &#name[9],
#include "app/evidence.def"
};

/* The evidence that shows as a fault. */
static const uint32_t shown = 0u
#define EVIDENCE(name, threshold, off, fault, meaning)                                                                 \
    | (((uint32_t)(fault) != 0u) ? ((uint32_t)1u << (uint32_t)(name)) : 0u)
#include "app/evidence.def"
    ;

/* Square of a change from sample to sample that does no harm, by input [m^2/s^4], [N^2 m^2]. */
static const float harmless[INPUT_COUNT] = {4.0f, 0.09f};

const char *lever_test_ratio_name(uint32_t index)
{
    return (index < (uint32_t)LEVER_TEST_RATIOS) ? names[index] : NULL;
}

void evidence_start(evidence_t *evidence)
{
    (void)memset(evidence, 0, sizeof *evidence);
    evidence->input[INPUT_BASE].limit = harmless[INPUT_BASE];
    evidence->input[INPUT_TORQUE].limit = harmless[INPUT_TORQUE];
    evidence->since_change = EVIDENCE_LONG_AGO;
    evidence->nis_fast = 1.0f;
    evidence->nis_slow = 1.0f;
    change_detection_init(&evidence->change);
    hands_start(&evidence->hands);
    evidence_note(evidence, EVIDENCE_REST, true); /* nothing is learnt before the lever is seen to move */
    evidence_show(evidence);
}

void evidence_set(evidence_t *evidence, enum evidence_id which, float statistic)
{
    const evidence_row_t *row = &rows[which];
    const bool before = evidence_has(evidence, which);
    const float ratio = statistic * row->inverse;
    evidence->ratio[which] = ratio;
    evidence_note(evidence, which, ratio > (before ? row->off : 1.0f));
}

/* --- with each sample --------------------------------------------------------------------------------------------- */

bool evidence_refuses_output(evidence_t *evidence, const cdkf_t *cdkf, uint32_t i, float y, float level, float elapsed)
{
    const float innovation = y - cdkf->x[i];
    const float square = (innovation * innovation) * (1.0f / (GATE_SIGMA * GATE_SIGMA));
    const float noise = cdkf->output_noise[i]; /* the least that the variance can be */
    const bool far = (square > (noise * noise)) && (square > (level * cdkf_output_variance(cdkf, i)));
    return gate_refuses(&evidence->refused[i], far, elapsed);
}

static void agreement_add(agreement_t *agreement, float expected, float measured)
{
    agreement->expected += expected * expected;
    agreement->measured += measured * measured;
    agreement->product += expected * measured;
}

void evidence_follow_command(evidence_t *evidence, float commanded, float elapsed)
{
    evidence->commanded += lesser(elapsed * (1.0f / MOTOR_LAG), 1.0f) * (commanded - evidence->commanded);
}

void evidence_add_torque(evidence_t *evidence, float measured)
{
    const float other = measured - evidence->commanded;
    const float expected = evidence->commanded - evidence->commanded_level;
    const float deviation = measured - evidence->measured_level;
    agreement_add(&evidence->torque, expected, deviation);
    evidence->commanded_level += LEVEL_SHARE * expected;
    evidence->measured_level += LEVEL_SHARE * deviation;
    evidence->other_torque += OTHER_SHARE * ((other * other) - evidence->other_torque);
}

bool evidence_has_other_torque(const evidence_t *evidence)
{
    return evidence->other_torque > OTHER_LEAST;
}

void evidence_add_outputs(evidence_t *evidence, const float last[CDKF_OUTPUTS], const float y[CDKF_OUTPUTS], bool both,
    float elapsed, float period)
{
    kinematics_t *of = &evidence->kinematics;
    const float turn = KINEMATICS_CORNER * elapsed;
    const float change[2] = {y[0] - last[0], (0.5f * elapsed) * (y[1] + last[1])};
    const bool on = both && evidence->paired && (is_successive(elapsed, period) || (elapsed < KINEMATICS_LINE)) &&
                    (fabsf(change[0] - change[1]) < KINEMATICS_STEP);
    for (uint32_t i = 0u; i < 2u; i++) { /* y of an output that is not valid may be NaN */
        const float passed = on ? ((1.0f - turn) * (of->passed[i] + change[i])) : 0.0f;
        const float left = on ? (passed - of->level[i]) : 0.0f;
        of->level[i] = on ? (of->level[i] + (turn * left)) : 0.0f;
        of->sum[i] += left;
        of->passed[i] = passed;
    }
    evidence->paired = both;
}

/* --- at the end of a block ---------------------------------------------------------------------------------------- */

/* The means of what is measured: of the innovations, and of the motion. */
static void follow_outputs(evidence_t *evidence, float period, float slow_time)
{
    motion_t *motion = &evidence->motion;
    if (evidence->measured > 0.0f) {
        const float each = 1.0f / evidence->measured;
        const float nis = each * evidence->nis_sum;
        const float square = each * motion->sum;
        const float slow = share_of(period, slow_time);
        const float fast = share_of(period, NIS_TIME);
        evidence->nis_fast += fast * (nis - evidence->nis_fast);
        if (!evidence_has(evidence, EVIDENCE_UNSETTLED)) { /* innovations are those of the filter, not of the levels */
            evidence->nis_slow += slow * (nis - evidence->nis_slow);
        }
        motion->slow = greater(motion->slow + (slow * (square - motion->slow)), 0.0f);
        motion->fast += fast * (square - motion->fast);
    }
    evidence->measured = 0.0f;
    evidence->nis_sum = 0.0f;
    motion->sum = 0.0f;
}

/* Whether there is too little motion to learn from, beyond what the noise of theta_dot looks like. */
static bool judge_motion(evidence_t *evidence, const lever_settings_t *s, float noise, float period)
{
    const motion_t *motion = &evidence->motion;
    const float least = (s->excitation_least * s->excitation_least) + (NOISE_LIKE_MOTION * (noise * noise));
    const bool rests = (motion->slow < least) || (motion->fast < (0.25f * least));
    evidence->awake = rests ? 0.0f : lesser(evidence->awake + period, AWAKE);
    evidence_note(evidence, EVIDENCE_REST, evidence->awake < (AWAKE - 0.001f));
    return rests;
}

static void judge_stillness(evidence_t *evidence, enum signal signal, float period)
{
    stillness_t *of = &evidence->stillness[signal];
    const enum evidence_id which = evidence_of_stuck(signal);
    const bool changed = (of->now < of->before) || (of->now > of->before);
    const bool seen = evidence->seen[signal];
    const bool taken = (signal == SIGNAL_BASE) && (evidence->alive > (ALIVE - (0.5f * period)));
    const bool told = evidence_has(evidence, which) || (evidence->nis_fast > SURPRISED) || taken;
    of->before = of->now;
    of->still = (changed || !seen) ? 0.0f : (of->still + period);
    evidence_set(evidence, which, told ? of->still : 0.0f);
    if ((signal == SIGNAL_BASE) && seen && changed) {
        evidence->alive = lesser(evidence->alive + period, ALIVE);
    }
    if ((signal == SIGNAL_BASE) && ((of->still * rows[which].inverse) > 1.0f)) {
        evidence->alive = 0.0f;
    }
    evidence->seen[signal] = false;
}

/* Whether the base goes on as it did for a second: otherwise the lever may well stand still. */
static bool base_goes_on(motion_t *motion, const stillness_t *base, float period)
{
    const float change = base->now - base->before;
    const float square = change * change;
    motion->base_slow += share_of(period, BASE_USUAL) * (square - motion->base_slow);
    motion->base_fast += share_of(period, NIS_TIME) * (square - motion->base_fast);
    return motion->base_fast > (BASE_LESS * motion->base_slow);
}

/* Forgets what was seen of the base: the arm has changed, or is not known yet. */
static void trust_base(evidence_t *evidence)
{
    (void)memset(&evidence->base, 0, sizeof evidence->base);
    evidence->base_unheard = 0.0f;
    evidence_set(evidence, EVIDENCE_BASE, 0.0f);
}

static void judge_base(evidence_t *evidence, const score_t *sudden, float period)
{
    score_t *base = &evidence->base;
    const bool before = evidence_has(evidence, EVIDENCE_BASE);
    const float keep = 1.0f - share_of(period, before ? BASE_MEMORY_WRONG : BASE_MEMORY);
    const float sure = before ? BASE_SURE_WRONG : BASE_SURE;
    const float noise = before ? 1.0f : greater(evidence->nis_fast, 1.0f); /* rough air that begins is no wrong base */
    base->vector = (keep * base->vector) + sudden->vector;
    base->information = (keep * base->information) + sudden->information;
    evidence->ratio[EVIDENCE_BASE] = 0.0f;
    if ((base->information * (BASE_DOUBT * BASE_DOUBT)) > 1.0f) {
        const float gain = (before ? 0.0f : 1.0f) - (base->vector / base->information);
        const float away = fabsf(gain - 1.0f);
        evidence->base_unheard = 0.0f;
        evidence->ratio[EVIDENCE_BASE] = lesser(away * rows[EVIDENCE_BASE].inverse, 1.0f); /* not sure yet */
        if ((base->information * (sure * sure)) > noise) {
            evidence_set(evidence, EVIDENCE_BASE, away);
        }
    } else {
        evidence->base_unheard += period;
        if (evidence->base_unheard > LAPSE) {
            trust_base(evidence);
        }
    }
    if (evidence_has(evidence, EVIDENCE_BASE) != before) {
        (void)memset(base, 0, sizeof *base);
    }
}

void evidence_start_calibration(evidence_t *evidence)
{
    calibration_start(&evidence->calibration);
    evidence_set(evidence, EVIDENCE_CALIBRATION, 0.0f);
}

/* How far the gain of measured over expected is from 1. `other` becomes what else is measured over what is expected, rms. */
static float agreement_away(const agreement_t *agreement, float *other)
{
    const float gain = agreement->product / agreement->expected;
    *other = sqrtf(greater((agreement->measured / agreement->expected) - (gain * gain), 0.0f));
    return fabsf(gain - 1.0f);
}

static void agreement_forget(agreement_t *agreement, float keep)
{
    agreement->expected *= keep;
    agreement->measured *= keep;
    agreement->product *= keep;
}

static void judge_motor(evidence_t *evidence, float period, float sample_period)
{
    const float least = TORQUE_MIN * (AGREEMENT_MEMORY / ((float)EVIDENCE_TORQUE_EVERY * sample_period));
    float other = 0.0f;
    const float away = (evidence->torque.expected > least) ? agreement_away(&evidence->torque, &other) : 0.0f;
    evidence_set(evidence, EVIDENCE_MOTOR, away - (TORQUE_SURE * other));
    evidence_set(evidence, EVIDENCE_TORQUE_GAIN, away - (TORQUE_GAIN_SURE * other));
    agreement_forget(&evidence->torque, 1.0f - share_of(period, AGREEMENT_MEMORY));
}

/* Samples are too far apart even if each long interval is one in which some were lost, or too close even if none is:
 * intervals of any length that are right in the mean are neither. */
static void judge_clock(evidence_t *evidence, float period)
{
    const float keep = 1.0f - share_of(period, CLOCK_MEMORY);
    evidence_set(evidence, EVIDENCE_CLOCK, greater(evidence->slow, evidence->fast) * (1.0f / CLOCK_MEMORY));
    evidence->slow *= keep;
    evidence->fast *= keep;
}

/* Compares the angle with the integral of the rate. The gain's standard deviation is what else differs, over the root
 * of the effective number n of blocks (Kish 1965), as a few large ones may be most of the sum; n / (n - 2) times that, as
 * it is of so few itself (variance of Student's t). */
static void judge_kinematics(evidence_t *evidence, float period, float sample_period)
{
    kinematics_t *of = &evidence->kinematics;
    const float integral = of->sum[1]; /* times the samples of a block */
    const float square = integral * integral;
    const float keep = 1.0f - share_of(period, AGREEMENT_MEMORY);
    const float least = (KINEMATICS_MIN * AGREEMENT_MEMORY) * (period / (sample_period * sample_period));
    agreement_add(&of->agreement, integral, of->sum[0]);
    of->sum[0] = 0.0f;
    of->sum[1] = 0.0f;
    of->fourth = (keep * keep * of->fourth) + (square * square);
    const float expected = of->agreement.expected;
    const float blocks = (expected * expected) * lesser(period * (1.0f / KINEMATICS_BLOCK), 1.0f);
    if ((expected > least) && (blocks > (KINEMATICS_BLOCKS * of->fourth))) {
        const float inverse = of->fourth / blocks;
        const float sure = (KINEMATICS_SURE * sqrtf(inverse)) / (1.0f - (2.0f * inverse));
        of->unheard = 0.0f;
        float other;
        const float away = agreement_away(&of->agreement, &other);
        evidence_set(evidence, EVIDENCE_KINEMATICS, away - (sure * other));
    } else { /* it stays as it is, for a while */
        of->unheard += period;
        if (of->unheard > LAPSE) {
            evidence_set(evidence, EVIDENCE_KINEMATICS, 0.0f);
        }
    }
    agreement_forget(&of->agreement, keep);
}

/* A change of an arm that was known has to explain the innovations within its probation; otherwise noise has grown,
 * where that is estimated: without an estimate nothing would end it. */
static void judge_noise(evidence_t *evidence, const evidence_block_t *block)
{
    const float since = evidence->since_change;
    const bool judged = block->known && (block->setup->settings->noise_window > 0.0f);
    const bool tests = judged && (block->verdict != (uint8_t)VERDICT_REGRIP) && (since <= PROBATION);
    const bool ends = judged && (since > PROBATION) && (since < (PROBATION + (1.01f * block->period)));
    if (ends) {
        evidence_set(evidence, EVIDENCE_NOISE, (1.0f / EXPLAINED) * evidence->nis_fast);
    } else if (tests || evidence_has(evidence, EVIDENCE_NOISE)) {
        evidence_set(evidence, EVIDENCE_NOISE, evidence->nis_fast);
    } else {
        evidence->ratio[EVIDENCE_NOISE] = 0.0f;
    }
}

static void judge_states(evidence_t *evidence, const cdkf_t *cdkf, const evidence_block_t *block)
{
    const float since = evidence->since_change;
    evidence_note(evidence, EVIDENCE_REGRIP, since < REGRIP_TIME);
    evidence->offset = block->held ? evidence->offset : 0.0f;
    evidence_note(evidence, EVIDENCE_OFFSET, fabsf(evidence->offset) > OFFSET_MAX);
    const float transient = evidence->opened ? CHANGE_REPORTED : TRANSIENT;
    evidence_note(evidence, EVIDENCE_NEW, !block->held && ((cdkf->trust < 1.0f) || (since < transient)));
    const bool passed = (since >= PROBATION) || evidence_has(evidence, EVIDENCE_CHANGE); /* this one, or one before */
    evidence_note(evidence, EVIDENCE_CHANGE, passed && (since < (PROBATION + CHANGE_REPORTED)));
}

void evidence_end_block(evidence_t *evidence, const cdkf_t *cdkf, const evidence_block_t *block)
{
    const setup_t *setup = block->setup;
    const float period = block->period;
    const bool adapts = verdict_rows[block->verdict].adapt;
    follow_outputs(evidence, period, setup->settings->excitation_time);
    const bool rests = judge_motion(evidence, setup->settings, cdkf->output_noise[1], period);
    const bool moves =
        !rests && !evidence_has(evidence, EVIDENCE_MISSING) && !evidence_has(evidence, EVIDENCE_UNSETTLED);
    const score_t sudden = cdkf_sudden_score(cdkf);
    float force = 0.0f;
    evidence->since_change = lesser(evidence->since_change + period, EVIDENCE_LONG_AGO);
    for (uint32_t i = 0u; i < (uint32_t)INPUT_COUNT; i++) {
        input_gate_end_block(&evidence->input[i], harmless[i], period, setup->settings->sample_period);
    }
    const bool driven = base_goes_on(&evidence->motion, &evidence->stillness[SIGNAL_BASE], period);
    for (uint32_t i = 0u; i < (uint32_t)SIGNAL_COUNT; i++) {
        judge_stillness(evidence, (enum signal)i, period);
    }
    const hands_block_t hands = hands_step(
        &evidence->hands, &setup->constants, cdkf->x[1], period, moves && (setup->model == (uint8_t)LEVER_MODEL_LEVER));
    if (hands.counted) {
        evidence_set(evidence, EVIDENCE_HANDS, hands_statistic(&evidence->hands));
    }
    if (grip_force_judge(&evidence->force, setup, &hands, &force)) {
        evidence_set(evidence, EVIDENCE_FORCE, force);
    }
    judge_motor(evidence, period, setup->settings->sample_period);
    judge_kinematics(evidence, period, setup->settings->sample_period);
    judge_clock(evidence, period);
    if ((block->known || block->held) && !evidence_has(evidence, EVIDENCE_HANDS) &&
        !evidence_has(evidence, EVIDENCE_KINEMATICS)) { /* what does not agree says nothing of the base */
        judge_base(evidence, &sudden, period);
    } else {
        trust_base(evidence);
    }
    judge_noise(evidence, block);
    judge_states(evidence, cdkf, block);
    evidence_set(evidence, EVIDENCE_STICKING,
        sticking_judge(&evidence->sticking, evidence->motion.slow, cdkf->output_noise[1], moves && driven));
    evidence_set(evidence, EVIDENCE_COLOUR, whiteness_correlation(&evidence->whiteness));
    /* an arm that has changed meanwhile would say the same as an error of the base */
    if (adapts && moves && !block->held && (evidence->ratio[EVIDENCE_BASE] < CHANGE_WAITS)) {
        evidence_set(evidence, EVIDENCE_CALIBRATION, calibration_step(&evidence->calibration, cdkf, period));
    }
    evidence_set(evidence, EVIDENCE_INNOVATION, evidence->nis_slow);
}

void evidence_show(evidence_t *evidence)
{
    evidence->faults = 0u;
    uint32_t i = 0u;
    for (uint32_t rest = evidence->present & shown; rest != 0u; rest >>= 1u) {
        evidence->faults |= ((rest & 1u) != 0u) ? rows[i].fault : 0u;
        i++;
    }
}

bool evidence_of_change(
    evidence_t *evidence, const cdkf_t *cdkf, const correction_t *correction, const evidence_block_t *block)
{
    const lever_settings_t *s = block->setup->settings;
    const float statistic =
        change_detection_step(&evidence->change, correction, &cdkf->scaling, block->period, s->change_memory);
    const float ratio = (s->change_threshold > 0.0f) ? (statistic / s->change_threshold) : 0.0f;
    const float since = evidence->since_change;
    const bool again = (since > s->change_memory) && block->known && (evidence->ratio[EVIDENCE_HANDS] < HELD);
    evidence->ratio[EVIDENCE_CHANGE] = ratio;
    if (ratio > 1.0f) {
        change_detection_restart(&evidence->change);
    }
    return (ratio > 1.0f) && ((since >= CHANGE_REPORTED) || again) && (evidence->ratio[EVIDENCE_BASE] < CHANGE_WAITS);
}

void evidence_begin_change(evidence_t *evidence, bool known, bool opened)
{
    evidence->since_change = known ? 0.0f : PROBATION;
    evidence->opened = opened;
    evidence_note(evidence, EVIDENCE_REGRIP, known);
    if (opened) { /* what was seen of the calibration was seen with the other arm */
        evidence_start_calibration(evidence);
    }
}

float evidence_of_torque(const evidence_t *evidence)
{
    const float part = (evidence->nis_fast - TORQUE_UNKNOWN) * (1.0f / (TORQUE_ALL - TORQUE_UNKNOWN));
    return greater(lesser(part, 1.0f), 0.0f);
}

void evidence_resume(evidence_t *evidence)
{
    trust_base(evidence);
    whiteness_start(&evidence->whiteness);
}
