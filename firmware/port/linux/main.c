/* lever_can: the estimator behind a SocketCAN interface. See options.c for its help. */
#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "lever_cdkf.h"
#include "port/linux/loop.h"
#include "port/linux/options.h"
#include "port/linux/settings.h"
#include "port/linux/socketcan.h"
#include "port/linux/stop.h"

enum { EXIT_GOOD = 0, EXIT_BAD_INTERFACE = 1, EXIT_BAD_USAGE = 2 };

typedef struct session {
    socketcan_t socketcan;
    loop_t loop;
    bool verbose;
} session_t;

static void print_bus_state(void *context, const char *words)
{
    const session_t *session = context;

    (void)fprintf(stderr, "lever_can: %s: %s\n", session->socketcan.interface, words);
}

static void print_event(void *context, enum loop_event event)
{
    static const char *const modes[] = {"init", "align", "run", "coast", "frozen", "fault"};
    const session_t *session = context;
    const char *interface = session->socketcan.interface;

    if (event == LOOP_EVENT_DOWN) {
        (void)fprintf(stderr, "lever_can: %s: link lost (%s); waiting for it with the estimate kept\n", interface,
            session->socketcan.reason);
    } else if (event == LOOP_EVENT_UP) {
        (void)fprintf(stderr, "lever_can: %s: link restored\n", interface);
    } else if (session->verbose) {
        (void)fprintf(stderr, "lever_can: %s: mode %s at sample %" PRIu64 "\n", interface, modes[session->loop.mode],
            session->loop.totals.samples);
    } else {
        /* a change of mode interests only who asks for it */
    }
}

static void print_totals(const session_t *session, const lever_t *lever)
{
    const loop_totals_t *totals = &session->loop.totals;
    lever_health_t health;

    lever_health(lever, &health);
    (void)printf("lever_can: %s: %" PRIu64 " frames in, %" PRIu64 " frames out, %" PRIu64 " samples, %" PRIu32
                 " lost, %" PRIu32 " corrupt, %" PRIu32 " late, %" PRIu32 " overflowed, %u unsent, %" PRIu64
                 " send retries, %" PRIu64 " outages\n",
        session->socketcan.interface, totals->received, totals->sent, totals->samples, health.lost, health.corrupt,
        health.late, session->socketcan.overflow, session->loop.has_unsent ? 1u : 0u, totals->retries, totals->outages);
}

static int run(const options_t *options)
{
    session_t session = {.verbose = options->verbose};
    lever_memory_t memory;
    lever_t *lever = lever_init(&memory, &options->config);
    const int stop = stop_descriptor();

    if ((lever == NULL) || (stop < 0)) {
        (void)fprintf(stderr, "lever_can: cannot start: %s\n", strerror(errno));
        return EXIT_BAD_INTERFACE;
    }
    if (!socketcan_open(&session.socketcan, options->interface, stop)) {
        (void)fprintf(stderr, "lever_can: %s: %s\n", options->interface, session.socketcan.reason);
        return EXIT_BAD_INTERFACE;
    }
    session.socketcan.on_bus_state = print_bus_state;
    session.socketcan.context = &session;
    const transport_t transport = socketcan_transport(&session.socketcan);
    loop_init(&session.loop, &transport, lever);
    session.loop.on_event = print_event;
    session.loop.context = &session;
    if (options->verbose) {
        settings_write(&options->config, stdout);
    }
    (void)printf("lever_can: %s: ready\n", options->interface);
    (void)fflush(stdout);

    const bool good = loop_run(&session.loop);
    if (!good) {
        (void)fprintf(stderr, "lever_can: %s: %s\n", options->interface, session.socketcan.reason);
    }
    print_totals(&session, lever);
    socketcan_close(&session.socketcan);
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
