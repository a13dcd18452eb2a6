/* Which COMMANDs reach the estimator: a stage between a port's receive() and the loop.
 *
 * COMMAND starts torque and chooses models, so it is let through only as far as the build, the state of the machine and
 * its sender allow:
 *   - one that changes nothing, or only ends something (dither, mitigation, learning by FREEZE, all of it by RESET),
 *     passes always: it keeps torque and correction alive, or ends them;
 *   - any other passes when the build takes commands, while nothing acts on the lever (lever_is_acting()) and, where
 *     there is such a callback, the machine says that it is safe, e.g. on the ground;
 *   - with an authentication none passes that is not authentic and new, whatever it says.
 * What is refused is counted in LINK_HEALTH, and COMMAND_ACK says why. Other frames pass.
 *
 * Authentication is that of AUTOSAR SecOC with the authenticator in a frame of its own: COMMAND has no room for it. A
 * frame with the identifier `id`, which the integrator chooses, precedes its COMMAND: 8 bytes, the low 24 bits of the
 * freshness value and then the first 40 bits of the MAC, most significant byte first. The MAC is over identifier (2
 * bytes), data (8 bytes) and full freshness value (8 bytes) of the COMMAND, in the same order of bytes. Key, algorithm
 * and freshness are the integrator's, by callbacks: this module has no cryptography.
 *
 *     port.receive = command_guard_receive, port.self = &guard;    // callbacks of the port get guard.self
 */
#ifndef LEVER_PORT_COMMAND_GUARD_H
#define LEVER_PORT_COMMAND_GUARD_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/port.h"

enum command_guard_sizes { COMMAND_GUARD_DATA = 18, COMMAND_GUARD_MAC = 5 };

typedef struct command_authentication {
    void *self;  /* first argument of the callbacks */
    uint32_t id; /* of the frame with the authenticator; a port has to receive it */

    /* The full freshness value of which these are the low 24 bits; false: it is not newer than the last accepted. */
    bool (*freshness)(void *self, uint32_t low, uint64_t *value);

    /* Whether this is the MAC of the data. To be compared in constant time. */
    bool (*verify)(void *self, const uint8_t data[COMMAND_GUARD_DATA], const uint8_t mac[COMMAND_GUARD_MAC]);

    /* The COMMAND with this freshness value was authentic: from now on it is old. */
    void (*accepted)(void *self, uint64_t value);
} command_authentication_t;

typedef struct command_guard {
    enum port_result (*receive)(void *self, lever_frame_t *frame); /* of the port */
    void *self;
    lever_t *lever;
    bool (*is_safe)(void *self);                    /* NULL: the state of the lever decides alone */
    const command_authentication_t *authentication; /* NULL: none */
    bool takes_commands;                            /* that change something: by the build */
    bool has_authenticator;                         /* for the next COMMAND */
    uint8_t authenticator[8];
} command_guard_t;

/* No message has this identifier. */
#define COMMAND_GUARD_NOBODY UINT32_MAX

/* receive of port.h, with a command_guard_t as `self`. A COMMAND that is refused becomes a frame for COMMAND_GUARD_NOBODY,
 * so that the loop sends its COMMAND_ACK before it receives the next frame. */
enum port_result command_guard_receive(void *self, lever_frame_t *frame);

#endif
