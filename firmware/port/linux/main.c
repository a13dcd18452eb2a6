/* lever_can: the estimator behind a SocketCAN interface or a serial line. See options.c for its help. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "lever_cdkf.h"
#include "port/linux/aircraft.h"
#include "port/linux/options.h"
#include "port/linux/settings.h"
#include "port/linux/slcan_host.h"
#include "port/linux/slcan_peer.h"
#include "port/linux/socketcan.h"
#include "port/linux/stop.h"
#include "port/loop.h"
#include "port/recording.h"

enum { EXIT_GOOD = 0, EXIT_BAD_INTERFACE = 1, EXIT_BAD_USAGE = 2 };

typedef struct session {
    const options_t *options;
    socketcan_t socketcan; /* of these three, the one that options->medium says */
    slcan_host_t slcan_host;
    slcan_peer_t slcan_peer;
    const char *reason; /* of it: what is wrong */
    port_t medium;
    recording_t recording;
    port_t port; /* the medium, with snapshots or without */
    loop_t loop;
} session_t;

static void print_bus_state(void *context, const char *words)
{
    const session_t *session = context;

    (void)fprintf(stderr, "lever_can: %s: %s\n", session->options->interface, words);
}

static void print_link(const session_t *session)
{
    const char *const interface = session->options->interface;

    if (session->loop.is_down) {
        (void)fprintf(stderr, "lever_can: %s: link lost (%s); waiting for it with the estimate kept\n", interface,
            session->reason);
    } else {
        (void)fprintf(stderr, "lever_can: %s: link restored\n", interface);
    }
}

static void print_mode(const session_t *session)
{
    static const char *const modes[] = {"init", "align", "run", "coast", "frozen", "fault"};

    (void)fprintf(stderr, "lever_can: %s: mode %s at sample %" PRIu64 "\n", session->options->interface,
        modes[session->loop.mode], session->loop.totals.samples);
}

/* Turns the loop until it is to end (PORT_NOTHING) or cannot go on. */
static enum port_result run_loop(session_t *session)
{
    loop_t *const loop = &session->loop;
    enum port_result result = PORT_DONE;

    while (result == PORT_DONE) {
        const enum lever_mode mode = loop->mode;
        const bool was_down = loop->is_down;
        result = loop_turn(loop);
        if (loop->is_down != was_down) {
            print_link(session);
        }
        if (session->options->verbose && (loop->mode != mode)) {
            print_mode(session);
        }
    }
    return result;
}

/* What the medium itself has lost or refused. */
static void print_losses(const session_t *session)
{
    if (session->options->medium == OPTIONS_MEDIUM_CAN) {
        (void)printf("%" PRIu32 " overflowed", session->socketcan.overflow);
    } else if (session->options->medium == OPTIONS_MEDIUM_SLCAN) {
        (void)printf("%" PRIu32 " refused by the adapter", session->slcan_host.refused);
    } else {
        const slcan_counts_t *counts = &session->slcan_peer.slcan.counts;
        (void)printf("%" PRIu32 " dropped, %" PRIu32 " lines refused", counts->dropped, counts->refused);
    }
}

static void print_totals(const session_t *session, const lever_t *lever)
{
    const loop_totals_t *totals = &session->loop.totals;
    lever_health_t health;

    lever_health(lever, &health);
    (void)printf("lever_can: %s: %" PRIu64 " frames in, %" PRIu64 " frames out, %" PRIu64 " samples, %" PRIu32
                 " lost, %" PRIu32 " corrupt, %" PRIu32 " late, ",
        session->options->interface, totals->received, totals->sent, totals->samples, health.lost, health.corrupt,
        health.late);
    print_losses(session);
    (void)printf(", %u unsent, %" PRIu64 " held, %" PRIu64 " stale, %" PRIu64 " outages\n",
        session->loop.is_held ? 1u : 0u, totals->held, totals->stale, totals->outages);
}

/* Opens the medium and gets its port; session->reason says what is wrong if that fails. */
static bool open_medium(session_t *session, int stop)
{
    const char *const interface = session->options->interface;
    const uint32_t identifiers = session->options->identifiers;
    bool good = false;

    session->medium = slcan_peer_port(&session->slcan_peer);
    session->reason = session->slcan_peer.tty.reason;
    switch (session->options->medium) {
    case OPTIONS_MEDIUM_SLCAN:
        good = slcan_host_open(&session->slcan_host, interface, identifiers, stop);
        session->medium = slcan_host_port(&session->slcan_host);
        session->reason = session->slcan_host.tty.reason;
        break;
    case OPTIONS_MEDIUM_PTY:
        good = slcan_peer_open_pty(&session->slcan_peer, interface, identifiers, stop);
        break;
    case OPTIONS_MEDIUM_SERIAL:
        good = slcan_peer_open_device(&session->slcan_peer, interface, identifiers, stop);
        break;
    case OPTIONS_MEDIUM_CAN:
    case OPTIONS_MEDIUM_NONE:
    default:
        good = socketcan_open(&session->socketcan, interface, identifiers, stop);
        session->socketcan.on_bus_state = print_bus_state;
        session->socketcan.context = session;
        session->medium = socketcan_port(&session->socketcan);
        session->reason = session->socketcan.reason;
        break;
    }
    return good;
}

static void close_medium(session_t *session)
{
    switch (session->options->medium) {
    case OPTIONS_MEDIUM_SLCAN:
        slcan_host_close(&session->slcan_host);
        break;
    case OPTIONS_MEDIUM_PTY:
    case OPTIONS_MEDIUM_SERIAL:
        slcan_peer_close(&session->slcan_peer);
        break;
    case OPTIONS_MEDIUM_CAN:
    case OPTIONS_MEDIUM_NONE:
    default:
        socketcan_close(&session->socketcan);
        break;
    }
}

static void print_reason(const session_t *session)
{
    (void)fprintf(stderr, "lever_can: %s: %s\n", session->options->interface, session->reason);
}

/* Whether the estimator's host is at the other end of a line. */
static bool is_adapter(const options_t *options)
{
    return (options->medium == OPTIONS_MEDIUM_PTY) || (options->medium == OPTIONS_MEDIUM_SERIAL);
}

static int run(const options_t *options)
{
    session_t session = {.options = options};
    lever_memory_t memory;
    lever_t *lever = lever_init(&memory, &options->config);
    const int stop = stop_descriptor();

    if ((lever == NULL) || (stop < 0)) {
        (void)fprintf(stderr, "lever_can: cannot start: %s\n", strerror(errno));
        return EXIT_BAD_INTERFACE;
    }
    if (options->has_aircraft && !lever_aircraft(lever, &options->aircraft)) {
        (void)fputs("lever_can: " AIRCRAFT_REFUSED "\n", stderr);
        return EXIT_BAD_USAGE;
    }
    if (!open_medium(&session, stop)) {
        print_reason(&session);
        close_medium(&session);
        return EXIT_BAD_INTERFACE;
    }
    session.port = session.medium;
    if (options->snapshot_us != 0u) {
        session.port = recording_port(&session.recording, &session.medium, lever, options->snapshot_us);
    }
    loop_init(&session.loop, &session.port, lever,
        is_adapter(options) ? LOOP_DROP : LOOP_HOLD); /* a bus is waited for, a host that does not read is not */
    session.loop.lock_step = options->lock_step;
    if (options->verbose) {
        settings_write(&options->config, stdout);
    }
    (void)printf("lever_can: %s: ready\n", options->interface);
    (void)fflush(stdout);

    const bool good = run_loop(&session) == PORT_NOTHING;
    if (!good) {
        print_reason(&session);
    }
    print_totals(&session, lever);
    close_medium(&session);
    return good ? EXIT_GOOD : EXIT_BAD_INTERFACE;
}

int main(int argc, char *argv[])
{
    options_t options;
    settings_error_t error;

    if (!options_read(&options, argc, argv, &error)) {
        (void)fprintf(stderr, "lever_can: %s\n", error.text);
        return EXIT_BAD_USAGE;
    }
    if (options.action == OPTIONS_HELP) {
        options_print_help();
        return EXIT_GOOD;
    }
    if (options.action == OPTIONS_VERSION) {
        options_print_version();
        return EXIT_GOOD;
    }
    return run(&options);
}
