/* FMI 3.0: functions that every FMU exports, for what these have not. Each says so and returns fmi3Error. */
#include "fmi3Functions.h"
#include "fmu.h"
#include "fmu_config.h"

#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

static fmi3Status refused(fmi3Instance instance, const char *function)
{
    if (instance != NULL) {
        fmu_log(instance, fmi3Error,
            "%s: this FMU has no such thing; it is for co-simulation, with variables of the types in its description",
            function);
    }
    return fmi3Error;
}

#define REFUSE(name, parameters)                                                                                       \
    fmi3Status name parameters                                                                                         \
    {                                                                                                                  \
        return refused(instance, #name);                                                                               \
    }

#define REFUSE_TYPE(suffix)                                                                                            \
    REFUSE(fmi3Get##suffix, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,               \
                                fmi3##suffix values[], size_t value_count))                                            \
    REFUSE(fmi3Set##suffix, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,               \
                                const fmi3##suffix values[], size_t value_count))

REFUSE_TYPE(Float32)
REFUSE_TYPE(Int8)
REFUSE_TYPE(UInt8)
REFUSE_TYPE(Int16)
REFUSE_TYPE(UInt16)
REFUSE_TYPE(Int32)
REFUSE_TYPE(UInt32)
REFUSE_TYPE(UInt64)
REFUSE_TYPE(String)
#ifndef FMU_EVENTS /* otherwise they are in fmi3_events.c */
REFUSE(fmi3GetBinary, (fmi3Instance instance, const fmi3ValueReference references[], size_t count, size_t sizes[],
                          fmi3Binary values[], size_t value_count))
REFUSE(fmi3SetBinary, (fmi3Instance instance, const fmi3ValueReference references[], size_t count, const size_t sizes[],
                          const fmi3Binary values[], size_t value_count))
REFUSE(fmi3GetClock, (fmi3Instance instance, const fmi3ValueReference references[], size_t count, fmi3Clock values[]))
REFUSE(fmi3SetClock,
    (fmi3Instance instance, const fmi3ValueReference references[], size_t count, const fmi3Clock values[]))

REFUSE(fmi3EnterEventMode, (fmi3Instance instance))
REFUSE(fmi3EnterStepMode, (fmi3Instance instance))
REFUSE(fmi3EnterConfigurationMode, (fmi3Instance instance))
REFUSE(fmi3ExitConfigurationMode, (fmi3Instance instance))
REFUSE(fmi3EvaluateDiscreteStates, (fmi3Instance instance))
REFUSE(
    fmi3UpdateDiscreteStates, (fmi3Instance instance, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                  fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next))
#endif
REFUSE(fmi3ActivateModelPartition, (fmi3Instance instance, fmi3ValueReference clock, fmi3Float64 time))

REFUSE(fmi3GetIntervalDecimal, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                   fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]))
REFUSE(
    fmi3GetIntervalFraction, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                 fmi3UInt64 counters[], fmi3UInt64 resolutions[], fmi3IntervalQualifier qualifiers[]))
REFUSE(fmi3GetShiftDecimal,
    (fmi3Instance instance, const fmi3ValueReference references[], size_t count, fmi3Float64 shifts[]))
REFUSE(fmi3GetShiftFraction, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                 fmi3UInt64 counters[], fmi3UInt64 resolutions[]))
REFUSE(fmi3SetIntervalDecimal,
    (fmi3Instance instance, const fmi3ValueReference references[], size_t count, const fmi3Float64 intervals[]))
REFUSE(fmi3SetIntervalFraction, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                    const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))
REFUSE(fmi3SetShiftDecimal,
    (fmi3Instance instance, const fmi3ValueReference references[], size_t count, const fmi3Float64 shifts[]))
REFUSE(fmi3SetShiftFraction, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                 const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]))

REFUSE(fmi3GetNumberOfVariableDependencies, (fmi3Instance instance, fmi3ValueReference reference, size_t *count))
REFUSE(fmi3GetVariableDependencies,
    (fmi3Instance instance, fmi3ValueReference dependent, size_t dependent_elements[],
        fmi3ValueReference independents[], size_t independent_elements[], fmi3DependencyKind kinds[], size_t count))
REFUSE(
    fmi3GetDirectionalDerivative, (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t unknown_count,
                                      const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
                                      size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count))
REFUSE(fmi3GetAdjointDerivative, (fmi3Instance instance, const fmi3ValueReference unknowns[], size_t unknown_count,
                                     const fmi3ValueReference knowns[], size_t known_count, const fmi3Float64 seed[],
                                     size_t seed_count, fmi3Float64 sensitivity[], size_t sensitivity_count))
REFUSE(fmi3GetOutputDerivatives, (fmi3Instance instance, const fmi3ValueReference references[], size_t count,
                                     const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count))

REFUSE(fmi3EnterContinuousTimeMode, (fmi3Instance instance))
REFUSE(fmi3CompletedIntegratorStep,
    (fmi3Instance instance, fmi3Boolean no_set_before, fmi3Boolean *event_mode, fmi3Boolean *terminate))
REFUSE(fmi3SetTime, (fmi3Instance instance, fmi3Float64 time))
REFUSE(fmi3SetContinuousStates, (fmi3Instance instance, const fmi3Float64 states[], size_t count))
REFUSE(fmi3GetContinuousStateDerivatives, (fmi3Instance instance, fmi3Float64 derivatives[], size_t count))
REFUSE(fmi3GetEventIndicators, (fmi3Instance instance, fmi3Float64 indicators[], size_t count))
REFUSE(fmi3GetContinuousStates, (fmi3Instance instance, fmi3Float64 states[], size_t count))
REFUSE(fmi3GetNominalsOfContinuousStates, (fmi3Instance instance, fmi3Float64 nominals[], size_t count))
REFUSE(fmi3GetNumberOfEventIndicators, (fmi3Instance instance, size_t *count))
REFUSE(fmi3GetNumberOfContinuousStates, (fmi3Instance instance, size_t *count))

static fmi3Instance refused_kind(fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, const char *function)
{
    fmu_t unborn = {.environment = environment, .log = log};
    fmu_log(&unborn, fmi3Error, "%s: this FMU is for co-simulation only", function);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    return refused_kind(environment, log, "fmi3InstantiateModelExchange");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
    fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock)
{
    return refused_kind(environment, log, "fmi3InstantiateScheduledExecution");
}
