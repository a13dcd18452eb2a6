#include "app/grip_force.h"

#include "math/bounds.h"
#include "math/share.h"

#include <math.h>
#include <string.h>

#if LEVER_GRIP_FORCE

#define GRIP_FORCE_MEMORY 10.0f /* of the comparison, and of the mean square [s] */
#define GRIP_FORCE_MIN 2.0f     /* before the comparison says that it is wrong [s] */
#define TOLERATED 0.2f          /* what the lever's own equation may be off */
#define SURE 2.0f               /* standard deviations of the comparison */
#define WALK_MIN 1e-3f          /* q [1/sqrt(s)] */

/* Takes a valid force, or notes that it is missing. After an outage its level is a guess. */
static void receive(grip_force_t *grip, const setup_t *setup, trim_t *trim, const float *force, float period)
{
    if (force != NULL) {
        const bool starts = !grip->seen || (grip->missing > TRIM_OUTAGE);
        grip->raw = (*force - setup->settings->grip_force_bias) / setup->settings->grip_force_gain;
        grip->seen = true;
        grip->missing = 0.0f;
        if (starts) {
            trim_start_input(trim, TRIM_GRIP_FORCE, grip->raw);
            grip->settling = trim->deviations ? trim_settling_time(trim) : 0.0f;
            grip->right = false;
            (void)memset(&grip->means, 0, sizeof grip->means);
        }
    } else {
        grip->missing += period;
    }
}

/* Standard deviation of a force over a step, its gain error included. */
static float noise_of(const grip_force_t *grip, const lever_settings_t *s, float period)
{
    const float gain = s->grip_force_gain_sigma;
    const float walk = greater(s->k_p_walk, WALK_MIN);
    const float relative = (gain * gain) / walk; /* root of the density */
    return sqrtf((s->grip_force_noise * s->grip_force_noise) + (grip->square * ((relative * relative) / period)));
}

/* What the filter takes of a mean force over a step. */
static void look(const grip_force_t *grip, const setup_t *setup, const model_step_t *step, float force, float alone,
    const float error[CDKF_CONSIDERED], cdkf_grip_t *seen)
{
    const model_constants_t *constants = &setup->constants;
    const float torque = step->period / constants->inertia;
    const float base = -(constants->length * constants->mass_moment) * step->trim_cosine;
    seen->change = (alone + (step->period * (constants->length * force))) / constants->inertia;
    seen->noise = (torque * constants->length) * noise_of(grip, setup->settings, step->period);
    seen->torque = torque;
    seen->own[0] = torque * constants->stiffness;
    seen->own[1] = torque * constants->damping;
    seen->error[CDKF_STEP] = 0.0f; /* of the hand's torque, which moves the lever through the force */
    for (uint32_t c = 0u; c < (uint32_t)CDKF_CALIBRATION; c++) {
        seen->error[c] = (torque * ((c <= (uint32_t)CDKF_BASE_DELAY) ? base : 1.0f)) * error[c];
    }
}

bool grip_force_step(grip_force_t *grip, const setup_t *setup, trim_t *trim, const float *force,
    const model_step_t *step, float alone, const float error[CDKF_CONSIDERED], cdkf_grip_t *seen)
{
    const float period = step->period;
    receive(grip, setup, trim, force, period);
    const bool known = (force != NULL) && grip_force_is_used(grip);
    if (grip->seen) {
        float now = grip->raw;
        trim_inputs(trim, &now, TRIM_GRIP_FORCE, 1u, period);
        grip->impulse += (period * setup->constants.length) * now;
        grip->square += share_of(period, GRIP_FORCE_MEMORY) * ((now * now) - grip->square);
        grip->settling -= period;
        if (known) {
            look(grip, setup, step, now, alone, error, seen);
        }
    }
    return known;
}

/* Compares the impulses that sensor and motion say of the hand. Both are multiplied by the drive, which no noise is in:
 * torque that nobody knows moves lever and force differently. */
static float compare(grip_force_t *grip, const lever_settings_t *s, const hands_block_t *hands)
{
    grip_comparison_t *means = &grip->means;
    means->time += (means->time < GRIP_FORCE_MEMORY) ? hands->length : 0.0f;
    const float share = hands->length / means->time; /* a mean first, and then one with exponential forgetting */
    const float difference = grip->impulse - hands->of_hand;
    means->measured += share * ((grip->impulse * hands->driven) - means->measured);
    means->expected += share * ((hands->of_hand * hands->driven) - means->expected);
    means->drive_square += share * ((hands->driven * hands->driven) - means->drive_square);
    means->difference_square += share * ((difference * difference) - means->difference_square);
    const float limit = ((2.0f * s->grip_force_gain_sigma) + TOLERATED) * fabsf(means->expected);
    const float off = fabsf(means->measured - means->expected);
    const float sure = SURE * sqrtf(means->drive_square * (means->difference_square * share));
    grip->right = ((off + sure) < limit);
    const float away = (means->time > GRIP_FORCE_MIN) ? (off / greater(limit + sure, 1.0e-9f)) : 0.0f;
    grip->wrong = grip->wrong || (away > 1.0f);
    return away;
}

bool grip_force_judge(grip_force_t *grip, const setup_t *setup, const hands_block_t *hands, float *away)
{
    bool compared = false;
    if (hands->length > 0.0f) {
        if (hands->counted && grip->seen && (grip->missing < TRIM_OUTAGE) && (grip->settling <= 0.0f)) {
            *away = compare(grip, setup->settings, hands);
            compared = true;
        }
        grip->impulse = 0.0f;
    }
    return compared;
}

#else

bool grip_force_step(grip_force_t *grip, const setup_t *setup, trim_t *trim, const float *force,
    const model_step_t *step, float alone, const float error[CDKF_CONSIDERED], cdkf_grip_t *seen)
{
    (void)grip;
    (void)setup;
    (void)trim;
    (void)force;
    (void)step;
    (void)alone;
    (void)error;
    (void)seen;
    return false;
}

bool grip_force_judge(grip_force_t *grip, const setup_t *setup, const hands_block_t *hands, float *away)
{
    (void)grip;
    (void)setup;
    (void)hands;
    (void)away;
    return false;
}

#endif
