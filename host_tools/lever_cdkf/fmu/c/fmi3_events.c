/* FMI 3.0: event mode, clocks and binary variables, for models with FMU_EVENTS. */
#include "fmi3Functions.h"
#include "fmu.h"

/* --- modes -------------------------------------------------------------------------------------------------------- */

static fmi3Status change_phase(fmi3Instance instance, enum fmu_phase from, enum fmu_phase to, const char *function)
{
    fmu_t *fmu = instance;
    const bool may = fmu_is_in(fmu, from, function);
    if (may) {
        fmu->phase = (uint32_t)to;
    }
    return may ? fmi3OK : fmi3Error;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance instance)
{
    return change_phase(instance, FMU_INSTANTIATED, FMU_CONFIGURING, "fmi3EnterConfigurationMode");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance instance)
{
    return change_phase(instance, FMU_CONFIGURING, FMU_INSTANTIATED, "fmi3ExitConfigurationMode");
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return change_phase(instance, FMU_STEPPING, FMU_EVENT, "fmi3EnterEventMode");
}

fmi3Status fmi3EnterStepMode(fmi3Instance instance)
{
    return change_phase(instance, FMU_EVENT, FMU_STEPPING, "fmi3EnterStepMode");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance instance)
{
    return fmu_is_in(instance, FMU_EVENT, "fmi3EvaluateDiscreteStates") ? fmi3OK : fmi3Error;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *terminate,
    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next)
{
    fmu_t *fmu = instance;
    if (!fmu_is_in(fmu, FMU_EVENT, "fmi3UpdateDiscreteStates")) {
        return fmi3Error;
    }
    *again = false;
    *terminate = false;
    *nominals = false;
    *values = false;
    *has_next = false;
    *next = 0.0;
    fmu->has_warned = false;
    model_update(fmu);
    return fmu->has_warned ? fmi3Warning : fmi3OK;
}

/* --- values ------------------------------------------------------------------------------------------------------- */

static bool is_of(fmu_t *fmu, fmi3ValueReference reference, enum fmu_type type, bool is_set, const char *function)
{
    const bool is_type = (reference < model_variables) && (model_variable[reference].type == (uint8_t)type);
    const fmu_variable_t *variable = fmu_variable(fmu, reference, is_type, function);
    const bool may = (variable != NULL) && (!is_set || (variable->role == (uint8_t)FMU_INPUT));
    if ((variable != NULL) && !may) {
        fmu_log(fmu, fmi3Error, "%s is no input: it cannot be set", variable->name);
    }
    return may;
}

fmi3Status fmi3SetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count,
    const size_t sizes[], const fmi3Binary values[], size_t value_count)
{
    bool is_done = (count == value_count);
    for (size_t i = 0u; (i < count) && is_done; i++) {
        is_done = is_of(instance, references[i], FMU_BINARY, true, "fmi3SetBinary") &&
                  model_set_binary(instance, references[i], values[i], sizes[i]);
    }
    return is_done ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetBinary(fmi3Instance instance, const fmi3ValueReference references[], size_t count, size_t sizes[],
    fmi3Binary values[], size_t value_count)
{
    bool is_done = (count == value_count);
    for (size_t i = 0u; (i < count) && is_done; i++) {
        is_done = is_of(instance, references[i], FMU_BINARY, false, "fmi3GetBinary");
        if (is_done) {
            model_get_binary(instance, references[i], &values[i], &sizes[i]);
        }
    }
    return is_done ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SetClock(
    fmi3Instance instance, const fmi3ValueReference references[], size_t count, const fmi3Clock values[])
{
    bool is_done = fmu_is_in(instance, FMU_EVENT, "fmi3SetClock");
    for (size_t i = 0u; (i < count) && is_done; i++) {
        is_done = is_of(instance, references[i], FMU_CLOCK, true, "fmi3SetClock");
        if (is_done) {
            model_set_clock(instance, references[i], values[i]);
        }
    }
    return is_done ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetClock(fmi3Instance instance, const fmi3ValueReference references[], size_t count, fmi3Clock values[])
{
    bool is_done = fmu_is_in(instance, FMU_EVENT, "fmi3GetClock");
    for (size_t i = 0u; (i < count) && is_done; i++) {
        is_done = is_of(instance, references[i], FMU_CLOCK, false, "fmi3GetClock");
        if (is_done) {
            values[i] = model_get_clock(instance, references[i]);
        }
    }
    return is_done ? fmi3OK : fmi3Error;
}
