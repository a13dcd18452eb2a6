/* Runs the estimator over recorded samples and writes, for every sample, the time it took and the stack it used.
 *
 *     budget OUTPUT update|tick|bounce [model=N estimator=N preload=N adaptation=N mitigation=N] [SETTING=BITS …] [dither_rms=BITS]
 *         [paint=0]
 *
 * All numbers are hexadecimal, those of settings and torque the bits of a float. The samples lie in flash, behind a
 * header_t: for `update` lever_sample_t, each one measured call of lever_update(); for `tick` two frames for a sample,
 * measured from the first lever_on_frame() to the lever_next_frame() that returns false. OUTPUT gets an intro_t, a
 * record_t for each sample, and the last lever_estimate_t. Time is in ticks of SysTick. Without painting, the stack is
 * not measured. */
#include "semihosting.h"

#include "lever_cdkf.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* SysTick, ARMv7-M ARM B3.3: counts down 24 bits from the processor's clock. */
#define SYST_CSR (*(volatile uint32_t *)0xE000E010u)
#define SYST_RVR (*(volatile uint32_t *)0xE000E014u)
#define SYST_CVR (*(volatile uint32_t *)0xE000E018u)
#define SYST_ENABLE_FROM_PROCESSOR_CLOCK 5u
#define SYST_MASK 0xFFFFFFu

#define CALIBRATION_ROUNDS 100000u /* of two instructions each */
#define SAMPLES_A_COMMAND 500u
#define PAINT 0xC5A5C5A5u
#define PAINTED_WORDS 1024u /* below the stack pointer: more than any call of the core may take */

typedef struct header {
    uint32_t count;
    uint32_t record_bytes;
} header_t;

typedef struct wire_frame {
    uint16_t id;
    uint8_t data[8];
} wire_frame_t;

typedef struct intro {
    uint32_t empty_ticks;       /* between two readings with nothing in between */
    uint32_t calibration_ticks; /* of 2 * calibration_rounds instructions, and the former */
    uint32_t calibration_rounds;
    uint32_t init_stack; /* bytes that lever_init() took, and so on */
    uint32_t command_stack;
    uint32_t platform_stack;
    uint32_t estimate_stack;
    uint32_t health_stack;
    uint32_t init_ticks;
    uint32_t said_bytes; /* of the said_t at the end */
} intro_t;

typedef struct record {
    uint32_t ticks;
    uint32_t faults;
    uint16_t stack; /* bytes that the measured calls took at most */
    uint8_t mode;
    uint8_t frames; /* sent */
} record_t;

/* What the instance says after the last sample. */
typedef struct said {
    lever_estimate_t estimate;
    lever_stability_t stability;
    lever_correction_t correction;
} said_t;

/* A header_t, and behind it the samples: image.ld, and QEMU's loader. */
extern const uint8_t samples_in_flash[];

static lever_memory_t memory;
static const lever_platform_t platform; /* a machine with nothing to report */
static record_t records[1024];
static uint32_t record_count;
static uint32_t output;
static uint32_t painted_words = PAINTED_WORDS;

/* --- measuring ------------------------------------------------------------------------------------------------- */

static inline uint32_t elapsed(uint32_t begin, uint32_t end)
{
    return (begin - end) & SYST_MASK;
}

static inline uint32_t *stack_pointer(void)
{
    uint32_t *sp;
    __asm volatile("mov %0, sp" : "=r"(sp));
    return sp;
}

/* Both are inlined, so that the caller's stack pointer is meant, and use no stack themselves: it is what they look
 * at. */
__attribute__((always_inline)) static inline void paint_stack(void)
{
    volatile uint32_t *word = stack_pointer();
    for (uint32_t i = 1u; i <= painted_words; i++) {
        word[-(int32_t)i] = PAINT;
    }
}

__attribute__((always_inline)) static inline uint16_t stack_used(void)
{
    const volatile uint32_t *word = stack_pointer();
    uint32_t used = painted_words;
    while ((used > 0u) && (word[-(int32_t)used] == PAINT)) {
        used--;
    }
    return (uint16_t)(used * sizeof *word);
}

static intro_t calibrate(void)
{
    intro_t intro;
    (void)memset(&intro, 0, sizeof intro);
    uint32_t begin = SYST_CVR;
    uint32_t end = SYST_CVR;
    intro.empty_ticks = elapsed(begin, end);

    uint32_t rounds = CALIBRATION_ROUNDS;
    intro.calibration_rounds = rounds;
    begin = SYST_CVR;
    __asm volatile("1: subs %0, %0, #1\n bne 1b" : "+l"(rounds) : : "cc");
    end = SYST_CVR;
    intro.calibration_ticks = elapsed(begin, end);
    return intro;
}

/* --- results --------------------------------------------------------------------------------------------------- */

static void flush(void)
{
    semihosting_write(output, records, record_count * (uint32_t)sizeof records[0]);
    record_count = 0u;
}

static void keep(lever_t *lever, uint32_t ticks, uint16_t stack, uint32_t frames)
{
    lever_health_t health;
    lever_health(lever, &health);
    record_t *record = &records[record_count];
    record->ticks = ticks;
    record->stack = stack;
    record->faults = health.faults;
    record->mode = (uint8_t)health.mode;
    record->frames = (uint8_t)frames;
    record_count++;
    if (record_count == (sizeof records / sizeof records[0])) {
        flush();
    }
}

/* --- what is measured ------------------------------------------------------------------------------------------ */

static uint32_t sample_count(void)
{
    return ((const header_t *)(const void *)samples_in_flash)->count;
}

static const void *first_sample(void)
{
    return samples_in_flash + sizeof(header_t);
}

/* The torque gate closes when no command comes for a second. */
static void keep_alive(lever_t *lever, const lever_command_t *command, uint32_t sample)
{
    if ((sample % SAMPLES_A_COMMAND) == 0u) {
        (void)lever_command(lever, command);
    }
}

static void update_all(lever_t *lever, const lever_command_t *command)
{
    const lever_sample_t *samples = (const lever_sample_t *)first_sample();
    const uint32_t count = sample_count();
    for (uint32_t i = 0u; i < count; i++) {
        keep_alive(lever, command, i);
        paint_stack();
        const uint32_t begin = SYST_CVR;
        (void)lever_update(lever, &samples[i]);
        const uint32_t end = SYST_CVR;
        const uint16_t stack = stack_used();
        keep(lever, elapsed(begin, end), stack, 0u);
    }
}

/* As port/loop.c does it. */
static void tick_all(lever_t *lever, const lever_command_t *command)
{
    const wire_frame_t *wire = (const wire_frame_t *)first_sample();
    const uint32_t count = sample_count();
    for (uint32_t i = 0u; i < count; i++) {
        lever_frame_t in[2];
        lever_frame_t out;
        uint32_t sent = 0u;
        for (uint32_t k = 0u; k < 2u; k++) {
            const wire_frame_t *frame = &wire[(2u * i) + k];
            in[k].id = frame->id;
            in[k].length = 8u;
            (void)memcpy(in[k].data, frame->data, sizeof in[k].data);
        }
        keep_alive(lever, command, i);
        paint_stack();
        const uint32_t begin = SYST_CVR;
        (void)lever_on_frame(lever, &in[0]);
        if (lever_on_frame(lever, &in[1]) == LEVER_FRAME_SAMPLE) {
            lever_platform(lever, &platform);
            (void)lever_step(lever);
            while (lever_next_frame(lever, &out)) {
                sent++;
            }
        }
        const uint32_t end = SYST_CVR;
        const uint16_t stack = stack_used();
        keep(lever, elapsed(begin, end), stack, sent);
    }
}

/* --- arguments ------------------------------------------------------------------------------------------------- */

/* KEY=BITS into configuration or command; ends the program when there is no such key. */
static void take_argument(char *word, lever_config_t *config, lever_command_t *command)
{
    char *value = strchr(word, '=');
    if (value == NULL) {
        semihosting_exit("an argument without =");
        return;
    }
    *value = '\0';
    const uint32_t bits = (uint32_t)strtoul(value + 1, NULL, 16);
    uint8_t *choices[] = {
        &config->model, &config->preload, &config->estimator, &config->adaptation, &config->mitigation};
    static const char *const names[] = {"model", "preload", "estimator", "adaptation", "mitigation"};
    void *target = (strcmp(word, "dither_rms") == 0) ? (void *)&command->dither_rms : NULL;
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        if (strcmp(word, lever_setting(i)->name) == 0) {
            target = (float *)&config->settings + i;
        }
    }
    for (uint32_t i = 0u; i < (sizeof names / sizeof names[0]); i++) {
        if (strcmp(word, names[i]) == 0) {
            *choices[i] = (uint8_t)bits;
            return;
        }
    }
    if (strcmp(word, "paint") == 0) {
        target = &painted_words;
    }
    if (target == NULL) {
        semihosting_exit(word);
        return;
    }
    (void)memcpy(target, &bits, sizeof bits);
}

/* Of a helicopter of the size of a UH-60, geared by 0.5. */
static const lever_aircraft_t aircraft = {.count = 24u,
    .frequency = {1.5f, 1.613f, 1.735f, 1.866f, 2.007f, 2.158f, 2.321f, 2.497f, 2.685f, 2.888f, 3.106f, 3.34f, 3.592f,
        3.864f, 4.155f, 4.469f, 4.807f, 5.169f, 5.56f, 5.979f, 6.431f, 6.916f, 7.438f, 8.0f},
    .real = {44.33f, 43.35f, 42.14f, 40.64f, 38.76f, 36.37f, 33.32f, 29.37f, 24.21f, 17.42f, 8.46f, -3.188f, -17.74f,
        -34.37f, -50.28f, -60.96f, -62.94f, -56.81f, -46.28f, -34.98f, -24.92f, -16.74f, -10.39f, -5.602f},
    .imaginary = {-27.12f, -29.94f, -32.99f, -36.32f, -39.95f, -43.92f, -48.23f, -52.89f, -57.81f, -62.81f, -67.42f,
        -70.76f, -71.26f, -66.72f, -55.16f, -36.99f, -16.28f, 1.557f, 13.58f, 19.95f, 22.27f, 22.11f, 20.63f, 18.5f},
    .gain_sigma = 0.05f,
    .phase_sigma = 0.05f,
    .warning = 3.0f,
    .alarm = 1.5f};

/* The instance as the arguments want it; measures the stack of the calls that are made once. */
static lever_t *start(const lever_config_t *config, const lever_command_t *command, intro_t *intro)
{
    lever_health_t health;
    lever_estimate_t estimate;
    paint_stack();
    const uint32_t begin = SYST_CVR;
    lever_t *lever = lever_init(&memory, config);
    const uint32_t end = SYST_CVR;
    intro->init_stack = stack_used();
    intro->init_ticks = elapsed(begin, end);
    if (lever == NULL) {
        semihosting_exit(lever_config_check(config));
    }
    paint_stack();
    const bool known = lever_command(lever, command);
    intro->command_stack = stack_used();
    if (!known) {
        semihosting_exit("command refused");
    }
    paint_stack();
    lever_platform(lever, &platform);
    intro->platform_stack = stack_used();
    paint_stack();
    lever_estimate(lever, &estimate);
    intro->estimate_stack = stack_used();
    paint_stack();
    lever_health(lever, &health);
    intro->health_stack = stack_used();
    intro->said_bytes = sizeof(said_t);
    return lever;
}

int main(void)
{
    static char arguments[1024];
    lever_config_t config;
    lever_command_t command = {(uint8_t)LEVER_REQUEST_NONE, (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP,
        (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP, 0.0f};
    SYST_RVR = SYST_MASK;
    SYST_CVR = 0u;
    SYST_CSR = SYST_ENABLE_FROM_PROCESSOR_CLOCK;

    semihosting_arguments(arguments, sizeof arguments);
    (void)strtok(arguments, " ");
    const char *path = strtok(NULL, " ");
    const char *what = strtok(NULL, " ");
    lever_config_default(&config);
    for (char *word = strtok(NULL, " "); word != NULL; word = strtok(NULL, " ")) {
        take_argument(word, &config, &command);
    }
    output = semihosting_create(path);
    intro_t intro = calibrate();
    lever_t *lever = start(&config, &command, &intro);
    semihosting_write(output, &intro, sizeof intro);
    if (strcmp(what, "bounce") == 0) {
        (void)lever_aircraft(lever, &aircraft);
    }
    if (strcmp(what, "tick") == 0) {
        tick_all(lever, &command);
    } else {
        update_all(lever, &command);
    }
    flush();
    static said_t said;
    lever_estimate(lever, &said.estimate);
    lever_stability(lever, &said.stability);
    lever_correction(lever, &said.correction);
    semihosting_write(output, &said, sizeof said);
    return 0;
}
