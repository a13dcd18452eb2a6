/* Whole recordings at the speed of C, for Python: text of candump to frames and back, frames through an estimator, and
 * tables as text.
 *
 * What Python does a frame at a time takes microseconds; an hour at 1 kHz has 12 million frames. The estimator is used
 * through its façade lever_cdkf.h like everywhere else. No function here allocates, keeps or opens anything.
 */
#ifndef BULK_H
#define BULK_H

#include <stdint.h>

struct lever;
struct lever_estimate;
struct lever_health;
struct lever_sample;

/* --- frames ---------------------------------------------------------------------------------------------------- */

enum bulk_flag {
    BULK_EXTENDED = 1, /* identifier of 29 bits */
    BULK_REMOTE = 2,   /* remote request: no data */
    BULK_ERROR = 4,    /* error frame of the controller */
    BULK_FD = 8,       /* CAN FD: data is not kept, length is 0 */
    BULK_ANSWER = 16   /* came from the estimator of bulk_feed() */
};

typedef struct bulk_frame {
    int64_t time_us; /* recorded time [us] */
    uint32_t id;
    uint8_t length;
    uint8_t flags; /* of enum bulk_flag */
    uint16_t bus;  /* index of its name in bulk_buses_t */
    uint8_t data[8];
} bulk_frame_t;

enum bulk_limits {
    BULK_BUSES = 64,    /* buses in a recording */
    BULK_BUS_NAME = 32, /* bytes of a name, with its final 0 */
    BULK_LINE = 512,    /* longest line of text */
    BULK_OUT_ROOM = 16, /* frames that one frame can become in bulk_feed(), at most */
    BULK_ANSWERS = 11,  /* messages of the estimator that rows hold */
    BULK_SLOTS = 25     /* 3 messages of a sample, the answers, and the same answers as they were recorded */
};

/* Names of the buses in the order of their first frame. */
typedef struct bulk_buses {
    uint32_t count;
    char name[BULK_BUSES][BULK_BUS_NAME];
} bulk_buses_t;

/* --- candump's text -------------------------------------------------------------------------------------------- */

typedef struct bulk_parsed {
    uint64_t used;    /* bytes of text done with */
    uint64_t lines;   /* lines in them that are not empty */
    uint64_t damaged; /* lines of those that are no frame */
} bulk_parsed_t;

/* Reads the whole lines of `text`, until they or the `room` in `frames` end, and returns the number of frames. A line
 * is "(seconds.fraction) bus id#data", as candump -L and python-can write it, with or without a direction; whatever
 * else is counted as damaged. New buses are added to `buses`. */
uint64_t bulk_parse(
    const char *text, uint64_t size, bulk_buses_t *buses, bulk_frame_t *frames, uint64_t room, bulk_parsed_t *parsed);

/* Writes frames of 11-bit identifiers as such lines, with direction R for answers and T for all else, as from the view
 * of whoever feeds the estimator. `text` must have room for count lines of BULK_BUS_NAME + 64 bytes. Returns the bytes
 * written. */
uint64_t bulk_format(const bulk_frame_t *frames, uint64_t count, const char *bus, char *text);

/* --- tables ---------------------------------------------------------------------------------------------------- */

enum { BULK_NUMBER = 32 }; /* longest number as text, with what follows it */

/* Writes rows of numbers as lines of CSV: six decimals, NaN as "NaN", and beyond 9.2e18 "inf"; in columns that are
 * `whole` no decimals, and NaN as nothing. `text` must have room for BULK_NUMBER bytes a number. Returns the bytes
 * written. */
uint64_t bulk_format_table(const double *numbers, uint64_t rows, uint64_t columns, const uint8_t *whole, char *text);

/* --- the estimator --------------------------------------------------------------------------------------------- */

/* A sample and all that belongs to it. Slot 0 is LEVER_SAMPLE, 1 BASE_SAMPLE, 2 GRIP_SAMPLE, 3.. the answers in the order of
 * bulk_feeder_t.answer_id, and after them the same messages as the recording has them. */
typedef struct bulk_row {
    int64_t time_us;             /* recorded time of its BASE_SAMPLE [us] */
    uint32_t fresh;              /* a bit for each slot that came with this sample */
    uint32_t known;              /* a bit for each slot that came with this sample or an earlier one */
    uint8_t data[BULK_SLOTS][8]; /* of each slot, the last one that came */
} bulk_row_t;

typedef struct bulk_feeder {
    uint32_t lever_id; /* LEVER_SAMPLE */
    uint32_t base_id;  /* BASE_SAMPLE */
    uint32_t grip_id;  /* GRIP_SAMPLE */
    uint32_t command_id;
    uint32_t answer_id[BULK_ANSWERS];
    uint8_t has_row;   /* whether `row` waits for what the recording still has of its sample */
    uint8_t has_lever; /* whether a LEVER_SAMPLE waits for its BASE_SAMPLE */
    uint8_t has_grip;  /* likewise */
    uint8_t lever_data[8];
    uint8_t grip_data[8];
    bulk_row_t row;
    uint64_t refused; /* frames that the estimator did not accept */
} bulk_feeder_t;

typedef struct bulk_fed {
    uint64_t taken; /* frames done with */
    uint64_t out;   /* frames in `out` */
    uint64_t rows;  /* rows in `rows` */
} bulk_fed_t;

/* Feeds classic data frames of one bus to the estimator in their order, until they or the room in `out` or `rows` end.
 * `out` gets what was fed, each frame followed by its answers, which have its recorded time; `rows` gets the samples
 * that are complete: the last one stays in the feeder until the next comes. Only the four inputs are fed, no recorded
 * answers. */
void bulk_feed(bulk_feeder_t *feeder, struct lever *lever, const bulk_frame_t *frames, uint64_t count,
    bulk_frame_t *out, uint64_t out_room, bulk_row_t *rows, uint64_t row_room, bulk_fed_t *fed);

/* Has the estimator take samples in their order, up to the last that is asked for: estimates[i] and healths[i] are of after
 * samples[at[i]]. The indices `at` rise. */
void bulk_estimates(struct lever *lever, const struct lever_sample *samples, const int64_t *at, uint64_t count,
    struct lever_estimate *estimates, struct lever_health *healths);

#endif
