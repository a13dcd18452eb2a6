/* The estimator of lever_cdkf.h behind an FMU. fmu_config.h, written by `lever fmu`, has the model, the aircraft, the start
 * values and the token. */
#include "fmu.h"
#include "fmu_config.h"
#include "lever_cdkf.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define KEEP_ALIVE 0.25 /* [s], between two commands that keep torque and correction alive */
#define IDLE_US 5000u   /* without a sample, after which lever_idle() is called */

enum {
#define FMU_VARIABLE(name, type, role, unit, start, meaning) AT_##name,
#include "controller.def"
    FIRST_SETTING
};

enum {
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) SETTING_##name,
#include "lever_settings.def"
    SETTINGS
};

enum { FAULTS = 18 };

const uint32_t model_variables = (uint32_t)FIRST_SETTING + (uint32_t)SETTINGS;
const char *const model_token = FMU_TOKEN;
const double model_start_value[] = {FMU_START_VALUES};
const fmu_variable_t model_variable[] = {
#define FMU_VARIABLE(name, type, role, unit, start, meaning) {#name, FMU_##type, FMU_##role},
#include "controller.def"
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) {#name, FMU_FLOAT64, FMU_PARAMETER},
#include "lever_settings.def"
};

typedef struct controller {
    lever_memory_t memory;
    lever_config_t config;
    lever_t *lever;
    /* state besides the estimator's */
    uint64_t commanded; /* sample of the last command */
    double dither_rms;  /* of it; NaN: there was none yet */
    uint32_t idle_us;   /* without a sample, since lever_idle() */
    uint32_t missing;   /* inputs that have been reported as missing, a bit each */
    uint32_t faults;    /* that have been reported */
    uint8_t mode;
    bool freezes;
    bool resets;
} controller_t;

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

/* --- parameters ------------------------------------------------------------------------------------------------------ */

bool model_accepts(fmu_t *fmu, uint32_t variable, double value)
{
    bool accepts = true;
    if (variable >= (uint32_t)FIRST_SETTING) {
        const lever_setting_t *setting = lever_setting(variable - (uint32_t)FIRST_SETTING);
        accepts = ((float)value >= setting->least) && ((float)value <= setting->greatest);
        if (!accepts) {
            fmu_log(fmu, fmi3Error, "%s = %g is out of range: it must be a number from %g to %g %s (%s)", setting->name,
                value, (double)setting->least, (double)setting->greatest, setting->unit, setting->meaning);
        }
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
    controller->dither_rms = (double)NAN;
    fmu->period = floor(((double)controller->config.settings.sample_period * 1.0e6) + 0.5) * 1.0e-6;
    model_put_outputs(fmu);
    return true;
}

/* --- steps ----------------------------------------------------------------------------------------------------------- */

static uint32_t period_us(const fmu_t *fmu)
{
    return (uint32_t)floor((fmu->period * 1.0e6) + 0.5);
}

/* The inputs of a sample that are measured, with the variable that says whether they may be used. */
static const struct {
    uint32_t value;
    uint32_t valid;
} measured[] = {{AT_theta, AT_theta_valid}, {AT_theta_dot, AT_theta_dot_valid}, {AT_z_ddot, AT_z_ddot_valid},
    {AT_tau_m, AT_tau_m_valid}, {AT_grip_force, AT_grip_force_valid}};

enum { MEASURED = (int)(sizeof measured / sizeof measured[0]) };

/* An input that is used must have been set, and be a number; reported once for as long as it is missing. */
static float reading(fmu_t *fmu, uint32_t which, bool *valid)
{
    controller_t *controller = fmu->model;
    const uint32_t at = measured[which].value;
    const bool is_wanted = (fmu->value[measured[which].valid] != 0.0);
    const bool is_there = (fmu->given[at] != 0u) && (fabs(fmu->value[at]) < 3.0e38);
    const uint32_t bit = (uint32_t)1u << which;
    if (is_wanted && !is_there && ((controller->missing & bit) == 0u)) {
        fmu_log(fmu, fmi3Warning,
            (fmu->given[at] != 0u)
                ? "input %s is not a number: it counts as invalid"
                : "input %s has never been set: it counts as invalid; connect it, or set %s to false",
            model_variable[at].name, model_variable[measured[which].valid].name);
        controller->missing |= bit;
    } else if (is_there) {
        controller->missing &= ~bit;
    } else {
        /* reported already, or not wanted */
    }
    *valid = is_wanted && is_there;
    return *valid ? (float)fmu->value[at] : 0.0f;
}

/* What the inputs ask for; repeated while torque or a correction is to be kept alive. */
static void command(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    const bool freezes = (fmu->value[AT_freeze] != 0.0);
    const bool resets = (fmu->value[AT_reset] != 0.0);
    const double rms = fmu->value[AT_dither_rms];
    const bool mitigates = (controller->config.mitigation != (uint8_t)LEVER_MITIGATION_NONE);
    const uint64_t repetition = (uint64_t)fmax(1.0, floor((KEEP_ALIVE / fmu->period) + 0.5));
    const bool is_due = ((fmu->samples - controller->commanded) >= repetition) && (mitigates || (rms > 0.0));
    lever_command_t to = {LEVER_REQUEST_NONE, LEVER_KEEP, LEVER_KEEP, LEVER_KEEP, LEVER_KEEP, LEVER_KEEP, (float)rms};
    if (resets && !controller->resets) {
        to.request = LEVER_REQUEST_RESET;
    } else if (freezes != controller->freezes) {
        to.request = freezes ? LEVER_REQUEST_FREEZE : LEVER_REQUEST_RUN;
    } else {
        /* nothing but the dither */
    }
    /* the comparison with NaN is true */
    const bool has_changed = !((rms <= controller->dither_rms) && (rms >= controller->dither_rms));
    if ((to.request != (uint8_t)LEVER_REQUEST_NONE) || has_changed || is_due) {
        if (!lever_command(controller->lever, &to) && (has_changed || !is_due)) {
            fmu_log(fmu, fmi3Warning, "the estimator refuses dither_rms = %g N m, freeze = %d, reset = %d in this mode",
                rms, freezes ? 1 : 0, resets ? 1 : 0);
        }
        controller->commanded = fmu->samples;
        controller->dither_rms = rms;
    }
    controller->freezes = freezes;
    controller->resets = resets;
}

/* What is new since the last sample, as events. */
static void report(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    lever_health_t health;
    lever_health(controller->lever, &health);
    const double time = fmu->start_time + ((double)fmu->samples * fmu->period);
    for (uint32_t i = 0u; i < (uint32_t)FAULTS; i++) {
        const uint32_t bit = (uint32_t)1u << i;
        if (((health.faults ^ controller->faults) & bit) != 0u) {
            fmu_log(fmu, fmi3OK, "%s %s at %.6g s", model_variable[(uint32_t)AT_fault_theta + i].name,
                ((health.faults & bit) != 0u) ? "raised" : "gone", time);
        }
    }
    if ((uint8_t)health.mode != controller->mode) {
        static const char *const name[] = {"init", "align", "run", "coast", "frozen", "fault"};
        fmu_log(fmu, (health.mode == LEVER_MODE_FAULT) ? fmi3Warning : fmi3OK, "mode %s at %.6g s", name[health.mode],
            time);
    }
    controller->faults = health.faults;
    controller->mode = (uint8_t)health.mode;
}

static void take_sample(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    lever_sample_t sample = {.time_us = (uint32_t)(fmu->samples * period_us(fmu))};
    sample.theta = reading(fmu, 0u, &sample.theta_valid);
    sample.theta_dot = reading(fmu, 1u, &sample.theta_dot_valid);
    sample.z_ddot = reading(fmu, 2u, &sample.z_ddot_valid);
    sample.tau_m = reading(fmu, 3u, &sample.tau_m_valid);
    sample.grip_force = reading(fmu, 4u, &sample.grip_force_valid);
    (void)lever_update(controller->lever, &sample);
    controller->idle_us = 0u;
}

fmi3Status model_step(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    command(fmu);
    if (fmu->value[AT_sampled] != 0.0) {
        take_sample(fmu);
    } else {
        controller->idle_us += period_us(fmu);
        if (controller->idle_us >= IDLE_US) {
            lever_idle(controller->lever, controller->idle_us);
            controller->idle_us = 0u;
        }
    }
    report(fmu);
    return fmi3OK;
}

/* --- outputs --------------------------------------------------------------------------------------------------------- */

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

/* --- state ----------------------------------------------------------------------------------------------------------- */

/* What a controller_t has besides memory, configuration and pointer. */
typedef struct rest {
    uint64_t commanded;
    double dither_rms;
    uint32_t idle_us;
    uint32_t missing;
    uint32_t faults;
    uint8_t mode;
    uint8_t freezes;
    uint8_t resets;
    uint8_t unused;
} rest_t;

size_t model_state_size(const fmu_t *fmu)
{
    (void)fmu;
    return sizeof(rest_t) + (size_t)LEVER_STATE_BYTES;
}

void model_state_save(const fmu_t *fmu, uint8_t *state)
{
    const controller_t *controller = fmu->model;
    const rest_t rest = {controller->commanded, controller->dither_rms, controller->idle_us, controller->missing,
        controller->faults, controller->mode, controller->freezes ? 1u : 0u, controller->resets ? 1u : 0u, 0u};
    (void)memcpy(state, &rest, sizeof rest);
    lever_state_save(controller->lever, &state[sizeof rest]);
}

bool model_state_restore(fmu_t *fmu, const uint8_t *state, size_t size)
{
    controller_t *controller = fmu->model;
    rest_t rest;
    if ((size != model_state_size(fmu)) || !lever_state_restore(controller->lever, &state[sizeof rest])) {
        return false;
    }
    (void)memcpy(&rest, state, sizeof rest);
    controller->commanded = rest.commanded;
    controller->dither_rms = rest.dither_rms;
    controller->idle_us = rest.idle_us;
    controller->missing = rest.missing;
    controller->faults = rest.faults;
    controller->mode = rest.mode;
    controller->freezes = (rest.freezes != 0u);
    controller->resets = (rest.resets != 0u);
    return true;
}
