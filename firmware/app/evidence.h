/* What the samples say of sensors, pilot and model: statistics with their thresholds (evidence.def). Nothing here
 * changes the filter; what follows from the evidence is the verdict's (verdict.h).
 *
 *   stuck    a signal has not changed by a bit for a while, and the innovations say that it should have. For the base
 *            acceleration, which innovations tell late, it is enough that it did change all the time before
 *   base     the response to the base acceleration is not about once what it should be: no sensor, the wrong sign, the
 *            wrong unit. By the score of a sudden error of the accelerometer's gain (filter/cdkf.h)
 *   motor    the measured torque does not follow the commanded one. By regression; other torque makes it less sure
 *   clock    samples are further apart, or closer, than sample_period: their sender's clock is wrong, or the setting
 *   kinematics  the angle is not the integral of the rate, whatever the arm. By the same regression
 *   motion   the mean square of the measured rate without the noise of its sensor
 */
#ifndef APP_EVIDENCE_H
#define APP_EVIDENCE_H

#include "app/gate.h"
#include "app/grip_force.h"
#include "app/hands.h"
#include "app/setup.h"
#include "app/verdict.h"
#include "filter/calibration.h"
#include "filter/cdkf.h"
#include "filter/change_detection.h"
#include "filter/sticking.h"
#include "filter/trim.h"
#include "filter/whiteness.h"
#include "math/elapsed.h"

#include <stdbool.h>
#include <stdint.h>

enum signal { SIGNAL_THETA, SIGNAL_THETA_DOT, SIGNAL_BASE, SIGNAL_COUNT };
enum input { INPUT_BASE, INPUT_TORQUE, INPUT_COUNT };

typedef struct stillness {
    float now;    /* value of the last sample, */
    float before; /* and of the last one of the block before */
    float still;  /* time for which it has been that [s] */
} stillness_t;

/* Compares a signal with what it should be: sums of squares and products, with exponential forgetting [unit^2]. */
typedef struct agreement {
    float expected;
    float measured;
    float product;
} agreement_t;

/* The angle and the integrated rate [rad], through the same second-order high-pass: offsets of either do not pass. */
typedef struct kinematics {
    float passed[2];       /* the first order of the angle, of the integral, */
    float level[2];        /* the level of that, */
    float sum[2];          /* and what is left, over the samples of a block */
    agreement_t agreement; /* of the angle with the integral, by their sums over a block, */
    float fourth;          /* sum of the integral to the fourth: how many blocks the agreement rests on */
    float unheard;         /* time for which they have not been enough [s] */
} kinematics_t;

typedef struct motion {
    float sum;                /* of the products of successive rates in this block [rad^2/s^2]; */
    float slow;               /* their mean over excitation_time, */
    float fast;               /* and over 0.1 s */
    float last[MODEL_STATES]; /* deviations of the last sample that measured each output, as a rate [rad/s] */
    float base_slow;          /* mean square change of the base acceleration in a block over 1 s [m^2/s^4], */
    float base_fast;          /* and over 0.1 s */
} motion_t;

typedef struct evidence {
    float ratio[LEVER_TEST_RATIOS]; /* statistic over threshold, of those that are no states */
    uint32_t present;               /* a bit each */
    uint32_t faults;                /* of enum lever_fault, that it shows as at the end of a block */
    float since_change;             /* time since the pilot changed last [s] */
    float measured;                 /* samples of this block with an output, */
    float nis_sum;                  /* sum of their nis / nis_size, each expected to be 1; */
    float nis_fast;                 /* its mean over 0.1 s, */
    float nis_slow;                 /* and over excitation_time */
    motion_t motion;
    stillness_t stillness[SIGNAL_COUNT];
    float awake;                 /* time since there was too little motion [s] */
    float alive;                 /* time in which the base acceleration has changed all the time [s] */
    float offset;                /* by which theta has jumped, and the rate not, since the parameters learnt [rad] */
    float refused[CDKF_OUTPUTS]; /* time for which samples of an output have been refused [s] */
    input_gate_t input[INPUT_COUNT];
    score_t base;       /* of CDKF_BASE_GAIN, with exponential forgetting */
    float base_unheard; /* time for which it has said nothing [s] */
    agreement_t torque; /* measured with commanded, each less its level [N m]: a bias does not hide a motor */
    float commanded;    /* as a motor follows it [N m] */
    float commanded_level;
    float measured_level;
    float other_torque; /* mean square of what the motor was not asked for, while it was measured [N^2 m^2] */
    float slow; /* time by the clock less that by sample_period, where a long interval is so many lost samples [s], */
    float fast; /* and the other way round, if none was lost; with exponential forgetting */
    kinematics_t kinematics;
    change_detection_t change;
    whiteness_t whiteness;
    sticking_t sticking;
    calibration_t calibration;
    hands_t hands;
    grip_force_t force;
    bool seen[SIGNAL_COUNT]; /* in this block */
    bool paired;             /* the last sample measured both outputs */
    bool opened;             /* the last change was to another pilot */
} evidence_t;

#define EVIDENCE_NIS_MAX 100.0f  /* of a single sample, so that the means recover */
#define EVIDENCE_LONG_AGO 1.0e3f /* [s] */
#define CHANGE_REPORTED 3.0f     /* a change is reported, and its step estimated, until then [s] */

void evidence_start(evidence_t *evidence);

static inline bool evidence_has(const evidence_t *evidence, enum evidence_id which)
{
    return (evidence->present & ((uint32_t)1u << (uint32_t)which)) != 0u;
}

/* A statistic: its ratio, and with hysteresis whether the evidence is present. */
void evidence_set(evidence_t *evidence, enum evidence_id which, float statistic);

/* A state. */
static inline void evidence_note(evidence_t *evidence, enum evidence_id which, bool present)
{
    const uint32_t bit = (uint32_t)1u << (uint32_t)which;
    evidence->present = present ? (evidence->present | bit) : (evidence->present & ~bit);
}

/* Whether a parameter rests on a bound. While innovations are coloured, too, no arm explains how the lever moves. */
static inline void evidence_note_bound(evidence_t *evidence, bool bounded)
{
    evidence_note(evidence, EVIDENCE_BOUND, bounded);
    evidence_note(evidence, EVIDENCE_UNEXPLAINED, bounded && evidence_has(evidence, EVIDENCE_COLOUR));
}

/* --- with each sample --------------------------------------------------------------------------------------------- */

/* The evidence that a signal is stuck. */
static inline enum evidence_id evidence_of_stuck(enum signal signal)
{
    const enum evidence_id other = (signal == SIGNAL_BASE) ? EVIDENCE_BASE_STUCK : EVIDENCE_THETA_DOT_STUCK;
    return (signal == SIGNAL_THETA) ? EVIDENCE_THETA_STUCK : other;
}

/* A value that its sender calls valid; true when it is not stuck. */
static inline bool evidence_sees(evidence_t *evidence, enum signal signal, float value)
{
    evidence->stillness[signal].now = value;
    evidence->seen[signal] = true;
    return !evidence_has(evidence, evidence_of_stuck(signal));
}

/* Before the next sample: its value would be that of the last. */
static inline bool evidence_repeats(const evidence_t *evidence, enum signal signal, float value)
{
    const float last = evidence->stillness[signal].now;
    return !((value < last) || (value > last));
}

/* Output y, which is not valid where it is refused. The squares of innovations are now `level` times those expected. */
bool evidence_refuses_output(evidence_t *evidence, const cdkf_t *cdkf, uint32_t i, float y, float level, float elapsed);

/* A sample `elapsed` after the last, by its clock [s]; */
static inline void evidence_add_time(evidence_t *evidence, float elapsed, float period)
{
    const float early = period - elapsed;
    evidence->fast += early;
    evidence->slow -= early;
}

/* and so many that were lost before it, if that is why it comes late. */
static inline void evidence_add_lost(evidence_t *evidence, float period, uint32_t lost)
{
    evidence->slow -= period * (float)lost;
}

/* The torque that was commanded before this sample [N m], by each. */
void evidence_follow_command(evidence_t *evidence, float commanded, float elapsed);

/* A measured torque beside it [N m]; one sample in EVIDENCE_TORQUE_EVERY is enough. */
enum { EVIDENCE_TORQUE_EVERY = 8 };
void evidence_add_torque(evidence_t *evidence, float measured);

/* Whether the torque may be other than the commanded one where it is not measured: somebody else was driving. */
bool evidence_has_other_torque(const evidence_t *evidence);

/* Outputs of a sample, those before, and whether both are measured: [rad], [rad/s]. `period`: of samples [s]. */
void evidence_add_outputs(evidence_t *evidence, const float last[CDKF_OUTPUTS], const float y[CDKF_OUTPUTS], bool both,
    float elapsed, float period);

/* Adds nis / nis_size of a sample with an output, after the update. */
static inline void evidence_add_nis(evidence_t *evidence, float ratio)
{
    evidence->measured += 1.0f;
    evidence->nis_sum += lesser(ratio, EVIDENCE_NIS_MAX);
}

/* Adds the rate of such a sample, measured or presumed by output i [rad/s]. Products of successive samples are summed up:
 * unlike motion, the noise of a sensor differs from sample to sample. The prediction is no evidence of motion: the base
 * drives it on a lever that is locked. */
static inline void evidence_add_motion(evidence_t *evidence, uint32_t i, float rate, float elapsed, float period)
{
    motion_t *motion = &evidence->motion;
    const float square = rate * motion->last[i];
    motion->last[i] = rate;
    if (is_successive(elapsed, period) || (elapsed < TRIM_OUTAGE)) {
        motion->sum += square;
    }
}

/* --- at the end of a block ---------------------------------------------------------------------------------------- */

/* What a block is judged with. */
typedef struct evidence_block {
    const setup_t *setup;
    float period;    /* [s] */
    bool known;      /* the arm was known two seconds ago */
    bool held;       /* the parameters do not learn: they are compared with as they are */
    uint8_t verdict; /* so far */
} evidence_block_t;

/* Judges the block, from the scores that are pending. */
void evidence_end_block(evidence_t *evidence, const cdkf_t *cdkf, const evidence_block_t *block);

/* The faults that the evidence shows as, after it. */
void evidence_show(evidence_t *evidence);

/* A correction that the block has taught. Returns true when the pilot has changed. */
bool evidence_of_change(
    evidence_t *evidence, const cdkf_t *cdkf, const correction_t *correction, const evidence_block_t *block);

/* The pilot changed just now; `opened`: to another one. An arm that is not known yet does not grip anew. */
void evidence_begin_change(evidence_t *evidence, bool known, bool opened);

/* What was seen of the calibration does not count any more. */
void evidence_start_calibration(evidence_t *evidence);

/* How much torque the lever is moved by that nobody knows, 0 to 1: as far as innovations are larger than expected. */
float evidence_of_torque(const evidence_t *evidence);

/* The parameters learn again after they were held: what was compared with them begins anew. */
void evidence_resume(evidence_t *evidence);

#endif
