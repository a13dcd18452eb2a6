#include "can/e2e.h"

enum { FRAME_BYTES = 8, COUNTER_MASK = 0x0F, COUNTER_GREATEST = 15 };

/* crc_table[i]: the byte i shifted through the polynomial 0x2F, most significant bit first; the unit test works it out
 * bit by bit and compares. */
/* clang-format off */
static const uint8_t crc_table[256] = {
    0x00u, 0x2Fu, 0x5Eu, 0x71u, 0xBCu, 0x93u, 0xE2u, 0xCDu, 0x57u, 0x78u, 0x09u, 0x26u, 0xEBu, 0xC4u, 0xB5u, 0x9Au,
    0xAEu, 0x81u, 0xF0u, 0xDFu, 0x12u, 0x3Du, 0x4Cu, 0x63u, 0xF9u, 0xD6u, 0xA7u, 0x88u, 0x45u, 0x6Au, 0x1Bu, 0x34u,
    0x73u, 0x5Cu, 0x2Du, 0x02u, 0xCFu, 0xE0u, 0x91u, 0xBEu, 0x24u, 0x0Bu, 0x7Au, 0x55u, 0x98u, 0xB7u, 0xC6u, 0xE9u,
    0xDDu, 0xF2u, 0x83u, 0xACu, 0x61u, 0x4Eu, 0x3Fu, 0x10u, 0x8Au, 0xA5u, 0xD4u, 0xFBu, 0x36u, 0x19u, 0x68u, 0x47u,
    0xE6u, 0xC9u, 0xB8u, 0x97u, 0x5Au, 0x75u, 0x04u, 0x2Bu, 0xB1u, 0x9Eu, 0xEFu, 0xC0u, 0x0Du, 0x22u, 0x53u, 0x7Cu,
    0x48u, 0x67u, 0x16u, 0x39u, 0xF4u, 0xDBu, 0xAAu, 0x85u, 0x1Fu, 0x30u, 0x41u, 0x6Eu, 0xA3u, 0x8Cu, 0xFDu, 0xD2u,
    0x95u, 0xBAu, 0xCBu, 0xE4u, 0x29u, 0x06u, 0x77u, 0x58u, 0xC2u, 0xEDu, 0x9Cu, 0xB3u, 0x7Eu, 0x51u, 0x20u, 0x0Fu,
    0x3Bu, 0x14u, 0x65u, 0x4Au, 0x87u, 0xA8u, 0xD9u, 0xF6u, 0x6Cu, 0x43u, 0x32u, 0x1Du, 0xD0u, 0xFFu, 0x8Eu, 0xA1u,
    0xE3u, 0xCCu, 0xBDu, 0x92u, 0x5Fu, 0x70u, 0x01u, 0x2Eu, 0xB4u, 0x9Bu, 0xEAu, 0xC5u, 0x08u, 0x27u, 0x56u, 0x79u,
    0x4Du, 0x62u, 0x13u, 0x3Cu, 0xF1u, 0xDEu, 0xAFu, 0x80u, 0x1Au, 0x35u, 0x44u, 0x6Bu, 0xA6u, 0x89u, 0xF8u, 0xD7u,
    0x90u, 0xBFu, 0xCEu, 0xE1u, 0x2Cu, 0x03u, 0x72u, 0x5Du, 0xC7u, 0xE8u, 0x99u, 0xB6u, 0x7Bu, 0x54u, 0x25u, 0x0Au,
    0x3Eu, 0x11u, 0x60u, 0x4Fu, 0x82u, 0xADu, 0xDCu, 0xF3u, 0x69u, 0x46u, 0x37u, 0x18u, 0xD5u, 0xFAu, 0x8Bu, 0xA4u,
    0x05u, 0x2Au, 0x5Bu, 0x74u, 0xB9u, 0x96u, 0xE7u, 0xC8u, 0x52u, 0x7Du, 0x0Cu, 0x23u, 0xEEu, 0xC1u, 0xB0u, 0x9Fu,
    0xABu, 0x84u, 0xF5u, 0xDAu, 0x17u, 0x38u, 0x49u, 0x66u, 0xFCu, 0xD3u, 0xA2u, 0x8Du, 0x40u, 0x6Fu, 0x1Eu, 0x31u,
    0x76u, 0x59u, 0x28u, 0x07u, 0xCAu, 0xE5u, 0x94u, 0xBBu, 0x21u, 0x0Eu, 0x7Fu, 0x50u, 0x9Du, 0xB2u, 0xC3u, 0xECu,
    0xD8u, 0xF7u, 0x86u, 0xA9u, 0x64u, 0x4Bu, 0x3Au, 0x15u, 0x8Fu, 0xA0u, 0xD1u, 0xFEu, 0x33u, 0x1Cu, 0x6Du, 0x42u,
};
/* clang-format on */

uint8_t e2e_crc(const uint8_t *data, size_t length, uint8_t data_id)
{
    uint8_t crc = 0xFFu;
    for (size_t i = 0u; i < length; i++) {
        crc = crc_table[crc ^ data[i]];
    }
    return (uint8_t)(crc_table[crc ^ data_id] ^ 0xFFu);
}

uint8_t e2e_counter(const lever_frame_t *frame)
{
    return (uint8_t)(frame->data[1] & (uint8_t)COUNTER_MASK);
}

static uint8_t frame_crc(const lever_frame_t *frame, uint8_t data_id_base)
{
    return e2e_crc(&frame->data[1], (size_t)FRAME_BYTES - 1u, (uint8_t)(data_id_base + e2e_counter(frame)));
}

void e2e_protect(lever_frame_t *frame, uint8_t data_id_base, uint8_t counter)
{
    frame->data[1] = (uint8_t)((frame->data[1] & 0xF0u) | (counter & (uint8_t)COUNTER_MASK));
    frame->data[0] = frame_crc(frame, data_id_base);
}

void e2e_receiver_init(e2e_receiver_t *receiver, uint8_t data_id_base, e2e_tolerance_t tolerance)
{
    *receiver = (e2e_receiver_t){.tolerance = tolerance, .data_id_base = data_id_base, .waiting = true};
}

/* Adds one, up to the greatest value of a counter. */
static uint8_t count_up(uint8_t value)
{
    return (value < (uint8_t)COUNTER_GREATEST) ? (uint8_t)(value + 1u) : value;
}

static void take_over(e2e_receiver_t *receiver, uint8_t counter)
{
    receiver->last_counter = counter;
    receiver->max_delta = receiver->tolerance.max_delta_counter;
}

/* A frame `delta` after the last one, as tolerated: is the receiver synchronised, or still to be? */
static e2e_status_t judge_in_order(e2e_receiver_t *receiver, uint8_t delta)
{
    bool silent_too_long = receiver->no_new_or_repeated > receiver->tolerance.max_no_new_or_repeated;
    receiver->no_new_or_repeated = 0u;
    receiver->lost = (uint8_t)(delta - 1u);
    if (silent_too_long) {
        receiver->sync_left = receiver->tolerance.sync_counter;
        return E2E_SYNC;
    }
    if (receiver->sync_left > 0u) {
        receiver->sync_left--;
        return E2E_SYNC;
    }
    return (delta == 1u) ? E2E_OK : E2E_SOME_LOST;
}

/* A frame with a correct CRC that is not the first. */
static e2e_status_t judge_counter(e2e_receiver_t *receiver, uint8_t counter)
{
    uint8_t delta = (uint8_t)((uint8_t)(counter - receiver->last_counter) & (uint8_t)COUNTER_MASK);
    if (delta == 0u) {
        receiver->no_new_or_repeated = count_up(receiver->no_new_or_repeated);
        return E2E_REPEATED;
    }
    if (delta <= receiver->max_delta) {
        take_over(receiver, counter);
        return judge_in_order(receiver, delta);
    }
    receiver->no_new_or_repeated = 0u;
    receiver->sync_left = receiver->tolerance.sync_counter;
    if (receiver->sync_left > 0u) {
        take_over(receiver, counter);
    }
    return E2E_WRONG_SEQUENCE;
}

e2e_status_t e2e_check(e2e_receiver_t *receiver, const lever_frame_t *frame)
{
    receiver->max_delta = count_up(receiver->max_delta);
    receiver->lost = 0u;
    if (frame == NULL) {
        receiver->no_new_or_repeated = count_up(receiver->no_new_or_repeated);
        return E2E_NO_NEW_DATA;
    }
    if ((frame->length != (uint8_t)FRAME_BYTES) || (frame->data[0] != frame_crc(frame, receiver->data_id_base))) {
        return E2E_CRC_ERROR;
    }
    if (receiver->waiting) {
        receiver->waiting = false;
        take_over(receiver, e2e_counter(frame));
        return E2E_INITIAL;
    }
    return judge_counter(receiver, e2e_counter(frame));
}

bool e2e_is_usable(e2e_status_t status)
{
    return (status == E2E_OK) || (status == E2E_SOME_LOST) || (status == E2E_INITIAL);
}
