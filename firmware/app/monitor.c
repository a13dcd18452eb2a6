#include "app/monitor.h"
#include "math/bounds.h"
#include "math/share.h"

#include <math.h>
#include <string.h>

#define STILL 4u             /* blocks without a change before it is stuck */
#define ALIVE 20u            /* blocks with a change before it is taken for granted */
#define SURPRISE 1.3f        /* of `surprise`; its standard deviation in flight is 0.07 */
#define SURPRISE_TIME 0.1f   /* [s] */
#define SURPRISE_MOST 100.0f /* of a single sample */
#define SPIKE 8.0f           /* standard deviations */
#define SPIKE_TIME 0.02f     /* longer than this it is no spike [s] */
#define JUMP_MEMORY 1.0f     /* of the mean square of changes [s] */
#define BASE_MEMORY 0.5f     /* [s] */
#define BASE_MEMORY_AGAIN 0.2f
#define BASE_WRONG 0.4f    /* gain of the base's response below which it is wrong, */
#define BASE_RIGHT 0.7f    /* and above which it is right again; wrong and right beyond 2 minus these, too */
#define BASE_SURE 0.1f     /* standard deviation of that gain up to which it counts, */
#define BASE_AGAIN 0.35f   /* and while it is wrong, when the state hardly follows the base */
#define TORQUE_MEMORY 0.5f /* [s] */
#define TORQUE_LEAST 4e-4f /* mean square of what is asked, from which on it says anything [N^2 m^2] */
#define TORQUE_OFF 0.35f   /* of the gain from one, */
#define TORQUE_AGAIN 0.25f /* and while it is wrong; */
#define TORQUE_SURE 1.6f   /* besides, times torque of other origin over what is asked, both rms */

/* Square of a jump that does no harm, by input [m^2/s^4], [N^2 m^2]. */
static const float jump_least[MONITOR_INPUTS] = {4.0f, 0.09f};

void monitor_start(monitor_t *monitor)
{
    (void)memset(monitor, 0, sizeof *monitor);
    monitor->jump[MONITOR_BASE].limit = jump_least[MONITOR_BASE];
    monitor->jump[MONITOR_TORQUE].limit = jump_least[MONITOR_TORQUE];
    monitor->surprise = 1.0f;
}

/* At the end of a block. */
static void watch(stillness_t *of, bool noisy, bool surprised)
{
    const bool changed = (of->now < of->before) || (of->now > of->before);
    of->before = of->now;
    const bool seen = of->seen;
    of->seen = false;
    if (!seen) { /* not sent, or not valid: nothing to say */
        of->same = 0u;
        of->stuck = false;
    } else if (changed) {
        of->same = 0u;
        of->stuck = false;
        if (of->changes < ALIVE) {
            of->changes++;
        }
    } else if (of->same < STILL) {
        of->same++;
    } else {
        of->stuck = of->stuck || surprised || (noisy && (of->changes == ALIVE));
        of->changes = 0u;
    }
}

bool monitor_has_stuck(const monitor_t *monitor)
{
    const stillness_t *of = monitor->stillness;
    return of[MONITOR_THETA].stuck || of[MONITOR_THETA_DOT].stuck || of[MONITOR_Z_DDOT].stuck;
}

bool monitor_is_spike(monitor_t *monitor, const cdkf_t *cdkf, uint32_t i, float y, float level, float elapsed)
{
    const float innovation = y - cdkf->x[i];
    const float square = (innovation * innovation) * (1.0f / (SPIKE * SPIKE));
    const float noise = cdkf->output_noise[i]; /* the least that the variance can be */
    const bool far = (square > (noise * noise)) && (square > (level * cdkf_output_variance(cdkf, i)));
    monitor->refused[i] = far ? (monitor->refused[i] + elapsed) : 0.0f;
    return far && (monitor->refused[i] < SPIKE_TIME);
}

bool monitor_hold_input(jump_t *of, bool far, float elapsed)
{
    of->refused = far ? (of->refused + elapsed) : 0.0f;
    return far && (of->refused < SPIKE_TIME);
}

void monitor_end_jumps(monitor_t *monitor, float period, float sample_period)
{
    const float share = share_of(period, JUMP_MEMORY);
    const float each = (SPIKE * SPIKE) * (sample_period / period);
    for (uint32_t i = 0u; i < (uint32_t)MONITOR_INPUTS; i++) {
        jump_t *of = &monitor->jump[i];
        of->limit += share * (((each * of->sum) + jump_least[i]) - of->limit);
        of->sum = 0.0f;
    }
}

void monitor_add(monitor_t *monitor, float ratio, float elapsed)
{
    const float share = lesser(elapsed * (1.0f / SURPRISE_TIME), 1.0f);
    monitor->surprise += share * (lesser(ratio, SURPRISE_MOST) - monitor->surprise);
}

bool monitor_has_just_stuck(monitor_t *monitor)
{
    const bool before = monitor_has_stuck(monitor);
    const bool surprised = (monitor->surprise > SURPRISE);
    for (uint32_t i = 0u; i < (uint32_t)MONITOR_SIGNALS; i++) {
        watch(&monitor->stillness[i], i == (uint32_t)MONITOR_Z_DDOT, surprised);
    }
    return monitor_has_stuck(monitor) && !before;
}

bool monitor_step(monitor_t *monitor, const score_t *sudden, float period)
{
    const bool before = monitor->base_wrong;
    const float memory = before ? BASE_MEMORY_AGAIN : BASE_MEMORY;
    const float keep = 1.0f - share_of(period, memory);
    score_t *base = &monitor->base;
    base->vector = (keep * base->vector) + sudden->vector;
    base->information = (keep * base->information) + sudden->information;
    const float sure = before ? BASE_AGAIN : BASE_SURE;
    if ((base->information * (sure * sure)) > 1.0f) {
        const float gain = (before ? 0.0f : 1.0f) - (base->vector / base->information);
        const float away = fabsf(gain - 1.0f);
        monitor->base_wrong = (away > (1.0f - (before ? BASE_RIGHT : BASE_WRONG)));
    }
    if (monitor->base_wrong != before) {
        (void)memset(base, 0, sizeof *base);
    }
    return monitor->base_wrong && !before;
}

bool monitor_judge_torque(monitor_t *monitor, float period, float sample_period)
{
    agreement_t *torque = &monitor->torque;
    const bool before = monitor->torque_wrong;
    monitor->torque_wrong = false;
    if ((torque->asked * sample_period) > (TORQUE_LEAST * (TORQUE_MEMORY / (float)MONITOR_TORQUE_EVERY))) {
        const float gain = torque->product / torque->asked;
        const float other = (torque->measured / torque->asked) - (gain * gain); /* torque of other origin, in squares */
        const float sure = TORQUE_SURE * sqrtf(greater(other, 0.0f));
        monitor->torque_wrong = (fabsf(gain - 1.0f) > ((before ? TORQUE_AGAIN : TORQUE_OFF) + sure));
    }
    const float keep = 1.0f - share_of(period, TORQUE_MEMORY);
    torque->asked *= keep;
    torque->measured *= keep;
    torque->product *= keep;
    return monitor->torque_wrong && !before;
}

void monitor_trust_base(monitor_t *monitor)
{
    (void)memset(&monitor->base, 0, sizeof monitor->base);
    monitor->base_wrong = false;
}
