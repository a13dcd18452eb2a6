/* SLCAN: CAN frames as lines of text, the LAWICEL protocol (CAN232 and CANUSB manuals). No I/O, no clock, no heap;
 * nothing waits.
 *
 * Two things live here. The peer (slcan_t) is an adapter as seen by its host: it takes the host's bytes, gives the
 * frames in them to its caller and answers every command; estimator ports use it. The lines themselves (slcan_line_t,
 * slcan_read_frame(), slcan_write_frame()) serve either end of a serial line.
 *
 * The peer's answers, each of which ends with CR (0x0D) or is BEL (0x07):
 *
 *     Sn, sXXYY       bit rate, n = 0..8; BTR0 and BTR1        closed        CR
 *     O, L            open, open to listen only                closed        CR
 *     C               close                                    open          CR
 *     tIIIL…, rIIIL   send a data, remote frame                open, not L   z CR
 *     TIIIIIIIIL…, R  the same with 29 bits of identifier      open, not L   Z CR
 *     F               status flags, which are then cleared     open          FXX CR
 *     V, v; N         version; serial number                   always        VHHSS, vHHSS; NXXXX CR
 *     Zn              time stamps off, on                      closed        CR
 *     MXXXXXXXX, m…   acceptance code, mask (of an SJA1000)    closed        CR
 *     (nothing)       an empty line                            always        CR
 *
 * and BEL to everything else: an unknown command, a malformed or too long line, a command in the wrong state, such as
 * the second O of python-can. The bit rate is 1 Mbit/s until told otherwise, so that O does not need an S before it.
 * Hexadecimal digits of either case are read, capitals written. A LF after a CR is skipped.
 */
#ifndef LEVER_PORT_SLCAN_H
#define LEVER_PORT_SLCAN_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"

/* What our adapters answer to V, two digits each: hardware 10, and the first two numbers of the version. */
#define SLCAN_TEXT(number) #number
#define SLCAN_VERSION_TEXT(major, minor) "10" SLCAN_TEXT(major) SLCAN_TEXT(minor)
#define SLCAN_VERSION SLCAN_VERSION_TEXT(LEVER_VERSION_MAJOR, LEVER_VERSION_MINOR)
#if (LEVER_VERSION_MAJOR > 9) || (LEVER_VERSION_MINOR > 9)
#error "SLCAN has a digit each for the version"
#endif

/* A frame of either kind. `frame.id` has 29 bits when it is extended; a remote frame has a length, but no data. */
typedef struct slcan_frame {
    lever_frame_t frame;
    bool extended;
    bool remote;
} slcan_frame_t;

/* --- lines ----------------------------------------------------------------------------------------------------- */

enum slcan_limits {
    SLCAN_LINE_BYTES = 31,     /* the longest line: T, 8 + 1 + 16 digits, 4 of a time stamp, CR */
    SLCAN_TIME_STAMPS = 60000, /* a time stamp counts milliseconds, from 0 to 59999 */
    SLCAN_NO_TIME = 0xFFFF     /* instead of a time stamp: the line has none */
};

/* Bytes on their way to becoming a line. Zero-initialised it is empty. */
typedef struct slcan_line {
    char text[SLCAN_LINE_BYTES];
    uint8_t length; /* characters in text, without CR or BEL */
    bool too_long;  /* more came than there is room for: text is not to be used */
    bool ended;     /* the next byte starts a new line */
} slcan_line_t;

enum slcan_end {
    SLCAN_GOES_ON = 0, /* not yet a line */
    SLCAN_CR = 1,      /* a line, in line->text; may be empty */
    SLCAN_BEL = 2      /* the same, ended by BEL: what an adapter refuses with */
};

/* Takes the next byte. A line stays as it is until the byte after it. A LF at the start of a line is skipped. */
enum slcan_end slcan_line_take(slcan_line_t *line, uint8_t byte);

/* Reads the frame in t, T, r, R lines, with or without a time stamp if `may_have_time`. False, with `frame` undefined,
 * if it is anything else, or not exactly such a line. */
bool slcan_read_frame(const slcan_line_t *line, bool may_have_time, slcan_frame_t *frame);

/* Writes a frame, with its time stamp [ms] or SLCAN_NO_TIME, as a line with CR (and no 0 at the end); returns its
 * length. Of an identifier the lowest 11 or 29 bits count; a length above 8 is taken as 8. */
uint32_t slcan_write_frame(const slcan_frame_t *frame, uint16_t time_stamp, char text[SLCAN_LINE_BYTES]);

/* --- the peer -------------------------------------------------------------------------------------------------- */

/* Where answers and frames go. put() takes `length` bytes whole, or none of them (false) when there is no room for the
 * moment; it must not wait. What finds no room is dropped and counted. */
typedef struct slcan_sink {
    void *self; /* first argument of put */
    bool (*put)(void *self, const char *text, uint32_t length);
} slcan_sink_t;

/* What V and N answer: four characters each. */
typedef struct slcan_identity {
    char version[5]; /* digits: hardware, then software, two each */
    char serial[5];  /* letters or digits */
} slcan_identity_t;

enum slcan_channel { SLCAN_CHANNEL_CLOSED = 0, SLCAN_CHANNEL_OPEN = 1, SLCAN_CHANNEL_LISTEN = 2 };

/* Bits of the status flags (answer to F). The peer itself sets the first and DATA_OVERRUN, for a frame that found no
 * room. */
enum slcan_status {
    SLCAN_STATUS_RECEIVE_FULL = 0x01,
    SLCAN_STATUS_TRANSMIT_FULL = 0x02,
    SLCAN_STATUS_ERROR_WARNING = 0x04,
    SLCAN_STATUS_DATA_OVERRUN = 0x08,
    SLCAN_STATUS_ERROR_PASSIVE = 0x20,
    SLCAN_STATUS_ARBITRATION_LOST = 0x40,
    SLCAN_STATUS_BUS_ERROR = 0x80
};

/* Since slcan_init(); each stops at its greatest value. */
typedef struct slcan_counts {
    uint32_t frames_in;  /* given to the caller */
    uint32_t frames_out; /* put into the sink */
    uint32_t refused;    /* lines answered with BEL */
    uint32_t dropped;    /* frames and answers that found no room in the sink */
} slcan_counts_t;

typedef struct slcan {
    slcan_sink_t sink;
    slcan_identity_t identity;
    slcan_line_t line;
    slcan_counts_t counts;
    uint32_t acceptance_code; /* of M */
    uint32_t acceptance_mask; /* of m: bits that do not matter */
    uint16_t bit_timing;      /* BTR0 and BTR1 of s; 0: none, bit_rate counts */
    uint8_t bit_rate;         /* n of Sn */
    uint8_t channel;          /* enum slcan_channel */
    uint8_t status;           /* of enum slcan_status */
    bool time_stamps;         /* Z1 */
} slcan_t;

/* A peer with its channel closed, no time stamps, and everything accepted. */
void slcan_init(slcan_t *slcan, const slcan_sink_t *sink, const slcan_identity_t *identity);

/* Takes a byte from the host; when it ends a line, this is carried out and answered. Returns true when the line was a
 * frame, which then is in `frame`, acknowledged, and the caller's. Bounded, and never waits. */
bool slcan_take(slcan_t *slcan, uint8_t byte, slcan_frame_t *frame);

/* Sends a frame to the host; `time_ms` [ms] is any clock's, for hosts that want time stamps. Returns false if it was
 * dropped for lack of room. True also when the channel is closed or the acceptance filter keeps it back: nobody wants
 * it. */
bool slcan_send(slcan_t *slcan, const slcan_frame_t *frame, uint32_t time_ms);

/* Forgets what has been received of a line, and closes the channel: the host has gone. */
void slcan_hang_up(slcan_t *slcan);

/* A data frame of the estimator, as it is on the bus; `identifiers`: port/identifiers.h. */
slcan_frame_t slcan_shifted(const lever_frame_t *frame, uint32_t identifiers);

/* The other way; false for a frame that is not for the estimator. */
bool slcan_is_ours(const slcan_frame_t *received, uint32_t identifiers, lever_frame_t *frame);

#endif
