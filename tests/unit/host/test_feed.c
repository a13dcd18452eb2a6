/* Frames through an estimator in bulk: little room and much give the same, and nothing is written beyond either. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "bulk.h"
#include "can/e2e.h"
#include "can/messages.h"
#include "lever_cdkf.h"
#include "test.h"

enum { SAMPLES = 60, FRAMES = 2 * SAMPLES, MOST_OUT = FRAMES * 9 };

static void put(bulk_frame_t *frame, const lever_frame_t *made, int64_t time_us)
{
    (void)memset(frame, 0, sizeof *frame);
    frame->time_us = time_us;
    frame->id = made->id;
    frame->length = made->length;
    (void)memcpy(frame->data, made->data, sizeof frame->data);
}

static void make_frames(bulk_frame_t *frames)
{
    for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
        const message_lever_sample_t lever = {
            .theta = 0.35f, .theta_dot = 0.01f, .tau_m = 0.0f, .theta_valid = true, .theta_dot_valid = true};
        const message_base_sample_t base = {.z_ddot = 0.5f, .z_ddot_valid = true, .time_us = 1000u * k};
        lever_frame_t made;
        TEST_ASSERT_TRUE(message_lever_sample_encode(&made, &lever));
        e2e_protect(&made, MESSAGE_LEVER_SAMPLE_DATA_ID, (uint8_t)k);
        put(&frames[2u * k], &made, 1000 * (int64_t)k);
        TEST_ASSERT_TRUE(message_base_sample_encode(&made, &base));
        e2e_protect(&made, MESSAGE_BASE_SAMPLE_DATA_ID, (uint8_t)k);
        put(&frames[(2u * k) + 1u], &made, 1000 * (int64_t)k);
    }
}

typedef struct result {
    uint64_t out;
    uint64_t rows;
    bulk_frame_t frames[MOST_OUT];
    bulk_row_t row[SAMPLES];
} result_t;

/* All frames through a fresh estimator, with so much room at a time, in memory of exactly that size. */
static void run(const bulk_frame_t *frames, uint64_t out_room, uint64_t row_room, result_t *result)
{
    static lever_memory_t memory;
    lever_config_t config;
    lever_config_default(&config);
    lever_t *lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    bulk_feeder_t feeder = {.lever_id = MESSAGE_LEVER_SAMPLE_ID,
        .base_id = MESSAGE_BASE_SAMPLE_ID,
        .answer_id = {MESSAGE_STATE_ESTIMATE_ID}};
    bulk_frame_t *out = malloc((size_t)out_room * sizeof *out);
    bulk_row_t *rows = malloc((size_t)row_room * sizeof *rows);
    TEST_ASSERT_NOT_NULL(out);
    TEST_ASSERT_NOT_NULL(rows);
    (void)memset(result, 0, sizeof *result);
    for (uint64_t done = 0u; done < (uint64_t)FRAMES;) {
        bulk_fed_t fed;
        bulk_feed(&feeder, lever, &frames[done], (uint64_t)FRAMES - done, out, out_room, rows, row_room, &fed);
        TEST_ASSERT_TRUE(fed.taken > 0u);
        (void)memcpy(&result->frames[result->out], out, (size_t)fed.out * sizeof *out);
        (void)memcpy(&result->row[result->rows], rows, (size_t)fed.rows * sizeof *rows);
        done += fed.taken;
        result->out += fed.out;
        result->rows += fed.rows;
    }
    free(out);
    free(rows);
}

TEST(room_makes_no_difference)
{
    static bulk_frame_t frames[FRAMES];
    static result_t much;
    static result_t little;
    make_frames(frames);
    run(frames, MOST_OUT, SAMPLES, &much);
    run(frames, BULK_OUT_ROOM, 1u, &little);
    TEST_ASSERT_EQUAL_UINT64(SAMPLES - 1, much.rows); /* the last one stays in the feeder */
    TEST_ASSERT_TRUE(much.out >= (uint64_t)(FRAMES + SAMPLES));
    TEST_ASSERT_EQUAL_UINT64(much.out, little.out);
    TEST_ASSERT_EQUAL_MEMORY(much.frames, little.frames, (size_t)much.out * sizeof much.frames[0]);
    TEST_ASSERT_EQUAL_MEMORY(much.row, little.row, (size_t)much.rows * sizeof much.row[0]);
}
