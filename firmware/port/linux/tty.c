#define _GNU_SOURCE /* posix_openpt, cfmakeraw, TIOCEXCL */

#include "port/linux/tty.h"

#include <ctype.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
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
    for (size_t i = 0u; i < ((sizeof speeds) / (sizeof speeds[0])); i++) {
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

static bool is_later(struct timespec one, struct timespec other)
{
    return (one.tv_sec != other.tv_sec) ? (one.tv_sec > other.tv_sec) : (one.tv_nsec > other.tv_nsec);
}

/* Whether a killed process has left `link` behind. Its pseudo-terminal ended with it, and the number may have been
 * given to another since: to ours, or to one that is younger than the link. */
static bool is_left_behind(const char *link, const char *slave)
{
    struct stat state;
    struct stat target;
    struct stat own;
    bool is_left = false;

    if ((lstat(link, &state) == 0) && S_ISLNK(state.st_mode)) {
        is_left = stat(link, &target) != 0;
        if (!is_left && (stat(slave, &own) == 0) && (major(target.st_rdev) == major(own.st_rdev))) {
            is_left = (target.st_rdev == own.st_rdev) || is_later(target.st_ctim, state.st_ctim);
        }
    }
    return is_left;
}

static bool make_link(tty_t *tty, const char *link)
{
    const char *const slave = ptsname(tty->file);

    if ((slave != NULL) && is_left_behind(link, slave)) {
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

/* The speed that a text names; NULL: none. */
static const named_speed_t *read_speed(const char *text)
{
    char *end = NULL;
    const unsigned long baud = strtoul(text, &end, 10);

    return ((isdigit((unsigned char)text[0]) != 0) && (*end == '\0') && (baud <= UINT32_MAX))
               ? find_speed((uint32_t)baud)
               : NULL;
}

/* Splits DEVICE[:BAUD] into path and speed. The path may hold colons, as those of /dev/serial/by-path do. */
static bool read_device(tty_t *tty, const char *device)
{
    const char *const colon = strrchr(device, ':');

    if ((device[0] == '\0') || (colon == device) || (strlen(device) >= sizeof tty->path)) {
        return explain(tty, "the path of a device has 1 to %zu characters", sizeof tty->path - 1u);
    }
    (void)memcpy(tty->path, device, strlen(device) + 1u);
    tty->baud = TTY_BAUD;
    if ((colon != NULL) && (access(device, F_OK) != 0)) {
        const named_speed_t *const speed = read_speed(&colon[1]);
        tty->path[colon - device] = '\0';
        if (speed != NULL) {
            tty->baud = speed->baud;
        } else if (access(tty->path, F_OK) == 0) {
            return explain(tty, "\"%s\" is not a usual baud rate, such as 115200, 921600 or 1000000", &colon[1]);
        } else {
            tty->path[colon - device] = ':'; /* which open_device() does not find */
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

/* What a read or write that could not be done means. A pseudo-terminal that nobody has open any more gives EIO, an
 * adapter that was unplugged EIO, ENXIO or ENODEV. */
static enum port_result failure(tty_t *tty)
{
    if ((errno == EAGAIN) || (errno == EINTR)) {
        return PORT_NOTHING;
    }
    if ((errno == EIO) || (errno == ENXIO) || (errno == ENODEV)) {
        (void)explain(tty, tty->is_pty ? "the host has hung up" : "the device is gone");
        return PORT_DOWN;
    }
    (void)explain(tty, "%s", strerror(errno));
    return PORT_BROKEN;
}

enum port_result tty_flush(tty_t *tty)
{
    enum port_result result = PORT_DONE;

    if (tty->out_length > 0u) {
        const ssize_t written = write(tty->file, tty->out, tty->out_length);
        if (written > 0) {
            tty->out_length -= (uint32_t)written;
            (void)memmove(tty->out, &tty->out[written], tty->out_length);
        } else {
            result = failure(tty);
        }
    }
    return (result == PORT_NOTHING) ? PORT_DONE : result;
}

static enum port_result fill(tty_t *tty)
{
    const ssize_t count = read(tty->file, tty->in, sizeof tty->in);

    if (count < 0) {
        return failure(tty);
    }
    if (count == 0) {
        errno = EIO; /* the end of a device that is gone */
        return tty->is_pty ? PORT_NOTHING : failure(tty);
    }
    tty->in_next = 0u;
    tty->in_length = (uint32_t)count;
    return PORT_DONE;
}

enum port_result tty_take(tty_t *tty, uint8_t *byte)
{
    if (tty->in_next == tty->in_length) {
        enum port_result result = tty_flush(tty);
        if (result == PORT_DONE) {
            result = fill(tty);
        }
        if (result != PORT_DONE) {
            return result;
        }
    }
    *byte = tty->in[tty->in_next];
    tty->in_next++;
    return PORT_DONE;
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

bool tty_is_slow(tty_t *tty)
{
    int queued = 0;

    (void)tty_flush(tty);
    if (tty->is_pty || (ioctl(tty->file, TIOCOUTQ, &queued) != 0)) {
        return tty->out_length > 0u;
    }
    const uint32_t bits = 10u * (tty->out_length + (uint32_t)queued);
    return bits > ((tty->baud * (uint32_t)PORT_STALE_MS) / 1000u);
}

enum port_result tty_restore(tty_t *tty)
{
    struct pollfd watched = {.fd = tty->file, .events = POLLIN};

    tty->out_length = 0u;
    if (tty->is_pty) {
        (void)poll(&watched, 1u, 0);
        return ((watched.revents & POLLHUP) == 0) ? PORT_DONE : PORT_DOWN;
    }
    close_file(tty);
    if (!open_device(tty)) {
        close_file(tty);
        return PORT_DOWN;
    }
    return PORT_DONE;
}

bool tty_wait(tty_t *tty, bool for_byte, int32_t timeout_ms)
{
    const short events = (short)(POLLIN | ((tty->out_length > 0u) ? POLLOUT : 0));
    struct pollfd watched[2] = {{.fd = tty->stop, .events = POLLIN}, {.fd = tty->file, .events = events}};

    const bool has_byte = for_byte && (tty->in_next != tty->in_length);
    (void)poll(watched, for_byte ? 2u : 1u, has_byte ? 0 : timeout_ms);
    return (watched[0].revents & POLLIN) == 0;
}
