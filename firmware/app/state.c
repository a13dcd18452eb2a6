#include "app/state.h"

#include "app/instance.h"
#include "math/bounds.h"
#include "math/crc32.h"
#include "math/factor.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#define ANY_BYTE 0xFFu   /* no limit of a byte, */
#define ANY_HALF 0xFFFFu /* and of two */
#define COUNTER 15u      /* of E2E */
#define FLAG 1u          /* the most that a flag may be */
#define EVERY_EVIDENCE (((uint32_t)1u << (uint32_t)EVIDENCE_COUNT) - 1u)
#define BYTE_BITS 8u       /* in a byte */
#define FLOAT_LIMIT 1.0e9f /* no member is as large */
#define MODERATE 1.0e6f    /* members whose squares are used */

/* From one member to another of the same size, side by side. */
#define MEMBERS(first, last, size, most)                                                                               \
    {(uint16_t)offsetof(struct lever, first),                                                                          \
        (uint16_t)(((offsetof(struct lever, last) - offsetof(struct lever, first)) / (size)) + 1u), (size), false,     \
        (most)}

#define WORDS(first, last) MEMBERS(first, last, 4u, UINT32_MAX)
#define FLOATS(first, last)                                                                                            \
    {(uint16_t)offsetof(struct lever, first),                                                                          \
        (uint16_t)(((offsetof(struct lever, last) - offsetof(struct lever, first)) / 4u) + 1u), 4u, true, UINT32_MAX}
#define BYTES(first, last, most) MEMBERS(first, last, 1u, most)
#define FLAGS(first, last) MEMBERS(first, last, 1u, FLAG)

/* What a value may be at most is what the code may meet: of an enum, an index, or what counts bits, so that bytes from
 * anywhere do no harm. A float is finite and below FLOAT_LIMIT in size, but in a sample that waits: there, any may come. */
/* cppcheck-suppress misra-c2012-20.7 ; D1 */
#define RECEIVER(name) BYTES(link.name.max_delta, link.name.lost, COUNTER), FLAGS(link.name.waiting, link.name.waiting)

static const state_row_t rows[] = {
    WORDS(link.settings_crc, link.settings_crc), /* not restored: it must be the instance's own */
    BYTES(estimator.setup.model, estimator.setup.model, (uint32_t)LEVER_MODEL_COUNT - 1u),
    BYTES(estimator.setup.preload, estimator.setup.preload, (uint32_t)LEVER_PRELOAD_COUNT - 1u),
    BYTES(estimator.setup.estimator, estimator.setup.estimator, (uint32_t)LEVER_ESTIMATOR_COUNT - 1u),
    BYTES(estimator.setup.adaptation, estimator.setup.adaptation, (uint32_t)LEVER_ADAPTATION_COUNT - 1u),

    FLOATS(estimator.cdkf.w[0], estimator.cdkf.considered_sigma[CDKF_STEP]),
    MEMBERS(estimator.cdkf.acting, estimator.cdkf.acting, 4u, (uint32_t)CDKF_CONSIDERED),
    FLOATS(estimator.cdkf.trust, estimator.cdkf.points[MODEL_POINTS - 1].c[MODEL_COEFFICIENTS - 1]),

    FLOATS(estimator.learning.evidence.ratio[0], estimator.learning.evidence.ratio[EVIDENCE_CLOCK]),
    MEMBERS(estimator.learning.evidence.present, estimator.learning.evidence.present, 4u, EVERY_EVIDENCE),
    WORDS(estimator.learning.evidence.faults, estimator.learning.evidence.faults),
    FLOATS(estimator.learning.evidence.since_change, estimator.learning.evidence.hands.elapsed),
    FLAGS(estimator.learning.evidence.hands.idle, estimator.learning.evidence.hands.idle),
    FLOATS(estimator.learning.evidence.force.raw, estimator.learning.evidence.force.means.time),
    FLAGS(estimator.learning.evidence.force.seen, estimator.learning.evidence.force.wrong),
    FLAGS(estimator.learning.evidence.seen[0], estimator.learning.evidence.opened),
    FLOATS(estimator.learning.noise.elapsed, estimator.learning.elapsed),
    BYTES(estimator.learning.verdict, estimator.learning.verdict, (uint32_t)VERDICT_COUNT - 1u),
    FLAGS(estimator.learning.levels, estimator.learning.levels),

    FLOATS(estimator.trim.output[0].section[0].level, estimator.trim.corner),
    FLAGS(estimator.trim.deviations, estimator.trim.deviations),
    FLOATS(estimator.trim_sine_cosine.sine, estimator.alignment.time),
    WORDS(estimator.line.value[0][0], estimator.line.value[DELAY_LINE_MOST - 1][DELAY_LINE_SIGNALS - 1]),
    BYTES(estimator.line.valid[0], estimator.line.valid[DELAY_LINE_MOST - 1], ANY_BYTE),
    BYTES(estimator.line.next, estimator.line.next, (uint32_t)DELAY_LINE_MOST - 1u),
    MEMBERS(estimator.mode, estimator.mode, (uint8_t)sizeof(enum lever_mode), (uint32_t)LEVER_MODE_FAULT),
    WORDS(estimator.time_us, estimator.late_series_us),
    FLOATS(estimator.raw_z_ddot, estimator.torque_missing),
    FLOATS(estimator.seat.place[0], estimator.seat.z_ddot),
    FLOATS(estimator.last_z_ddot, estimator.nis),
    BYTES(estimator.nis_size, estimator.nis_size, (uint32_t)CDKF_OUTPUTS),
    FLAGS(estimator.frozen, estimator.communication_fault),
    WORDS(estimator.faults, estimator.recoveries),

    FLOATS(dither.high_pass.level, dither.slope),
    WORDS(dither.noise, dither.noise),
    FLOATS(gate.torque, gate.mean_square),
    WORDS(gate.output_left, gate.counted),
    FLAGS(gate.open, gate.asked),
    WORDS(to_gate.elapsed_us, to_gate.elapsed_us),
    FLAGS(to_gate.advances, to_gate.harmful),

    RECEIVER(lever_receiver),
    RECEIVER(base_receiver),
    RECEIVER(grip_receiver),
    RECEIVER(command_receiver),
    WORDS(link.lever_sample.theta, link.lever_sample.tau_m),
    FLAGS(link.lever_sample.theta_valid, link.lever_sample.tau_m_valid),
    WORDS(link.grip_sample.grip_force, link.grip_sample.grip_force),
    FLAGS(link.grip_sample.grip_force_valid, link.grip_sample.grip_force_valid),
    BYTES(link.lever_counter, link.grip_counter, COUNTER),
    FLAGS(link.has_lever_sample, link.has_grip_sample),
    WORDS(link.time_us, link.latched),
    MEMBERS(link.due, link.due, 2u, ((uint32_t)1u << (uint32_t)OUTPUTS) - 1u),
    BYTES(link.parts, link.parts, ANY_BYTE),
    BYTES(link.pages, link.pages, ((uint32_t)1u << (uint32_t)MESSAGE_PAGE_COUNT) - 1u),
    BYTES(link.evidence, link.evidence, (uint32_t)LEVER_TEST_RATIOS),
    BYTES(link.frequency, link.command_counter, COUNTER),
    BYTES(link.command_result, link.command_result, (uint32_t)MESSAGE_RESULT_COUNT - 1u),
    BYTES(link.counter[0], link.counter[OUTPUT_STATE_ESTIMATE], COUNTER),

    FLOATS(bounce.mitigation.involuntary.base.level, bounce.mitigation.expected_damping),
    WORDS(bounce.mitigation.sensed_left, bounce.mitigation.counted),
    BYTES(bounce.mitigation.theta.same, bounce.mitigation.samples, ANY_BYTE),
    FLAGS(bounce.mitigation.rated, bounce.mitigation.started),
    BYTES(bounce.chosen, bounce.chosen, (uint32_t)LEVER_MITIGATION_COUNT - 1u),
    BYTES(bounce.state, bounce.state, (uint32_t)LEVER_BOUNCE_ALARM),
    BYTES(bounce.same, bounce.same, (uint32_t)BOUNCE_SAME_THETA | (uint32_t)BOUNCE_SAME_Z_DDOT),
    FLAGS(bounce.mitigates, bounce.mitigates),
    WORDS(bounce.time_us, bounce.time_us),
    WORDS(bounce.margin.gain, bounce.margin.frequency_sigma),

    BYTES(platform.faults, platform.bus_offs, ANY_BYTE),
    MEMBERS(platform.overruns, platform.dropped, 2u, ANY_HALF),
    WORDS(settings_us, settings_us),
    FLAGS(has_platform, settings_changed),
};

uint32_t state_row_count(void)
{
    return (uint32_t)(sizeof(rows) / sizeof(rows[0]));
}

const state_row_t *state_row(uint32_t index)
{
    return &rows[index];
}

/* Bytes of the state for a value. */
static uint32_t width_of(const state_row_t *row)
{
    const uint32_t wide = (row->most <= ANY_HALF) ? 2u : 4u;
    return (row->most <= ANY_BYTE) ? 1u : wide;
}

/* --- values in memory and in the state ---------------------------------------------------------------------------- */

static uint32_t load(const uint8_t *member, const state_row_t *row)
{
    uint32_t value = *member;
    if (row->size == (uint8_t)sizeof(uint32_t)) {
        (void)memcpy(&value, member, sizeof value); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    } else if (row->size == (uint8_t)sizeof(uint16_t)) {
        uint16_t half;
        (void)memcpy(&half, member, sizeof half); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
        value = half;
    } else {
        /* a byte, lowest or not */
    }
    return value;
}

static void store(uint8_t *member, const state_row_t *row, uint32_t value)
{
    const uint16_t half = (uint16_t)(value & ANY_HALF);
    if (row->size == (uint8_t)sizeof(uint32_t)) {
        (void)memcpy(member, &value, sizeof value); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    } else if (row->size == (uint8_t)sizeof(uint16_t)) {
        (void)memcpy(member, &half, sizeof half); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    } else {
        *member = (uint8_t)(value & ANY_BYTE);
    }
}

/* Lowest byte first. */
static uint32_t value_at(const uint8_t *bytes, uint32_t width)
{
    uint32_t value = 0u;
    for (uint32_t i = 0u; i < width; i++) {
        value |= (uint32_t)bytes[i] << (BYTE_BITS * i);
    }
    return value;
}

static void put_value(uint8_t *bytes, uint32_t width, uint32_t value)
{
    for (uint32_t i = 0u; i < width; i++) {
        bytes[i] = (uint8_t)((value >> (BYTE_BITS * i)) & ANY_BYTE);
    }
}

/* --- lever_cdkf.h ------------------------------------------------------------------------------------------------- */

uint16_t lever_state_layout(void)
{
    const uint32_t version[] = {
        (uint32_t)LEVER_VERSION_MAJOR, (uint32_t)LEVER_VERSION_MINOR, (uint32_t)LEVER_VERSION_PATCH};
    uint32_t crc = CRC32_START;
    for (uint32_t i = 0u; i < (uint32_t)(sizeof(version) / sizeof(version[0])); i++) {
        crc = crc32_shift(crc ^ version[i], BYTE_BITS);
    }
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        crc = crc32_shift(crc ^ rows[i].count, 16u);
        crc = crc32_shift(crc ^ rows[i].most, 32u);
    }
    return (uint16_t)(crc & ANY_HALF);
}

/* Words are nearly all: compilers make one store of four, where the machine can. */
static void put_words(uint8_t *bytes, const uint8_t *members, uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        uint8_t *byte = &bytes[4u * k];
        uint32_t value;
        (void)memcpy(&value, &members[4u * k], sizeof value); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
        byte[0] = (uint8_t)(value & ANY_BYTE);
        byte[1] = (uint8_t)((value >> 8u) & ANY_BYTE);
        byte[2] = (uint8_t)((value >> 16u) & ANY_BYTE);
        byte[3] = (uint8_t)(value >> 24u);
    }
}

void lever_state_save(const lever_t *lever, uint8_t state[LEVER_STATE_BYTES])
{
    const uint8_t *memory = (const uint8_t *)lever;
    uint32_t at = 1u;
    state[0] = (lever->bounce.aircraft != NULL) ? 1u : 0u;
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const state_row_t *row = &rows[i];
        const uint8_t *members = &memory[row->offset];
        const uint32_t width = width_of(row);
        if (width == 4u) {
            put_words(&state[at], members, row->count);
        } else {
            for (uint32_t k = 0u; k < row->count; k++) {
                put_value(&state[at + (k * width)], width, load(&members[k * row->size], row));
            }
        }
        at += width * row->count;
    }
}

static bool is_possible_value(const state_row_t *row, uint32_t value)
{
    float number = 0.0f;
    if (row->is_float) {
        (void)memcpy(&number, &value, sizeof number); /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    }
    return (value <= row->most) && (fabsf(number) < FLOAT_LIMIT); /* NaN is not */
}

/* Every value is one that the row may have. */
static bool is_possible(const uint8_t state[LEVER_STATE_BYTES])
{
    bool possible = true;
    uint32_t at = 1u;
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const uint32_t width = width_of(&rows[i]);
        for (uint32_t k = 0u; k < rows[i].count; k++) {
            possible = possible && is_possible_value(&rows[i], value_at(&state[at], width));
            at += width;
        }
    }
    return possible;
}

/* Copies possible values into the instance, and renews what follows from them. */
static void adopt(lever_t *lever, const uint8_t state[LEVER_STATE_BYTES])
{
    uint8_t *memory = (uint8_t *)lever;
    setup_t *setup = &lever->estimator.setup;
    uint32_t at = 1u;
    for (uint32_t i = 0u; i < state_row_count(); i++) {
        const state_row_t *row = &rows[i];
        const uint32_t width = width_of(row);
        for (uint32_t k = 0u; k < row->count; k++) {
            store(&memory[row->offset + (k * row->size)], row, value_at(&state[at], width));
            at += width;
        }
    }
    lever->link.has_sample = false;
    setup_choose(setup);
    const prior_t prior = setup_prior(setup); /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    scaling_init(&lever->estimator.cdkf.scaling, setup->model_in_use, &prior);
}

static bool is_near(float value, float expected)
{
    return fabsf(value - expected) <= (1.0e-3f * fabsf(expected));
}

/* The parameters and the coefficients at the sigma points are those of the belief. */
static bool is_drawn(const estimator_t *estimator)
{
    const cdkf_t *cdkf = &estimator->cdkf;
    cdkf_t drawn = *cdkf; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    cdkf_draw(&drawn, estimator->setup.model_in_use, &estimator->setup.constants);
    bool same = true;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        same = same && is_near(cdkf->p[i], drawn.p[i]);
    }
    for (uint32_t i = 0u; i < (uint32_t)MODEL_POINTS; i++) {
        for (uint32_t j = 0u; j < (uint32_t)MODEL_COEFFICIENTS; j++) {
            same = same && is_near(cdkf->points[i].c[j], drawn.points[i].c[j]);
        }
    }
    return same;
}

/* The filter's invariant, and that its factors are some. */
static bool is_belief(const cdkf_t *cdkf)
{
    return factor_is_whole(cdkf->s, MODEL_PARAMETERS) && factor_is_whole(cdkf->s_xx, MODEL_STATES) &&
           cdkf_is_valid(cdkf);
}

/* A belief that may be returned to keeps the invariant, too. */
static bool can_return(const estimator_t *estimator, const snapshot_t *kept)
{
    cdkf_t returned = estimator->cdkf; /* cppcheck-suppress misra-c2012-9.3 ; D3 */
    cdkf_return(&returned, kept);
    return is_belief(&returned);
}

/* What the belief is moved by is no more than settings and samples can make it, so that no product of it overflows. */
static bool is_moderate(const cdkf_t *cdkf)
{
    float size = cdkf->growth;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        for (uint32_t c = 0u; c < (uint32_t)CDKF_CONSIDERED; c++) {
            size += fabsf(cdkf->considered[c].w[i]);
        }
    }
    return (size < MODERATE) && (cdkf->growth >= 0.0f);
}

/* Values that are possible one by one may contradict each other: the filter keeps its invariant. */
static bool is_consistent(const estimator_t *estimator)
{
    const learning_t *learning = &estimator->learning;
    const bool positive =
        (estimator->nis >= 0.0f) && (learning->evidence.motion.slow >= 0.0f) && (learning->elapsed >= 0.0f);
    return positive && is_belief(&estimator->cdkf) && is_drawn(estimator) && is_moderate(&estimator->cdkf) &&
           can_return(estimator, &learning->kept[0]) && can_return(estimator, &learning->kept[1]);
}

bool lever_state_restore(lever_t *lever, const uint8_t state[LEVER_STATE_BYTES])
{
    const uint8_t watches = (lever->bounce.aircraft != NULL) ? 1u : 0u;
    const bool ours = (state[0] == watches) && (value_at(&state[1], 4u) == lever->link.settings_crc);
    bool accepted = ours && is_possible(state);
    if (accepted) {
        const lever_t before = *lever;
        adopt(lever, state);
        accepted = is_consistent(&lever->estimator);
        if (!accepted) {
            *lever = before;
        }
    }
    return accepted;
}
