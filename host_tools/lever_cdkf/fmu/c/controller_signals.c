/* Samples and commands from the variables of an FMU. */
#include "controller.h"

#include <math.h>

#define KEEP_ALIVE 0.25 /* [s], between two commands that keep torque and correction alive */

void input_start(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    controller->input.dither_rms = (double)NAN;
    fmu->period = floor(((double)controller->config.settings.sample_period * 1.0e6) + 0.5) * 1.0e-6;
}

bool input_accepts(fmu_t *fmu, uint32_t variable, double value)
{
    (void)fmu, (void)variable, (void)value; /* it has no parameters */
    return true;
}

bool input_is_usable(const uint8_t *bytes)
{
    (void)bytes;
    return true;
}

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
    if (is_wanted && !is_there && ((controller->input.missing & bit) == 0u)) {
        fmu_log(fmu, fmi3Warning,
            (fmu->given[at] != 0u)
                ? "input %s is not a number: it counts as invalid"
                : "input %s has never been set: it counts as invalid; connect it, or set %s to false",
            model_variable[at].name, model_variable[measured[which].valid].name);
        controller->input.missing |= bit;
    } else if (is_there) {
        controller->input.missing &= ~bit;
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
    const bool is_due = ((fmu->samples - controller->input.commanded) >= repetition) && (mitigates || (rms > 0.0));
    lever_command_t to = {LEVER_REQUEST_NONE, LEVER_KEEP, LEVER_KEEP, LEVER_KEEP, LEVER_KEEP, LEVER_KEEP, (float)rms};
    if (resets && (controller->input.resets == 0u)) {
        to.request = LEVER_REQUEST_RESET;
    } else if (freezes != (controller->input.freezes != 0u)) {
        to.request = freezes ? LEVER_REQUEST_FREEZE : LEVER_REQUEST_RUN;
    } else {
        /* nothing but the dither */
    }
    /* the comparison with NaN is true */
    const bool has_changed = !((rms <= controller->input.dither_rms) && (rms >= controller->input.dither_rms));
    if ((to.request != (uint8_t)LEVER_REQUEST_NONE) || has_changed || is_due) {
        if (!lever_command(controller->lever, &to) && (has_changed || !is_due)) {
            fmu_log(fmu, fmi3Warning, "the estimator refuses dither_rms = %g N m, freeze = %d, reset = %d in this mode",
                rms, freezes ? 1 : 0, resets ? 1 : 0);
        }
        controller->input.commanded = fmu->samples;
        controller->input.dither_rms = rms;
    }
    controller->input.freezes = freezes ? 1u : 0u;
    controller->input.resets = resets ? 1u : 0u;
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
    controller->input.idle_us = 0u;
}

void input_step(fmu_t *fmu)
{
    controller_t *controller = fmu->model;
    command(fmu);
    if (fmu->value[AT_sampled] != 0.0) {
        take_sample(fmu);
    } else {
        controller->input.idle_us += period_us(fmu);
        if (controller->input.idle_us >= CONTROLLER_IDLE_US) {
            lever_idle(controller->lever, controller->input.idle_us);
            controller->input.idle_us = 0u;
        }
    }
    controller_report(fmu);
}
