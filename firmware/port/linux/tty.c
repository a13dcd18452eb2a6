#define _GNU_SOURCE /* posix_openpt, cfmakeraw, TIOCEXCL */

#include "port/linux/tty.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

/* The bit rates that termios has a name for. */
typedef struct named_speed {
    uint32_t baud;
    speed_t name;
} named_speed_t;

static const named_speed_t speeds[] = {{9600u, B9600}, {19200u, B19200}, {38400u, B38400}, {57600u, B57600},
    {115200u, B115200}, {230400u, B230400}, {460800u, B460800}, {500000u, B500000}, {921600u, B921600},
    {1000000u, B1000000}, {2000000u, B2000000}, {3000000u, B3000000}};

static const named_speed_t *find_speed(uint32_t baud)
{
    for (size_t i = 0u; i < (sizeof speeds / sizeof speeds[0]); i++) {
        if (speeds[i].baud == baud) {
            return &speeds[i];
        }
    }
    return NULL;
}

static bool explain(tty_t *tty, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(tty->reason, sizeof tty->reason, format, arguments);
    va_end(arguments);
    return false;
}

/* --- opening ----------------------------------------------------------------------------------------------------- */

static void start(tty_t *tty, int stop)
{
    (void)memset(tty, 0, sizeof *tty);
    tty->file = -1;
    tty->stop = stop;
}

/* Raw bytes both ways, at the tty's speed if it has one. */
static bool make_raw(const tty_t *tty)
{
    const named_speed_t *const speed = find_speed(tty->baud);
    struct termios mode;

    if (tcgetattr(tty->file, &mode) != 0) {
        return false;
    }
    cfmakeraw(&mode);
    mode.c_cflag |= CLOCAL | CREAD;
    mode.c_cflag &= ~(tcflag_t)(CSTOPB | CRTSCTS);
    if ((speed != NULL) && (cfsetspeed(&mode, speed->name) != 0)) {
        return false;
    }
    return tcsetattr(tty->file, TCSANOW, &mode) == 0;
}

/* Makes the link, in the place of one that a process which was killed has left behind. */
static bool make_link(tty_t *tty, const char *link)
{
    struct stat state;
    const char *const slave = ptsname(tty->file);

    if ((lstat(link, &state) == 0) && S_ISLNK(state.st_mode) && (stat(link, &state) != 0)) {
        (void)unlink(link);
    }
    if ((slave == NULL) || (symlink(slave, link) != 0)) {
        return explain(tty, "cannot make the link to the pseudo-terminal: %s", strerror(errno));
    }
    (void)memcpy(tty->path, link, strlen(link) + 1u);
    return true;
}

bool tty_open_pty(tty_t *tty, const char *link, int stop)
{
    start(tty, stop);
    tty->is_pty = true;
    if ((link[0] == '\0') || (strlen(link) >= sizeof tty->path)) {
        return explain(tty, "the path of a link has 1 to %zu characters", sizeof tty->path - 1u);
    }
    tty->file = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if ((tty->file < 0) || (grantpt(tty->file) != 0) || (unlockpt(tty->file) != 0) || !make_raw(tty)) {
        return explain(tty, "cannot make a pseudo-terminal: %s", strerror(errno));
    }
    return make_link(tty, link);
}

/* Splits DEVICE[:BAUD] into path and speed. */
static bool read_device(tty_t *tty, const char *device)
{
    const char *const colon = strrchr(device, ':');
    const size_t length = (colon == NULL) ? strlen(device) : (size_t)(colon - device);

    if ((length == 0u) || (length >= sizeof tty->path)) {
        return explain(tty, "the path of a device has 1 to %zu characters", sizeof tty->path - 1u);
    }
    (void)memcpy(tty->path, device, length);
    tty->baud = TTY_BAUD;
    if (colon != NULL) {
        char *end = NULL;
        tty->baud = (uint32_t)strtoul(&colon[1], &end, 10);
        if ((*end != '\0') || (find_speed(tty->baud) == NULL)) {
            return explain(tty, "\"%s\" is not a usual baud rate, such as 115200, 921600 or 1000000", &colon[1]);
        }
    }
    return true;
}

static bool open_device(tty_t *tty)
{
    tty->file = open(tty->path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (tty->file < 0) {
        return explain(tty, "%s%s", strerror(errno),
            (errno == EACCES) ? "; its group may use it, see ls -l: usermod -aG dialout $USER, and log in anew" : "");
    }
    if (isatty(tty->file) == 0) {
        return explain(tty, "not a serial device");
    }
    if ((ioctl(tty->file, TIOCEXCL) != 0) || !make_raw(tty) || (tcflush(tty->file, TCIOFLUSH) != 0)) {
        return explain(tty, "cannot set it up: %s", strerror(errno));
    }
    return true;
}

bool tty_open_device(tty_t *tty, const char *device, int stop)
{
    start(tty, stop);
    return read_device(tty, device) && open_device(tty);
}

static void close_file(tty_t *tty)
{
    if (tty->file >= 0) {
        (void)close(tty->file);
        tty->file = -1;
    }
}

void tty_close(tty_t *tty)
{
    if (tty->is_pty && (tty->path[0] != '\0')) {
        (void)unlink(tty->path);
    }
    close_file(tty);
}

/* --- bytes ------------------------------------------------------------------------------------------------------- */

/* What a read or write that could not be done means. A pseudo-terminal that nobody has open any more gives EIO, an adapter
 * that was unplugged EIO, ENXIO or ENODEV. */
static enum transport_result failure(tty_t *tty)
{
    if ((errno == EAGAIN) || (errno == EINTR)) {
        return TRANSPORT_EMPTY;
    }
    if ((errno == EIO) || (errno == ENXIO) || (errno == ENODEV)) {
        (void)explain(tty, tty->is_pty ? "the host has hung up" : "the device is gone");
        return TRANSPORT_DOWN;
    }
    (void)explain(tty, "%s", strerror(errno));
    return TRANSPORT_BROKEN;
}

enum transport_result tty_flush(tty_t *tty)
{
    enum transport_result result = TRANSPORT_OK;

    if (tty->out_length > 0u) {
        const ssize_t written = write(tty->file, tty->out, tty->out_length);
        if (written > 0) {
            tty->out_length -= (uint32_t)written;
            (void)memmove(tty->out, &tty->out[written], tty->out_length);
        } else {
            result = failure(tty);
        }
    }
    return (result == TRANSPORT_EMPTY) ? TRANSPORT_OK : result;
}

static enum transport_result fill(tty_t *tty)
{
    const ssize_t count = read(tty->file, tty->in, sizeof tty->in);

    if (count < 0) {
        return failure(tty);
    }
    if (count == 0) {
        errno = EIO; /* the end of a device that is gone */
        return tty->is_pty ? TRANSPORT_EMPTY : failure(tty);
    }
    tty->in_next = 0u;
    tty->in_length = (uint32_t)count;
    return TRANSPORT_OK;
}

enum transport_result tty_take(tty_t *tty, uint8_t *byte)
{
    if (tty->in_next == tty->in_length) {
        enum transport_result result = tty_flush(tty);
        if (result == TRANSPORT_OK) {
            result = fill(tty);
        }
        if (result != TRANSPORT_OK) {
            return result;
        }
    }
    *byte = tty->in[tty->in_next];
    tty->in_next++;
    return TRANSPORT_OK;
}

bool tty_put(tty_t *tty, const char *text, uint32_t length)
{
    if ((tty->out_length + length) > sizeof tty->out) {
        (void)tty_flush(tty);
    }
    const bool has_room = (tty->out_length + length) <= sizeof tty->out;
    if (has_room) {
        (void)memcpy(&tty->out[tty->out_length], text, length);
        tty->out_length += length;
    }
    return has_room;
}

enum transport_result tty_restore(tty_t *tty)
{
    struct pollfd watched = {.fd = tty->file, .events = POLLIN};

    tty->out_length = 0u;
    if (tty->is_pty) {
        (void)poll(&watched, 1u, 0);
        return ((watched.revents & POLLHUP) == 0) ? TRANSPORT_OK : TRANSPORT_DOWN;
    }
    close_file(tty);
    if (!open_device(tty)) {
        close_file(tty);
        return TRANSPORT_DOWN;
    }
    return TRANSPORT_OK;
}

bool tty_wait(tty_t *tty, bool for_byte, int32_t timeout_ms)
{
    const short events = (short)(POLLIN | ((tty->out_length > 0u) ? POLLOUT : 0));
    struct pollfd watched[2] = {{.fd = tty->stop, .events = POLLIN}, {.fd = tty->file, .events = events}};

    const bool has_byte = for_byte && (tty->in_next != tty->in_length);
    (void)poll(watched, for_byte ? 2u : 1u, has_byte ? 0 : timeout_ms);
    return (watched[0].revents & POLLIN) == 0;
}
