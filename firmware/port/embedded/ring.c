#include "port/embedded/ring.h"

uint32_t ring_used(const ring_t *ring)
{
    const uint32_t put = ring->put;

    return put - ring->got;
}

bool ring_put(ring_t *ring, const void *record, uint32_t length)
{
    const uint8_t *bytes = record; /* cppcheck-suppress misra-c2012-11.5 ; D4 */
    const uint32_t start = ring->put;

    if (length > (ring->size - ring_used(ring))) {
        return false;
    }
    for (uint32_t i = 0u; i < length; i++) {
        ring->bytes[(start + i) & (ring->size - 1u)] = bytes[i];
    }
    ring->put = start + length;
    return true;
}

bool ring_get(ring_t *ring, void *record, uint32_t length)
{
    uint8_t *bytes = record; /* cppcheck-suppress misra-c2012-11.5 ; D4 */
    const uint32_t start = ring->got;

    if (length > ring_used(ring)) {
        return false;
    }
    for (uint32_t i = 0u; i < length; i++) {
        bytes[i] = ring->bytes[(start + i) & (ring->size - 1u)];
    }
    ring->got = start + length;
    return true;
}

void ring_clear(ring_t *ring)
{
    ring->got = ring->put;
}
