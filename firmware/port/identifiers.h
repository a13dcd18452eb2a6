/* Where the identifiers of lever.dbc are on a bus: as they are, higher by an offset, or, with 29 bits, by a base, so that
 * several levers share a bus, or their identifiers do not collide with those of others.
 *
 * One word says it: what is added to an identifier, with IDENTIFIERS_EXTENDED for 29 bits. Payloads, and the data IDs of
 * the E2E protection, stay as they are. Only where a port makes frames of its medium is anything shifted: the loop and all
 * behind it know the identifiers of lever.dbc alone. */
#ifndef LEVER_PORT_IDENTIFIERS_H
#define LEVER_PORT_IDENTIFIERS_H

#include <stdbool.h>
#include <stdint.h>

#include "can/messages.h"

#define IDENTIFIERS_EXTENDED 0x80000000u /* of a frame on the bus, too: it has 29 bits */
#define IDENTIFIERS_MOST 0x7FFu          /* with 11 bits */
#define IDENTIFIERS_OFFSET_MAX (IDENTIFIERS_MOST - (uint32_t)MESSAGE_PLATFORM_RESET_ID) /* the highest */
#define IDENTIFIERS_BASE_MAX (0x1FFFFFFFu - IDENTIFIERS_MOST)

/* The identifier on the bus of a message of lever.dbc. */
static inline uint32_t identifiers_to_bus(uint32_t identifiers, uint32_t id)
{
    return id + identifiers;
}

/* The other way; what is no message's becomes one that no message has. */
static inline uint32_t identifiers_from_bus(uint32_t identifiers, uint32_t id)
{
    return id - identifiers;
}

/* Whether an identifier from the bus may be one of lever.dbc. */
static inline bool identifiers_are_ours(uint32_t id)
{
    return id <= IDENTIFIERS_MOST;
}

#endif
