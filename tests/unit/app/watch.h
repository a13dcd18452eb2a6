/* Watches torque over time, in steps of 100 us, for the limits of the gate. */
#ifndef UNIT_APP_WATCH_H
#define UNIT_APP_WATCH_H

#include "lever_cdkf.h"
#include "test.h"

#include <math.h>
#include <string.h>

enum { WINDOW = 10000 }; /* of 1 s */

typedef struct watch {
    const lever_settings_t *settings;
    float last;
    bool open;
    double square[WINDOW];
    double sum;
    uint32_t at;
    uint32_t held_us;
} watch_t;

static watch_t watch;

static inline void watch_start(const lever_settings_t *settings)
{
    (void)memset(&watch, 0, sizeof watch);
    watch.settings = settings;
}

/* The torque was `watch.last` for so long, and is `torque` now. A gate that closes, or was closed for a
 * moment, may be faster than torque_slew. */
static inline void watch_torque(float torque, uint32_t elapsed_us, bool open)
{
    const lever_settings_t *s = watch.settings;
    watch.held_us += elapsed_us;
    for (; watch.held_us >= 100u; watch.held_us -= 100u) {
        watch.sum -= watch.square[watch.at];
        watch.square[watch.at] = (double)watch.last * (double)watch.last;
        watch.sum += watch.square[watch.at];
        watch.at = (watch.at + 1u) % (uint32_t)WINDOW;
    }
    const double rms = sqrt(fmax(watch.sum, 0.0) / (double)WINDOW);
    const bool stayed_open = open && watch.open && (elapsed_us <= 20000u);
    const float slew = stayed_open ? s->torque_slew : fmaxf(s->torque_slew, s->torque_limit / 0.04f);
    TEST_ASSERT_TRUE(fabsf(torque) <= s->torque_limit);
    TEST_ASSERT_TRUE(fabsf(torque - watch.last) <= ((slew * 1.0e-6f * (float)elapsed_us) * 1.005f) + 1.0e-6f);
    TEST_ASSERT_TRUE(rms <= (((double)s->torque_rms * 1.0001) + 1.0e-6));
    watch.last = torque;
    watch.open = open;
}

#endif
