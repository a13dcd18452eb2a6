#include "flight.h"

#include <math.h>
#include <string.h>

#define INERTIA 0.0807f /* of the lever alone [kg m^2] */
#define LENGTH 0.45f    /* [m] */

static const arm_t alone = {.base = -3.14f, .torque = 12.4f, .stiffness = 62.0f, .damping = 6.2f};

static void hold(arm_t *arm, float stronger)
{
    arm->base = -2.0f;
    arm->torque = 1.6f;
    arm->stiffness = 483.6f * stronger;
    arm->damping = 13.2f * stronger;
}

static void let_go(arm_t *arm)
{
    arm->base = alone.base;
    arm->torque = alone.torque;
    arm->stiffness = alone.stiffness;
    arm->damping = alone.damping;
}

arm_t arm_start(uint32_t seed)
{
    arm_t arm = {.random = seed, .trim = FLIGHT_TRIM, .shaken = 1.0f, .driven = 1.0f, .noise = 1.0f};
    hold(&arm, 1.0f);
    arm.theta = FLIGHT_TRIM;
    return arm;
}

float arm_noise(arm_t *arm)
{
    arm->random = (1664525u * arm->random) + 1013904223u;
    return ((float)(int32_t)(arm->random >> 8) / 8388608.0f) - 1.0f;
}

uint32_t arm_random(arm_t *arm, uint32_t below)
{
    (void)arm_noise(arm);
    return (arm->random >> 8) % below;
}

static float acceleration(const arm_t *arm, const arm_t *held)
{
    return (held->base * arm->z_ddot) + (held->torque * arm->tau_m) - (held->stiffness * (arm->theta - arm->trim)) -
           (held->damping * arm->theta_dot);
}

lever_sample_t arm_sample(arm_t *arm, uint32_t ms)
{
    const float period = 1.0e-6f * (float)FLIGHT_PERIOD_US;
    arm->z_ddot += 0.05f * ((20.0f * arm->shaken * arm_noise(arm)) - arm->z_ddot);
    arm->tau_m += 0.05f * ((4.0f * arm->driven * arm_noise(arm)) - arm->tau_m);
    const float held = acceleration(arm, arm);
    arm->force = (INERTIA / LENGTH) * (held - acceleration(arm, &alone));
    arm->theta_dot += period * held;
    arm->theta += period * arm->theta_dot;
    return (lever_sample_t){.time_us = ms * FLIGHT_PERIOD_US,
        .theta = arm->theta + (1.0e-3f * arm->noise * arm_noise(arm)),
        .theta_dot = arm->theta_dot + (1.0e-2f * arm->noise * arm_noise(arm)),
        .tau_m = arm->tau_m,
        .z_ddot = arm->z_ddot,
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = true,
        .z_ddot_valid = true};
}

void draw_settings(lever_config_t *config, arm_t *arm)
{
    float *value = (float *)(void *)&config->settings; /* an array of them: lever_cdkf.h */
    const float wide = 0.5f + (0.5f * arm_noise(arm)); /* how far from the defaults, 0 to 1 */
    do {
        for (uint32_t i = 0u; i < lever_setting_count(); i++) {
            const lever_setting_t *row = lever_setting(i);
            const float part = arm_noise(arm) * wide;
            const float end = (part < 0.0f) ? row->least : row->greatest;
            const float cubed = fabsf(part) * part * part;
            value[i] = (i == 0u) ? row->value : (row->value + (cubed * (end - row->value)));
        }
    } while (lever_config_check(config) != NULL);
}

/* --- what happens to the arm -------------------------------------------------------------------------------------- */

static void grips(arm_t *arm, uint32_t ms)
{
    if (ms == 3000u) {
        hold(arm, 1.7f);
        arm->trim += 0.06f;
    } else if (ms == 4200u) { /* another change while the first is followed */
        hold(arm, 1.0f);
        arm->trim -= 0.04f;
    } else if (ms == 7000u) {
        hold(arm, 2.5f);
    } else {
        /* as before */
    }
}

static void stiffens(arm_t *arm, uint32_t ms)
{
    hold(arm, 1.0f + (1.0e-4f * (float)ms));
}

static void rests(arm_t *arm, uint32_t ms)
{
    const bool still = (ms >= 3000u) && (ms < 5500u);
    arm->shaken = still ? 0.0f : 1.0f;
    arm->driven = still ? 0.0f : 1.0f;
}

static void opens_hands(arm_t *arm, uint32_t ms)
{
    if ((ms == 3500u) || (ms == 6600u)) {
        let_go(arm);
    } else if (ms == 5500u) {
        hold(arm, 2.0f);
        arm->trim += 0.1f;
    } else if (ms == 6900u) {
        hold(arm, 1.0f);
    } else {
        /* as before */
    }
}

static void hits_bounds(arm_t *arm, uint32_t ms)
{
    hold(arm, (ms < 4000u) ? 7.0f : 0.05f);
}

static void shakes(arm_t *arm, uint32_t ms)
{
    arm->noise = (ms < 4000u) ? 12.0f : 1.0f;
    arm->shaken = ((ms / 500u) % 2u == 0u) ? 3.0f : 0.3f;
    arm->trim = FLIGHT_TRIM + ((((ms / 1300u) % 2u) == 0u) ? 0.05f : -0.05f);
}

/* --- what the sensors say of it ----------------------------------------------------------------------------------- */

static bool is_within(uint32_t ms, uint32_t begin, uint32_t end)
{
    return (ms >= begin) && (ms < end);
}

static bool pushes(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    (void)ms;
    sample->tau_m += 1.0f;
    sample->tau_m *= 0.5f;
    sample->z_ddot *= 1.3f;
    arm->theta_dot += 0.02f * arm_noise(arm);
    return true;
}

static bool loses(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    (void)arm;
    (void)sample;
    const bool gap = is_within(ms, 2000u, 2010u) || is_within(ms, 3000u, 3300u) || is_within(ms, 4000u, 4499u) ||
                     is_within(ms, 5000u, 5900u) || (is_within(ms, 1500u, 1900u) && ((ms % 3u) != 0u));
    return !gap;
}

static bool hides(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    (void)arm;
    sample->theta_valid = !(is_within(ms, 0u, 50u) || is_within(ms, 1500u, 2200u) || is_within(ms, 4000u, 4100u) ||
                            is_within(ms, 6000u, 7400u) || ((ms % 97u) == 0u));
    sample->theta_dot_valid = !(is_within(ms, 2500u, 3400u) || is_within(ms, 4000u, 4030u) ||
                                is_within(ms, 6100u, 7500u) || ((ms % 89u) == 0u));
    sample->tau_m_valid = !is_within(ms, 3000u, 4000u) && ((ms % 83u) != 0u);
    sample->z_ddot_valid = !(is_within(ms, 3500u, 3540u) || is_within(ms, 4600u, 5600u) || ((ms % 79u) == 0u));
    return true;
}

static bool sticks(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    sample->theta = is_within(ms, 2500u, 3200u) ? 0.36f : sample->theta;
    sample->theta_dot = is_within(ms, 4000u, 4600u) ? 0.05f : sample->theta_dot;
    sample->z_ddot = is_within(ms, 5500u, 6300u) ? 0.4f : sample->z_ddot;
    sample->z_ddot *= is_within(ms, 7000u, 7600u) ? (1.0f + arm_noise(arm)) : 1.0f;
    return true;
}

static bool lies(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    (void)arm;
    sample->z_ddot *= is_within(ms, 3000u, 5500u) ? -1.0f : 1.0f;
    sample->z_ddot *= (ms >= 7000u) ? 2.2f : 1.0f;
    return true;
}

static bool spikes(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    const uint32_t at = ms % 400u;
    sample->theta += (at == 7u) ? 0.3f : 0.0f;
    sample->theta_dot += ((at >= 100u) && (at < (100u + (ms / 200u)))) ? 6.0f : 0.0f;
    sample->theta = (at == 200u) ? NAN : sample->theta;
    sample->z_ddot = (at == 201u) ? INFINITY : sample->z_ddot;
    sample->tau_m = (at == 202u) ? 2.0e4f : sample->tau_m;
    sample->theta_dot = (at == 203u) ? -2.0e4f : sample->theta_dot;
    sample->theta += is_within(ms, 5000u, 5600u) ? arm_noise(arm) : 0.0f;
    return true;
}

static bool jumps(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    (void)arm;
    sample->time_us -= ((ms % 50u) == 0u) ? 3000u : 0u;                               /* late */
    sample->time_us -= is_within(ms, 2000u, 3500u) ? 5000000u : 0u;                   /* another clock */
    sample->time_us += (ms >= 4500u) ? 0xFFFFFFF0u - (6000u * FLIGHT_PERIOD_US) : 0u; /* wraps at 6 s */
    sample->time_us = is_within(ms, 5000u, 5200u) ? 5000u : sample->time_us;          /* stands */
    sample->time_us -= is_within(ms, 6500u, 6600u) ? (ms - 6500u) * 900u : 0u;        /* crawls */
    return true;
}

static bool feels(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    sample->grip_force = arm->force + (2.0f * arm_noise(arm));
    sample->grip_force_valid = !is_within(ms, 3000u, 3030u) && !is_within(ms, 4000u, 4600u);
    return true;
}

static bool feels_wrongly(arm_t *arm, uint32_t ms, lever_sample_t *sample)
{
    (void)feels(arm, ms, sample);
    sample->grip_force *= (ms < 3500u) ? 1.0f : 3.0f;
    return true;
}

/* --- configurations ----------------------------------------------------------------------------------------------- */

static void fix_preload(lever_config_t *config)
{
    config->preload = (uint8_t)LEVER_PRELOAD_FIXED;
    config->settings.grip_force_bias = 3.0f;
}

static void doubt_nothing(lever_config_t *config)
{
    lever_settings_t *s = &config->settings;
    s->z_ddot_gain_sigma = 0.0f;
    s->z_ddot_delay_sigma = 0.0f;
    s->tau_m_gain_sigma = 0.0f;
    s->lever_friction_sigma = 0.0f;
    s->grip_force_gain_sigma = 0.005f;
    s->grip_force_noise = 1.0f;
}

static void calibrate(lever_config_t *config)
{
    lever_settings_t *s = &config->settings;
    s->z_ddot_gain = 1.1f;
    s->z_ddot_delay = 2.0e-3f;
    s->tau_m_gain = 0.9f;
    s->lever_friction = 0.1f;
    s->seat_frequency = 4.5f;
    s->theta_process_noise = 1.0e-3f;
}

static void learn_at_once(lever_config_t *config)
{
    lever_settings_t *s = &config->settings;
    config->estimator = (uint8_t)LEVER_ESTIMATOR_JOINT;
    s->learn_period = 0.0f;
    s->caution_time = 0.0f;
    s->change_threshold = 0.0f;
    s->noise_window = 0.0f;
    s->trim_corner = 0.3f;
    s->dither_fade = 0.0f;
    s->annealing_time = 0.5f;
}

static void expect_no_noise(lever_config_t *config)
{
    lever_settings_t *s = &config->settings;
    s->theta_noise = 1.0e-7f;
    s->theta_dot_noise = 1.0e-6f;
    s->theta_dot_process_noise = 0.0f;
    s->noise_range = 1.0f;
}

static void hand(lever_config_t *config)
{
    config->model = (uint8_t)LEVER_MODEL_HAND;
}

const scene_t scenes[] = {
    {"grip", NULL, grips, NULL},
    {"grip_fixed", fix_preload, grips, NULL},
    {"stiffening", NULL, stiffens, NULL},
    {"rest", NULL, rests, NULL},
    {"hands_off", NULL, opens_hands, NULL},
    {"bounds", NULL, hits_bounds, NULL},
    {"rough", NULL, shakes, NULL},
    {"pushed", NULL, NULL, pushes},
    {"losses", NULL, NULL, loses},
    {"losses_hand", hand, NULL, loses},
    {"hidden", NULL, NULL, hides},
    {"hidden_seated", calibrate, grips, hides},
    {"stuck", NULL, NULL, sticks},
    {"lying", NULL, NULL, lies},
    {"spikes", NULL, NULL, spikes},
    {"clock", NULL, NULL, jumps},
    {"force", NULL, grips, feels},
    {"force_sure", doubt_nothing, grips, feels},
    {"force_fixed", fix_preload, opens_hands, feels},
    {"force_wrong", NULL, NULL, feels_wrongly},
    {"at_once", learn_at_once, grips, hides},
    {"no_noise", expect_no_noise, shakes, spikes},
};
const uint32_t scene_count = (uint32_t)(sizeof(scenes) / sizeof(scenes[0]));
