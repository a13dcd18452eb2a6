/* Whether a signal can be believed although its sender calls it valid.
 *
 *   stuck    it has not changed by a bit for a while, and the innovations say that it should have. For the base
 *            acceleration, which innovations tell late, it is enough that it did change all the time before
 *   spike    an output far outside of what is expected of it, for some samples; a longer one is believed
 *   base     the response to the base acceleration is not about once what it should be: no sensor, the wrong sign, the
 *            wrong unit. By the innovations: a sudden error of the accelerometer's gain (filter/cdkf.h, score_t)
 */
#ifndef APP_MONITOR_H
#define APP_MONITOR_H

#include "filter/cdkf.h"

#include <stdbool.h>

enum monitor_signal { MONITOR_THETA, MONITOR_THETA_DOT, MONITOR_Z_DDOT, MONITOR_SIGNALS };

typedef struct stillness {
    float last;      /* value */
    float unchanged; /* time for which it has been that [s] */
    uint8_t changes; /* since it was unchanged for long, up to what makes it alive */
    bool stuck;
} stillness_t;

typedef struct monitor {
    stillness_t stillness[MONITOR_SIGNALS];
    float refused[CDKF_OUTPUTS]; /* time for which samples of an output have been spikes [s] */
    float surprise;              /* mean of nis / nis_size over 50 ms; expected 1 */
    score_t base;                /* of CDKF_BASE_GAIN, with exponential forgetting */
    bool base_wrong;             /* the base acceleration is not used */
    bool had_stuck;              /* a signal was, at the end of the last block */
} monitor_t;

void monitor_start(monitor_t *monitor);

/* A value after `elapsed` seconds; true when it is stuck. */
bool monitor_is_stuck(monitor_t *monitor, enum monitor_signal signal, float value, float elapsed);

/* Output i of the coming measurement update, `elapsed` seconds after the last; true when it is a spike. Innovations are
 * now `level` times as large as expected, in squares. */
bool monitor_is_spike(monitor_t *monitor, const cdkf_t *cdkf, uint32_t i, float y, float level, float elapsed);

/* Any signal is stuck. */
bool monitor_has_stuck(const monitor_t *monitor);

/* After the update: nis / nis_size of the sample. */
void monitor_add(monitor_t *monitor, float ratio, float elapsed);

/* After a block of `period` seconds: judges the base. True when it has just been found wrong. */
bool monitor_step(monitor_t *monitor, const score_t *sudden, float period);

/* Forgets what was seen of the base: the arm has changed, or is not known yet. */
void monitor_trust_base(monitor_t *monitor);

#endif
