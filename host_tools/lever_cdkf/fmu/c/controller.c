/* The estimator of lever_cdkf.h behind an FMU. fmu_config.h, written by `lever fmu`, has the model, the aircraft, the start
 * values and the token. */
#include "controller.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { FAULTS = 18 };

const uint32_t model_variables = MODEL_VARIABLES;
const char *const model_token = FMU_TOKEN;
const double model_start_value[] = {FMU_START_VALUES};
const fmu_variable_t model_variable[] = {
#define FMU_VARIABLE(name, type, role, unit, start, meaning) {#name, FMU_##type, FMU_##role},
#include "controller.def"
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) {#name, FMU_FLOAT64, FMU_PARAMETER},
#include "lever_settings.def"
#ifdef FMU_EVENTS
#define FMU_VARIABLE(name, type, role, unit, start, meaning) {#name, FMU_##type, FMU_##role},
#include "controller_bus.def"
#endif
};

/* One of each for each of the enumeration. */
typedef char fmu_has_every_variable[((sizeof model_variable / sizeof model_variable[0]) == MODEL_VARIABLES) ? 1 : -1];
typedef char
    fmu_has_every_start[((sizeof model_start_value / sizeof model_start_value[0]) == MODEL_VARIABLES) ? 1 : -1];

#ifdef CONTROLLER_AIRCRAFT
static const lever_aircraft_t aircraft = CONTROLLER_AIRCRAFT;
#endif

void *model_new(void)
{
    return calloc(1u, sizeof(controller_t));
}

void model_free(void *model)
{
    free(model);
}

/* --- parameters --------------------------------------------------------------------------------------------------- */

bool model_accepts(fmu_t *fmu, uint32_t variable, double value)
{
    bool accepts = true;
    if (variable >= (uint32_t)FIRST_BUS) {
        accepts = input_accepts(fmu, variable, value);
    } else if (variable >= (uint32_t)FIRST_SETTING) {
        const lever_setting_t *setting = lever_setting(variable - (uint32_t)FIRST_SETTING);
        accepts = ((float)value >= setting->least) && ((float)value <= setting->greatest);
        if (!accepts) {
            fmu_log(fmu, fmi3Error, "%s = %g is out of range: it must be a number from %g to %g %s (%s)", setting->name,
                value, (double)setting->least, (double)setting->greatest, setting->unit, setting->meaning);
        }
    } else {
        /* a choice: lever_config_check() looks at it */
    }
    return accepts;
}

/* A choice beyond its enumeration is one that lever_config_check() refuses. */
static uint8_t choice(const fmu_t *fmu, uint32_t at)
{
    const double value = fmu->value[at];
    return ((value >= 0.0) && (value < 255.0)) ? (uint8_t)value : UINT8_MAX;
}

static void configure(const fmu_t *fmu, lever_config_t *config)
{
    float settings[SETTINGS];
    lever_config_default(config);
    for (uint32_t i = 0u; i < (uint32_t)SETTINGS; i++) {
        settings[i] = (float)fmu->value[(uint32_t)FIRST_SETTING + i];
    }
    (void)memcpy(&config->settings, settings, sizeof config->settings);
    config->model = CONTROLLER_MODEL;
    config->preload = choice(fmu, AT_preload);
    config->estimator = choice(fmu, AT_estimator);
    config->adaptation = choice(fmu, AT_adaptation);
    config->mitigation = choice(fmu, AT_mitigation);
}

static double value_named(const fmu_t *fmu, const char *name)
{
    double value = (double)NAN;
    for (uint32_t i = 0u; i < model_variables; i++) {
        if (strcmp(model_variable[i].name, name) == 0) {
            value = fmu->value[i];
        }
    }
    return value;
}

bool model_start(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    (void)memset(controller, 0, sizeof *controller);
    configure(fmu, &controller->config);
    controller->lever = lever_init(&controller->memory, &controller->config);
    if (controller->lever == NULL) {
        const char *name = lever_config_check(&controller->config);
        fmu_log(fmu, fmi3Error, "%s = %g does not go with the other settings", name, value_named(fmu, name));
        return false;
    }
#ifdef CONTROLLER_AIRCRAFT
    if (!lever_aircraft(controller->lever, &aircraft)) {
        fmu_log(fmu, fmi3Error, "the aircraft of this FMU is not usable");
        return false;
    }
#endif
    input_start(fmu);
    model_put_outputs(fmu);
    return true;
}

/* --- steps -------------------------------------------------------------------------------------------------------- */

/* What is new since the last sample, as events. */
void controller_report(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    lever_health_t health;
    lever_health(controller->lever, &health);
    const double time = fmu->start_time + ((double)fmu->samples * fmu->period);
    for (uint32_t i = 0u; i < (uint32_t)FAULTS; i++) {
        const uint32_t bit = (uint32_t)1u << i;
        if (((health.faults ^ controller->input.faults) & bit) != 0u) {
            fmu_log(fmu, fmi3OK, "%s %s at %.6g s", model_variable[(uint32_t)AT_fault_theta + i].name,
                ((health.faults & bit) != 0u) ? "raised" : "gone", time);
        }
    }
    if ((uint32_t)health.mode != controller->input.mode) {
        static const char *const name[] = {"init", "align", "run", "coast", "frozen", "fault"};
        fmu_log(fmu, (health.mode == LEVER_MODE_FAULT) ? fmi3Warning : fmi3OK, "mode %s at %.6g s", name[health.mode],
            time);
    }
    controller->input.faults = health.faults;
    controller->input.mode = (uint32_t)health.mode;
}

fmi3Status model_step(fmu_t *fmu)
{
    input_step(fmu);
    return fmi3OK;
}

/* --- outputs ------------------------------------------------------------------------------------------------------ */

static void put_estimate(const lever_t *lever, double *value)
{
    lever_estimate_t estimate;
    lever_estimate(lever, &estimate);
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        value[(uint32_t)AT_parameter_1 + i] = (double)estimate.parameter[i];
        value[(uint32_t)AT_parameter_1_sigma + i] = (double)estimate.parameter_sigma[i];
    }
    value[AT_natural_frequency] = (double)estimate.natural_frequency;
    value[AT_natural_frequency_sigma] = (double)estimate.natural_frequency_sigma;
    value[AT_damping_ratio] = (double)estimate.damping_ratio;
    value[AT_damping_ratio_sigma] = (double)estimate.damping_ratio_sigma;
    value[AT_theta_estimate] = (double)estimate.theta;
    value[AT_theta_sigma] = (double)estimate.theta_sigma;
    value[AT_theta_dot_estimate] = (double)estimate.theta_dot;
    value[AT_theta_dot_sigma] = (double)estimate.theta_dot_sigma;
    value[AT_trim] = (double)estimate.trim;
    value[AT_nis] = (double)estimate.nis;
    value[AT_nis_size] = (double)estimate.nis_size;
}

static void put_health(const lever_t *lever, double *value)
{
    lever_health_t health;
    lever_health(lever, &health);
    value[AT_torque] = (double)health.torque;
    value[AT_mode] = (double)health.mode;
    value[AT_excitation] = (double)health.excitation;
    value[AT_gate_open] = health.gate_open ? 1.0 : 0.0;
    value[AT_recoveries] = (double)health.recoveries;
    for (uint32_t i = 0u; i < (uint32_t)FAULTS; i++) {
        value[(uint32_t)AT_fault_theta + i] = ((health.faults & ((uint32_t)1u << i)) != 0u) ? 1.0 : 0.0;
    }
}

void model_put_outputs(fmu_t *fmu)
{
    const controller_t *controller = fmu->model;
    lever_correction_t correction;
    lever_stability_t stability;
    put_estimate(controller->lever, fmu->value);
    put_health(controller->lever, fmu->value);
    lever_correction(controller->lever, &correction);
    fmu->value[AT_correction] = (double)correction.angle;
    fmu->value[AT_correction_weight] = (double)correction.weight;
    lever_stability(controller->lever, &stability);
    fmu->value[AT_bounce_state] = (double)stability.state;
    fmu->value[AT_gain_margin] = (double)stability.gain_margin;
    fmu->value[AT_gain_margin_sigma] = (double)stability.gain_margin_sigma;
    fmu->value[AT_bounce_frequency] = (double)stability.frequency;
}

/* --- state -------------------------------------------------------------------------------------------------------- */

size_t model_state_size(const fmu_t *fmu)
{
    (void)fmu;
    return sizeof(controller_input_t) + (size_t)LEVER_STATE_BYTES;
}

void model_state_save(const fmu_t *fmu, uint8_t *state)
{
    const controller_t *controller = fmu->model;
    (void)memcpy(state, &controller->input, sizeof controller->input);
    lever_state_save(controller->lever, &state[sizeof controller->input]);
}

bool model_state_restore(fmu_t *fmu, const uint8_t *state, size_t size)
{
    controller_t *controller = fmu->model;
    if ((size != model_state_size(fmu)) || !input_is_usable(state) ||
        !lever_state_restore(controller->lever, &state[sizeof controller->input])) {
        return false;
    }
    (void)memcpy(&controller->input, state, sizeof controller->input);
    return true;
}
