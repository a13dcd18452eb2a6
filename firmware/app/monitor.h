/* Whether a signal can be believed although its sender calls it valid.
 *
 *   stuck    it has not changed by a bit for a while, and the innovations say that it should have. For the base
 *            acceleration, which innovations tell late, it is enough that it did change all the time before
 *   spike    an output far outside of what is expected of it, for some samples; a longer one is believed
 *   jump     an input far outside of how it usually changes from sample to sample, likewise
 *   base     the response to the base acceleration is not about once what it should be: no sensor, the wrong sign, the
 *            wrong unit. By the innovations: a sudden error of the accelerometer's gain (filter/cdkf.h, score_t)
 *   torque   the motor torque that is measured does not follow the one that is asked for: gain or sign are wrong, or the
 *            motor does not do what it is told. By regression on what is asked; other torque makes it less sure
 */
#ifndef APP_MONITOR_H
#define APP_MONITOR_H

#include "filter/cdkf.h"

#include <stdbool.h>
#include <stdint.h>

enum monitor_signal { MONITOR_THETA, MONITOR_THETA_DOT, MONITOR_Z_DDOT, MONITOR_SIGNALS };

typedef struct stillness {
    float now;       /* value of the last sample, */
    float before;    /* and of the last one of the block before */
    uint8_t same;    /* blocks for which it has been that */
    uint8_t changes; /* blocks since then in which it has changed, up to ALIVE */
    bool seen;       /* in this block */
    bool stuck;
} stillness_t;

/* Of the measured torque with the one that was asked for: sums over samples, with exponential forgetting. */
typedef struct agreement {
    float asked;    /* squares [N^2 m^2] */
    float measured; /* likewise */
    float product;
} agreement_t;

#define MONITOR_JUMP_COUNTED 0.0625f /* part of its limit that a jump counts as: it hardly raises the mean */

enum monitor_input { MONITOR_BASE, MONITOR_TORQUE, MONITOR_INPUTS };

/* How an input changes from sample to sample. */
typedef struct jump {
    float limit;   /* square of the change that is a jump */
    float sum;     /* squares of the changes in this block; that of a jump counts as less */
    float refused; /* time for which samples have been jumps [s] */
} jump_t;

typedef struct monitor {
    stillness_t stillness[MONITOR_SIGNALS];
    float refused[CDKF_OUTPUTS]; /* time for which samples of an output have been spikes [s] */
    jump_t jump[MONITOR_INPUTS];
    float surprise; /* mean of nis / nis_size over 0.1 s; expected 1 */
    score_t base;   /* of CDKF_BASE_GAIN, with exponential forgetting */
    agreement_t torque;
    bool base_wrong; /* the base acceleration is not used */
    bool torque_wrong;
} monitor_t;

void monitor_start(monitor_t *monitor);

/* A value that its sender calls valid; true when it is not stuck. */
static inline bool monitor_is_alive(monitor_t *monitor, enum monitor_signal signal, float value)
{
    stillness_t *of = &monitor->stillness[signal];
    of->now = value;
    of->seen = true;
    return !of->stuck;
}

/* One sample in MONITOR_TORQUE_EVERY says enough. */
enum monitor_limits { MONITOR_TORQUE_EVERY = 8 };
static inline bool monitor_takes_torque(uint32_t samples)
{
    return (samples % (uint32_t)MONITOR_TORQUE_EVERY) == 0u;
}

/* A motor torque that its sender calls valid, and the one that was asked for before it [N m]. */
static inline void monitor_add_torque(monitor_t *monitor, float asked, float measured)
{
    agreement_t *torque = &monitor->torque;
    torque->asked += asked * asked;
    torque->measured += measured * measured;
    torque->product += asked * measured;
}

/* After a block of `period` seconds of samples `sample_period` apart: true when the torque has just been found wrong. */
bool monitor_judge_torque(monitor_t *monitor, float period, float sample_period);

/* Before the next sample: its value would be that of the last. */
static inline bool monitor_repeats(const monitor_t *monitor, enum monitor_signal signal, float value)
{
    const float last = monitor->stillness[signal].now;
    return !((value < last) || (value > last));
}

/* At the end of a block: true when a signal has just been found stuck. */
bool monitor_has_just_stuck(monitor_t *monitor);

/* Output i of the coming measurement update, `elapsed` seconds after the last; true when it is a spike. Innovations are
 * now `level` times as large as expected, in squares. */
bool monitor_is_spike(monitor_t *monitor, const cdkf_t *cdkf, uint32_t i, float y, float level, float elapsed);

/* A jump, or the first sample after some: true when what was believed before is better. */
bool monitor_hold_input(jump_t *of, bool far, float elapsed);

/* An input that has changed by `change` since it was believed last, `elapsed` seconds after the last sample; true when
 * it is a jump, and what was believed last is better. */
static inline bool monitor_is_jump(monitor_t *monitor, enum monitor_input input, float change, float elapsed)
{
    jump_t *of = &monitor->jump[input];
    const float square = change * change;
    const bool far = square > of->limit;
    of->sum += far ? (MONITOR_JUMP_COUNTED * of->limit) : square;
    bool held = false;
    if (far || (of->refused > 0.0f)) {
        held = monitor_hold_input(of, far, elapsed);
    }
    return held;
}

/* After a block of `period` seconds of samples `sample_period` apart: how inputs usually change. */
void monitor_end_jumps(monitor_t *monitor, float period, float sample_period);

/* Any signal is stuck. */
bool monitor_has_stuck(const monitor_t *monitor);

/* After the update: nis / nis_size of the sample. */
void monitor_add(monitor_t *monitor, float ratio, float elapsed);

/* After a block of `period` seconds: judges the base. True when it has just been found wrong. */
bool monitor_step(monitor_t *monitor, const score_t *sudden, float period);

/* Forgets what was seen of the base: the arm has changed, or is not known yet. */
void monitor_trust_base(monitor_t *monitor);

#endif
