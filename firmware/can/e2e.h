/* End-to-end protection of CAN frames: AUTOSAR E2E Profile 2 (AUTOSAR FO PRS E2EProtocol, CRC of SWS CRCLibrary).
 *
 * Byte 0 of a frame is a CRC-8H2F over bytes 1..7 and then the data ID, the low nibble of byte 1 a counter 0..15; the
 * data ID, data_id_base + counter, is not sent. Every message has 16 data IDs of its own (messages.h).
 *
 * This is safety, not security: it finds corruption, loss, repetition, wrong order and frames of the wrong message
 * caused by faults. Whoever wants to forge a frame can compute the same CRC.
 *
 * Cost on a Cortex-M4F at -O2: about 60 instructions to protect, 100 to check.
 */
#ifndef CAN_E2E_H
#define CAN_E2E_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "lever_cdkf.h"

/* CRC-8H2F (polynomial 0x2F, initial value and final xor 0xFF) over data[0..length-1] and then data_id. */
uint8_t e2e_crc(const uint8_t *data, size_t length, uint8_t data_id);

/* Writes counter (its low four bits) and CRC into an 8-byte frame; all else in it must be final. */
void e2e_protect(lever_frame_t *frame, uint8_t data_id_base, uint8_t counter);

/* The counter 0..15 of an 8-byte frame. */
uint8_t e2e_counter(const lever_frame_t *frame);

/* What a check found; values as in E2E_P02CheckStatusType. */
typedef enum e2e_status {
    E2E_OK = 0x00,            /* the frame after the last one */
    E2E_NO_NEW_DATA = 0x01,   /* no frame came in this cycle */
    E2E_CRC_ERROR = 0x02,     /* CRC or length is wrong; no other field of the frame can be trusted */
    E2E_SYNC = 0x03,          /* in order again, but not yet often enough after trouble to be used */
    E2E_INITIAL = 0x04,       /* the first correct frame: nothing to compare its counter with */
    E2E_REPEATED = 0x08,      /* the counter of the last one again */
    E2E_SOME_LOST = 0x20,     /* correct, but frames before it are missing, no more than tolerated */
    E2E_WRONG_SEQUENCE = 0x40 /* too many are missing, or it is older than the last one */
} e2e_status_t;

/* How a receiver judges, chosen per message; the standard's names in brackets. Each is 0..15. */
typedef struct e2e_tolerance {
    uint8_t max_delta_counter;      /* frames in a row that may be missing before a usable one [MaxDeltaCounterInit] */
    uint8_t max_no_new_or_repeated; /* cycles without new data, beyond which it synchronises [MaxNoNewOrRepeatedData] */
    uint8_t sync_counter;           /* frames in order before one is used after trouble [SyncCounterInit]; 0: none, and
                                       the counter of a frame in WRONG_SEQUENCE is not taken over */
} e2e_tolerance_t;

/* State of one message's receiver. Read `lost`; leave the rest to the functions below. */
typedef struct e2e_receiver {
    e2e_tolerance_t tolerance;
    uint8_t data_id_base;
    uint8_t max_delta;          /* tolerated step now: each check without an accepted counter adds one */
    uint8_t last_counter;       /* of the last frame whose counter was taken over */
    uint8_t no_new_or_repeated; /* cycles without new data since then */
    uint8_t sync_left;          /* frames still to come before the receiver is synchronised */
    uint8_t lost;               /* frames missing directly before the last frame, by its counter (so modulo 16), when
                                   that was OK, SOME_LOST or SYNC; otherwise 0. A corrupt frame is missing here too */
    bool waiting;               /* for the first correct frame */
} e2e_receiver_t;

/* Starts, or starts over: the next correct frame will be E2E_INITIAL. */
void e2e_receiver_init(e2e_receiver_t *receiver, uint8_t data_id_base, e2e_tolerance_t tolerance);

/* Judges a received frame of this receiver's message, or with NULL a cycle in which none came. */
e2e_status_t e2e_check(e2e_receiver_t *receiver, const lever_frame_t *frame);

/* Whether the content of a frame may be used: OK, SOME_LOST and INITIAL. */
bool e2e_is_usable(e2e_status_t status);

#endif
