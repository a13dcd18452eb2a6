/* FMI 3.0 Co-Simulation: life of an instance, steps, and its state. */
#include "fmi3Functions.h"
#include "fmu.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TOLERANCE 0.01 /* of a period, by which times may be off */
#define STATE_MAGIC 0x4C46534Du

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

/* --- life ---------------------------------------------------------------------------------------------------------- */

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
    (void)visible, (void)event_mode, (void)early_return, (void)intermediate, (void)intermediates, (void)update;
    fmu_t unborn = {.environment = environment, .log = log};
    if ((token == NULL) || (strcmp(token, model_token) != 0)) {
        fmu_log(&unborn, fmi3Error,
            "instantiationToken %s is not that of this binary, %s: model description and binary "
            "are of different FMUs",
            (token != NULL) ? token : "(none)", model_token);
        return NULL;
    }
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

static fmi3Status started(fmu_t *fmu)
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

static bool is_in(fmu_t *fmu, enum fmu_phase phase, const char *function)
{
    const bool is = (fmu->phase == (uint32_t)phase);
    if (!is) {
        static const char *const name[] = {"instantiated", "in initialization mode", "in step mode", "terminated"};
        fmu_log(fmu, fmi3Error, "%s: the instance is %s, not %s", function, name[fmu->phase], name[phase]);
    }
    return is;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
    fmi3Float64 start_time, fmi3Boolean has_stop, fmi3Float64 stop_time)
{
    (void)has_tolerance, (void)tolerance, (void)has_stop, (void)stop_time;
    fmu_t *fmu = instance;
    if (!is_in(fmu, FMU_INSTANTIATED, "fmi3EnterInitializationMode")) {
        return fmi3Error;
    }
    if (!isfinite(start_time)) {
        fmu_log(fmu, fmi3Error, "start time %g s: must be a number", start_time);
        return fmi3Error;
    }
    fmu->start_time = start_time;
    fmu->value[0] = start_time;
    fmu->phase = FMU_INITIALIZING;
    return started(fmu);
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    fmu_t *fmu = instance;
    fmi3Status status = is_in(fmu, FMU_INITIALIZING, "fmi3ExitInitializationMode") ? started(fmu) : fmi3Error;
    if (status != fmi3Error) {
        fmu->phase = FMU_STEPPING;
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

/* --- steps --------------------------------------------------------------------------------------------------------- */

/* How many periods a step has; 0: it cannot be taken, which is said. */
static uint64_t periods_of(fmu_t *fmu, double time, double step)
{
    const double here = fmu->start_time + ((double)fmu->samples * fmu->period);
    const double periods = step / fmu->period;
    const double whole = floor(periods + 0.5);
    uint64_t count = 0u;
    if (!(fabs(time - here) <= (TOLERANCE * fmu->period) + (1.0e-12 * fabs(here)))) {
        fmu_log(fmu, fmi3Discard, "a step from %.9g s: this instance is at %.9g s", time, here);
    } else if (!(whole >= 1.0) || !(whole < 1.0e9) || (fabs(periods - whole) > TOLERANCE)) {
        fmu_log(fmu, fmi3Discard,
            "a step of %.9g s at %.9g s: it must be %.9g s, the sample period, or a whole multiple", step, time,
            fmu->period);
    } else {
        count = (uint64_t)whole;
    }
    return count;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_set_before,
    fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last_time)
{
    (void)no_set_before;
    fmu_t *fmu = instance;
    if (!is_in(fmu, FMU_STEPPING, "fmi3DoStep")) {
        return fmi3Error;
    }
    const uint64_t count = periods_of(fmu, time, step);
    fmi3Status status = (count > 0u) ? fmi3OK : fmi3Discard;
    fmu->has_warned = false;
    for (uint64_t i = 0u; (i < count) && (status == fmi3OK); i++) {
        status = model_step(fmu);
        fmu->samples += (status == fmi3OK) ? 1u : 0u;
    }
    fmu->value[0] = fmu->start_time + ((double)fmu->samples * fmu->period);
    model_put_outputs(fmu);
    *event_needed = false;
    *terminate = false;
    *early_return = false;
    *last_time = fmu->value[0];
    return ((status == fmi3OK) && fmu->has_warned) ? fmi3Warning : status;
}

/* --- state --------------------------------------------------------------------------------------------------------- */

typedef struct head {
    uint32_t magic;
    uint32_t phase;
    uint64_t samples;
    double start_time;
    char token[64];
} head_t;

typedef struct saved {
    size_t size;
    uint8_t bytes[];
} saved_t;

static bool has_model_state(const fmu_t *fmu)
{
    return (fmu->phase != (uint32_t)FMU_INSTANTIATED) && !fmu->changed;
}

static size_t values_size(void)
{
    return sizeof(head_t) + (model_variables * (sizeof(double) + 1u));
}

static void save(const fmu_t *fmu, uint8_t *bytes)
{
    const size_t values = model_variables * sizeof fmu->value[0];
    head_t head = {STATE_MAGIC, fmu->phase, fmu->samples, fmu->start_time, {0}};
    (void)snprintf(head.token, sizeof head.token, "%s", model_token);
    (void)memcpy(bytes, &head, sizeof head);
    (void)memcpy(&bytes[sizeof head], fmu->value, values);
    (void)memcpy(&bytes[sizeof head + values], fmu->given, model_variables);
    if (has_model_state(fmu)) {
        model_state_save(fmu, &bytes[values_size()]);
    }
}

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    fmu_t *fmu = instance;
    const size_t size = values_size() + (has_model_state(fmu) ? model_state_size(fmu) : 0u);
    fmi3FreeFMUState(instance, state);
    saved_t *saved = calloc(1u, sizeof *saved + size);
    if (saved == NULL) {
        fmu_log(fmu, fmi3Error, "no memory left for a state");
        return fmi3Error;
    }
    saved->size = size;
    save(fmu, saved->bytes);
    *state = saved;
    return fmi3OK;
}

/* Values first, as the model starts from them; again after that, as it has set the outputs. */
static bool restore(fmu_t *fmu, const uint8_t *bytes, size_t size)
{
    head_t head;
    const size_t values = model_variables * sizeof fmu->value[0];
    if (size < values_size()) {
        return false;
    }
    (void)memcpy(&head, bytes, sizeof head);
    head.token[sizeof head.token - 1u] = '\0';
    if ((head.magic != STATE_MAGIC) || (head.phase > (uint32_t)FMU_TERMINATED) ||
        (strncmp(head.token, model_token, sizeof head.token - 1u) != 0)) {
        return false;
    }
    (void)memcpy(fmu->value, &bytes[sizeof head], values);
    bool is_whole = true;
    if (size > values_size()) {
        fmu->changed = true;
        is_whole = (started(fmu) == fmi3OK) && model_state_restore(fmu, &bytes[values_size()], size - values_size());
    } else {
        fmu->changed = true;
        is_whole = (head.phase == (uint32_t)FMU_INSTANTIATED);
    }
    (void)memcpy(fmu->value, &bytes[sizeof head], values);
    (void)memcpy(fmu->given, &bytes[sizeof head + values], model_variables);
    fmu->phase = head.phase;
    fmu->samples = head.samples;
    fmu->start_time = head.start_time;
    return is_whole;
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState state)
{
    fmu_t *fmu = instance;
    const saved_t *saved = state;
    const bool is_whole = (saved != NULL) && restore(fmu, saved->bytes, saved->size);
    if (!is_whole) {
        fmu_log(fmu, fmi3Error, "the state is not one of this FMU");
    }
    return is_whole ? fmi3OK : fmi3Error;
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *state)
{
    (void)instance;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState state, size_t *size)
{
    (void)instance;
    const saved_t *saved = state;
    *size = (saved != NULL) ? saved->size : 0u;
    return (saved != NULL) ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    const saved_t *saved = state;
    if ((saved == NULL) || (size < saved->size)) {
        fmu_log(instance, fmi3Error, "the state needs more room than %zu bytes", size);
        return fmi3Error;
    }
    (void)memcpy(bytes, saved->bytes, saved->size);
    return fmi3OK;
}

/* It is judged where it is set. */
fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    fmi3FreeFMUState(instance, state);
    saved_t *saved = calloc(1u, sizeof *saved + size);
    if (saved == NULL) {
        fmu_log(instance, fmi3Error, "no memory left for a state");
        return fmi3Error;
    }
    saved->size = size;
    (void)memcpy(saved->bytes, bytes, size);
    *state = saved;
    return fmi3OK;
}
