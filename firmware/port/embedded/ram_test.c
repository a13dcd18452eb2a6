#include "port/embedded/ram_test.h"

uint32_t ram_test_background(uint32_t number)
{
    static const uint32_t background[RAM_TEST_BACKGROUNDS] = {
        0x00000000u, 0x55555555u, 0x33333333u, 0x0F0F0F0Fu, 0x00FF00FFu, 0x0000FFFFu};

    return background[number % (uint32_t)RAM_TEST_BACKGROUNDS];
}

/* An element of the march: each word is read, and written. The bits that were not as expected. */
static uint32_t march_up(volatile uint32_t *slice, uint32_t expected, uint32_t next)
{
    uint32_t wrong = 0u;

    for (uint32_t i = 0u; i < (uint32_t)RAM_TEST_WORDS; i++) {
        wrong |= slice[i] ^ expected;
        slice[i] = next;
    }
    return wrong;
}

static uint32_t march_down(volatile uint32_t *slice, uint32_t expected, uint32_t next)
{
    uint32_t wrong = 0u;

    for (uint32_t i = (uint32_t)RAM_TEST_WORDS; i > 0u; i--) {
        wrong |= slice[i - 1u] ^ expected;
        slice[i - 1u] = next;
    }
    return wrong;
}

/* Copies the slice, and says which bits did not arrive: the place of the copy may be the one that is broken. */
static uint32_t keep(volatile uint32_t *kept, const volatile uint32_t *slice)
{
    uint32_t wrong = 0u;

    for (uint32_t i = 0u; i < (uint32_t)RAM_TEST_WORDS; i++) {
        kept[i] = slice[i];
    }
    for (uint32_t i = 0u; i < (uint32_t)RAM_TEST_WORDS; i++) {
        wrong |= kept[i] ^ slice[i];
    }
    return wrong;
}

bool ram_test_slice(volatile uint32_t *slice, uint32_t background)
{
    volatile uint32_t kept[RAM_TEST_WORDS];
    uint32_t wrong = keep(kept, slice);

    if (wrong == 0u) {
        for (uint32_t i = 0u; i < (uint32_t)RAM_TEST_WORDS; i++) {
            slice[i] = background;
        }
        wrong |= march_up(slice, background, ~background);
        wrong |= march_up(slice, ~background, background);
        wrong |= march_down(slice, background, ~background);
        wrong |= march_down(slice, ~background, background);
        for (uint32_t i = 0u; i < (uint32_t)RAM_TEST_WORDS; i++) {
            wrong |= slice[i] ^ background;
            slice[i] = kept[i];
        }
    }
    return wrong == 0u;
}
