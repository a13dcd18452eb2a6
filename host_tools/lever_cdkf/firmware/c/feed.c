/* Frames or samples of a recording through an estimator, and what belongs to each sample side by side. */
#include "bulk.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum {
    LEVER_SLOT = 0,
    BASE_SLOT = 1,
    GRIP_SLOT = 2,
    ANSWER_SLOT = 3,
    RECORDED_SLOT = ANSWER_SLOT + BULK_ANSWERS,
    FRAME_BYTES = 8
};

#define COUNTER_MASK 15u

/* The place of an identifier among the answers; BULK_ANSWERS if it is none. */
static uint32_t answer_index(const bulk_feeder_t *feeder, uint32_t id)
{
    uint32_t index = 0u;
    while ((index < (uint32_t)BULK_ANSWERS) && (feeder->answer_id[index] != id)) {
        index++;
    }
    return index;
}

static void put_slot(bulk_row_t *row, uint32_t slot, const uint8_t data[FRAME_BYTES])
{
    (void)memcpy(row->data[slot], data, FRAME_BYTES);
    row->fresh |= 1u << slot;
    row->known |= 1u << slot;
}

static bool have_same_counter(const uint8_t *a, const uint8_t *b)
{
    return ((a[1] ^ b[1]) & COUNTER_MASK) == 0u;
}

/* The row of a new sample: with its LEVER_SAMPLE and GRIP_SAMPLE if they came before it with the same counter, as the
 * estimator pairs. */
static void start_row(bulk_feeder_t *feeder, const bulk_frame_t *base)
{
    bulk_row_t *row = &feeder->row;
    row->time_us = base->time_us;
    row->fresh = 0u;
    put_slot(row, BASE_SLOT, base->data);
    if ((feeder->has_lever != 0u) && have_same_counter(feeder->lever_data, base->data)) {
        put_slot(row, LEVER_SLOT, feeder->lever_data);
    }
    if ((feeder->has_grip != 0u) && have_same_counter(feeder->grip_data, base->data)) {
        put_slot(row, GRIP_SLOT, feeder->grip_data);
    }
    feeder->has_lever = 0u;
    feeder->has_grip = 0u;
    feeder->has_row = 1u;
}

/* Appends what the estimator has to say after a frame; returns the frames in `out` then. */
static uint64_t fetch(
    bulk_feeder_t *feeder, struct lever *lever, const bulk_frame_t *cause, bulk_frame_t *out, uint64_t count)
{
    lever_frame_t answer;
    while (lever_next_frame(lever, &answer)) {
        bulk_frame_t *frame = &out[count];
        frame->time_us = cause->time_us;
        frame->id = answer.id;
        frame->length = answer.length;
        frame->flags = (uint8_t)BULK_ANSWER;
        frame->bus = cause->bus;
        (void)memcpy(frame->data, answer.data, sizeof frame->data);
        const uint32_t index = answer_index(feeder, answer.id);
        if (index < (uint32_t)BULK_ANSWERS) {
            put_slot(&feeder->row, (uint32_t)ANSWER_SLOT + index, answer.data);
        }
        count++;
    }
    return count;
}

/* What an estimator takes. An IDENTITY of the recorded one is not for it: it would stand for a second one on the
 * bus. */
static bool is_input(const bulk_feeder_t *feeder, const bulk_frame_t *frame)
{
    return (frame->id == feeder->lever_id) || (frame->id == feeder->base_id) || (frame->id == feeder->grip_id) ||
           (frame->id == feeder->command_id);
}

/* An answer in the recording belongs to the sample before it. */
static void keep_recorded(bulk_feeder_t *feeder, const bulk_frame_t *frame)
{
    const uint32_t index = answer_index(feeder, frame->id);
    if ((index < (uint32_t)BULK_ANSWERS) && (feeder->has_row != 0u) && (frame->length == (uint8_t)FRAME_BYTES)) {
        put_slot(&feeder->row, (uint32_t)RECORDED_SLOT + index, frame->data);
    }
}

static void feed_one(bulk_feeder_t *feeder, struct lever *lever, const bulk_frame_t *frame, bulk_frame_t *out,
    bulk_row_t *rows, bulk_fed_t *fed)
{
    lever_frame_t received;
    received.id = frame->id;
    received.length = frame->length;
    (void)memcpy(received.data, frame->data, sizeof received.data);
    out[fed->out] = *frame;
    fed->out++;
    const enum lever_frame_result result = lever_on_frame(lever, &received);
    if (result == LEVER_FRAME_SAMPLE) {
        if (feeder->has_row != 0u) {
            rows[fed->rows] = feeder->row;
            fed->rows++;
        }
        start_row(feeder, frame);
        (void)lever_step(lever);
    } else if ((result == LEVER_FRAME_TAKEN) && (frame->id == feeder->lever_id)) {
        (void)memcpy(feeder->lever_data, frame->data, sizeof feeder->lever_data);
        feeder->has_lever = 1u;
    } else if ((result == LEVER_FRAME_TAKEN) && (frame->id == feeder->grip_id)) {
        (void)memcpy(feeder->grip_data, frame->data, sizeof feeder->grip_data);
        feeder->has_grip = 1u;
    } else {
        feeder->refused += (result == LEVER_FRAME_REFUSED) ? 1u : 0u;
    }
    fed->out = fetch(feeder, lever, frame, out, fed->out);
}

void bulk_feed(bulk_feeder_t *feeder, struct lever *lever, const bulk_frame_t *frames, uint64_t count,
    bulk_frame_t *out, uint64_t out_room, bulk_row_t *rows, uint64_t row_room, bulk_fed_t *fed)
{
    (void)memset(fed, 0, sizeof *fed);
    while ((fed->taken < count) && (fed->rows < row_room) && ((fed->out + (uint64_t)BULK_OUT_ROOM) <= out_room)) {
        const bulk_frame_t *frame = &frames[fed->taken];
        if (is_input(feeder, frame)) {
            feed_one(feeder, lever, frame, out, rows, fed);
        } else {
            keep_recorded(feeder, frame);
        }
        fed->taken++;
    }
}

void bulk_estimates(struct lever *lever, const lever_sample_t *samples, const int64_t *at, uint64_t count,
    lever_estimate_t *estimates, lever_health_t *healths)
{
    int64_t next = 0;
    for (uint64_t i = 0u; i < count; i++) {
        for (; next <= at[i]; next++) {
            (void)lever_update(lever, &samples[next]);
        }
        lever_estimate(lever, &estimates[i]);
        lever_health(lever, &healths[i]);
    }
}
