#include "bounce/mitigation.h"

#include "math/bounds.h"
#include "math/elapsed.h"
#include "math/share.h"
#include "math/trigonometry.h"

#include <math.h>
#include <string.h>

#define BAND_LOW 1.5f             /* [Hz] */
#define BAND_HIGH 8.0f            /* [Hz] */
#define OPENING_US 5.0e5f         /* [us] */
#define DAMPING_CLOSING_US 7.0e4f /* [us] */
#define SAME_US 22000u            /* a sensor that says the same for longer is stuck, */
#define SAME_LEAST 8u             /* if for so many samples more than */
#define SAME_USUAL 3u             /* times the most for which it did lately */
#define LETTING_GO 0.95f          /* of a correction that no model stands behind any more, what a sample leaves */
#define MOTION_MEMORY 0.5f        /* of how the lever moves [s] */
#define HELPS 0.7f                /* part of what is expected that is there: from here on the correction helps, */
#define UNEXPLAINED 0.5f          /* and below this it adds to the motion */
#define LIVELY 2.5e-5f            /* mean square of the rate from which on that can be told: (5 mrad/s)^2 */
#define LEFT_LEAST 2.25e-4f       /* mean square of an unexplained rate from which on it is taken: (15 mrad/s)^2, */
#define LEFT_PART 0.05f           /* and this part of the expected one */
#define WEIGHED_EVERY 8u          /* samples */
#define SLOW 100.0f               /* squares of the frequencies below which it is the pilot's own, */
#define SLOW_TURN 10.0f           /* the root of that [rad/s] */
#define FAST 230.0f               /* and above which it is not: 1.6 and 2.4 Hz [rad^2/s^2] */
#define FASTEST 2500.0f           /* 8 Hz */
#define NOTCH_TURN_MOST 0.8f      /* corner of the notch times a sample period, up to which it is stable */
#define FILTER_PERIOD_MOST 0.02f  /* of a filter's step [s] */
#define SILENCE_MOST 0.1f         /* without a sample, until the filters begin anew [s] */

static bool has_notch(uint8_t mitigation)
{
    return mitigation >= (uint8_t)LEVER_MITIGATION_NOTCH;
}

static bool has_correction(uint8_t mitigation)
{
    return mitigation > (uint8_t)LEVER_MITIGATION_DAMPING;
}

/* --- gate --------------------------------------------------------------------------------------------------------- */

static void fade(float *weight, bool on, float elapsed_us)
{
    const float next = *weight + (on ? (elapsed_us / OPENING_US) : -(elapsed_us / DAMPING_CLOSING_US));
    *weight = lesser(greater(next, 0.0f), 1.0f);
}

/* Time has passed with all as it was; when the sensors have been away for too long by now, it has been fading since. */
static void age(mitigation_t *mitigation, uint32_t elapsed_us)
{
    mitigation->sensed_left = time_left(mitigation->sensed_left, elapsed_us);
    mitigation->open = mitigation->open && (mitigation->sensed_left != 0u);
    if (!mitigation->open) {
        fade(&mitigation->weight, false, (float)elapsed_us);
        fade(&mitigation->damping_weight, false, (float)elapsed_us);
    }
}

/* A sensor is stuck. A coarse one in a quiet cabin says the same again and again: how long it usually does is learnt, and
 * forgotten by a sample each time that `forgets`. */
static bool is_stuck(mitigation_reading_t *reading, bool same, uint32_t elapsed_us, bool forgets)
{
    const uint32_t most = SAME_LEAST + (SAME_USUAL * reading->longest);
    if (!same) {
        reading->longest = (uint8_t)greater_count(lesser_count(reading->same, most), reading->longest);
        reading->same = 0u;
    } else if (reading->same < UINT8_MAX) {
        reading->same++;
    } else {
        /* counted to the end */
    }
    if (forgets && (reading->longest > 0u)) {
        reading->longest--;
    }
    return (reading->same > most) && ((reading->same * elapsed_us) > SAME_US);
}

static void pass_gate(mitigation_t *mitigation, const mitigation_sample_t *sample)
{
    const bool sensed = sample->sensed && (sample->rated || !mitigation->rated);
    age(mitigation, time_left(sample->elapsed_us, mitigation->counted));
    mitigation->counted = 0u;
    mitigation->rated = mitigation->rated || sample->rated;
    if (sample->advances && sensed) {
        const uint32_t elapsed_us = sample->elapsed_us;
        const bool forgets = (mitigation->samples == 0u);
        const bool theta_stuck = is_stuck(&mitigation->theta, sample->same_theta, elapsed_us, forgets);
        const bool base_stuck = is_stuck(&mitigation->z_ddot, sample->same_z_ddot, elapsed_us, forgets);
        mitigation->samples++;
        mitigation->sensed_left = (theta_stuck || base_stuck) ? 0u : (sample->silence_us + 1u);
    }
    mitigation->open = sample->advances && sample->permitted && (mitigation->sensed_left != 0u);
    if (mitigation->open) {
        const uint32_t period_us = lesser_count(sample->elapsed_us, sample->silence_us);
        const bool as_chosen =
            has_correction(sample->mitigation) && (mitigation->notches == has_notch(sample->mitigation));
        fade(&mitigation->weight, as_chosen, (float)period_us);
        fade(&mitigation->trust, mitigation->explained && sample->fits, (float)period_us);
        fade(&mitigation->damping_weight, mitigation_has_damping(sample->mitigation), (float)period_us);
    }
}

void mitigation_idle(mitigation_t *mitigation, uint32_t elapsed_us)
{
    age(mitigation, elapsed_us);
    mitigation->counted = time_sum(mitigation->counted, elapsed_us);
}

lever_correction_t mitigation_correction(const mitigation_t *mitigation)
{
    const lever_correction_t correction = {mitigation->weight * mitigation->correction, mitigation->weight};
    return correction;
}

/* --- filters ------------------------------------------------------------------------------------------------------ */

/* At the square root of both corners, where bounce is, it has no phase; everywhere it is within 90 degrees of the
 * signal, so that torque against it takes energy from the lever. */
static float pass_band(mitigation_band_t *band, float value, float period)
{
    band->low_pass += ((TURN * BAND_HIGH) * period) * (value - band->low_pass); /* about once at most */
    band->level += ((TURN * BAND_LOW) * period) * (band->low_pass - band->level);
    return band->low_pass - band->level;
}

/* What a notch takes away, with gain 1 at its frequency; `turn`: that in radians a step. */
static float pass_notch(mitigation_notch_t *notch, float value, float turn, float damping)
{
    const float bounded = lesser(turn, NOTCH_TURN_MOST);
    notch->band_pass += bounded * ((value - notch->low_pass) - (damping * notch->band_pass));
    notch->low_pass += bounded * notch->band_pass;
    return damping * notch->band_pass;
}

static float between_0_and_1(float value)
{
    return lesser(greater(value, 0.0f), 1.0f);
}

/* Of the rate in the band, whether what the estimated arm makes of base and motor is there. Other motion does not count:
 * it has nothing in common with that. */
static void compare(mitigation_t *mitigation, float moved, float expected, float period)
{
    const float share = share_of(period, MOTION_MEMORY);
    mitigation->expected_square += share * ((expected * expected) - mitigation->expected_square);
    mitigation->product += share * ((moved * expected) - mitigation->product);
    if (mitigation->expected_square > LIVELY) {
        const float least = mitigation->explained ? UNEXPLAINED : HELPS;
        mitigation->explained = (mitigation->product > (least * mitigation->expected_square));
    }
}

/* About which frequency most of what is left is, by the mean squares of rate and angle, and how much of it a notch there
 * is to take: none where it is quiet, or as slow as the pilot's own. */
static void weigh(mitigation_rest_t *rest, float usual)
{
    const float turn_square = rest->rate_square / greater(rest->square, LEFT_LEAST / FASTEST);
    rest->turn = sqrtf(lesser(greater(turn_square, SLOW), FASTEST));
    rest->weight =
        between_0_and_1((rest->rate_square / usual) - 1.0f) * between_0_and_1((turn_square - SLOW) / (FAST - SLOW));
}

/* Takes that away. */
static float take_rest(mitigation_rest_t *rest, float left, float period, float share, float damping)
{
    const float rise = (TURN * BAND_HIGH) * (left - rest->band.low_pass);
    const float angle = pass_band(&rest->band, left, period);
    const float rate = rise - ((TURN * BAND_LOW) * angle);
    rest->square += share * ((angle * angle) - rest->square);
    rest->rate_square += share * ((rate * rate) - rest->rate_square);
    return left - (rest->weight * pass_notch(&rest->notch, left, rest->turn * period, damping));
}

/* Nothing of an angle [rad] at which the lever stands. */
static void start_rest(mitigation_t *mitigation, float theta)
{
    const mitigation_rest_t none = {.band = {theta, theta}, .notch = {.low_pass = theta}, .turn = SLOW_TURN};
    for (uint32_t i = 0u; i < (uint32_t)MITIGATION_RESTS; i++) {
        mitigation->rest[i] = none;
    }
}

/* --- a sample ----------------------------------------------------------------------------------------------------- */

/* Begins with the base as it is now, and nothing known of how the lever moves. */
static void start(mitigation_t *mitigation, const mitigation_sample_t *sample)
{
    const mitigation_t none = {.rated = mitigation->rated, .sensed_left = mitigation->sensed_left};
    *mitigation = none;
    involuntary_start(&mitigation->involuntary, sample->step.z_ddot);
    start_rest(mitigation, sample->theta);
}

/* The angle to take away. */
static float angle_of(
    mitigation_t *mitigation, const lever_settings_t *settings, const mitigation_sample_t *sample, float period)
{
    float angle = 0.0f;
    if (mitigation->notches) {
        const float turn = sqrtf(sample->dynamics->stiffness) * period;
        angle = pass_notch(&mitigation->notch, sample->theta, turn, 2.0f * settings->notch_damping_ratio);
    } else {
        const float involuntary = mitigation->trust * mitigation->involuntary.theta;
        const float damping = 2.0f * settings->notch_damping_ratio;
        const float share = share_of(period, MOTION_MEMORY);
        const float unexplained = sample->theta - involuntary;
        float left = unexplained;
        for (uint32_t i = 0u; i < (uint32_t)MITIGATION_RESTS; i++) {
            left = take_rest(&mitigation->rest[i], left, period, share, damping);
        }
        if ((mitigation->samples % WEIGHED_EVERY) == 0u) {
            const float usual = LEFT_LEAST + (LEFT_PART * mitigation->expected_square);
            weigh(&mitigation->rest[0], usual);
            weigh(&mitigation->rest[1], usual);
        }
        angle = (mitigation->trust * involuntary_angle(&mitigation->involuntary, settings->correction_delay)) +
                (unexplained - left);
    }
    return angle;
}

/* While nothing is corrected, the other of notch and cancellation may take over. */
static void choose(mitigation_t *mitigation, const mitigation_sample_t *sample)
{
    if (mitigation->weight <= 0.0f) {
        if (mitigation->notches) {
            start_rest(mitigation, sample->theta);
        }
        mitigation->notches = has_notch(sample->mitigation);
        mitigation->notch.low_pass = sample->theta;
        mitigation->notch.band_pass = 0.0f;
    }
}

/* The motor's torque is that of the identification dither, and against the lever's rate. The arm takes it as if it were
 * against the involuntary rate: so it is damped as the lever is, and the lever's own motion stays out of it. */
static void advance(mitigation_t *mitigation, const lever_settings_t *settings, const mitigation_sample_t *sample)
{
    const float period = lesser(sample->step.period, FILTER_PERIOD_MOST);
    model_step_t step = sample->step;
    step.tau_m += sample->drive * (mitigation->expected_damping - mitigation->damping);
    const bool stable = involuntary_step(
        &mitigation->involuntary, sample->dynamics, sample->constants, &step, settings->cancellation_corner);
    const float moved = pass_band(&mitigation->moved, sample->theta_dot, period);
    const float expected = pass_band(&mitigation->expected, mitigation->involuntary.theta_dot, period);
    compare(mitigation, moved, expected, period);
    const float gain = mitigation->damping_weight * settings->damping_gain;
    mitigation->damping = -clamped(gain * moved, settings->damping_limit);
    mitigation->expected_damping = -clamped(gain * expected, settings->damping_limit);
    choose(mitigation, sample);
    if (stable) {
        mitigation->correction = -clamped(angle_of(mitigation, settings, sample, period), settings->correction_limit);
    } else {
        mitigation->explained = false;
        mitigation->correction *= LETTING_GO;
    }
}

bool mitigation_step(mitigation_t *mitigation, const lever_settings_t *settings, const mitigation_sample_t *sample)
{
    pass_gate(mitigation, sample);
    if (!mitigation->started || (sample->step.period > SILENCE_MOST)) { /* then all has faded */
        start(mitigation, sample);
    } else if (sample->advances) {
        advance(mitigation, settings, sample);
    } else { /* no time has passed, and the torque gate is closed */
        mitigation->damping = 0.0f;
        mitigation->expected_damping = 0.0f;
    }
    mitigation->started = (sample->mitigation != (uint8_t)LEVER_MITIGATION_NONE) || (mitigation->weight > 0.0f) ||
                          (mitigation->damping_weight > 0.0f);
    return mitigation->started;
}
