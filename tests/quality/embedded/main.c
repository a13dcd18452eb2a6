/* Feeds a lively series of samples to the estimator and prints every estimate as hexadecimal bits, and every frame:
 * two builds that compute alike print alike. The samples come from single-precision arithmetic under the same compiler
 * flags.
 *
 *     embedded SAMPLES
 *
 * One run for each choice of preload and adaptation, and one for each model and estimator; a line is: run, sample,
 * mode, then the bits of the estimate. Then one run over the bus for each model and estimator, with an aircraft and a
 * mitigation; a line is: "bus", run, sample, then the frames that were sent. The last line says whether self_test() passed. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "port/embedded/self_test.h"

#define PERIOD 1.0e-3f         /* [s] */
#define SAMPLES_A_COMMAND 500u /* the motor's torque needs one each second */
#define DITHER 0.3f            /* [N m] */

/* An arm and lever of 3.5 Hz and damping ratio 0.3 about a trim of 0.35 rad, shaken by the base and the motor. */
typedef struct arm {
    uint32_t random;
    float base;   /* band-limited base acceleration [m/s^2] */
    float torque; /* band-limited motor torque [N m] */
    float angle;  /* about the trim [rad] */
    float rate;   /* [rad/s] */
} arm_t;

/* Uniform in [-1, 1): a linear congruential generator. */
static float noise(arm_t *arm)
{
    arm->random = (1664525u * arm->random) + 1013904223u;
    return ((float)(int32_t)(arm->random >> 8) / 8388608.0f) - 1.0f;
}

static lever_sample_t next_sample(arm_t *arm, uint32_t index)
{
    arm->base += 0.05f * ((20.0f * noise(arm)) - arm->base);
    arm->torque += 0.05f * ((4.0f * noise(arm)) - arm->torque);
    const float forcing = (-2.0f * arm->base) + (1.6f * arm->torque);
    arm->rate += PERIOD * (forcing - (483.6f * arm->angle) - (13.2f * arm->rate));
    arm->angle += PERIOD * arm->rate;

    lever_sample_t sample;
    (void)memset(&sample, 0, sizeof sample);
    sample.time_us = index * 1000u;
    sample.theta = 0.35f + arm->angle + (1.0e-3f * noise(arm));
    sample.theta_dot = arm->rate + (1.0e-2f * noise(arm));
    sample.tau_m = arm->torque;
    sample.z_ddot = arm->base;
    sample.theta_valid = (index % 97u) != 0u;
    sample.theta_dot_valid = (index % 89u) != 0u;
    sample.tau_m_valid = (index % 83u) != 0u;
    sample.z_ddot_valid = (index % 79u) != 0u;
    return sample;
}

static void print_bits(float value)
{
    uint32_t bits = 0u;
    (void)memcpy(&bits, &value, sizeof bits);
    (void)printf(" %08" PRIx32, bits);
}

static void print_estimate(const lever_estimate_t *estimate)
{
    print_bits(estimate->theta);
    print_bits(estimate->theta_sigma);
    print_bits(estimate->theta_dot);
    print_bits(estimate->theta_dot_sigma);
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        print_bits(estimate->parameter[i]);
        print_bits(estimate->parameter_sigma[i]);
    }
    print_bits(estimate->natural_frequency);
    print_bits(estimate->natural_frequency_sigma);
    print_bits(estimate->damping_ratio);
    print_bits(estimate->damping_ratio_sigma);
    print_bits(estimate->trim);
    print_bits(estimate->nis);
    (void)printf(" %u\n", estimate->nis_size);
}

static lever_t *start(const lever_config_t *config)
{
    static lever_memory_t memory;
    lever_t *lever = lever_init(&memory, config);

    if (lever == NULL) {
        (void)fprintf(stderr, "embedded: refused: %s\n", lever_config_check(config));
        exit(1);
    }
    return lever;
}

static void run(const lever_config_t *config, uint32_t samples)
{
    arm_t arm = {1u, 0.0f, 0.0f, 0.0f, 0.0f};
    lever_t *lever = start(config);

    for (uint32_t index = 0u; index < samples; index++) {
        lever_estimate_t estimate;
        const lever_sample_t sample = next_sample(&arm, index);
        const enum lever_mode mode = lever_update(lever, &sample);
        lever_estimate(lever, &estimate);
        (void)printf("%u.%u.%u.%u %" PRIu32 " %u", config->model, config->estimator, config->preload,
            config->adaptation, index, (unsigned int)mode);
        print_estimate(&estimate);
    }
}

static void send_command(lever_t *lever, uint32_t index)
{
    const message_command_t command = {(uint8_t)LEVER_REQUEST_NONE, (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP,
        (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP, (uint8_t)LEVER_KEEP, DITHER};
    lever_frame_t frame;

    if (message_command_encode(&frame, &command)) {
        e2e_protect(&frame, (uint8_t)MESSAGE_COMMAND_DATA_ID, (uint8_t)((index / SAMPLES_A_COMMAND) % 16u));
        (void)lever_on_frame(lever, &frame);
    }
}

static void send_sample(lever_t *lever, const lever_sample_t *sample, uint32_t index)
{
    const message_lever_sample_t of_lever = {.theta = sample->theta,
        .theta_dot = sample->theta_dot,
        .tau_m = sample->tau_m,
        .theta_valid = sample->theta_valid,
        .theta_dot_valid = sample->theta_dot_valid,
        .tau_m_valid = sample->tau_m_valid};
    const message_base_sample_t of_base = {
        .time_us = sample->time_us, .z_ddot = sample->z_ddot, .z_ddot_valid = sample->z_ddot_valid};
    lever_frame_t frame;

    if (message_lever_sample_encode(&frame, &of_lever)) {
        e2e_protect(&frame, (uint8_t)MESSAGE_LEVER_SAMPLE_DATA_ID, (uint8_t)(index % 16u));
        (void)lever_on_frame(lever, &frame);
    }
    if (message_base_sample_encode(&frame, &of_base)) {
        e2e_protect(&frame, (uint8_t)MESSAGE_BASE_SAMPLE_DATA_ID, (uint8_t)(index % 16u));
        (void)lever_on_frame(lever, &frame);
    }
}

static void print_frame(const lever_frame_t *frame)
{
    (void)printf(" %03" PRIX32 "#", frame->id);
    for (uint32_t i = 0u; i < frame->length; i++) {
        (void)printf("%02X", frame->data[i]);
    }
}

static void run_bus(const lever_config_t *config, uint32_t samples)
{
    static const lever_aircraft_t aircraft = {.count = 4u,
        .frequency = {1.5f, 3.0f, 4.5f, 8.0f},
        .real = {24.0f, 18.0f, 9.0f, -3.0f},
        .imaginary = {-6.0f, -14.0f, -17.0f, -9.0f},
        .gain_sigma = 0.05f,
        .phase_sigma = 0.05f,
        .warning = 3.0f,
        .alarm = 1.5f};
    const lever_platform_t platform = {.overruns = 1u};
    arm_t arm = {1u, 0.0f, 0.0f, 0.0f, 0.0f};
    lever_t *lever = start(config);

    lever_platform(lever, &platform);
    (void)lever_aircraft(lever, &aircraft);
    for (uint32_t index = 0u; index < samples; index++) {
        const lever_sample_t sample = next_sample(&arm, index);
        lever_frame_t frame;

        if ((index % SAMPLES_A_COMMAND) == 0u) {
            send_command(lever, index);
        }
        send_sample(lever, &sample, index);
        (void)lever_step(lever);
        (void)printf("bus %u.%u %" PRIu32, config->model, config->estimator, index);
        while (lever_next_frame(lever, &frame)) {
            print_frame(&frame);
        }
        (void)printf("\n");
    }
}

int main(int argc, char **argv)
{
    const uint32_t samples = (argc == 2) ? (uint32_t)strtoul(argv[1], NULL, 10) : 0u;
    lever_config_t config;

    lever_config_default(&config);
    for (uint8_t preload = 0u; preload < (uint8_t)LEVER_PRELOAD_COUNT; preload++) {
        for (uint8_t adaptation = 0u; adaptation < (uint8_t)LEVER_ADAPTATION_COUNT; adaptation++) {
            config.preload = preload;
            config.adaptation = adaptation;
            run(&config, samples);
        }
    }
    lever_config_default(&config);
    const uint8_t estimators = (uint8_t)LEVER_ESTIMATOR_COUNT;
    for (uint8_t choice = 0u; choice < (uint8_t)((uint8_t)LEVER_MODEL_COUNT * estimators); choice++) {
        config.model = choice / estimators;
        config.estimator = choice % estimators;
        if (choice > 0u) {
            run(&config, samples);
        }
        config.mitigation = (uint8_t)(1u + (choice % ((uint8_t)LEVER_MITIGATION_COUNT - 1u)));
        run_bus(&config, samples);
        config.mitigation = (uint8_t)LEVER_MITIGATION_NONE;
    }
    lever_memory_t memory;
    (void)printf("self test %s\n", self_test(&memory) ? "passed" : "failed");
    return 0;
}
