/* FMI 3.0: the state of an instance. */
#include "fmi3Functions.h"
#include "fmu.h"
#include "math/crc32.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STATE_MAGIC 0x4C46534Du

typedef struct head {
    uint32_t magic;
    uint32_t crc; /* CRC-32 of what follows it, in a serialised state; 0 in others */
    uint64_t samples;
    double start_time;
    uint32_t phase;
    char token[68];
} head_t;

enum { CRC_ENDS = 8 };

typedef struct saved {
    size_t size;
    uint8_t bytes[];
} saved_t;

/* Room for a state; NULL: none left, which is said. */
static saved_t *new_saved(fmu_t *fmu, size_t size)
{
    saved_t *saved = calloc(1u, sizeof *saved + size);
    if (saved != NULL) {
        saved->size = size;
    } else {
        fmu_log(fmu, fmi3Error, "no memory left for a state");
    }
    return saved;
}

static bool has_model_state(const fmu_t *fmu)
{
    return (fmu->phase >= (uint32_t)FMU_INITIALIZING) && !fmu->changed;
}

static uint32_t checksum(const uint8_t *bytes, size_t size)
{
    uint32_t crc = CRC32_START;
    for (size_t i = CRC_ENDS; i < size; i++) {
        crc = crc32_shift(crc ^ bytes[i], 8u);
    }
    return ~crc;
}

static size_t values_size(void)
{
    return sizeof(head_t) + (model_variables * (sizeof(double) + 1u));
}

static void save(const fmu_t *fmu, uint8_t *bytes)
{
    const size_t values = model_variables * sizeof fmu->value[0];
    head_t head = {STATE_MAGIC, 0u, fmu->samples, fmu->start_time, fmu->phase, {0}};
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
    saved_t *saved = new_saved(fmu, size);
    if (saved != NULL) {
        save(fmu, saved->bytes);
        *state = saved;
    }
    return (saved != NULL) ? fmi3OK : fmi3Error;
}

/* Why bytes are no state of this FMU; NULL: they are one. */
static const char *fault(const uint8_t *bytes, size_t size)
{
    head_t head = {0};
    const bool has_head = size >= sizeof head;
    if (has_head) {
        (void)memcpy(&head, bytes, sizeof head);
        head.token[sizeof head.token - 1u] = '\0';
    }
    const char *found = NULL;
    if (!has_head || (head.magic != STATE_MAGIC)) {
        found = "they do not begin as one";
    } else if (strncmp(head.token, model_token, sizeof head.token - 1u) != 0) {
        found = "they are a state of another FMU, or of another version of this one";
    } else if ((size < values_size()) || (head.crc != checksum(bytes, size))) {
        found = "they are damaged or incomplete, as their CRC-32 is wrong";
    } else {
        /* none */
    }
    return found;
}

/* Values first, as the model starts from them; again after that, as it has set the outputs. */
static bool restore(fmu_t *fmu, const uint8_t *bytes, size_t size)
{
    head_t head;
    const size_t values = model_variables * sizeof fmu->value[0];
    (void)memcpy(&head, bytes, sizeof head);
    (void)memcpy(fmu->value, &bytes[sizeof head], values);
    bool is_whole = (head.phase < (uint32_t)FMU_INITIALIZING);
    fmu->changed = true;
    if (size > values_size()) {
        is_whole =
            (fmu_started(fmu) == fmi3OK) && model_state_restore(fmu, &bytes[values_size()], size - values_size());
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
    const uint32_t crc = checksum(bytes, saved->size);
    (void)memcpy(&bytes[offsetof(head_t, crc)], &crc, sizeof crc);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size, fmi3FMUState *state)
{
    fmi3FreeFMUState(instance, state);
    const char *wrong = fault(bytes, size);
    if (wrong != NULL) {
        fmu_log(instance, fmi3Error, "%zu bytes are no state of this FMU: %s", size, wrong);
        return fmi3Error;
    }
    saved_t *saved = new_saved(instance, size);
    if (saved != NULL) {
        (void)memcpy(saved->bytes, bytes, size);
        *state = saved;
    }
    return (saved != NULL) ? fmi3OK : fmi3Error;
}
