/* The least of a port: a frame through the guard and the loop, and the self test, by all that lever_cdkf::port has.
 *
 * Prints the result of the self test, how many frames were received, and the CRC of the answers. */
#include <can/messages.h>
#include <port/command_guard.h>
#include <port/embedded/crc32.h>
#include <port/embedded/self_test.h>
#include <port/loop.h>

#include <inttypes.h>
#include <stdio.h>

static lever_memory_t memory;
static uint32_t crc;
static bool ended;

/* One COMMAND that changes nothing: it is answered by a COMMAND_ACK. */
static enum port_result receive(void *self, lever_frame_t *frame)
{
    static bool was_sent;
    const lever_frame_t command = {MESSAGE_COMMAND_ID, 8u, {0x14u, 0x00u, 0xF0u, 0xFFu, 0xFFu, 0x00u, 0xFFu, 0xFFu}};
    (void)self;
    *frame = command;
    ended = was_sent;
    was_sent = true;
    return ended ? PORT_NOTHING : PORT_DONE;
}

static enum port_result send(void *self, const lever_frame_t *frame)
{
    (void)self;
    crc = crc32_update(crc, frame->data, frame->length);
    return PORT_DONE;
}

static bool wait_frame(void *self, bool for_frame, int32_t timeout_ms)
{
    (void)self;
    (void)for_frame;
    (void)timeout_ms;
    return !ended;
}

static uint32_t now_us(void *self)
{
    (void)self;
    return 0u;
}

int main(void)
{
    lever_config_t config;
    loop_t loop;
    const bool passed = self_test(&memory);
    lever_config_default(&config);
    lever_t *lever = lever_init(&memory, &config);
    command_guard_t guard = {.receive = receive, .lever = lever, .takes_commands = true};
    const port_t port = {&guard, command_guard_receive, send, wait_frame, now_us, NULL, NULL};
    loop_init(&loop, &port, lever, LOOP_DROP);
    while (loop_turn(&loop) == PORT_DONE) {
    }
    (void)printf("%s %u %08" PRIx32 "\n", passed ? "passed" : "failed", (unsigned)loop.totals.received, crc);
    return 0;
}
