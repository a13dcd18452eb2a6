#include "app/hands.h"
#include "math/bounds.h"
#include "math/share.h"

#include <string.h>

#define BLOCK 0.038f /* [s]: two blocks of learning. In less, the noise of theta_dot is a good part of the change */
#define HANDS_MEMORY 0.16f /* [s] */

void hands_start(hands_t *hands)
{
    (void)memset(hands, 0, sizeof *hands);
    hands->residual = 1.0f;
}

void hands_begin(hands_t *hands)
{
    hands->begin = 0.0f;
    hands->impulse = 0.0f;
    hands->drive = 0.0f;
    hands->elapsed = 0.0f;
    hands->idle = false;
}

float hands_predict(
    hands_t *hands, const model_constants_t *constants, const model_step_t *step, const float x[MODEL_STATES])
{
    const float acceleration = constants->trim ? step->z_ddot : (step->z_ddot + MODEL_GRAVITY);
    const float rest = constants->trim ? 0.0f : constants->lever_preload_angle;
    const float base = (constants->length * constants->mass_moment) * (step->trim_cosine * acceleration);
    const float own = (constants->damping * x[1]) + (constants->stiffness * (x[0] - rest));
    const float drive = step->period * (step->tau_m - base);
    const float impulse = drive - (step->period * own);
    hands->drive += drive;
    hands->impulse += impulse;
    return impulse;
}

hands_block_t hands_step(hands_t *hands, const model_constants_t *constants, float theta_dot, float period, bool counts)
{
    hands_block_t block = {.length = 0.0f};
    hands->elapsed += period;
    hands->idle = hands->idle || !counts;
    if (hands->elapsed > BLOCK) {
        const float change = theta_dot - hands->begin;
        const float residual = change - (hands->impulse / constants->inertia);
        if (!hands->idle) {
            const float share = share_of(hands->elapsed, HANDS_MEMORY);
            hands->change += share * ((change * change) - hands->change);
            hands->residual += share * ((residual * residual) - hands->residual);
        }
        block.length = hands->elapsed;
        block.of_hand = residual * constants->inertia;
        block.driven = hands->drive;
        block.counted = !hands->idle;
        hands->begin = theta_dot;
        hands->impulse = 0.0f;
        hands->drive = 0.0f;
        hands->elapsed = 0.0f;
        hands->idle = false;
    }
    return block;
}

float hands_statistic(const hands_t *hands)
{
    return hands->change / greater(hands->residual, 1.0e-9f);
}
