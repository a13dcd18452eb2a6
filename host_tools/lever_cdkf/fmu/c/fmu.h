/* Between the FMI 3.0 interface (fmi3.c, fmi3_values.c) and what is simulated behind it: controller.c, or the pilot of
 * sil/fmu/c. Exactly one of them is in an FMU, and has the functions model_…().
 *
 * All variables of an instance are numbers of type double, whatever their FMI type, at the index of their value
 * reference; a Boolean is 0 or 1, and what is binary or a clock is with the model. This is host code: it allocates with calloc() and prints with vsnprintf().
 */
#ifndef FMU_H
#define FMU_H

#include "fmi3FunctionTypes.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum fmu_type { FMU_FLOAT64, FMU_INT64, FMU_ENUMERATION, FMU_BOOLEAN, FMU_BINARY, FMU_CLOCK };
enum fmu_role { FMU_INDEPENDENT, FMU_STRUCTURALPARAMETER, FMU_PARAMETER, FMU_INPUT, FMU_OUTPUT };
enum fmu_phase { FMU_INSTANTIATED, FMU_CONFIGURING, FMU_INITIALIZING, FMU_EVENT, FMU_STEPPING, FMU_TERMINATED };

typedef struct fmu_variable {
    const char *name;
    uint8_t type; /* enum fmu_type */
    uint8_t role; /* enum fmu_role */
} fmu_variable_t;

typedef struct fmu {
    char *name;
    char *resources; /* path of the FMU's resources, which ends in a separator; may be empty */
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
    bool logs_events;  /* debug logging is on */
    bool changed;      /* parameters have changed since model_start() */
    bool has_warned;   /* since the last step */
    uint32_t phase;    /* enum fmu_phase */
    double start_time; /* [s] */
    uint64_t samples;  /* taken, of `period` each */
    double period;     /* [s], of model_start() */
    double *value;     /* [model_variables] */
    uint8_t *given;    /* [model_variables]: the importer has set it */
    void *model;       /* of the model, from model_new() */
} fmu_t;

/* Sends a message of a status to the importer; a fmi3OK is an event, which goes out with debug logging only. */
void fmu_log(fmu_t *fmu, fmi3Status status, const char *format, ...);

/* Whether an instance is in a phase; says so otherwise. */
bool fmu_is_in(fmu_t *fmu, enum fmu_phase phase, const char *function);

/* Starts the model, where parameters have changed since it was. */
fmi3Status fmu_started(fmu_t *fmu);

/* The variable of a value reference, if it is of the type; NULL otherwise, and said so. */
const fmu_variable_t *fmu_variable(fmu_t *fmu, fmi3ValueReference reference, bool is_type, const char *function);

/* --- what a model has --------------------------------------------------------------------------------------------- */

extern const uint32_t model_variables;
extern const fmu_variable_t model_variable[]; /* by value reference */
extern const double model_start_value[];
extern const char *const model_token; /* instantiationToken */

/* Its own memory; NULL: none left. */
void *model_new(void);
void model_free(void *model);

/* Whether a parameter may have a value; says so otherwise. */
bool model_accepts(fmu_t *fmu, uint32_t variable, double value);

/* At the start, with the values of the parameters; sets `period` and the outputs. False: impossible, and said so. */
bool model_start(fmu_t *fmu);

/* One period, from the inputs; fmi3Discard, and nothing changed, where there is nothing further. */
fmi3Status model_step(fmu_t *fmu);

/* After the last period of a step: sets the outputs. */
void model_put_outputs(fmu_t *fmu);

/* Its state besides the values of the variables, after model_start(). Restoring is of an instance with the same values
 * after model_start(); false: the bytes are not such a state. */
size_t model_state_size(const fmu_t *fmu);
void model_state_save(const fmu_t *fmu, uint8_t *state);
bool model_state_restore(fmu_t *fmu, const uint8_t *state, size_t size);

/* --- what a model with event mode has: FMU_EVENTS is defined in fmu_config.h -------------------------------------- */

/* Binary variables and clocks, at their value reference and of their type. Setting: false where the bytes are too many,
 * and said so. The bytes that are got stand until the next call for the instance. */
bool model_set_binary(fmu_t *fmu, uint32_t variable, const uint8_t *bytes, size_t size);
void model_get_binary(fmu_t *fmu, uint32_t variable, const uint8_t **bytes, size_t *size);
void model_set_clock(fmu_t *fmu, uint32_t variable, bool is_active);
bool model_get_clock(fmu_t *fmu, uint32_t variable);

/* At the end of a step: whether an output clock ticks, so that event mode is needed. */
bool model_ticks(fmu_t *fmu);

/* At the end of an iteration in event mode; sets the outputs. */
void model_update(fmu_t *fmu);

#endif
