/* Texts, and what stands in for the functions of the C library that look into them: any result that the standard allows
 * for some text. */
#ifndef PROOF_TEXTS_H
#define PROOF_TEXTS_H

#include "any.h"

#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

static bool apart; /* each position is followed by itself, which is more exact, and longer */

static size_t any_position(const char *text)
{
    const int end = (int)strlen(text);
    return (size_t)(apart ? Frama_C_interval_split(0, end) : Frama_C_interval(0, end));
}

size_t strspn(const char *text, const char *accepted)
{
    (void)accepted;
    return any_position(text);
}

int vsnprintf(char *restrict text, size_t size, const char *restrict format, va_list arguments)
{
    (void)format;
    (void)arguments;
    (void)Frama_C_make_unknown(text, size - 1u);
    text[size - 1u] = '\0';
    return Frama_C_interval(0, 1000);
}

/* Any text of `length` characters, up to `most`. */
static void any_text(char *text, uint32_t length, char most)
{
    for (uint32_t i = 0u; i < length; i++) {
        text[i] = Frama_C_char_interval(1, most);
    }
    text[length] = '\0';
}

#endif
