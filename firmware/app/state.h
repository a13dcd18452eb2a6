/* The state of an instance as bytes: what its future depends on besides configuration, aircraft and what comes in.
 *
 * What follows from the configuration and the choices is not in it, nor are pointers and padding: the bytes are the same
 * on every machine. The functions are those of lever_cdkf.h, lever_state_...(); linked where they are used. */
#ifndef APP_STATE_H
#define APP_STATE_H

#include <stdbool.h>
#include <stdint.h>

/* Members of one kind that lie side by side in an instance. */
typedef struct state_row {
    uint16_t offset;
    uint16_t count;
    uint8_t size;  /* of each, in memory: 1, 2 or 4 bytes */
    bool is_float; /* which must be finite */
    uint32_t most; /* greatest value; as many bytes of the state as that needs */
} state_row_t;

uint32_t state_row_count(void);
const state_row_t *state_row(uint32_t index);

#endif
