/* The state of an instance as bytes: all of it, the same again, and nothing that does harm. */
#include "app/instance.h"
#include "app/state.h"
#include "frames.h"
#include "port/embedded/crc32.h"

#include <float.h>
#include <math.h>
#include <stddef.h>

enum { FIRST_ROW = 1 }; /* byte 0 says whether there is an aircraft */

static uint8_t state[LEVER_STATE_BYTES];
static lever_memory_t other_memory;
static random_source_t source;
static const lever_aircraft_t aircraft = {.count = 3u,
    .frequency = {2.0f, 4.0f, 8.0f},
    .real = {1.0f, 1.0f, 1.0f},
    .gain_sigma = 0.1f,
    .phase_sigma = 0.1f,
    .warning = 6.0f,
    .alarm = 3.0f};

void setUp(void)
{
    lever_config_default(&config);
    config.settings.torque_limit = 2.0f;
    config.settings.torque_rms = 1.0f;
    source.state = 7u;
}

static uint32_t width_of(const state_row_t *row)
{
    const uint32_t wide = (row->most < 0x10000u) ? 2u : 4u;
    return (row->most < 0x100u) ? 1u : wide;
}

TEST(its_rows_fill_it)
{
    uint32_t bytes = FIRST_ROW;
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        bytes += state_row(i)->count * width_of(state_row(i));
    }
    TEST_ASSERT_EQUAL_UINT32(LEVER_STATE_BYTES, bytes);
}

/* Samples, commands, dither, mitigation and gaps, so that little is 0. */
static void fly(uint32_t samples)
{
    lever_command_t command = command_none();
    command.dither_rms = 0.4f;
    command.mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION_AND_DAMPING;
    for (uint32_t k = 0u; k < samples; k++) {
        if ((k % 500u) == 100u) {
            const lever_frame_t frame = command_frame(&command);
            (void)lever_on_frame(lever, &frame);
        }
        next_pair();
        if ((k % 300u) == 7u) {
            lever_frame.data[3] ^= 4u; /* one that is corrupt */
        }
        (void)lever_on_frame(lever, &lever_frame);
        TEST_ASSERT_EQUAL(LEVER_FRAME_SAMPLE, lever_on_frame(lever, &base_frame));
        (void)lever_step(lever);
        (void)fetch();
    }
}

static void assert_same_future(lever_t *restored)
{
    lever_t *first = lever;
    uint8_t expected[LEVER_STATE_BYTES];
    for (uint32_t k = 0u; k < 1500u; k++) {
        lever_frame_t answer;
        next_pair();
        lever = first;
        (void)take_pair();
        const uint32_t count = fetch();
        (void)lever_on_frame(restored, &lever_frame);
        (void)lever_on_frame(restored, &base_frame);
        (void)lever_step(restored);
        for (uint32_t i = 0u; i < count; i++) {
            TEST_ASSERT_TRUE(lever_next_frame(restored, &answer));
            TEST_ASSERT_EQUAL_UINT32(frames[i].id, answer.id);
            TEST_ASSERT_EQUAL_MEMORY(frames[i].data, answer.data, sizeof answer.data);
        }
        TEST_ASSERT_FALSE(lever_next_frame(restored, &answer));
    }
    lever_state_save(first, expected);
    lever_state_save(restored, state);
    TEST_ASSERT_EQUAL_MEMORY(expected, state, sizeof state);
}

/* R53 */
TEST(a_restored_instance_goes_on_as_the_one_that_was_saved)
{
    for (uint32_t i = 0u; i < (uint32_t)COMBINATIONS; i++) {
        lever_config_t other_config = config;
        config.model = config_of(i).model;
        config.estimator = config_of(i).estimator;
        start_bus();
        fly(1000u + (97u * i));
        lever_state_save(lever, state);
        other_config.model =
            (uint8_t)((config.model + 1u) % (uint32_t)LEVER_MODEL_COUNT); /* a COMMAND has changed it */
        other_config.settings = config.settings;
        lever_t *restored = lever_init(&other_memory, &other_config);
        TEST_ASSERT_TRUE(lever_state_restore(restored, state));
        assert_same_future(restored);
    }
}

/* Replaces the value that begins at byte `at`. */
static void put(uint32_t at, uint32_t width, uint32_t value)
{
    for (uint32_t byte = 0u; byte < width; byte++) {
        state[at + byte] = (uint8_t)((value >> (8u * byte)) & 0xFFu);
    }
}

static void assert_refused(lever_t *instance)
{
    uint8_t before[LEVER_STATE_BYTES];
    uint8_t after[LEVER_STATE_BYTES];
    lever_state_save(instance, before);
    TEST_ASSERT_FALSE(lever_state_restore(instance, state));
    lever_state_save(instance, after);
    TEST_ASSERT_EQUAL_MEMORY(before, after, sizeof after);
}

TEST(other_settings_or_an_aircraft_on_one_side_are_refused)
{
    start_bus();
    fly(50u);
    lever_state_save(lever, state);
    lever_config_t other_config = config;
    other_config.settings.theta_noise *= 2.0f;
    assert_refused(lever_init(&other_memory, &other_config));
    lever_t *watching = lever_init(&other_memory, &config);
    TEST_ASSERT_TRUE(lever_aircraft(watching, &aircraft));
    assert_refused(watching);
    lever_state_save(watching, state);
    assert_refused(lever);
    TEST_ASSERT_TRUE(lever_state_restore(watching, state));
}

TEST(without_an_aircraft_it_is_the_same_whether_that_was_said_or_not)
{
    uint8_t unsaid[LEVER_STATE_BYTES];
    start_bus();
    fly(50u);
    lever_state_save(lever, unsaid);
    TEST_ASSERT_TRUE(lever_aircraft(lever, &aircraft));
    TEST_ASSERT_TRUE(lever_aircraft(lever, NULL));
    lever_state_save(lever, state);
    TEST_ASSERT_EQUAL_MEMORY(unsaid, state, sizeof state);
}

/* What indexes, chooses or counts bits, written out: a value beyond would be one beyond an array. */
TEST(limits_are_those_of_what_they_index)
{
    static const struct {
        size_t offset;
        uint32_t most;
    } limits[] = {{offsetof(struct lever, estimator.setup.model), 3u},
        {offsetof(struct lever, estimator.setup.preload), 1u}, {offsetof(struct lever, estimator.setup.estimator), 1u},
        {offsetof(struct lever, estimator.setup.adaptation), 3u}, {offsetof(struct lever, estimator.cdkf.acting), 5u},
        {offsetof(struct lever, estimator.mode), 5u}, {offsetof(struct lever, estimator.nis_size), 2u},
        {offsetof(struct lever, link.due), 0x3FFFu}, /* 14 messages */
        {offsetof(struct lever, link.pages), 7u}, {offsetof(struct lever, link.counter), 15u},
        {offsetof(struct lever, link.command_result), 7u}, {offsetof(struct lever, bounce.chosen), 5u},
        {offsetof(struct lever, bounce.state), 3u}};
    for (uint32_t i = 0u; i < (uint32_t)(sizeof limits / sizeof limits[0]); i++) {
        uint32_t row = 0u;
        while (state_row(row)->offset != limits[i].offset) {
            row++;
            TEST_ASSERT_LESS_THAN_UINT32(state_row_count(), row);
        }
        TEST_ASSERT_EQUAL_UINT32(limits[i].most, state_row(row)->most);
    }
}

/* Every value that is limited: at its limit it is taken, beyond not. But a belief of one model is none of another. */
TEST(a_value_beyond_its_range_is_refused)
{
    uint32_t at = FIRST_ROW;
    start_bus();
    fly(50u);
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const state_row_t *row = state_row(i);
        const uint32_t width = width_of(row);
        for (uint32_t k = 0u; k < row->count; k++) {
            const uint32_t greatest = UINT32_MAX >> (8u * (4u - width));
            for (uint32_t beyond = 0u; (row->most < greatest) && (beyond < 2u); beyond++) {
                lever_state_save(lever, state);
                const uint32_t value = row->most + beyond;
                put(at, width, value);
                lever_t *other = lever_init(&other_memory, &config);
                if ((beyond == 0u) && (row->offset != offsetof(struct lever, estimator.setup.model))) {
                    TEST_ASSERT_TRUE(lever_state_restore(other, state));
                } else {
                    assert_refused(other);
                }
            }
            at += width;
        }
    }
}

/* An infinity or NaN in any float of the filter and the trim, not only in those that the estimate is made of. */
/* R53 */
TEST(a_float_that_is_not_finite_is_refused)
{
    static const uint32_t not_finite[] = {0x7F800000u, 0xFF800000u, 0x7FC00000u, 0xFFC00001u};
    uint32_t at = FIRST_ROW;
    uint32_t floats = 0u;
    start_bus();
    fly(50u);
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const state_row_t *row = state_row(i);
        const uint32_t width = width_of(row);
        for (uint32_t k = 0u; row->is_float && (k < row->count); k++) {
            lever_state_save(lever, state);
            put(at + (k * width), width, not_finite[k % 4u]);
            assert_refused(lever_init(&other_memory, &config));
            floats++;
        }
        at += width * row->count;
    }
    TEST_ASSERT_GREATER_THAN_UINT32(sizeof(cdkf_t) / 8u, floats);
}

/* R53 */
TEST(a_covariance_that_is_none_a_negative_square_or_time_and_points_that_are_not_of_the_belief_are_refused)
{
    start_bus();
    fly(50u);
    lever_t *other = lever_init(&other_memory, &config);
    cdkf_t *cdkf = &lever->estimator.cdkf;
    float *const member[] = {&cdkf->s[0], &cdkf->s_xx[0], &cdkf->s_xx[3], &cdkf->w[1], &cdkf->walk[2],
        &lever->estimator.nis, &lever->estimator.learning.evidence.motion.slow, &lever->estimator.learning.elapsed,
        &cdkf->p[0], &cdkf->points[0].c[0]};
    static const float value[] = {-1.0f, -1.0f, 0.0f, 1.0e6f, -1.0f, -1.0f, -1.0f, -1.0f, 1.0e3f, 1.0e3f};
    for (uint32_t i = 0u; i < (uint32_t)(sizeof value / sizeof value[0]); i++) {
        const float kept = *member[i];
        *member[i] = value[i];
        lever_state_save(lever, state);
        assert_refused(other);
        *member[i] = kept;
    }
    lever_state_save(lever, state);
    TEST_ASSERT_TRUE(lever_state_restore(other, state));
}

/* Another machine may round them otherwise. */
/* R53 */
TEST(parameters_are_those_of_the_belief_to_a_thousandth)
{
    static const float factor[] = {1.0005f, 0.9995f, 1.002f, 0.998f};
    start_bus();
    fly(50u);
    float *const member[] = {&lever->estimator.cdkf.p[0], &lever->estimator.cdkf.p[2]};
    for (uint32_t i = 0u; i < 8u; i++) {
        float *value = member[i / 4u];
        const float kept = *value;
        *value *= factor[i % 4u];
        lever_state_save(lever, state);
        TEST_ASSERT_EQUAL((i % 4u) < 2u, lever_state_restore(lever_init(&other_memory, &config), state));
        *value = kept;
    }
}

/* Numbers that are none, and too large ones, in each signal of the last sample, whether its sender calls it valid or not.
 */
/* R53 */
TEST(whatever_the_last_sample_was_the_state_can_be_restored)
{
    static const float values[] = {NAN, INFINITY, -INFINITY, FLT_MAX};
    start_bus();
    fly(400u);
    for (uint32_t k = 0u; k < 5u * 2u * 4u; k++) {
        lever_sample_t sample = sample_after(1u);
        float *const signal[] = {&sample.theta, &sample.theta_dot, &sample.tau_m, &sample.z_ddot, &sample.grip_force};
        bool *const valid[] = {&sample.theta_valid, &sample.theta_dot_valid, &sample.tau_m_valid, &sample.z_ddot_valid,
            &sample.grip_force_valid};
        *signal[k % 5u] = values[k / 10u];
        *valid[k % 5u] = ((k / 5u) % 2u) != 0u;
        (void)lever_update(lever, &sample);
        lever_state_save(lever, state);
        lever_t *restored = lever_init(&other_memory, &config);
        TEST_ASSERT_TRUE(lever_state_restore(restored, state));
        assert_same_future(restored);
    }
}

/* Samples by struct and by bus, silence and all that is asked, of the instance `hurt`. */
static void use(lever_t *hurt)
{
    lever_t *mine = lever;
    lever = hurt;
    (void)fetch();
    assert_finite(estimate());
    for (uint32_t k = 0u; k < 60u; k++) {
        lever_sample_t sample = sample_after(1u);
        (void)lever_update(lever, &sample);
        assert_finite(estimate());
        next_pair();
        (void)lever_on_frame(lever, &lever_frame);
        (void)lever_on_frame(lever, &base_frame);
        (void)lever_step(lever);
        (void)fetch();
        lever_idle(lever, 5000u);
        assert_finite(estimate());
    }
    lever = mine;
}

/* Some values anywhere in their ranges, floats of any bits; under the sanitizers. What is accepted estimates. */
/* R53 */
TEST(any_bytes_that_are_accepted_break_nothing)
{
    uint32_t accepted = 0u;
    start_bus();
    fly(20u);
    for (uint32_t trial = 0u; trial < 6000u; trial++) {
        uint32_t at = FIRST_ROW + 4u; /* behind the checksum of the settings */
        const double share = 1.0 / (double)(1u << (trial % 10u));
        lever_state_save(lever, state);
        for (uint32_t i = 1u; i < state_row_count(); i++) {
            const state_row_t *row = state_row(i);
            const uint32_t width = width_of(row);
            for (uint32_t k = 0u; k < row->count; k++) {
                const uint32_t bits = (uint32_t)(random_unit(&source) * 4294967295.0);
                const bool kept = random_unit(&source) > share;
                if (!kept) {
                    put(at, width, (row->most == UINT32_MAX) ? bits : (bits % (row->most + 1u)));
                }
                at += width;
            }
        }
        lever_t *hurt = lever_init(&other_memory, &config);
        state[0] = (uint8_t)(trial % 2u);
        TEST_ASSERT_TRUE(lever_aircraft(hurt, (state[0] != 0u) ? &aircraft : NULL));
        if (lever_state_restore(hurt, state)) {
            accepted++;
            use(hurt);
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT32(100u, accepted);
}

TEST(counts_of_two_bytes_are_restored_whole_and_a_sample_that_waits_is_dropped)
{
    const lever_platform_t platform = {.overruns = 0x1234u, .dropped = 0x5678u};
    start_bus();
    fly(50u);
    lever_platform(lever, &platform);
    lever->link.due = 0x1234u;
    lever_state_save(lever, state);
    lever_t *other = lever_init(&other_memory, &config);
    other->link.has_sample = true;
    TEST_ASSERT_TRUE(lever_state_restore(other, state));
    TEST_ASSERT_EQUAL_HEX16(platform.overruns, other->platform.overruns);
    TEST_ASSERT_EQUAL_HEX16(platform.dropped, other->platform.dropped);
    TEST_ASSERT_EQUAL_HEX16(0x1234u, other->link.due);
    TEST_ASSERT_FALSE(other->link.has_sample);
}

/* Values that are floats, one by one, but that no settings and samples make: what would overflow, and what a factor has
 * above its diagonal. */
TEST(a_belief_that_would_overflow_or_is_no_factor_is_refused)
{
    start_bus();
    fly(50u);
    cdkf_t *cdkf = &lever->estimator.cdkf;
    snapshot_t *kept = lever->estimator.learning.kept;
    float *const value[] = {&cdkf->growth, &cdkf->growth, &kept[0].s_ww[0], &kept[1].s_ww[0], &kept[0].s_ww[2],
        &kept[1].s_ww[5], &cdkf->s[5], &cdkf->s_xx[1], &cdkf->considered[1].w[0], &cdkf->s[4], &cdkf->s_xx[3]};
    static const float wrong[] = {
        -1.0f, 1.0e7f, 1.0e12f, 1.0e12f, -1.0e-3f, -1.0e-3f, 1.0e-3f, -1.0e-3f, 2.0e6f, -1.0e-3f, -1.0e-3f};
    for (uint32_t i = 0u; i < (uint32_t)(sizeof wrong / sizeof wrong[0]); i++) {
        const float right = *value[i];
        *value[i] = wrong[i];
        lever_state_save(lever, state);
        *value[i] = right;
        assert_refused(lever_init(&other_memory, &config));
    }
    lever_state_save(lever, state);
    TEST_ASSERT_TRUE(lever_state_restore(lever_init(&other_memory, &config), state));
}

/* A CRC-32, by another implementation, over version, and count and greatest value of each row. */
TEST(the_layout_is_a_number_of_its_own)
{
    const uint8_t version[] = {LEVER_VERSION_MAJOR, LEVER_VERSION_MINOR, LEVER_VERSION_PATCH};
    uint32_t crc = crc32_update(0u, version, (uint32_t)sizeof version);
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const uint32_t count = state_row(i)->count;
        const uint32_t most = state_row(i)->most;
        const uint8_t bytes[] = {(uint8_t)(count & 0xFFu), (uint8_t)(count >> 8u), (uint8_t)(most & 0xFFu),
            (uint8_t)((most >> 8u) & 0xFFu), (uint8_t)((most >> 16u) & 0xFFu), (uint8_t)(most >> 24u)};
        crc = crc32_update(crc, bytes, (uint32_t)sizeof bytes);
    }
    TEST_ASSERT_EQUAL_HEX16(~crc & 0xFFFFu, lever_state_layout());
}
