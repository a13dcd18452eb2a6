#define _GNU_SOURCE /* struct ifreq */

#include "port/linux/socketcan.h"

#include <errno.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/if_arp.h>

#include "can/messages.h"
#include "port/identifiers.h"
#include "port/linux/clock.h"

enum {
    RECEIVE_BUFFER_BYTES = 4 * 1024 * 1024, /* about 4000 waiting frames: seconds of a full 1 Mbit/s bus */
    MOST_SKIPPED = 64                       /* error frames in one call of receive_frame() */
};

static void explain(socketcan_t *socketcan, const char *format, ...)
{
    va_list arguments;

    va_start(arguments, format);
    (void)vsnprintf(socketcan->reason, sizeof socketcan->reason, format, arguments);
    va_end(arguments);
}

/* --- opening ----------------------------------------------------------------------------------------------------- */

static void explain_no_socket(socketcan_t *socketcan)
{
    if ((errno == EAFNOSUPPORT) || (errno == EPROTONOSUPPORT)) {
        explain(socketcan,
            "this kernel has no CAN sockets: load the modules can and can_raw (modprobe -a can_raw vcan), or "
            "run the estimator without them (lever sim --interface lever, or slcan)");
    } else if ((errno == EPERM) || (errno == EACCES)) {
        explain(socketcan, "no permission to open a CAN socket");
    } else {
        explain(socketcan, "cannot open a CAN socket: %s", strerror(errno));
    }
}

/* Finds the index of the interface and makes sure that it is a CAN interface and up. */
static enum port_result find_interface(socketcan_t *socketcan, int *index)
{
    struct ifreq request;

    (void)memset(&request, 0, sizeof request);
    (void)memcpy(request.ifr_name, socketcan->interface, sizeof request.ifr_name);
    if (ioctl(socketcan->socket, SIOCGIFHWADDR, &request) != 0) {
        if (errno == ENODEV) {
            explain(socketcan,
                "no such interface; a virtual one is made by: ip link add dev %s type vcan && "
                "ip link set %s up",
                socketcan->interface, socketcan->interface);
        } else {
            explain(socketcan, "%s", strerror(errno));
        }
        return PORT_DOWN;
    }
    if (request.ifr_hwaddr.sa_family != ARPHRD_CAN) {
        explain(socketcan, "not a CAN interface");
        return PORT_DOWN;
    }
    if ((ioctl(socketcan->socket, SIOCGIFFLAGS, &request) != 0) || ((request.ifr_flags & IFF_UP) == 0)) {
        explain(socketcan, "the interface is down; bring it up by: ip link set %s up", socketcan->interface);
        return PORT_DOWN;
    }
    if (ioctl(socketcan->socket, SIOCGIFINDEX, &request) != 0) {
        explain(socketcan, "%s", strerror(errno));
        return PORT_DOWN;
    }
    *index = request.ifr_ifindex;
    return PORT_DONE;
}

/* Only the frames that the estimator takes, and the error frames that tell of a change of condition (passing bus errors
 * come by the thousand). Own frames do not come back: that is the kernel's default, CAN_RAW_RECV_OWN_MSGS off. */
static bool set_options(const socketcan_t *socketcan)
{
    static const uint32_t inputs[] = PORT_INPUTS;
    struct can_filter filter[(sizeof inputs) / (sizeof inputs[0])];
    const can_err_mask_t errors = CAN_ERR_CRTL | CAN_ERR_BUSOFF | CAN_ERR_RESTARTED;
    const int count_overflow = 1;
    const int receive_buffer = RECEIVE_BUFFER_BYTES;

    for (size_t i = 0u; i < ((sizeof inputs) / (sizeof inputs[0])); i++) {
        filter[i].can_id =
            identifiers_to_bus(socketcan->identifiers, inputs[i]); /* IDENTIFIERS_EXTENDED is CAN_EFF_FLAG */
        filter[i].can_mask = CAN_EFF_MASK | CAN_EFF_FLAG | CAN_RTR_FLAG;
    }
    /* A larger receive buffer is a precaution, bounded by net.core.rmem_max for who is not root: not a failure. */
    if (setsockopt(socketcan->socket, SOL_SOCKET, SO_RCVBUFFORCE, &receive_buffer, sizeof receive_buffer) != 0) {
        (void)setsockopt(socketcan->socket, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    }
    return (setsockopt(socketcan->socket, SOL_CAN_RAW, CAN_RAW_FILTER, filter, sizeof filter) == 0) &&
           (setsockopt(socketcan->socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors) == 0) &&
           (setsockopt(socketcan->socket, SOL_SOCKET, SO_RXQ_OVFL, &count_overflow, sizeof count_overflow) == 0);
}

static enum port_result open_socket(socketcan_t *socketcan)
{
    struct sockaddr_can address;
    int index = 0;
    enum port_result result = PORT_DOWN;

    socketcan->socket = socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW);
    if (socketcan->socket < 0) {
        explain_no_socket(socketcan);
        return PORT_BROKEN;
    }
    result = find_interface(socketcan, &index);
    if (result == PORT_DONE) {
        (void)memset(&address, 0, sizeof address);
        address.can_family = AF_CAN;
        address.can_ifindex = index;
        if (!set_options(socketcan) || (bind(socketcan->socket, (struct sockaddr *)&address, sizeof address) != 0)) {
            explain(socketcan, "cannot listen: %s", strerror(errno));
            result = PORT_DOWN;
        }
    }
    if (result != PORT_DONE) {
        socketcan_close(socketcan);
    }
    return result;
}

bool socketcan_open(socketcan_t *socketcan, const char *interface, uint32_t identifiers, int stop)
{
    (void)memset(socketcan, 0, sizeof *socketcan);
    socketcan->socket = -1;
    socketcan->stop = stop;
    socketcan->identifiers = identifiers;
    if ((interface[0] == '\0') || (strlen(interface) >= sizeof socketcan->interface)) {
        explain(socketcan, "an interface name has 1 to %zu characters", sizeof socketcan->interface - 1u);
        return false;
    }
    (void)memcpy(socketcan->interface, interface, strlen(interface) + 1u);
    return open_socket(socketcan) == PORT_DONE;
}

void socketcan_close(socketcan_t *socketcan)
{
    if (socketcan->socket >= 0) {
        (void)close(socketcan->socket);
        socketcan->socket = -1;
    }
}

/* --- callbacks --------------------------------------------------------------------------------------------------- */

static enum port_result failure(socketcan_t *socketcan)
{
    const int error = errno;

    explain(socketcan, "%s", strerror(error));
    return ((error == ENETDOWN) || (error == ENODEV) || (error == ENXIO)) ? PORT_DOWN : PORT_BROKEN;
}

/* The most serious condition that an error frame tells of, in words; NULL when there is none. */
static const char *bus_state_words(const struct can_frame *frame)
{
    if ((frame->can_id & CAN_ERR_BUSOFF) != 0u) {
        return "bus-off: the controller has left the bus";
    }
    if ((frame->can_id & CAN_ERR_RESTARTED) != 0u) {
        return "the controller has restarted";
    }
    if ((frame->can_id & CAN_ERR_CRTL) != 0u) {
        if ((frame->data[1] & (CAN_ERR_CRTL_RX_PASSIVE | CAN_ERR_CRTL_TX_PASSIVE)) != 0u) {
            return "error-passive: many bus errors";
        }
        if ((frame->data[1] & (CAN_ERR_CRTL_RX_WARNING | CAN_ERR_CRTL_TX_WARNING)) != 0u) {
            return "error-warning: some bus errors";
        }
        if ((frame->data[1] & CAN_ERR_CRTL_ACTIVE) != 0u) {
            return "error-active: the bus is well again";
        }
    }
    return NULL;
}

/* Says a change of the bus's condition, once. */
static void take_error_frame(socketcan_t *socketcan, const struct can_frame *frame)
{
    const char *words = bus_state_words(frame);

    if ((words != NULL) && (words != socketcan->bus_state)) {
        socketcan->bus_state = words;
        if (socketcan->on_bus_state != NULL) {
            socketcan->on_bus_state(socketcan->context, words);
        }
    }
}

/* The kernel says with each frame how many it had no room for since the socket was opened. */
static void count_overflow(socketcan_t *socketcan, struct msghdr *message)
{
    for (struct cmsghdr *part = CMSG_FIRSTHDR(message); part != NULL; part = CMSG_NXTHDR(message, part)) {
        if ((part->cmsg_level == SOL_SOCKET) && (part->cmsg_type == SO_RXQ_OVFL)) {
            uint32_t count = 0u;
            (void)memcpy(&count, CMSG_DATA(part), sizeof count);
            socketcan->overflow += count - socketcan->overflow_of_socket;
            socketcan->overflow_of_socket = count;
        }
    }
}

/* Reads the next frame; one of another size becomes an error frame that tells of nothing. */
static enum port_result read_frame(socketcan_t *socketcan, struct can_frame *received)
{
    union {
        struct cmsghdr aligned;
        uint8_t bytes[CMSG_SPACE(sizeof(uint32_t))];
    } control;
    struct iovec part = {.iov_base = received, .iov_len = sizeof *received};
    struct msghdr message = {
        .msg_iov = &part, .msg_iovlen = 1u, .msg_control = &control, .msg_controllen = sizeof control};

    const ssize_t size = recvmsg(socketcan->socket, &message, 0);
    if (size < 0) {
        return ((errno == EAGAIN) || (errno == EINTR)) ? PORT_NOTHING : failure(socketcan);
    }
    count_overflow(socketcan, &message);
    if ((size_t)size != sizeof *received) {
        received->can_id = CAN_ERR_FLAG;
    }
    return PORT_DONE;
}

static enum port_result receive_frame(void *self, lever_frame_t *frame)
{
    socketcan_t *socketcan = self;
    struct can_frame received;
    enum port_result result = PORT_DONE;

    for (uint32_t skipped = 0u; skipped < (uint32_t)MOST_SKIPPED; skipped++) {
        result = read_frame(socketcan, &received);
        if ((result != PORT_DONE) || ((received.can_id & CAN_ERR_FLAG) == 0u)) {
            break;
        }
        take_error_frame(socketcan, &received);
        result = PORT_NOTHING;
    }
    if (result == PORT_DONE) {
        frame->id = identifiers_from_bus(socketcan->identifiers, received.can_id);
        frame->length = received.can_dlc;
        (void)memcpy(frame->data, received.data, sizeof frame->data);
    }
    return result;
}

static enum port_result send_frame(void *self, const lever_frame_t *frame)
{
    socketcan_t *socketcan = self;
    struct can_frame sent;

    (void)memset(&sent, 0, sizeof sent);
    sent.can_id = identifiers_to_bus(socketcan->identifiers, frame->id);
    sent.can_dlc = frame->length;
    (void)memcpy(sent.data, frame->data, sizeof sent.data);
    if (send(socketcan->socket, &sent, sizeof sent, 0) == (ssize_t)sizeof sent) {
        return PORT_DONE;
    }
    const bool is_full = (errno == ENOBUFS) || (errno == EAGAIN) || (errno == EINTR) || (errno == ENOMEM);
    return is_full ? PORT_NOTHING : failure(socketcan);
}

/* A socket outlives its interface going down and up, but is unbound for good when the interface is deleted. */
static bool is_bound_to(const socketcan_t *socketcan, int index)
{
    struct sockaddr_can address;
    socklen_t size = sizeof address;

    (void)memset(&address, 0, sizeof address);
    return (getsockname(socketcan->socket, (struct sockaddr *)&address, &size) == 0) && (address.can_ifindex == index);
}

static enum port_result restore_link(void *self)
{
    socketcan_t *socketcan = self;
    int index = 0;

    if (socketcan->socket >= 0) {
        const enum port_result result = find_interface(socketcan, &index);
        if ((result != PORT_DONE) || is_bound_to(socketcan, index)) {
            return result;
        }
        socketcan_close(socketcan);
    }
    socketcan->overflow_of_socket = 0u;
    return open_socket(socketcan);
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    const socketcan_t *socketcan = self;
    struct pollfd watched[2] = {{.fd = socketcan->stop, .events = POLLIN}, {.fd = socketcan->socket, .events = POLLIN}};

    (void)poll(watched, for_frame ? 2u : 1u, timeout_ms);
    return (watched[0].revents & POLLIN) == 0;
}

port_t socketcan_port(socketcan_t *socketcan)
{
    const port_t port = {.self = socketcan,
        .receive = receive_frame,
        .send = send_frame,
        .wait = wait_frame,
        .now_us = clock_now_us,
        .restore = restore_link};

    return port;
}
