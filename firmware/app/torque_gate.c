#include "app/torque_gate.h"

#include "math/bounds.h"
#include "math/elapsed.h"

#include <math.h>
#include <string.h>

#define KEEP_ALIVE_US 1000000u     /* torque ends so long after the last accepted command */
#define TORQUE_SILENCE_US 20000u   /* without a sample it ends after this, */
#define TORQUE_SILENCE_PERIODS 3u  /* or so many sample periods, if that is longer */
#define IDLE_US 5000u              /* longest time from a sample to torque_gate_idle(), or the next sample */
#define TORQUE_CLOSING_US 40000.0f /* so that a step of the port's clock is left of 50 ms */
#define TORQUE_LEAST 1.0e-6f /* a fade is never slower than that of this torque: one of 1e-40 would not end [N m] */
#define TORQUE_MEMORY 0.25f  /* of the mean square [s], or in windows of torque_rms, of 1 s */
#define TORQUE_MEMORY_PER_US 4.0e-6f /* 1 / that, in us */
#define ROOM 0.2f                    /* part of square_most in which the amplitude falls, at least */

/* Room of the mean square below square_most in which the amplitude allowed falls from the limit to what may stay for
 * ever: wide enough that it falls no faster than torque_slew, and that the longest step leaves the mean square
 * below. */
static float room_of(const torque_gate_t *gate, float slew)
{
    const float beyond = gate->limit - gate->sustained;
    const float share = (float)gate->silence_us * TORQUE_MEMORY_PER_US;
    const float by_slew = (beyond * gate->limit * gate->limit) / (TORQUE_MEMORY * slew);
    const float by_step = (beyond * (gate->limit + gate->sustained) * share) / (1.0f - share);
    return greater(greater(by_slew, by_step), ROOM * gate->square_most);
}

void torque_gate_init(torque_gate_t *gate, const lever_settings_t *settings)
{
    (void)memset(gate, 0, sizeof *gate);
    const float fade_steps = settings->dither_fade / settings->sample_period;
    gate->period_us = microseconds_of(settings->sample_period);
    gate->silence_us = greater_count(TORQUE_SILENCE_PERIODS * gate->period_us, TORQUE_SILENCE_US);
    gate->limit = settings->torque_limit;
    gate->slew = settings->torque_slew * 1.0e-6f;
    gate->open_step = 1.0f / greater(fade_steps, 1.0f);
    gate->square_most = (settings->torque_rms * settings->torque_rms) / (1.0f + TORQUE_MEMORY);
    gate->sustained = sqrtf(gate->square_most);
    if (gate->limit > gate->sustained) {
        gate->amplitude_slope = (gate->limit - gate->sustained) / room_of(gate, settings->torque_slew);
    }
}

/* --- open or closed ----------------------------------------------------------------------------------------------- */

static bool is_fresh(const torque_gate_t *gate)
{
    return (gate->output_left != 0u) && (gate->command_left != 0u);
}

void torque_gate_close(torque_gate_t *gate)
{
    if (gate->open) {
        gate->open = false;
        gate->gain = 0.0f;
        gate->closing = greater(fabsf(gate->torque), TORQUE_LEAST) / TORQUE_CLOSING_US;
    }
}

/* Amplitude that keeps the mean square below square_most; 0 when a long time at one torque has it above. */
static float amplitude(const torque_gate_t *gate)
{
    return greater(gate->sustained + (gate->amplitude_slope * (gate->square_most - gate->mean_square)), 0.0f);
}

/* The torque of a closed gate after so much time more. */
static void fade(torque_gate_t *gate, uint32_t elapsed_us)
{
    const float left = fabsf(gate->torque) - (gate->closing * (float)elapsed_us);
    gate->torque = (left > 0.0f) ? clamped(gate->torque, lesser(left, amplitude(gate))) : 0.0f;
}

/* Time has passed with the torque as it was; what is too old by now closes the gate, and it has been fading since. */
static void age(torque_gate_t *gate, uint32_t elapsed_us)
{
    const float share = (float)elapsed_us * TORQUE_MEMORY_PER_US;
    gate->mean_square += lesser(share, 1.0f) * ((gate->torque * gate->torque) - gate->mean_square);
    gate->output_left = time_left(gate->output_left, elapsed_us);
    gate->command_left = time_left(gate->command_left, elapsed_us);
    if (!is_fresh(gate)) {
        torque_gate_close(gate);
    }
    if (!gate->open) {
        fade(gate, elapsed_us);
    }
}

/* --- limits ------------------------------------------------------------------------------------------------------- */

static void drive(torque_gate_t *gate, float asked, uint32_t elapsed_us)
{
    const uint32_t step_us = lesser_count(elapsed_us, gate->period_us);
    const float slew = gate->slew * (float)step_us;
    gate->gain = lesser(gate->gain + gate->open_step, 1.0f);
    const float wanted = is_finite(asked) ? clamped(gate->gain * asked, gate->limit) : 0.0f;
    const float highest = gate->torque + slew;
    const float lowest = gate->torque - slew;
    gate->torque = clamped(greater(lesser(wanted, highest), lowest), amplitude(gate));
}

void torque_gate_step(torque_gate_t *gate, float asked, const torque_sample_t *sample)
{
    const uint32_t unknown_us = greater_count(gate->period_us, IDLE_US);
    const uint32_t elapsed_us = time_left(sample->advances ? sample->elapsed_us : unknown_us, gate->counted);
    age(gate, elapsed_us);
    gate->counted = 0u;
    if (sample->advances && sample->measured) {
        gate->output_left = gate->silence_us + 1u;
    }
    gate->barred = gate->barred || sample->harmful;
    const bool may_open = sample->advances && sample->permitted && !gate->barred && is_fresh(gate);
    if (gate->open && may_open) {
        drive(gate, asked, sample->elapsed_us);
    } else if (gate->open) {
        torque_gate_close(gate);
        fade(gate, elapsed_us);
    } else {
        gate->open = may_open; /* to let torque through from the next sample on */
    }
}

void torque_gate_idle(torque_gate_t *gate, uint32_t elapsed_us)
{
    age(gate, elapsed_us);
    gate->torque = clamped(gate->torque, amplitude(gate));
    gate->counted = time_sum(gate->counted, elapsed_us);
}

void torque_gate_keep_alive(torque_gate_t *gate)
{
    gate->command_left = KEEP_ALIVE_US + 1u;
}

bool torque_gate_has_output(const torque_gate_t *gate)
{
    return gate->output_left != 0u;
}

void torque_gate_ask(torque_gate_t *gate, bool asks)
{
    if (asks && !gate->asked) {
        gate->barred = false; /* the next sample, before which nothing opens, bars it again if it is still harmful */
    }
    gate->asked = asks;
}

bool torque_gate_is_abandoned(const torque_gate_t *gate)
{
    return gate->command_left == 0u;
}
