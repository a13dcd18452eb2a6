/* A simulated pilot with lever, motor, sensors and cabin behind an FMU: the columns of a scenario, which `lever fmu pilot`
 * has prepared, through the C plants of `lever sim`. fmu_config.h has the true parameters, start values and the token.
 *
 * resources/seed_N.bin, in the byte order and with the pointers of a 64-bit little-endian machine: head_t; offset and
 * block of each pointer in loop_t that is not NULL; bytes of each block; loop_t; the blocks, each from a multiple of 8
 * on. The last blocks are the columns of enum column.
 */
#include "can/e2e.h"
#include "can/messages.h"
#include "fmu.h"
#include "fmu_config.h"
#include "pilot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum {
#define FMU_VARIABLE(name, type, role, unit, start, meaning) AT_##name,
#include "pilot.def"
    FIRST_TRUTH
};

enum column { COLUMN_DITHER, COLUMN_Z_DDOT, COLUMN_TRUTH, COLUMNS = COLUMN_TRUTH + PILOT_TRUTHS };

enum { HISTORIES = LOOP_SIGNALS + 5 };

#define MAGIC 0x54554C4950554D46u
#define LARGEST ((size_t)4u << 30u) /* of a file [bytes] */

const uint32_t model_variables = (uint32_t)FIRST_TRUTH + (uint32_t)PILOT_TRUTHS;
const char *const model_token = FMU_TOKEN;
const double model_start_value[] = {FMU_START_VALUES};
const fmu_variable_t model_variable[] = {
#define FMU_VARIABLE(name, type, role, unit, start, meaning) {#name, FMU_##type, FMU_##role},
#include "pilot.def"
    PILOT_TRUTH_VARIABLES};

typedef struct head {
    uint64_t magic;
    uint64_t loop_bytes;
    uint64_t pointers;
    uint64_t blocks;
} head_t;

typedef struct pointer {
    uint64_t offset;
    uint64_t block;
} pointer_t;

typedef struct pilot {
    loop_t loop;
    uint64_t *file; /* all of it, aligned */
    const double *column[COLUMNS];
    bool has_ended;
    bool has_reported; /* that no torque is connected */
} pilot_t;

void *model_new(void)
{
    return calloc(1u, sizeof(pilot_t));
}

void model_free(void *model)
{
    pilot_t *pilot = model;
    free(pilot->file);
    free(pilot);
}

bool model_accepts(fmu_t *fmu, uint32_t variable, double value)
{
    (void)fmu, (void)variable, (void)value; /* a seed is judged where its file is opened */
    return true;
}

/* --- file ------------------------------------------------------------------------------------------------------------ */

static uint64_t *content_of(const char *path, size_t *size)
{
    uint64_t *content = NULL;
    FILE *file = fopen(path, "rb");
    if (file != NULL) {
        const long end = (fseek(file, 0, SEEK_END) == 0) ? ftell(file) : -1;
        if ((end > 0) && ((size_t)end < LARGEST) && (fseek(file, 0, SEEK_SET) == 0)) {
            *size = (size_t)end;
            content = calloc((*size / sizeof *content) + 1u, sizeof *content);
            if ((content != NULL) && (fread(content, 1u, *size, file) != *size)) {
                free(content);
                content = NULL;
            }
        }
        (void)fclose(file);
    }
    return content;
}

/* Sets the loop and the columns from a file's content; false: it is not such a file. */
static bool unpack(pilot_t *pilot, size_t size)
{
    const uint8_t *bytes = (const uint8_t *)pilot->file;
    const head_t *head = (const head_t *)(const void *)pilot->file;
    if ((size < sizeof *head) || (head->magic != MAGIC) || (head->loop_bytes != sizeof pilot->loop) ||
        (head->pointers > 64u) || (head->blocks > 64u) || (head->blocks < (uint64_t)COLUMNS)) {
        return false;
    }
    const pointer_t *pointers = (const pointer_t *)(const void *)&bytes[sizeof *head];
    const uint64_t *sizes = (const uint64_t *)(const void *)&pointers[head->pointers];
    size_t at = sizeof *head + (head->pointers * sizeof *pointers) + (head->blocks * sizeof *sizes);
    size_t block[64] = {0u};
    const size_t loop_at = at;
    at += (sizeof pilot->loop + 7u) & ~(size_t)7u;
    for (uint64_t i = 0u; (i < head->blocks) && (at <= size); i++) {
        block[i] = at;
        at += (size_t)((sizes[i] + 7u) & ~(uint64_t)7u);
    }
    if (at != size) {
        return false;
    }
    (void)memcpy(&pilot->loop, &bytes[loop_at], sizeof pilot->loop);
    for (uint64_t i = 0u; i < head->pointers; i++) {
        if ((pointers[i].block >= head->blocks) || (pointers[i].offset > (sizeof pilot->loop - sizeof(void *)))) {
            return false;
        }
        void *to = (uint8_t *)pilot->file + block[pointers[i].block];
        (void)memcpy((uint8_t *)&pilot->loop + pointers[i].offset, &to, sizeof to);
    }
    for (uint32_t i = 0u; i < (uint32_t)COLUMNS; i++) {
        const uint64_t of = head->blocks - (uint64_t)COLUMNS + i;
        pilot->column[i] = (const double *)(const void *)&bytes[block[of]];
        if (sizes[of] != (pilot->loop.count * sizeof(double))) {
            return false;
        }
    }
    return true;
}

bool model_start(fmu_t *fmu)
{
    enum { MORE = 64 };
    pilot_t *pilot = fmu->model;
    const long long seed = (long long)fmu->value[AT_seed];
    const size_t room = strlen(fmu->resources) + (size_t)MORE;
    char *path = calloc(room, 1u);
    size_t size = 0u;
    free(pilot->file);
    (void)memset(pilot, 0, sizeof *pilot);
    if (path != NULL) {
        (void)snprintf(path, room, "%sseed_%lld.bin", fmu->resources, seed);
        pilot->file = content_of(path, &size);
        free(path);
    }
    if (pilot->file == NULL) {
        fmu_log(fmu, fmi3Error,
            "seed = %lld: this FMU was made with the seeds %s; make one with it by "
            "`lever fmu pilot --seed %lld`",
            seed, PILOT_SEEDS, seed);
        return false;
    }
    if (!unpack(pilot, size)) {
        fmu_log(fmu, fmi3Error, "%sseed_%lld.bin is damaged, or of another kind of machine: make the FMU on this one",
            fmu->resources, seed);
        return false;
    }
    fmu->period = (double)pilot->loop.period_us * 1.0e-6;
    pilot_note(&pilot->loop);
    model_put_outputs(fmu);
    return true;
}

/* --- steps ----------------------------------------------------------------------------------------------------------- */

/* An input, or what a frame with it carries: nothing acts that does not fit. */
static double input_of(const fmu_t *fmu, uint32_t at, const loop_field_t *field)
{
    double value = isfinite(fmu->value[at]) ? fmu->value[at] : 0.0;
    if (fmu->value[AT_as_frames] != 0.0) {
        value = pilot_fits(field, value) ? pilot_rounded(field, value) : 0.0;
    }
    return value;
}

static void warn_of_inputs(fmu_t *fmu)
{
    pilot_t *pilot = fmu->model;
    if (!pilot->has_reported && (fmu->given[AT_torque] == 0u)) {
        fmu_log(fmu, fmi3Warning, "input torque has never been set: no torque acts on the lever");
        pilot->has_reported = true;
    } else if (!pilot->has_reported && !(isfinite(fmu->value[AT_torque]) && isfinite(fmu->value[AT_correction]))) {
        fmu_log(fmu, fmi3Warning, "input torque or correction is not a number: it counts as 0");
        pilot->has_reported = true;
    } else {
        /* all there, or reported already */
    }
}

fmi3Status model_step(fmu_t *fmu)
{
    pilot_t *pilot = fmu->model;
    loop_t *loop = &pilot->loop;
    warn_of_inputs(fmu);
    if ((loop->sample + 1u) < loop->count) {
        loop->asked = input_of(fmu, AT_torque, &loop->torque_field);
        loop->correction = input_of(fmu, AT_correction, &loop->correction_field);
        pilot_age_correction(loop);
        pilot_advance(loop);
        loop->sample++;
        pilot_note(loop);
    } else {
        if (fmu->samples == loop->count) { /* the first step beyond the end */
            fmu_log(fmu, fmi3Warning,
                "the scenario has ended, after %.9g s: the lever stays where it is, and there are no samples",
                (double)loop->count * fmu->period);
        }
        pilot->has_ended = true;
    }
    return fmi3OK;
}

/* --- outputs --------------------------------------------------------------------------------------------------------- */

static void put(fmu_t *fmu, uint32_t at, double value, bool valid)
{
    fmu->value[at] = valid ? value : 0.0;
    fmu->value[at + 1u] = valid ? 1.0 : 0.0;
}

/* Readings as the estimator decodes them from frames. */
static void put_framed(fmu_t *fmu, const loop_t *loop)
{
    lever_frame_t frame;
    message_lever_sample_t lever = {0};
    message_base_sample_t base = {0};
    message_grip_sample_t grip = {0};
    pilot_lever_sample(loop, loop->sample, &frame);
    (void)message_lever_sample_decode(&lever, &frame);
    pilot_base_sample(loop, loop->sample, &frame);
    (void)message_base_sample_decode(&base, &frame);
    if (loop->has_grip) {
        pilot_grip_sample(loop, loop->sample, &frame);
        (void)message_grip_sample_decode(&grip, &frame);
    }
    const bool has_lever = (loop->no_lever[loop->sample] == 0u);
    put(fmu, AT_theta, (double)lever.theta, has_lever && lever.theta_valid);
    put(fmu, AT_theta_dot, (double)lever.theta_dot, has_lever && lever.theta_dot_valid);
    put(fmu, AT_tau_m, (double)lever.tau_m, has_lever && lever.tau_m_valid);
    put(fmu, AT_z_ddot, (double)base.z_ddot, base.z_ddot_valid);
    put(fmu, AT_grip_force, (double)grip.grip_force, grip.grip_force_valid);
}

/* What does not fit into a frame is not available. */
static void put_reading(fmu_t *fmu, uint32_t at, const loop_t *loop, enum loop_signal which, bool is_sent)
{
    const double value = pilot_reading(loop, which, loop->sample);
    put(fmu, at, value, is_sent && pilot_fits(&loop->sensor[which].field, value));
}

static void put_readings(fmu_t *fmu, const loop_t *loop)
{
    const bool has_lever = (loop->no_lever[loop->sample] == 0u);
    put_reading(fmu, AT_theta, loop, LOOP_THETA, has_lever);
    put_reading(fmu, AT_theta_dot, loop, LOOP_THETA_DOT, has_lever);
    put_reading(fmu, AT_tau_m, loop, LOOP_TAU_M, has_lever);
    put_reading(fmu, AT_z_ddot, loop, LOOP_Z_DDOT, true);
    if (loop->has_grip) {
        put_reading(fmu, AT_grip_force, loop, LOOP_GRIP_FORCE, true);
    }
}

void model_put_outputs(fmu_t *fmu)
{
    const pilot_t *pilot = fmu->model;
    const loop_t *loop = &pilot->loop;
    const uint32_t sample = loop->sample;
    if (fmu->value[AT_as_frames] != 0.0) {
        put_framed(fmu, loop);
    } else {
        put_readings(fmu, loop);
    }
    fmu->value[AT_sampled] = ((loop->no_base[sample] == 0u) && !pilot->has_ended) ? 1.0 : 0.0;
    fmu->value[AT_dither_rms] = pilot->column[COLUMN_DITHER][sample];
    fmu->value[AT_true_theta] = loop->plant.theta;
    fmu->value[AT_true_theta_dot] = loop->plant.theta_dot;
    fmu->value[AT_true_tau_m] = loop->plant.tau_m;
    fmu->value[AT_true_z_ddot] = loop->cabin.exists ? loop->cabin.seat[sample] : pilot->column[COLUMN_Z_DDOT][sample];
    for (uint32_t i = 0u; i < (uint32_t)PILOT_TRUTHS; i++) {
        fmu->value[(uint32_t)FIRST_TRUTH + i] = pilot->column[(uint32_t)COLUMN_TRUTH + i][sample];
    }
}

/* --- state ----------------------------------------------------------------------------------------------------------- */

/* What changes on the way, besides the histories. */
typedef struct moving {
    uint64_t sample;
    double theta;
    double theta_dot;
    double tau_m;
    double grip_force;
    double s;
    double s_dot;
    double rest_sine;
    double forces[PLANT_ELEMENTS];
    double cabin[AIRCRAFT_STATES];
    double pitch;
    double speed;
    uint32_t silent_us;
    uint8_t has_ended;
    uint8_t has_reported;
    uint8_t unused[2];
} moving_t;

static void list_histories(loop_t *loop, double *history[HISTORIES])
{
    for (uint32_t i = 0u; i < (uint32_t)LOOP_SIGNALS; i++) {
        history[i] = loop->signal[i];
    }
    history[LOOP_SIGNALS] = loop->cabin.felt;
    history[LOOP_SIGNALS + 1] = loop->cabin.aircraft.lever;
    history[LOOP_SIGNALS + 2] = loop->cabin.aircraft.correction;
    history[LOOP_SIGNALS + 3] = loop->plant.reflex_force;
    history[LOOP_SIGNALS + 4] = loop->cabin.seat;
}

/* Of a history there are values up to this sample. */
static size_t history_bytes(const loop_t *loop, uint64_t sample)
{
    return (size_t)((sample < loop->count) ? (sample + 1u) : loop->count) * sizeof(double);
}

static size_t state_size(loop_t *loop, uint64_t sample)
{
    double *history[HISTORIES];
    size_t size = sizeof(moving_t);
    list_histories(loop, history);
    for (uint32_t i = 0u; i < (uint32_t)HISTORIES; i++) {
        size += (history[i] != NULL) ? history_bytes(loop, sample) : 0u;
    }
    return size;
}

size_t model_state_size(const fmu_t *fmu)
{
    pilot_t *pilot = fmu->model;
    return state_size(&pilot->loop, pilot->loop.sample);
}

static moving_t moving_of(const pilot_t *pilot)
{
    const loop_t *loop = &pilot->loop;
    const plant_t *plant = &loop->plant;
    moving_t moving = {.sample = loop->sample,
        .theta = plant->theta,
        .theta_dot = plant->theta_dot,
        .tau_m = plant->tau_m,
        .grip_force = plant->grip_force,
        .s = plant->s,
        .s_dot = plant->s_dot,
        .rest_sine = plant->rest_sine,
        .pitch = loop->cabin.aircraft.pitch,
        .speed = loop->cabin.speed,
        .silent_us = loop->silent_us,
        .has_ended = pilot->has_ended ? 1u : 0u,
        .has_reported = pilot->has_reported ? 1u : 0u};
    (void)memcpy(moving.forces, plant->forces, sizeof moving.forces);
    (void)memcpy(moving.cabin, loop->cabin.aircraft.state, sizeof moving.cabin);
    return moving;
}

void model_state_save(const fmu_t *fmu, uint8_t *state)
{
    pilot_t *pilot = fmu->model;
    double *history[HISTORIES];
    const moving_t moving = moving_of(pilot);
    const size_t bytes = history_bytes(&pilot->loop, moving.sample);
    size_t at = sizeof moving;
    (void)memcpy(state, &moving, sizeof moving);
    list_histories(&pilot->loop, history);
    for (uint32_t i = 0u; i < (uint32_t)HISTORIES; i++) {
        if (history[i] != NULL) {
            (void)memcpy(&state[at], history[i], bytes);
            at += bytes;
        }
    }
}

static void move_to(pilot_t *pilot, const moving_t *moving)
{
    loop_t *loop = &pilot->loop;
    plant_t *plant = &loop->plant;
    loop->sample = (uint32_t)moving->sample;
    plant->theta = moving->theta;
    plant->theta_dot = moving->theta_dot;
    plant->tau_m = moving->tau_m;
    plant->grip_force = moving->grip_force;
    plant->s = moving->s;
    plant->s_dot = moving->s_dot;
    plant->rest_sine = moving->rest_sine;
    (void)memcpy(plant->forces, moving->forces, sizeof plant->forces);
    (void)memcpy(loop->cabin.aircraft.state, moving->cabin, sizeof moving->cabin);
    loop->cabin.aircraft.pitch = moving->pitch;
    loop->cabin.speed = moving->speed;
    loop->silent_us = moving->silent_us;
    pilot->has_ended = (moving->has_ended != 0u);
    pilot->has_reported = (moving->has_reported != 0u);
}

bool model_state_restore(fmu_t *fmu, const uint8_t *state, size_t size)
{
    pilot_t *pilot = fmu->model;
    double *history[HISTORIES];
    moving_t moving;
    if (size < sizeof moving) {
        return false;
    }
    (void)memcpy(&moving, state, sizeof moving);
    if ((moving.sample >= pilot->loop.count) || (size != state_size(&pilot->loop, moving.sample))) {
        return false;
    }
    const size_t bytes = history_bytes(&pilot->loop, moving.sample);
    size_t at = sizeof moving;
    list_histories(&pilot->loop, history);
    for (uint32_t i = 0u; i < (uint32_t)HISTORIES; i++) {
        if (history[i] != NULL) {
            (void)memcpy(history[i], &state[at], bytes);
            at += bytes;
        }
    }
    move_to(pilot, &moving);
    return true;
}
