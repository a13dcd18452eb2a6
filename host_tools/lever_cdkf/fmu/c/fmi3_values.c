/* FMI 3.0: getting and setting variables. */
#include "fmi3Functions.h"
#include "fmu.h"

#include <math.h>

const fmu_variable_t *fmu_variable(fmu_t *fmu, fmi3ValueReference reference, bool is_type, const char *function)
{
    const fmu_variable_t *variable = NULL;
    if (reference >= model_variables) {
        fmu_log(fmu, fmi3Error, "%s: there is no variable with the value reference %u", function, (unsigned)reference);
    } else if (!is_type) {
        fmu_log(fmu, fmi3Error, "%s: %s is of another type", function, model_variable[reference].name);
    } else {
        variable = &model_variable[reference];
    }
    return variable;
}

static bool has_type(fmi3ValueReference reference, enum fmu_type type)
{
    bool is = false;
    if (reference < model_variables) {
        const enum fmu_type own = (enum fmu_type)model_variable[reference].type;
        is = (own == type) || ((own == FMU_ENUMERATION) && (type == FMU_INT64));
    }
    return is;
}

/* Before a variable is read: outputs follow parameters that have changed, up to the end of initialization. */
static fmi3Status fresh(fmu_t *fmu)
{
    fmi3Status status = fmi3OK;
    if ((fmu->phase == (uint32_t)FMU_INITIALIZING) && fmu->changed) {
        fmu->changed = !model_start(fmu);
        status = fmu->changed ? fmi3Error : fmi3OK;
    }
    return status;
}

static bool may_set(fmu_t *fmu, const fmu_variable_t *variable)
{
    const bool early = (fmu->phase == (uint32_t)FMU_INSTANTIATED) || (fmu->phase == (uint32_t)FMU_INITIALIZING);
    bool may = false;
    if (variable->role == (uint8_t)FMU_INPUT) {
        may = true;
    } else if (variable->role == (uint8_t)FMU_PARAMETER) {
        may = early;
        if (!may) {
            fmu_log(fmu, fmi3Error, "parameter %s is fixed: set it before the simulation starts", variable->name);
        }
    } else if (variable->role == (uint8_t)FMU_STRUCTURALPARAMETER) {
        may = fmu_is_in(fmu, FMU_CONFIGURING, variable->name);
    } else {
        fmu_log(fmu, fmi3Error, "%s is no input and no parameter: it cannot be set", variable->name);
    }
    return may;
}

static fmi3Status set(fmu_t *fmu, fmi3ValueReference reference, const fmu_variable_t *variable, double value)
{
    fmi3Status status = fmi3Error;
    if (may_set(fmu, variable)) {
        const bool is_parameter = (variable->role != (uint8_t)FMU_INPUT);
        if (!is_parameter || model_accepts(fmu, reference, value)) {
            fmu->value[reference] = value;
            fmu->given[reference] = 1u;
            fmu->changed = fmu->changed || is_parameter;
            status = fmi3OK;
        }
    }
    return status;
}

/* Every variable is a scalar. */
static bool counts(fmu_t *fmu, size_t references, size_t values, const char *function)
{
    if (references != values) {
        fmu_log(fmu, fmi3Error, "%s: %zu value references, but %zu values", function, references, values);
    }
    return references == values;
}

/* The functions of an FMI type: their C type, enum fmu_type, and how a number becomes such a value. */
#define VALUES(suffix, ctype, type, from_number)                                                                       \
    fmi3Status fmi3Get##suffix(fmi3Instance instance, const fmi3ValueReference references[], size_t count,             \
        ctype values[], size_t value_count)                                                                            \
    {                                                                                                                  \
        fmu_t *fmu = instance;                                                                                         \
        fmi3Status status = counts(fmu, count, value_count, "fmi3Get" #suffix) ? fresh(fmu) : fmi3Error;               \
        for (size_t i = 0u; (i < count) && (status == fmi3OK); i++) {                                                  \
            if (fmu_variable(fmu, references[i], has_type(references[i], type), "fmi3Get" #suffix) != NULL) {          \
                values[i] = from_number(fmu->value[references[i]]);                                                    \
            } else {                                                                                                   \
                status = fmi3Error;                                                                                    \
            }                                                                                                          \
        }                                                                                                              \
        return status;                                                                                                 \
    }                                                                                                                  \
    fmi3Status fmi3Set##suffix(fmi3Instance instance, const fmi3ValueReference references[], size_t count,             \
        const ctype values[], size_t value_count)                                                                      \
    {                                                                                                                  \
        fmu_t *fmu = instance;                                                                                         \
        fmi3Status status = counts(fmu, count, value_count, "fmi3Set" #suffix) ? fmi3OK : fmi3Error;                   \
        for (size_t i = 0u; (i < count) && (status == fmi3OK); i++) {                                                  \
            const fmu_variable_t *variable =                                                                           \
                fmu_variable(fmu, references[i], has_type(references[i], type), "fmi3Set" #suffix);                    \
            status = (variable != NULL) ? set(fmu, references[i], variable, (double)values[i]) : fmi3Error;            \
        }                                                                                                              \
        return status;                                                                                                 \
    }

#define AS_FLOAT64(number) (number)
#define AS_INT64(number) ((fmi3Int64)(number))
#define AS_BOOLEAN(number) ((number) != 0.0)

VALUES(Float64, fmi3Float64, FMU_FLOAT64, AS_FLOAT64)
VALUES(Int64, fmi3Int64, FMU_INT64, AS_INT64)
VALUES(Boolean, fmi3Boolean, FMU_BOOLEAN, AS_BOOLEAN)
