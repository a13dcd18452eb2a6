#include "app/setup.h"

#include "math/bounds.h"
#include "math/trigonometry.h"

#include <stddef.h>

#define DELAY_WHOLE 0.99f /* a delay is rounded up, but for a hundredth of a sample */
#define WALK_MAX 1.0e4f   /* of w, in squares: more does nothing, as its standard deviation is capped [1/s] */

const model_t *setup_model(uint8_t model)
{
    static const model_t *const models[LEVER_MODEL_COUNT] = {
        &model_lever, &model_linear_physical, &model_linear_black_box, &model_hand};
    return (model < (uint8_t)LEVER_MODEL_COUNT) ? models[model] : NULL;
}

void setup_choose(setup_t *setup)
{
    const lever_settings_t *s = setup->settings;
    model_constants_t *constants = &setup->constants;
    const float mass_moment = s->lever_mass_position * s->lever_mass;
    constants->length = s->lever_length;
    constants->length_squared = s->lever_length * s->lever_length;
    constants->mass_moment = mass_moment;
    constants->inertia = (s->lever_mass_position * mass_moment * constants->length_squared) + s->lever_inertia;
    constants->damping = s->lever_damping;
    constants->stiffness = s->lever_stiffness;
    constants->arm_preload_sine = sine_cosine(s->arm_preload_angle).sine;
    constants->lever_preload_angle = s->lever_preload_angle;
    constants->hand_inertia = constants->inertia + (constants->length_squared * s->m_p);
    constants->trim = (setup->preload == (uint8_t)LEVER_PRELOAD_TRIM);
    setup->base_scale = 1.0f / s->z_ddot_gain;
    setup->torque_scale = 1.0f / s->tau_m_gain;
    const float delay = s->z_ddot_delay / s->sample_period;
    setup->delay_samples = (uint8_t)(delay + DELAY_WHOLE);
    setup->delay_rest = greater((float)setup->delay_samples - delay, 0.0f);
    const bool seated = (setup->model == (uint8_t)LEVER_MODEL_LEVER) && (s->seat_frequency > 0.0f);
    const float seat = seated ? (TURN * s->seat_frequency) : 0.0f;
    constants->seat_stiffness = seat * seat;
    constants->seat_damping = 2.0f * (s->seat_damping_ratio * seat);
    setup->model_in_use = seated ? &model_lever_on_seat : setup_model(setup->model);
}

/* The rows of lever_settings.def that a model uses. */
typedef struct rows {
    prior_t prior;
    float walk[MODEL_PARAMETERS];
} rows_t;

static rows_t rows_of(const setup_t *setup)
{
    const lever_settings_t *s = setup->settings;
    rows_t rows;
    if (setup->model == (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL) {
        rows = (rows_t){{{s->m, s->c, s->k}, {s->m_sigma, s->c_sigma, s->k_sigma}}, {s->m_walk, s->c_walk, s->k_walk}};
    } else if (setup->model == (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX) {
        rows = (rows_t){{{s->a21, s->a22, s->b21}, {s->a21_sigma, s->a22_sigma, s->b21_sigma}},
            {s->a21_walk, s->a22_walk, s->b21_walk}};
    } else if (setup->model == (uint8_t)LEVER_MODEL_HAND) {
        rows = (rows_t){{{s->k_hand, s->c_hand, s->c_space}, {s->k_hand_sigma, s->c_hand_sigma, s->c_space_sigma}},
            {s->k_hand_walk, s->c_hand_walk, s->c_space_walk}};
    } else {
        rows = (rows_t){{{s->m_p, s->c_p, s->k_p}, {s->m_p_sigma, s->c_p_sigma, s->k_p_sigma}},
            {s->m_p_walk, s->c_p_walk, s->k_p_walk}};
    }
    return rows;
}

prior_t setup_prior(const setup_t *setup)
{
    return rows_of(setup).prior;
}

adaptation_t setup_adaptation(const setup_t *setup)
{
    const lever_settings_t *s = setup->settings;
    const rows_t rows = rows_of(setup); /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    adaptation_t adaptation = {.kind = setup->adaptation,
        .ceiling = s->walk_ceiling * s->walk_ceiling,
        .annealing_time = s->annealing_time,
        .averaging_time = s->robbins_monro_time,
        .memory = s->robbins_monro_memory,
        .forgetting_time = s->forgetting_time};
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        /* of the scaled parameter w, see model/scaling.h */
        const float walk = setup->model_in_use->positive ? rows.walk[i] : (rows.walk[i] / rows.prior.sigma[i]);
        adaptation.floor[i] = lesser(walk * walk, WALK_MAX);
    }
    return adaptation;
}

noise_setting_t setup_noise(const setup_t *setup)
{
    const lever_settings_t *s = setup->settings;
    const noise_setting_t noise = {
        s->noise_window, s->noise_range, {s->theta_noise, s->theta_dot_noise}, s->theta_dot_process_noise};
    return noise;
}
