/* A ring buffer of bytes between an interrupt and the loop: one side puts, the other gets, and neither waits or locks.
 *
 * A record (a byte, a line, a frame) goes in whole or not at all. The indices count for ever and wrap at 2^32; the side
 * that puts writes `put` only, the side that gets writes `got` only, each after the bytes. Everything shared is
 * volatile, so that a compiler keeps this order; a single core sees its own in order. Several cores would need
 * barriers.
 */
#ifndef LEVER_PORT_EMBEDDED_RING_H
#define LEVER_PORT_EMBEDDED_RING_H

#include <stdbool.h>
#include <stdint.h>

typedef struct ring {
    volatile uint8_t *bytes; /* the caller's */
    uint32_t size;           /* of bytes: a power of two */
    volatile uint32_t put;   /* bytes put in since the start */
    volatile uint32_t got;   /* bytes got out since the start */
} ring_t;

/* Bytes waiting in the ring. */
uint32_t ring_used(const ring_t *ring);

/* Puts a record in; false, changing nothing, if there is no room for all of it. */
bool ring_put(ring_t *ring, const void *record, uint32_t length);

/* Gets a record of `length` bytes out; false, changing nothing, if fewer wait. */
bool ring_get(ring_t *ring, void *record, uint32_t length);

/* Throws away what waits. For the side that gets, or with the other side's interrupt off. */
void ring_clear(ring_t *ring);

#endif
