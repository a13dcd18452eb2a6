/* Bytes over a serial line or a pseudo-terminal, in raw mode and without ever waiting but in tty_wait(). */
#ifndef LEVER_PORT_TTY_H
#define LEVER_PORT_TTY_H

#include <stdbool.h>
#include <stdint.h>

#include "port/port.h"

enum tty_limits {
    TTY_IN_BYTES = 4096,
    TTY_OUT_BYTES = 16384, /* what the other end is slow to take: 700 frames */
    TTY_PATH_BYTES = 512,
    TTY_BAUD = 115200 /* where none is given */
};

typedef struct tty {
    int file;    /* -1: none */
    int stop;    /* descriptor that becomes readable when the loop is to end; not owned */
    bool is_pty; /* path is our symbolic link to a pseudo-terminal; otherwise it is a device */
    char path[TTY_PATH_BYTES];
    uint32_t baud;
    uint32_t in_next; /* first byte of `in` that has not been taken */
    uint32_t in_length;
    uint32_t out_length;
    uint8_t in[TTY_IN_BYTES];
    uint8_t out[TTY_OUT_BYTES]; /* not yet written */
    char reason[256];           /* of the last failure, in words */
} tty_t;

/* Makes a pseudo-terminal, and at `link` a symbolic link to it, which must not exist yet, or be one that a killed
 * process has left behind. `stop` is a descriptor, see stop.h. Returns false when that cannot be done; tty->reason then
 * says, in one line, what is wrong and what to do. */
bool tty_open_pty(tty_t *tty, const char *link, int stop);

/* The same for a serial device with 8 data bits, no parity and one stop bit: "/dev/ttyUSB0" or "/dev/ttyUSB0:921600",
 * where what follows the last colon is a usual baud rate and the whole is no path that exists. */
bool tty_open_device(tty_t *tty, const char *device, int stop);

/* Releases what open has taken, the link too; also right after a failed open. */
void tty_close(tty_t *tty);

/* Takes the next byte: PORT_DONE, PORT_NOTHING, PORT_DOWN (the other end has hung up, the device is unplugged) or
 * PORT_BROKEN. What has been put is handed to the system before PORT_NOTHING is said, at the latest. */
enum port_result tty_take(tty_t *tty, uint8_t *byte);

/* Puts `length` bytes, whole, or none of them (false) when there is no room. */
bool tty_put(tty_t *tty, const char *text, uint32_t length);

/* Whether what is put now would leave later than PORT_STALE_MS: too much waits here, and in the driver at its baud
 * rate. What a pseudo-terminal holds is its reader's. */
bool tty_is_slow(tty_t *tty);

/* Hands over what was put as far as the system takes it at once. */
enum port_result tty_flush(tty_t *tty);

/* After PORT_DOWN: PORT_DONE when the other end is there again, PORT_DOWN or PORT_BROKEN. What was on its way is
 * forgotten. */
enum port_result tty_restore(tty_t *tty);

/* As wait of port.h. */
bool tty_wait(tty_t *tty, bool for_byte, int32_t timeout_ms);

#endif
