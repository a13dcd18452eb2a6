/* With any settings any frames come, as many as one likes; samples are taken from them, time passes, the platform and the
 * aircraft change, and what is due is fetched.
 *
 * The numeric parts have stand-ins here: any values come from them, finite or infinite (NaN: no_nan.h), torques of at
 * most 1e6 N m, and any codes. torque_gate.c and kernels.c prove some of these parts. */
#include "any.h"

#include "app/instance.h"
#include "bounce/alarm.h"

#include <math.h>

static float any_number(void)
{
    return any_bool() ? any_finite() : (any_bool() ? INFINITY : -INFINITY);
}

static float any_torque(void)
{
    return Frama_C_float_interval(-1.0e6f, 1.0e6f);
}

/* --- estimator ---------------------------------------------------------------------------------------------------- */

static void choose_any(setup_t *setup)
{
    setup->model = any_byte();
    setup->preload = any_byte();
    setup->estimator = any_byte();
    setup->adaptation = any_byte();
}

void estimator_init(estimator_t *estimator, const lever_config_t *config)
{
    estimator->setup.settings = &config->settings;
    choose_any(&estimator->setup);
}

enum lever_mode estimator_update(estimator_t *estimator, const lever_sample_t *sample, float own_torque)
{
    (void)own_torque;
    estimator->mode = (enum lever_mode)Frama_C_interval((int)LEVER_MODE_INIT, (int)LEVER_MODE_FAULT);
    estimator->time_us = sample->time_us;
    estimator->faults = any_word();
    estimator->lost = any_word();
    estimator->corrupt = any_word();
    estimator->late = any_word();
    estimator->nis = Frama_C_float_interval(0.0f, 3.4028235e38f);
    estimator->nis_size = any_byte();
    estimator->communication_fault = any_bool();
    return estimator->mode;
}

bool estimator_command(estimator_t *estimator, const lever_command_t *command)
{
    (void)command;
    choose_any(&estimator->setup);
    return any_bool();
}

float estimator_state(const estimator_t *estimator, uint32_t i)
{
    (void)estimator;
    (void)i;
    return any_number();
}

void estimator_parameters(const estimator_t *estimator, float parameter[LEVER_PARAMETERS])
{
    (void)estimator;
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        parameter[i] = any_number();
    }
}

void estimator_parameter_sigma(const estimator_t *estimator, float sigma[LEVER_PARAMETERS])
{
    estimator_parameters(estimator, sigma);
}

derived_dynamics_t estimator_dynamics(const estimator_t *estimator)
{
    const derived_dynamics_t dynamics = {any_number(), any_number(), any_number(), any_number()};
    (void)estimator;
    return dynamics;
}

derived_feedthrough_t estimator_feedthrough(const estimator_t *estimator, float frequency)
{
    const derived_feedthrough_t feedthrough = {any_number(), any_number(), any_number(), any_number(), any_number()};
    (void)estimator;
    (void)frequency;
    return feedthrough;
}

model_dynamics_t estimator_linearised(const estimator_t *estimator, model_step_t *step)
{
    const model_dynamics_t dynamics = {0};
    const model_step_t trim = {0};
    (void)estimator;
    *step = trim;
    return dynamics;
}

margin_t estimator_margin(const estimator_t *estimator, const lever_aircraft_t *aircraft)
{
    const margin_t margin = {any_number(), any_number(), any_number(), any_number(), any_number(), any_number()};
    (void)estimator;
    (void)aircraft;
    return margin;
}

void estimator_estimate(const estimator_t *estimator, lever_estimate_t *estimate)
{
    (void)estimator;
    (void)estimate;
}

void estimator_health(const estimator_t *estimator, lever_health_t *health)
{
    health->mode = estimator->mode;
    health->excitation = any_number();
    health->recoveries = any_word();
}

uint8_t alarm_next(uint8_t state, const margin_t *margin, const lever_aircraft_t *aircraft, bool carried, bool doubtful)
{
    (void)doubtful;
    (void)state;
    (void)margin;
    (void)aircraft;
    (void)carried;
    return any_byte();
}

bool margin_accepts(const lever_aircraft_t *aircraft)
{
    (void)aircraft;
    return any_bool();
}

/* --- torque and correction ---------------------------------------------------------------------------------------- */

void dither_init(dither_t *dither, float low, float high, float period, float rms_most, float fade)
{
    (void)dither, (void)low, (void)high, (void)period, (void)rms_most, (void)fade;
}

void dither_reset(dither_t *dither)
{
    (void)dither;
}

void dither_set(dither_t *dither, float rms, bool at_once)
{
    (void)rms;
    (void)at_once;
    dither->target = any_torque();
}

float dither_step(dither_t *dither)
{
    (void)dither;
    return any_torque();
}

bool dither_is_on(const dither_t *dither)
{
    (void)dither;
    return any_bool();
}

void torque_gate_init(torque_gate_t *gate, const lever_settings_t *settings)
{
    (void)settings;
    gate->period_us = Frama_C_unsigned_int_interval(100u, 20000u);
}

void torque_gate_step(torque_gate_t *gate, float asked, const torque_sample_t *sample)
{
    (void)asked;
    (void)sample;
    gate->torque = any_torque();
    gate->gain = Frama_C_float_interval(0.0f, 1.0f);
    gate->open = any_bool();
}

void torque_gate_idle(torque_gate_t *gate, uint32_t elapsed_us)
{
    const torque_sample_t sample = {elapsed_us, false, false, false, false};
    torque_gate_step(gate, 0.0f, &sample);
}

void torque_gate_close(torque_gate_t *gate)
{
    gate->open = false;
    gate->gain = 0.0f;
}

void torque_gate_keep_alive(torque_gate_t *gate)
{
    (void)gate;
}

void torque_gate_ask(torque_gate_t *gate, bool asks)
{
    (void)gate;
    (void)asks;
}

bool torque_gate_has_output(const torque_gate_t *gate)
{
    (void)gate;
    return any_bool();
}

bool torque_gate_is_abandoned(const torque_gate_t *gate)
{
    (void)gate;
    return any_bool();
}

bool mitigation_step(mitigation_t *mitigation, const lever_settings_t *settings, const mitigation_sample_t *sample)
{
    (void)settings;
    (void)sample;
    mitigation->damping = any_torque();
    mitigation->weight = Frama_C_float_interval(0.0f, 1.0f);
    mitigation->open = any_bool();
    return any_bool();
}

void mitigation_idle(mitigation_t *mitigation, uint32_t elapsed_us)
{
    (void)mitigation;
    (void)elapsed_us;
}

lever_correction_t mitigation_correction(const mitigation_t *mitigation)
{
    const lever_correction_t correction = {any_number(), any_number()};
    (void)mitigation;
    return correction;
}

/* --- all that can come -------------------------------------------------------------------------------------------- */

static void any_settings(lever_settings_t *settings)
{
#define LEVER_SETTING(name, unit, value, least, greatest, meaning)                                                     \
    settings->name = Frama_C_float_interval((least), (greatest));
#include "lever_settings.def"
}

static void give_platform(lever_t *lever)
{
    const lever_platform_t platform = {any_byte(), any_byte(), any_byte(), any_byte(),
        Frama_C_unsigned_short_interval(0u, UINT16_MAX), Frama_C_unsigned_short_interval(0u, UINT16_MAX)};
    lever_platform(lever, &platform);
}

void main(void)
{
    static lever_memory_t memory;
    static lever_config_t config;
    static const lever_aircraft_t aircraft;
    lever_frame_t sent = any_frame();
    lever_config_default(&config);
    any_settings(&config.settings);
    config.mitigation = any_byte();
    lever_t *lever = lever_init(&memory, &config);
    if (lever != NULL) {
        /*@ widen_hints "all", (1 << OUTPUTS) - 1; */
        while (any_bool()) {
            const lever_frame_t frame = any_frame();
            (void)lever_on_frame(lever, &frame);
            (void)lever_step(lever);
            if (any_bool()) {
                lever_idle(lever, any_word());
            }
            if (any_bool()) {
                give_platform(lever);
            }
            if (any_bool()) {
                (void)lever_aircraft(lever, any_bool() ? &aircraft : NULL);
            }
            (void)lever_next_frame(lever, &sent);
        }
    }
}
