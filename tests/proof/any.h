/* What Eva takes for granted of a harness: values of which nothing is known. */
#ifndef PROOF_ANY_H
#define PROOF_ANY_H

#include <__fc_builtin.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "lever_cdkf.h"

static inline uint32_t any_word(void)
{
    return Frama_C_unsigned_int_interval(0u, UINT32_MAX);
}

/* Any bits whatever, also those of NaN; bools are made by any_bool(). */
static inline float any_float(void)
{
    const uint32_t bits = any_word();
    float value;
    (void)memcpy(&value, &bits, sizeof value);
    return value;
}

static inline float any_finite(void)
{
    return Frama_C_float_interval(-3.4028235e38f, 3.4028235e38f);
}

static inline bool any_bool(void)
{
    return Frama_C_interval(0, 1) != 0;
}

static inline uint8_t any_byte(void)
{
    return (uint8_t)Frama_C_unsigned_char_interval(0u, UINT8_MAX);
}

static inline lever_frame_t any_frame(void)
{
    lever_frame_t frame;
    frame.id = any_word();
    frame.length = any_byte();
    for (uint32_t i = 0u; i < sizeof frame.data; i++) {
        frame.data[i] = any_byte();
    }
    return frame;
}

#endif
