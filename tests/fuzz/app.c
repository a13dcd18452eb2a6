/* Any frames, samples, commands, silences and settings: the estimator keeps the promises of lever_cdkf.h.
 *
 * The input is a series of single bytes that choose what comes next, each followed by what that needs; where the input
 * ends, zeros follow. It begins with the settings. Flights of a moving lever, with sensors that fail, are made from a
 * few bytes, so that the filters learn; the rest is taken as it comes. */
#include <math.h>
#include <string.h>

#include "app/instance.h"
#include "app/state.h"
#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "require.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);

enum {
    CLOSED_US = 50000,   /* of silence more, and there is no torque */
    MOST_STEPS = 6000,   /* in one input */
    ESTIMATE_STEPS = 7,  /* after which the estimate is looked at: it takes longer than a step */
    MOST_SETTINGS = 15,  /* that an input changes */
    MOST_ALIGNING = 400, /* samples, for which the end waits */
    OUTPUT_IDS = 15,
    FIRST_OUTPUT = 0x210
};

#define LARGE 1.0e6f /* no member is as large in a flight */

static uint64_t steps; /* of all inputs */

/* What is left of the input. */
typedef struct fuzz_input {
    const uint8_t *at;
    const uint8_t *end;
} input_t;

/* How the sensors of a flight fail. */
enum fault {
    FAULT_STUCK = 1,
    FAULT_NAN = 2,
    FAULT_SCALED = 4,
    FAULT_MISSING = 8,
    FAULT_NO_BASE = 16,
    FAULT_NO_TORQUE = 32,
    FAULT_NO_GRIP = 64
};

/* An instance, and what somebody beside it knows of it. */
typedef struct bench {
    lever_memory_t memory;
    lever_config_t config;
    lever_aircraft_t aircraft[2]; /* the one that is watched must stay as it is */
    lever_t *lever;
    lever_health_t health; /* as it was last */
    e2e_receiver_t receiver[OUTPUT_IDS];
    uint32_t time_us;
    uint32_t period_us;
    uint32_t silent_us; /* told by lever_idle() since the last sample */
    uint32_t sample_us; /* time of the last sample */
    bool held;          /* for longer than the gate waits for a sample, of which its mean square has to recover */
    uint32_t flown;     /* samples of flights */
    uint32_t steps;
    uint8_t counter[4]; /* of the messages that are sent to it */
    uint8_t faults;     /* of enum fault */
    uint8_t shape;      /* of the flight: see flight_sample() */
    uint32_t noise;     /* state of its generator */
} bench_t;

static uint8_t take_byte(input_t *input)
{
    return (input->at < input->end) ? *input->at++ : 0u;
}

static void take(input_t *input, void *into, size_t size)
{
    for (size_t i = 0u; i < size; i++) {
        ((uint8_t *)into)[i] = take_byte(input);
    }
}

static uint32_t take_word(input_t *input)
{
    uint32_t word = 0u;
    take(input, &word, sizeof word);
    return word;
}

static float take_float(input_t *input)
{
    float value = 0.0f;
    take(input, &value, sizeof value);
    return value;
}

/* --- promises ----------------------------------------------------------------------------------------------------- */

static void check_estimate(const lever_t *lever)
{
    lever_estimate_t estimate;
    lever_estimate(lever, &estimate);
    REQUIRE(isfinite(estimate.theta) && isfinite(estimate.theta_dot) && isfinite(estimate.trim));
    REQUIRE(isfinite(estimate.theta_sigma) && (estimate.theta_sigma >= 0.0f));
    REQUIRE(isfinite(estimate.theta_dot_sigma) && (estimate.theta_dot_sigma >= 0.0f));
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        REQUIRE(isfinite(estimate.parameter[i]));
        REQUIRE(isfinite(estimate.parameter_sigma[i]) && (estimate.parameter_sigma[i] >= 0.0f));
        REQUIRE(fabsf(estimate.parameter_correlation[i]) <= 1.001f);
    }
    REQUIRE(isfinite(estimate.natural_frequency) && (estimate.natural_frequency >= 0.0f));
    REQUIRE(isfinite(estimate.natural_frequency_sigma) && (estimate.natural_frequency_sigma >= 0.0f));
    REQUIRE(isfinite(estimate.damping_ratio));
    REQUIRE(isfinite(estimate.damping_ratio_sigma) && (estimate.damping_ratio_sigma >= 0.0f));
    REQUIRE((estimate.nis >= 0.0f) && (estimate.nis_size <= 2u));
}

static void check_stability(const bench_t *bench)
{
    lever_stability_t stability;
    lever_stability(bench->lever, &stability);
    REQUIRE(stability.state <= (uint8_t)LEVER_BOUNCE_ALARM);
    REQUIRE(stability.gain_margin <= 40.0f);
}

static void check_health(bench_t *bench)
{
    const lever_settings_t *settings = &bench->config.settings;
    lever_health_t health;
    lever_correction_t correction;
    lever_health(bench->lever, &health);
    lever_correction(bench->lever, &correction);
    REQUIRE((health.mode >= LEVER_MODE_INIT) && (health.mode <= LEVER_MODE_FAULT));
    REQUIRE(health.faults < (2u * (uint32_t)LEVER_FAULT_HANDS_OFF));
    REQUIRE(isfinite(health.excitation) && (health.excitation >= 0.0f));
    REQUIRE((health.samples >= bench->health.samples) && (health.recoveries >= bench->health.recoveries));
    REQUIRE(fabsf(health.torque) <= settings->torque_limit);
    REQUIRE((health.torque == 0.0f) || (bench->silent_us <= (bench->lever->gate.silence_us + CLOSED_US)));
    REQUIRE(!health.gate_open || ((health.mode >= LEVER_MODE_RUN) && (health.mode <= LEVER_MODE_FROZEN)));
    REQUIRE(fabsf(correction.angle) <= settings->correction_limit);
    REQUIRE((correction.weight >= 0.0f) && (correction.weight <= 1.0f));
    const torque_gate_t *gate = &bench->lever->gate;
    bench->held = bench->held && (gate->mean_square > gate->square_most);
    REQUIRE((gate->mean_square >= 0.0f) && (bench->held || (gate->mean_square <= (1.001f * gate->square_most))));
    REQUIRE((health.mode == LEVER_MODE_INIT) || cdkf_state_is_valid(&bench->lever->estimator.cdkf));
    bench->health = health;
}

/* All frames that it has to say: as many as there are messages, with the right CRCs and counters, those of one step in
 * order; what a MOTOR_COMMAND says is within the limit. */
static void check_frames(bench_t *bench)
{
    static const uint8_t data_ids[OUTPUT_IDS] = {MESSAGE_STATE_ESTIMATE_DATA_ID, MESSAGE_PILOT_PARAMETERS_DATA_ID,
        MESSAGE_PILOT_SIGMA_DATA_ID, MESSAGE_PILOT_DYNAMICS_DATA_ID, MESSAGE_HEALTH_DATA_ID,
        MESSAGE_MOTOR_COMMAND_DATA_ID, MESSAGE_PLATFORM_HEALTH_DATA_ID, MESSAGE_IDENTITY_DATA_ID,
        MESSAGE_COMMAND_ACK_DATA_ID, MESSAGE_LINK_HEALTH_DATA_ID, MESSAGE_FEEDTHROUGH_DATA_ID,
        MESSAGE_STABILITY_DATA_ID, MESSAGE_CORRECTION_DATA_ID, MESSAGE_SNAPSHOT_DATA_ID, MESSAGE_TEST_RATIO_DATA_ID};
    static const e2e_tolerance_t strict = {0u, 0u, 0u};
    lever_frame_t frame = {.length = 0u};
    message_motor_command_t motor;
    uint32_t count = 0u;
    while (lever_next_frame(bench->lever, &frame)) {
        count++;
        REQUIRE((count <= (uint32_t)OUTPUTS) && (frame.length == 8u));
        REQUIRE((frame.id >= (uint32_t)FIRST_OUTPUT) && (frame.id < (uint32_t)(FIRST_OUTPUT + OUTPUT_IDS)));
        e2e_receiver_t *receiver = &bench->receiver[frame.id - (uint32_t)FIRST_OUTPUT];
        if (receiver->data_id_base == 0u) {
            e2e_receiver_init(receiver, data_ids[frame.id - (uint32_t)FIRST_OUTPUT], strict);
        }
        const e2e_status_t status = e2e_check(receiver, &frame);
        REQUIRE((status == E2E_OK) || (status == E2E_INITIAL));
        if (message_motor_command_decode(&motor, &frame)) {
            REQUIRE(fabsf(motor.torque) <= (bench->config.settings.torque_limit + 1.0e-3f));
        }
    }
}

static void check(bench_t *bench)
{
    check_health(bench);
    check_frames(bench);
    if ((bench->steps % (uint32_t)ESTIMATE_STEPS) == 0u) {
        check_estimate(bench->lever);
        check_stability(bench);
    }
}

/* --- what comes --------------------------------------------------------------------------------------------------- */

static void after_sample(bench_t *bench, enum lever_mode mode)
{
    const float torque_before = bench->health.torque;
    const bool was_open = bench->health.gate_open;
    steps++;
    bench->steps++;
    bench->silent_us = 0u;
    const uint32_t time_us = bench->lever->estimator.time_us;
    const bool in_time = (time_us - bench->sample_us) <= bench->lever->gate.silence_us;
    bench->sample_us = time_us;
    bench->held = bench->held || !in_time;
    check(bench);
    REQUIRE(mode == bench->health.mode);
    if (was_open && bench->health.gate_open && in_time) { /* else it may have been closed in between */
        const float slew = 1.001e-6f * bench->config.settings.torque_slew * (float)bench->period_us;
        REQUIRE(fabsf(bench->health.torque - torque_before) <= (slew + 1.0e-6f));
    }
}

static void give_frame(bench_t *bench, const lever_frame_t *frame)
{
    const enum lever_frame_result result = lever_on_frame(bench->lever, frame);
    REQUIRE((result >= LEVER_FRAME_IGNORED) && (result <= LEVER_FRAME_REFUSED));
    if (result == LEVER_FRAME_SAMPLE) {
        after_sample(bench, lever_step(bench->lever));
    } else {
        check_frames(bench);
    }
}

/* Sends a frame of one of the messages that an estimator takes, with counter and CRC. */
static void give_protected(bench_t *bench, uint32_t which, lever_frame_t *frame, uint8_t skipped)
{
    static const uint8_t data_ids[] = {MESSAGE_LEVER_SAMPLE_DATA_ID, MESSAGE_BASE_SAMPLE_DATA_ID,
        MESSAGE_GRIP_SAMPLE_DATA_ID, MESSAGE_COMMAND_DATA_ID};
    bench->counter[which] = (uint8_t)((bench->counter[which] + 1u + skipped) & 15u);
    e2e_protect(frame, data_ids[which], bench->counter[which]);
    give_frame(bench, frame);
}

/* White, in [-1, 1). */
static float noise(bench_t *bench)
{
    bench->noise = (bench->noise * 1664525u) + 1013904223u;
    return ((float)(bench->noise >> 8u) * (2.0f / 16777216.0f)) - 1.0f;
}

/* A lever that swings on a bouncing base, in the grip of a hand, whose force is what the lever as shipped needs for
 * that. Of the shape, the lower four bits are its frequency, from 3 Hz on, the next two the amplitude; then that of the
 * noise. */
static lever_sample_t flight_sample(bench_t *bench)
{
    const float omega = 19.0f + (float)(bench->shape & 15u);
    const float amplitude = 0.02f * (float)(((bench->shape >> 4u) & 3u) ^ 1u);
    const float rough = 1.0e-3f * (float)(bench->shape >> 6u);
    const float t = 1.0e-6f * (float)bench->period_us * (float)bench->flown;
    const float swing = amplitude * sinf(omega * t);
    const float rate = amplitude * omega * cosf(omega * t);
    const float z_ddot = 75.0f * amplitude * sinf((omega * t) + 0.4f);
    lever_sample_t sample = {.time_us = bench->time_us,
        .theta = 0.35f + swing + (rough * noise(bench)),
        .theta_dot = rate + (10.0f * rough * noise(bench)),
        .tau_m = bench->health.torque,
        .z_ddot = z_ddot + (100.0f * rough * noise(bench)),
        .grip_force = ((((5.0f - (0.081f * omega * omega)) * swing) + (0.5f * rate) - bench->health.torque) / 0.45f) +
                      (0.56f * z_ddot) + (1000.0f * rough * noise(bench)),
        .theta_valid = true,
        .theta_dot_valid = true,
        .tau_m_valid = (bench->faults & (uint8_t)FAULT_NO_TORQUE) == 0u,
        .z_ddot_valid = (bench->faults & (uint8_t)FAULT_NO_BASE) == 0u,
        .grip_force_valid = (bench->faults & (uint8_t)FAULT_NO_GRIP) == 0u};
    if ((bench->faults & (uint8_t)FAULT_STUCK) != 0u) {
        sample.theta = 0.35f;
    }
    if ((bench->faults & (uint8_t)FAULT_NAN) != 0u) {
        sample.theta_dot = NAN;
    }
    if ((bench->faults & (uint8_t)FAULT_SCALED) != 0u) {
        sample.z_ddot *= -50.0f;
    }
    if ((bench->faults & (uint8_t)FAULT_MISSING) != 0u) {
        sample.theta_valid = false;
        sample.theta_dot_valid = false;
    }
    bench->flown++;
    return sample;
}

/* The same over the bus. */
static void give_on_bus(bench_t *bench, const lever_sample_t *sample)
{
    const message_lever_sample_t lever = {sample->theta, sample->theta_dot, sample->tau_m, sample->theta_valid,
        sample->theta_dot_valid, sample->tau_m_valid};
    const message_base_sample_t base = {sample->time_us, sample->z_ddot, sample->z_ddot_valid};
    const message_grip_sample_t grip = {sample->grip_force, sample->grip_force_valid};
    lever_frame_t frame = {.length = 0u};
    bench->counter[0] = bench->counter[1]; /* by which they pair, whatever was sent in between */
    bench->counter[2] = bench->counter[1];
    REQUIRE(message_lever_sample_encode(&frame, &lever));
    give_protected(bench, 0u, &frame, 0u);
    REQUIRE(message_grip_sample_encode(&frame, &grip));
    give_protected(bench, 2u, &frame, 0u);
    REQUIRE(message_base_sample_encode(&frame, &base));
    give_protected(bench, 1u, &frame, 0u);
}

static void fly(bench_t *bench, uint32_t count, bool on_bus)
{
    for (uint32_t i = 0u; (i < count) && (bench->steps < (uint32_t)MOST_STEPS); i++) {
        bench->time_us += bench->period_us;
        const lever_sample_t sample = flight_sample(bench);
        if (on_bus) {
            give_on_bus(bench, &sample);
        } else {
            after_sample(bench, lever_update(bench->lever, &sample));
        }
    }
}

static void give_any_sample(bench_t *bench, input_t *input)
{
    const uint8_t flags = take_byte(input);
    lever_sample_t sample = {.time_us = ((flags & 32u) != 0u) ? take_word(input) : (bench->time_us + bench->period_us)};
    sample.theta = take_float(input);
    sample.theta_dot = take_float(input);
    sample.tau_m = take_float(input);
    sample.z_ddot = take_float(input);
    sample.grip_force = take_float(input);
    sample.theta_valid = (flags & 1u) != 0u;
    sample.theta_dot_valid = (flags & 2u) != 0u;
    sample.tau_m_valid = (flags & 4u) != 0u;
    sample.z_ddot_valid = (flags & 8u) != 0u;
    sample.grip_force_valid = (flags & 16u) != 0u;
    bench->time_us = sample.time_us;
    after_sample(bench, lever_update(bench->lever, &sample));
}

static void give_any_frame(bench_t *bench, input_t *input, bool is_protected)
{
    static const uint32_t ids[] = {
        MESSAGE_LEVER_SAMPLE_ID, MESSAGE_BASE_SAMPLE_ID, MESSAGE_GRIP_SAMPLE_ID, MESSAGE_COMMAND_ID};
    const uint8_t head = take_byte(input);
    lever_frame_t frame = {.id = ids[head & 3u], .length = 8u};
    take(input, frame.data, sizeof frame.data);
    if (is_protected) {
        give_protected(bench, head & 3u, &frame, (uint8_t)(head >> 4u));
    } else {
        frame.id = ((head & 4u) != 0u) ? (0x210u + (head >> 4u)) : frame.id;
        frame.length = (uint8_t)(8u - ((head & 8u) >> 3u));
        give_frame(bench, &frame);
    }
}

static void give_command(bench_t *bench, input_t *input)
{
    lever_command_t command;
    const uint8_t choices[3] = {take_byte(input), take_byte(input), take_byte(input)};
    command.request = choices[0] & 7u;
    command.model = choices[0] >> 4u;
    command.preload = choices[1] & 15u;
    command.estimator = choices[1] >> 4u;
    command.adaptation = choices[2] & 15u;
    command.mitigation = choices[2] >> 4u;
    command.dither_rms = take_float(input);
    (void)lever_command(bench->lever, &command);
    check(bench);
}

/* What keeps torque alive: a COMMAND that changes nothing but the dither. */
static void keep_alive(bench_t *bench, uint8_t tenths, uint8_t request)
{
    const message_command_t command = {.request = request,
        .model = (uint8_t)LEVER_KEEP,
        .preload = (uint8_t)LEVER_KEEP,
        .estimator = (uint8_t)LEVER_KEEP,
        .adaptation = (uint8_t)LEVER_KEEP,
        .mitigation = (uint8_t)LEVER_KEEP,
        .dither_rms = 0.1f * (float)tenths};
    lever_frame_t frame = {.length = 0u};
    REQUIRE(message_command_encode(&frame, &command));
    give_protected(bench, 3u, &frame, 0u);
}

static void be_silent(bench_t *bench, uint32_t elapsed_us)
{
    lever_idle(bench->lever, elapsed_us);
    bench->held = bench->held || (elapsed_us > bench->lever->gate.silence_us);
    bench->silent_us += (elapsed_us < (UINT32_MAX - bench->silent_us)) ? elapsed_us : 0u;
    check_health(bench);
    check_frames(bench);
}

/* Another aircraft, in the table that is not in use; or none. */
static void change_aircraft(bench_t *bench, input_t *input)
{
    const uint8_t head = take_byte(input);
    lever_aircraft_t *next = &bench->aircraft[(bench->lever->bounce.aircraft == &bench->aircraft[0]) ? 1 : 0];
    (void)memset(next, 0, sizeof *next);
    next->count = head & 31u;
    const bool is_wild = (head & 32u) != 0u;
    for (uint32_t i = 0u; (i < next->count) && (i < (uint32_t)LEVER_AIRCRAFT_POINTS); i++) {
        next->frequency[i] = is_wild ? take_float(input) : (1.5f + (0.5f * (float)i));
        next->real[i] = is_wild ? take_float(input) : ((float)(int8_t)take_byte(input) * 0.5f);
        next->imaginary[i] = is_wild ? take_float(input) : ((float)(int8_t)take_byte(input) * 0.5f);
    }
    next->gain_sigma = is_wild ? take_float(input) : 0.1f;
    next->phase_sigma = is_wild ? take_float(input) : 0.1f;
    next->warning = is_wild ? take_float(input) : 5.0f;
    next->alarm = is_wild ? take_float(input) : 3.5f;
    (void)lever_aircraft(bench->lever, ((head & 64u) != 0u) ? NULL : next);
    check(bench);
}

static void report_platform(bench_t *bench, input_t *input)
{
    lever_platform_t platform;
    take(input, &platform, sizeof platform);
    lever_platform(bench->lever, &platform);
    check(bench);
}

/* What an instance does with bytes from anywhere as its state: any estimate, but a finite one. */
static void use(bench_t *bench, lever_t *lever)
{
    lever_health_t health;
    lever_frame_t frame;
    for (uint32_t i = 0u; i < 8u; i++) {
        lever_sample_t sample = flight_sample(bench);
        sample.time_us += i * bench->period_us;
        (void)lever_update(lever, &sample);
        lever_idle(lever, 100u);
        check_estimate(lever);
        lever_health(lever, &health);
        for (uint32_t k = 0u; lever_next_frame(lever, &frame); k++) {
            REQUIRE(k <= (uint32_t)OUTPUTS);
        }
    }
}

/* Settings and samples anywhere in their ranges can make numbers that a state may not have; NaN is never made. */
static bool is_extreme(const lever_t *lever)
{
    const uint8_t *memory = (const uint8_t *)lever;
    bool is_large = false;
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const state_row_t *row = state_row(i);
        for (uint32_t k = 0u; row->is_float && (k < row->count); k++) {
            float value;
            (void)memcpy(&value, &memory[row->offset + (k * row->size)], sizeof value);
            REQUIRE(isfinite(value));
            is_large = is_large || (fabsf(value) > LARGE);
        }
    }
    return is_large;
}

/* As it is, the state of an instance makes another one the same. */
static void move_state(bench_t *bench, input_t *input)
{
    static lever_memory_t memory;
    uint8_t state[LEVER_STATE_BYTES];
    uint8_t again[LEVER_STATE_BYTES];
    lever_t *other = lever_init(&memory, &bench->config);
    (void)lever_aircraft(other, bench->lever->bounce.aircraft);
    lever_state_save(bench->lever, state);
    const bool large = is_extreme(bench->lever);
    if (lever_state_restore(other, state)) {
        lever_state_save(other, again);
        REQUIRE(memcmp(state, again, sizeof state) == 0);
    } else {
        REQUIRE(large);
    }
    const uint8_t changed = take_byte(input) & 7u;
    for (uint32_t i = 0u; i < changed; i++) {
        const uint32_t at = take_byte(input) | ((uint32_t)take_byte(input) << 8u);
        state[at % (uint32_t)LEVER_STATE_BYTES] = take_byte(input);
    }
    if (lever_state_restore(other, state)) {
        use(bench, other);
    }
}

static void ask_feedthrough(const bench_t *bench, input_t *input)
{
    lever_feedthrough_t feedthrough;
    lever_feedthrough(bench->lever, take_float(input), &feedthrough);
}

static void give_next(bench_t *bench, input_t *input)
{
    const uint8_t what = take_byte(input);
    switch (what % 13u) {
    case 0:
    case 1:
        fly(bench, (uint32_t)take_byte(input) << ((what / 13u) % 5u), (what % 13u) == 1u);
        break;
    case 2:
        give_any_sample(bench, input);
        break;
    case 3:
    case 4:
        give_any_frame(bench, input, (what % 13u) == 4u);
        break;
    case 5:
        give_command(bench, input);
        break;
    case 6:
        keep_alive(bench, take_byte(input), (uint8_t)LEVER_REQUEST_NONE);
        break;
    case 7:
        be_silent(bench, 1000u * (uint32_t)take_byte(input));
        break;
    case 8:
        change_aircraft(bench, input);
        break;
    case 9:
        report_platform(bench, input);
        break;
    case 10:
        bench->faults = take_byte(input);
        bench->shape = take_byte(input);
        ask_feedthrough(bench, input);
        break;
    case 12:
        move_state(bench, input);
        break;
    default:
        bench->time_us += take_word(input) >> (take_byte(input) & 31u);
        break;
    }
}

/* --- an input ----------------------------------------------------------------------------------------------------- */

/* Choices, and some settings anywhere in their ranges, as long as they go with each other. */
static void choose_config(lever_config_t *config, input_t *input)
{
    lever_config_default(config);
    config->model = take_byte(input) % (uint8_t)LEVER_MODEL_COUNT;
    config->preload = take_byte(input) % (uint8_t)LEVER_PRELOAD_COUNT;
    config->estimator = take_byte(input) % (uint8_t)LEVER_ESTIMATOR_COUNT;
    config->adaptation = take_byte(input) % (uint8_t)LEVER_ADAPTATION_COUNT;
    config->mitigation = take_byte(input) % (uint8_t)LEVER_MITIGATION_COUNT;
    const uint32_t count = take_byte(input) % (uint32_t)(MOST_SETTINGS + 1);
    for (uint32_t i = 0u; i < count; i++) {
        const uint32_t index = take_byte(input) % lever_setting_count();
        const lever_setting_t *row = lever_setting(index);
        const float share = (float)take_byte(input) / 255.0f;
        const float value = row->least + (share * share * (row->greatest - row->least));
        const lever_config_t before = *config;
        (void)memcpy((uint8_t *)&config->settings + (index * sizeof value), &value, sizeof value);
        if (lever_config_check(config) != NULL) {
            *config = before;
        }
    }
}

static bool is_estimating(const bench_t *bench)
{
    return (bench->health.mode == LEVER_MODE_RUN) || (bench->health.mode == LEVER_MODE_COAST);
}

/* After all that, and a reset, good samples bring it to where it estimates: no mode is stuck. */
static void must_come_back(bench_t *bench)
{
    const lever_settings_t *settings = &bench->config.settings;
    const float aligning = settings->align_time / settings->sample_period;
    if (aligning < (float)MOST_ALIGNING) {
        bench->faults = 0u;
        bench->shape = 0u;
        bench->steps = 0u;
        for (uint32_t i = 0u; i < 14u; i++) { /* whatever counter was seen last */
            keep_alive(bench, 0u, (uint8_t)LEVER_REQUEST_RESET);
        }
        fly(bench, (uint32_t)aligning, true);
        for (uint32_t i = 0u; (i < 20u) && (bench->health.mode != LEVER_MODE_RUN); i++) {
            fly(bench, 1u, true);
        }
        REQUIRE(bench->health.mode == LEVER_MODE_RUN);
        for (uint32_t i = 0u; (i == 0u) || ((i < 20u) && !is_estimating(bench));
            i++) { /* a first sample may mislead it */
            fly(bench, 1u, true);
        }
        REQUIRE(is_estimating(bench));
    }
}

static void say_steps(void)
{
    (void)fprintf(stderr, "stat::estimator_steps: %llu\n", (unsigned long long)steps);
}

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
    (void)argc;
    (void)argv;
    return atexit(say_steps);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bench_t bench;
    input_t input = {data, data + size};
    (void)memset(&bench, 0, sizeof bench);
    choose_config(&bench.config, &input);
    bench.period_us = (uint32_t)((bench.config.settings.sample_period * 1.0e6f) + 0.5f);
    bench.time_us = 1000u * (uint32_t)take_byte(&input);
    bench.lever = lever_init(&bench.memory, &bench.config);
    REQUIRE(bench.lever != NULL);
    check(&bench);
    while ((input.at < input.end) && (bench.steps < (uint32_t)MOST_STEPS)) {
        give_next(&bench, &input);
    }
    must_come_back(&bench);
    return 0;
}
