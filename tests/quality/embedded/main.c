/* Flies the estimator through all that flight.h has, every model, estimator, preload and adaptation, random settings,
 * and a bus on which everything happens. Two builds that compute alike print alike.
 *
 *     embedded digests    prints a line a run: its name and digest
 *     embedded            before that a line each 100 samples: run, sample, mode, parameters as bits, digest until then
 *     embedded FILE       compares with lines of digests; names what differs, and exits 1 at the first that does
 *     embedded FILE RUN   makes one run, and compares it with all the lines that it prints otherwise; codec is one run
 *
 * The digest is the CRC-32 of every estimate, health and torque, or of every frame. The last run is self_test(). */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "can/e2e.h"
#include "can/messages.h"
#include "flight.h"
#include "port/embedded/crc32.h"
#include "port/embedded/self_test.h"

#define SAMPLES 2000u       /* of a run in which nothing happens */
#define SCENE_SAMPLES 8500u /* of one with a scene */
#define RANDOM_RUNS 24u
#define EVERY 100u

static uint32_t digest;
static bool prints_lines = true;
static FILE *expected;   /* NULL: prints */
static const char *only; /* run; NULL: all */
static char run_name[64];

/* --- output ------------------------------------------------------------------------------------------------------- */

/* Lowest byte first, whatever the machine's order. */
static void put_word(uint32_t word)
{
    const uint8_t byte[4] = {(uint8_t)(word & 0xFFu), (uint8_t)((word >> 8u) & 0xFFu), (uint8_t)((word >> 16u) & 0xFFu),
        (uint8_t)(word >> 24u)};
    digest = crc32_update(digest, byte, 4u);
}

static uint32_t bits_of(float value)
{
    uint32_t bits = 0x7FC00000u; /* of every NaN */
    if (!isnan(value)) {
        (void)memcpy(&bits, &value, sizeof bits);
    }
    return bits;
}

static void put_all(const float value[], uint32_t count)
{
    for (uint32_t i = 0u; i < count; i++) {
        put_word(bits_of(value[i]));
    }
}

static void put_frame(const lever_frame_t *frame)
{
    put_word(frame->id);
    digest = crc32_update(digest, frame->data, frame->length);
}

static void put_line(const char *line)
{
    char wanted[200] = "";
    if (expected == NULL) {
        (void)fputs(line, stdout);
    } else if ((fgets(wanted, (int)sizeof wanted, expected) == NULL) || (strcmp(line, wanted) != 0)) {
        (void)printf("expected %sgot %s", wanted, line);
        exit(1);
    } else {
        /* as expected */
    }
}

static void print_line(uint32_t sample, enum lever_mode mode, const lever_estimate_t *e)
{
    if (prints_lines) {
        char line[200];
        const float *p = e->parameter;
        const float *sigma = e->parameter_sigma;
        (void)snprintf(line, sizeof line,
            "%s %" PRIu32 " %u %08" PRIx32 " %08" PRIx32 " %08" PRIx32 " %08" PRIx32 " %08" PRIx32 " %08" PRIx32
            " %08" PRIx32 "\n",
            run_name, sample, (unsigned int)mode, bits_of(p[0]), bits_of(sigma[0]), bits_of(p[1]), bits_of(sigma[1]),
            bits_of(p[2]), bits_of(sigma[2]), digest);
        put_line(line);
    }
}

/* False: this one is not asked for. */
static bool begin_run(const char *kind, const char *name)
{
    (void)snprintf(run_name, sizeof run_name, "%s.%s", kind, name);
    digest = 0u;
    return (only == NULL) || (strcmp(only, run_name) == 0) || (strcmp(only, kind) == 0);
}

static void end_run(void)
{
    char line[100];
    (void)snprintf(line, sizeof line, "%s %08" PRIx32 "\n", run_name, digest);
    put_line(line);
}

/* --- samples ------------------------------------------------------------------------------------------------------ */

static lever_t *start(const lever_config_t *config)
{
    static lever_memory_t memory;
    lever_t *lever = lever_init(&memory, config);
    if (lever == NULL) {
        (void)fprintf(stderr, "embedded: refused: %s\n", lever_config_check(config));
        exit(2);
    }
    return lever;
}

static void put_estimate(const lever_t *lever, uint32_t sample, enum lever_mode mode)
{
    lever_estimate_t e;
    lever_health_t health;
    lever_correction_t correction;
    lever_estimate(lever, &e);
    lever_health(lever, &health);
    lever_correction(lever, &correction);
    const float value[] = {e.theta, e.theta_sigma, e.theta_dot, e.theta_dot_sigma, e.natural_frequency,
        e.natural_frequency_sigma, e.damping_ratio, e.damping_ratio_sigma, e.trim, e.nis, health.excitation,
        health.torque, correction.angle, correction.weight};
    put_all(value, (uint32_t)(sizeof value / sizeof value[0]));
    put_all(e.parameter, LEVER_PARAMETERS);
    put_all(e.parameter_sigma, LEVER_PARAMETERS);
    put_all(e.parameter_correlation, LEVER_PARAMETERS);
    put_word(e.time_us);
    put_word(((uint32_t)mode << 8u) | e.nis_size);
    put_word(health.faults);
    put_word(health.samples ^ (health.lost << 8u) ^ (health.corrupt << 16u) ^ (health.late << 24u));
    put_word((health.recoveries << 1u) | (health.gate_open ? 1u : 0u));
    if ((sample % EVERY) == 0u) {
        lever_feedthrough_t f;
        lever_feedthrough(lever, 1.0f + (1.0e-3f * (float)sample), &f);
        const float response[] = {f.real, f.imaginary, f.gain_sigma, f.phase_sigma, f.correlation};
        put_all(response, (uint32_t)(sizeof response / sizeof response[0]));
        print_line(sample, mode, &e);
    }
}

static void fly(const char *kind, const lever_config_t *config, const scene_t *scene, uint32_t samples, uint32_t seed)
{
    const lever_command_t alive = {.model = (uint8_t)LEVER_KEEP,
        .preload = (uint8_t)LEVER_KEEP,
        .estimator = (uint8_t)LEVER_KEEP,
        .adaptation = (uint8_t)LEVER_KEEP,
        .mitigation = (uint8_t)LEVER_KEEP,
        .dither_rms = 0.3f};
    if (!begin_run(kind, scene->name)) {
        return;
    }
    arm_t arm = arm_start(seed);
    lever_t *lever = start(config);
    for (uint32_t ms = 0u; ms < samples; ms++) {
        if (scene->happens != NULL) {
            scene->happens(&arm, ms);
        }
        lever_sample_t sample = arm_sample(&arm, ms);
        if ((ms % 900u) == 800u) {
            (void)lever_command(lever, &alive);
        }
        if ((scene->spoils == NULL) || scene->spoils(&arm, ms, &sample)) {
            const enum lever_mode mode = lever_update(lever, &sample);
            put_estimate(lever, ms, mode);
        }
    }
    end_run();
}

static void fly_choices(void)
{
    lever_config_t config;
    char name[40];
    const scene_t quiet = {name, NULL, NULL, scenes[0].spoils};
    lever_config_default(&config);
    for (config.model = 0u; config.model < (uint8_t)LEVER_MODEL_COUNT; config.model++) {
        for (uint8_t choice = 0u; choice < 16u; choice++) {
            config.estimator = choice / 8u;
            config.preload = (choice / 4u) % 2u;
            config.adaptation = choice % 4u;
            config.mitigation = choice % (uint8_t)LEVER_MITIGATION_COUNT;
            (void)snprintf(
                name, sizeof name, "%u.%u.%u.%u", config.model, config.estimator, config.preload, config.adaptation);
            fly("choice", &config, &quiet, SAMPLES, 1u);
        }
    }
}

static void fly_scenes(void)
{
    for (uint32_t i = 0u; i < scene_count; i++) {
        lever_config_t config;
        lever_config_default(&config);
        if (scenes[i].configure != NULL) {
            scenes[i].configure(&config);
        }
        fly("scene", &config, &scenes[i], SCENE_SAMPLES, i + 2u);
    }
}

static void fly_random_settings(void)
{
    arm_t dice = arm_start(99u);
    for (uint32_t i = 0u; i < RANDOM_RUNS; i++) {
        lever_config_t config;
        char name[40];
        scene_t scene = scenes[arm_random(&dice, scene_count)];
        lever_config_default(&config);
        draw_settings(&config, &dice);
        config.model = (uint8_t)arm_random(&dice, LEVER_MODEL_COUNT);
        config.estimator = (uint8_t)arm_random(&dice, LEVER_ESTIMATOR_COUNT);
        config.mitigation = (uint8_t)arm_random(&dice, LEVER_MITIGATION_COUNT);
        (void)snprintf(name, sizeof name, "%s.%" PRIu32, scene.name, i);
        scene.name = name;
        fly("random", &config, &scene, SAMPLES, i);
    }
}

/* --- bus ---------------------------------------------------------------------------------------------------------- */

typedef struct sender {
    arm_t dice;
    lever_t *lever;
    bool rough; /* frames are lost, repeated, damaged */
} sender_t;

static void send(sender_t *sender, lever_frame_t *frame, enum message_data_id data_id, uint32_t counter)
{
    e2e_protect(frame, (uint8_t)data_id, (uint8_t)(counter & 15u));
    const uint32_t fate = sender->rough ? arm_random(&sender->dice, 60u) : 60u;
    uint32_t times = 1u;
    if (fate == 0u) {
        frame->data[arm_random(&sender->dice, 8u)] ^= (uint8_t)(1u << arm_random(&sender->dice, 8u));
    } else if (fate == 1u) {
        frame->length = (uint8_t)arm_random(&sender->dice, 8u);
    } else if (fate == 2u) {
        frame->id ^= 1u << arm_random(&sender->dice, 11u);
    } else if (fate <= 4u) {
        times = (fate - 3u) * 2u; /* lost, or twice */
    } else {
        /* as it is */
    }
    for (; times > 0u; times--) {
        put_word((uint32_t)lever_on_frame(sender->lever, frame));
    }
}

static void send_sample(sender_t *sender, const lever_sample_t *s, uint32_t counter)
{
    const message_lever_sample_t of_lever = {
        s->theta, s->theta_dot, s->tau_m, s->theta_valid, s->theta_dot_valid, s->tau_m_valid};
    const message_grip_sample_t of_grip = {s->grip_force, s->grip_force_valid};
    const message_base_sample_t of_base = {s->time_us, s->z_ddot, s->z_ddot_valid};
    lever_frame_t frame;
    put_word(message_lever_sample_encode(&frame, &of_lever) ? 1u : 0u);
    send(sender, &frame, MESSAGE_LEVER_SAMPLE_DATA_ID, counter);
    put_word(message_grip_sample_encode(&frame, &of_grip) ? 1u : 0u);
    send(sender, &frame, MESSAGE_GRIP_SAMPLE_DATA_ID, counter);
    put_word(message_base_sample_encode(&frame, &of_base) ? 1u : 0u);
    send(sender, &frame, MESSAGE_BASE_SAMPLE_DATA_ID, counter);
}

/* Keeps the torque alive, and now and then asks for something else, which may not exist. */
static void send_command(sender_t *sender, uint32_t count)
{
    const uint8_t keep = (uint8_t)LEVER_KEEP;
    message_command_t command = {(uint8_t)LEVER_REQUEST_NONE, keep, keep, keep, keep, keep, 0.3f};
    lever_frame_t frame;
    if (sender->rough) {
        uint8_t *const choice[] = {&command.request, &command.model, &command.preload, &command.estimator,
            &command.adaptation, &command.mitigation};
        const uint32_t which = arm_random(&sender->dice, 16u);
        command.dither_rms = (arm_random(&sender->dice, 4u) == 0u) ? 0.0f : (0.5f + (0.5f * arm_noise(&sender->dice)));
        command.dither_rms = (arm_random(&sender->dice, 9u) == 0u) ? 70.0f : command.dither_rms;
        if (which < 6u) {
            *choice[which] = (uint8_t)arm_random(&sender->dice, 7u);
        }
    }
    put_word(message_command_encode(&frame, &command) ? 1u : 0u);
    send(sender, &frame, MESSAGE_COMMAND_DATA_ID, count);
}

/* What else is on the bus, and in the machine. */
static void disturb(sender_t *sender, uint32_t ms)
{
    arm_t *dice = &sender->dice;
    if (arm_random(dice, 800u) == 0u) {
        const message_identity_t other = {.page = (uint8_t)arm_random(dice, MESSAGE_PAGE_COUNT)};
        lever_frame_t frame;
        put_word(message_identity_encode(&frame, &other) ? 1u : 0u);
        send(sender, &frame, MESSAGE_IDENTITY_DATA_ID, ms);
    }
    if (arm_random(dice, 300u) == 0u) {
        const lever_platform_t platform = {
            .faults = (uint8_t)((arm_random(dice, 3u) == 0u) ? (1u << arm_random(dice, 8u)) : 0u),
            .transmit_errors = (uint8_t)arm_random(dice, 256u),
            .overruns = (uint16_t)arm_random(dice, 65536u)};
        lever_platform(sender->lever, &platform);
    }
    if (arm_random(dice, 400u) == 0u) {
        for (uint32_t i = arm_random(dice, 12u); i > 0u; i--) {
            lever_idle(sender->lever, 5000u);
            lever_frame_t frame;
            while (lever_next_frame(sender->lever, &frame)) {
                put_frame(&frame);
            }
        }
    }
}

/* Values that a frame cannot hold, or hardly. */
static void exceed(arm_t *dice, lever_sample_t *sample)
{
    float *const value[] = {&sample->theta, &sample->theta_dot, &sample->tau_m, &sample->z_ddot, &sample->grip_force};
    static const float most[] = {3.2767f, 16.3835f, 32.767f, 32.767f, 655.34f};
    const uint32_t which = arm_random(dice, 200u);
    if (which < 5u) {
        *value[which] = most[which] * (1.0f + (4.0e-5f * arm_noise(dice))) * ((arm_noise(dice) < 0.0f) ? -1.0f : 1.0f);
    } else if (which < 10u) {
        *value[which - 5u] = 1000.0f * most[which - 5u] * arm_noise(dice);
    } else {
        /* as it is */
    }
}

static void talk(const char *name, const lever_config_t *config, bool rough, uint32_t samples, uint32_t seed)
{
    lever_aircraft_t aircraft = {.count = 4u,
        .frequency = {1.5f, 3.0f, 4.5f, 8.0f},
        .real = {24.0f, 18.0f, 9.0f, -3.0f},
        .imaginary = {-6.0f, -14.0f, -17.0f, -9.0f},
        .gain_sigma = 0.05f,
        .phase_sigma = 0.05f,
        .warning = 3.0f,
        .alarm = 1.5f};
    if (!begin_run("bus", name)) {
        return;
    }
    const lever_platform_t platform = {.overruns = 1u};
    arm_t arm = arm_start(seed);
    sender_t sender = {arm_start(seed + 1000u), start(config), rough};
    for (uint32_t i = 0u; rough && (i < aircraft.count); i++) { /* nearer to the alarm, and beyond */
        aircraft.real[i] *= 5.0f;
        aircraft.imaginary[i] *= 5.0f;
    }
    lever_platform(sender.lever, &platform);
    (void)lever_aircraft(sender.lever, &aircraft);
    for (uint32_t ms = 0u; ms < samples; ms++) {
        lever_sample_t sample = arm_sample(&arm, ms);
        lever_frame_t frame;
        sample.grip_force = arm.force;
        sample.grip_force_valid = true;
        if ((ms % 400u) == 0u) {
            send_command(&sender, ms / 400u);
        }
        if (rough) {
            disturb(&sender, ms);
            exceed(&sender.dice, &sample);
        }
        send_sample(&sender, &sample, ms);
        const enum lever_mode mode = lever_step(sender.lever);
        while (lever_next_frame(sender.lever, &frame)) {
            put_frame(&frame);
        }
        if ((ms % EVERY) == 0u) {
            lever_estimate_t e;
            lever_estimate(sender.lever, &e);
            print_line(ms, mode, &e);
        }
    }
    end_run();
}

static void talk_on_the_bus(void)
{
    lever_config_t config;
    char name[40];
    lever_config_default(&config);
    for (uint32_t choice = 0u; choice < 8u; choice++) {
        config.model = (uint8_t)(choice / 2u);
        config.estimator = (uint8_t)(choice % 2u);
        config.mitigation = (uint8_t)(choice % (uint32_t)LEVER_MITIGATION_COUNT);
        (void)snprintf(name, sizeof name, "calm.%u.%u", config.model, config.estimator);
        talk(name, &config, false, SAMPLES, choice);
        (void)snprintf(name, sizeof name, "rough.%u.%u", config.model, config.estimator);
        talk(name, &config, true, SCENE_SAMPLES, choice);
    }
}

/* --- codec -------------------------------------------------------------------------------------------------------- */

/* Random payloads, read and written again. */
#define ROUND_TRIP(message, identifier)                                                                                \
    (void)begin_run("codec", #message);                                                                                \
    for (uint32_t round = 0u; round < 300u; round++) {                                                                 \
        message_##message##_t read;                                                                                    \
        lever_frame_t in = {.id = (identifier), .length = 8u};                                                         \
        lever_frame_t out = {.id = 0u};                                                                                \
        (void)memset(&read, 0, sizeof read);                                                                           \
        for (uint32_t i = 0u; i < 8u; i++) {                                                                           \
            in.data[i] = (uint8_t)((arm_random(&dice, 5u) == 0u) ? 0xFFu : arm_random(&dice, 256u));                   \
        }                                                                                                              \
        put_word(message_##message##_decode(&read, &in) ? 1u : 0u);                                                    \
        put_word(message_##message##_encode(&out, &read) ? 1u : 0u);                                                   \
        put_frame(&out);                                                                                               \
    }                                                                                                                  \
    end_run();

static void go_round(void)
{
    if (!begin_run("codec", "all")) {
        return;
    }
    arm_t dice = arm_start(7u);
    ROUND_TRIP(lever_sample, MESSAGE_LEVER_SAMPLE_ID)
    ROUND_TRIP(base_sample, MESSAGE_BASE_SAMPLE_ID)
    ROUND_TRIP(grip_sample, MESSAGE_GRIP_SAMPLE_ID)
    ROUND_TRIP(command, MESSAGE_COMMAND_ID)
    ROUND_TRIP(state_estimate, MESSAGE_STATE_ESTIMATE_ID)
    ROUND_TRIP(pilot_parameters, MESSAGE_PILOT_PARAMETERS_ID)
    ROUND_TRIP(pilot_sigma, MESSAGE_PILOT_SIGMA_ID)
    ROUND_TRIP(pilot_dynamics, MESSAGE_PILOT_DYNAMICS_ID)
    ROUND_TRIP(feedthrough, MESSAGE_FEEDTHROUGH_ID)
    ROUND_TRIP(test_ratio, MESSAGE_TEST_RATIO_ID)
    ROUND_TRIP(stability, MESSAGE_STABILITY_ID)
    ROUND_TRIP(health, MESSAGE_HEALTH_ID)
    ROUND_TRIP(motor_command, MESSAGE_MOTOR_COMMAND_ID)
    ROUND_TRIP(platform_health, MESSAGE_PLATFORM_HEALTH_ID)
    ROUND_TRIP(identity, MESSAGE_IDENTITY_ID)
    ROUND_TRIP(command_ack, MESSAGE_COMMAND_ACK_ID)
    ROUND_TRIP(link_health, MESSAGE_LINK_HEALTH_ID)
    ROUND_TRIP(correction, MESSAGE_CORRECTION_ID)
    ROUND_TRIP(snapshot, MESSAGE_SNAPSHOT_ID)
}

/* --- state -------------------------------------------------------------------------------------------------------- */

/* Its bytes, and those of an instance that goes on from it. */
static void save_states(void)
{
    static const char *const names[] = {"lever", "linear_physical", "linear_black_box", "hand"};
    lever_config_t config;
    lever_config_default(&config);
    for (uint32_t model = 0u; model < (uint32_t)LEVER_MODEL_COUNT; model++) {
        lever_memory_t memory[2];
        uint8_t state[LEVER_STATE_BYTES];
        config.model = (uint8_t)model;
        if (begin_run("state", names[model])) {
            arm_t arm = arm_start(model);
            lever_t *lever = lever_init(&memory[0], &config);
            for (uint32_t ms = 0u; ms < 1500u; ms++) {
                const lever_sample_t sample = arm_sample(&arm, ms);
                (void)lever_update(lever, &sample);
                if (ms == 1000u) {
                    lever_state_save(lever, state);
                    lever = lever_init(&memory[1], &config);
                    put_word(lever_state_restore(lever, state) ? lever_state_layout() : 0u);
                }
            }
            lever_state_save(lever, state);
            for (uint32_t i = 0u; i < (uint32_t)LEVER_STATE_BYTES; i++) {
                put_word(state[i]);
            }
            end_run();
        }
    }
}

int main(int argc, char **argv)
{
    prints_lines = (argc != 2);
    only = (argc == 3) ? argv[2] : NULL;
    if ((argc >= 2) && (strcmp(argv[1], "digests") != 0)) {
        expected = fopen(argv[1], "r");
        if (expected == NULL) {
            (void)fprintf(stderr, "embedded: no %s\n", argv[1]);
            return 2;
        }
    }
    fly_choices(); /* short ones first: a change shows soon */
    go_round();
    fly_random_settings();
    talk_on_the_bus();
    fly_scenes();
    save_states();
    if (begin_run("self", "test")) {
        lever_memory_t memory;
        put_word(self_test(&memory) ? 1u : 0u);
        end_run();
    }
    return 0;
}
