/* FMI 3.0 Co-Simulation: life of an instance, and steps. */
#include "fmi3Functions.h"
#include "fmu.h"
#include "fmu_config.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TOLERANCE 0.01 /* of a period, by which times may be off */
#define LONGEST 1000.0 /* step [s] of an FMU with event mode */

enum { LINE = 512 };

void fmu_log(fmu_t *fmu, fmi3Status status, const char *format, ...)
{
    static const char *const category[] = {
        "logEvents", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};
    if (status == fmi3Warning) {
        fmu->has_warned = true;
    }
    if ((fmu->log != NULL) && ((status != fmi3OK) || fmu->logs_events)) {
        char line[LINE];
        va_list arguments;
        va_start(arguments, format);
        (void)vsnprintf(line, sizeof line, format, arguments);
        va_end(arguments);
        fmu->log(fmu->environment, status, category[status], line);
    }
}

/* --- life --------------------------------------------------------------------------------------------------------- */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count, const fmi3String categories[])
{
    fmu_t *fmu = instance;
    bool events = (count == 0u);
    for (size_t i = 0u; i < count; i++) {
        events = events || (strcmp(categories[i], "logEvents") == 0);
    }
    fmu->logs_events = on && events;
    return fmi3OK;
}

static char *copy_of(const char *text, const char *ending)
{
    const size_t length = strlen(text);
    const size_t more = strlen(ending);
    char *copy = calloc(length + more + 1u, 1u);
    if (copy != NULL) {
        (void)memcpy(copy, text, length);
        (void)memcpy(&copy[length], ending, more);
    }
    return copy;
}

static void set_start_values(fmu_t *fmu)
{
    (void)memcpy(fmu->value, model_start_value, model_variables * sizeof fmu->value[0]);
    (void)memset(fmu->given, 0, model_variables * sizeof fmu->given[0]);
    fmu->phase = FMU_INSTANTIATED;
    fmu->changed = true;
    fmu->samples = 0u;
}

static const char *separator_after(const char *path)
{
    const size_t length = strlen(path);
    const char last = (length > 0u) ? path[length - 1u] : '/';
    return ((last == '/') || (last == '\\')) ? "" : "/";
}

static fmu_t *new_instance(const char *name, const char *resources)
{
    fmu_t *fmu = calloc(1u, sizeof *fmu);
    if (fmu != NULL) {
        fmu->name = copy_of(name, "");
        fmu->resources = copy_of(resources, separator_after(resources));
        fmu->value = calloc(model_variables, sizeof fmu->value[0]);
        fmu->given = calloc(model_variables, sizeof fmu->given[0]);
        fmu->model = model_new();
        if ((fmu->name == NULL) || (fmu->resources == NULL) || (fmu->value == NULL) || (fmu->given == NULL) ||
            (fmu->model == NULL)) {
            fmi3FreeInstance(fmu);
            fmu = NULL;
        }
    }
    return fmu;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return, const fmi3ValueReference intermediate[],
    size_t intermediates, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3IntermediateUpdateCallback update)
{
    (void)visible, (void)early_return, (void)intermediate, (void)intermediates, (void)update;
    fmu_t unborn = {.environment = environment, .log = log};
    if ((token == NULL) || (strcmp(token, model_token) != 0)) {
        fmu_log(&unborn, fmi3Error,
            "instantiationToken %s is not that of this binary, %s: model description and binary "
            "are of different FMUs",
            (token != NULL) ? token : "(none)", model_token);
        return NULL;
    }
#ifdef FMU_EVENTS
    if (!event_mode) {
        fmu_log(&unborn, fmi3Error, "this FMU needs event mode, in which its clocks tick: use an importer that has it");
        return NULL;
    }
#else
    (void)event_mode;
#endif
    fmu_t *fmu = new_instance((name != NULL) ? name : "", (resources != NULL) ? resources : "");
    if (fmu == NULL) {
        fmu_log(&unborn, fmi3Error, "no memory left for an instance");
        return NULL;
    }
    fmu->environment = environment;
    fmu->log = log;
    fmu->logs_events = logging;
    set_start_values(fmu);
    return fmu;
}

void fmi3FreeInstance(fmi3Instance instance)
{
    fmu_t *fmu = instance;
    if (fmu != NULL) {
        if (fmu->model != NULL) {
            model_free(fmu->model);
        }
        free(fmu->given);
        free(fmu->value);
        free(fmu->resources);
        free(fmu->name);
        free(fmu);
    }
}

fmi3Status fmu_started(fmu_t *fmu)
{
    fmi3Status status = fmi3OK;
    if (fmu->changed) {
        fmu->samples = 0u;
        fmu->has_warned = false;
        if (model_start(fmu)) {
            fmu->changed = false;
            status = fmu->has_warned ? fmi3Warning : fmi3OK;
        } else {
            status = fmi3Error;
        }
    }
    return status;
}

bool fmu_is_in(fmu_t *fmu, enum fmu_phase phase, const char *function)
{
    const bool is = (fmu->phase == (uint32_t)phase);
    if (!is) {
        static const char *const name[] = {"instantiated", "in configuration mode", "in initialization mode",
            "in event mode", "in step mode", "terminated"};
        fmu_log(fmu, fmi3Error, "%s: the instance is %s, not %s", function, name[fmu->phase], name[phase]);
    }
    return is;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
    fmi3Float64 start_time, fmi3Boolean has_stop, fmi3Float64 stop_time)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop_time;
    fmu_t *fmu = instance;
    if (!fmu_is_in(fmu, FMU_INSTANTIATED, "fmi3EnterInitializationMode")) {
        return fmi3Error;
    }
    if (!isfinite(start_time)) {
        fmu_log(fmu, fmi3Error, "start time %g s: must be a number", start_time);
        return fmi3Error;
    }
    fmu->start_time = start_time;
    fmu->value[0] = start_time;
    fmu->phase = FMU_INITIALIZING;
    return fmu_started(fmu);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    fmu_t *fmu = instance;
    fmi3Status status = fmu_is_in(fmu, FMU_INITIALIZING, "fmi3ExitInitializationMode") ? fmu_started(fmu) : fmi3Error;
    if (status != fmi3Error) {
#ifdef FMU_EVENTS
        fmu->phase = FMU_EVENT;
#else
        fmu->phase = FMU_STEPPING;
#endif
    }
    return status;
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    fmu_t *fmu = instance;
    fmu->phase = FMU_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    set_start_values(instance);
    return fmi3OK;
}

/* --- steps -------------------------------------------------------------------------------------------------------- */

#ifdef FMU_EVENTS
/* How many periods end within a step of any length; false: it cannot be taken, which is said. */
static bool periods_of(fmu_t *fmu, double step, uint64_t *count)
{
    const bool is_usable = (step > 0.0) && (step < LONGEST);
    if (is_usable) {
        const double end = fmu->value[0] + step;
        const double periods = floor(((end - fmu->start_time) / fmu->period) + TOLERANCE);
        *count = (uint64_t)fmax(0.0, periods - (double)fmu->samples);
        fmu->value[0] = end;
    } else {
        fmu_log(fmu, fmi3Discard, "a step of %.9g s at %.9g s: it must be above 0 s, and below %g s", step,
            fmu->value[0], LONGEST);
    }
    return is_usable;
}
#else
/* How many periods a step has; false: it cannot be taken, which is said. */
static bool periods_of(fmu_t *fmu, double step, uint64_t *count)
{
    const double periods = step / fmu->period;
    const double whole = floor(periods + 0.5);
    const bool is_whole = (whole >= 1.0) && (whole < 1.0e9) && (fabs(periods - whole) <= TOLERANCE);
    if (is_whole) {
        *count = (uint64_t)whole;
    } else {
        fmu_log(fmu, fmi3Discard,
            "a step of %.9g s at %.9g s: it must be %.9g s, the sample period, or a whole multiple", step,
            fmu->value[0], fmu->period);
    }
    return is_whole;
}
#endif

static bool is_from_here(fmu_t *fmu, double time)
{
    const double here = fmu->value[0];
    const bool is = fabs(time - here) <= ((TOLERANCE * fmu->period) + (1.0e-12 * fabs(here)));
    if (!is) {
        fmu_log(fmu, fmi3Discard, "a step from %.9g s: this instance is at %.9g s", time, here);
    }
    return is;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_before,
    fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last_time)
{
    (void)no_set_before;
    fmu_t *fmu = instance;
    if (!fmu_is_in(fmu, FMU_STEPPING, "fmi3DoStep")) {
        return fmi3Error;
    }
    uint64_t count = 0u;
    fmi3Status status = (is_from_here(fmu, time) && periods_of(fmu, step, &count)) ? fmi3OK : fmi3Discard;
    fmu->has_warned = false;
    for (uint64_t i = 0u; (i < count) && (status == fmi3OK); i++) {
        status = model_step(fmu);
        fmu->samples += (status == fmi3OK) ? 1u : 0u;
    }
    model_put_outputs(fmu);
#ifdef FMU_EVENTS
    *event_needed = model_ticks(fmu);
#else
    fmu->value[0] = fmu->start_time + ((double)fmu->samples * fmu->period);
    *event_needed = false;
#endif
    *terminate = false;
    *early_return = false;
    *last_time = fmu->value[0];
    return ((status == fmi3OK) && fmu->has_warned) ? fmi3Warning : status;
}
