#define _GNU_SOURCE /* getopt_long */

#include "port/linux/options.h"

#include "lever_build.h"
#include "lever_build_port.h"
#include "port/identifiers.h"
#include "port/linux/aircraft.h"

#include <errno.h>
#include <getopt.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SNAPSHOTS_LEAST 0.1 /* [s] */
#define SNAPSHOTS_MOST 10.0

static const char help[] =
    "lever_can: estimates a pilot's mass, damping and stiffness on the collective lever, on a CAN interface.\n"
    "\n"
    "usage: lever_can (--can INTERFACE | --slcan DEVICE | --pty LINK | --serial DEVICE) [option]...\n"
    "\n"
    "It receives LEVER_SAMPLE (0x110), BASE_SAMPLE (0x111), COMMAND (0x120) and, where there is a sensor of the force\n"
    "on the grip, GRIP_SAMPLE (0x112), and answers each sample with\n"
    "estimates, the last of which is STATE_ESTIMATE (0x210). All messages are in firmware/can/lever.dbc.\n"
    "\n"
    "On a CAN bus:\n"
    "  --can INTERFACE      SocketCAN interface, for instance can0 or vcan0; it must be up\n"
    "  --slcan DEVICE       SLCAN (LAWICEL) adapter on a serial device, for instance /dev/ttyUSB0 or "
    "/dev/ttyUSB0:1000000\n"
    "                       (baud; default 115200); its channel is opened at 1 Mbit/s, and closed at the end\n"
    "Without one, as an SLCAN adapter itself, with the estimator as all there is on its bus:\n"
    "  --pty LINK           on a pseudo-terminal, to which LINK is made; a host opens LINK: slcand, python-can's "
    "slcan\n"
    "  --serial DEVICE      on a serial device, as for --slcan, with the host at the other end of the line\n"
    "  A host that does not read is not waited for: what finds no room is dropped and counted.\n"
    "\n"
    "  --settings FILE      read settings from FILE: one `name = value` a line; # starts a comment\n"
    "                       (a number is in the unit listed below, or in the unit that follows it: 2 mrad)\n"
    "  --set NAME=VALUE     set one of the settings below; may be repeated\n"
    "  --model NAME         the same as --set model=NAME, and so for\n"
    "  --preload NAME       where the springs rest: fixed, or at a trim angle that is followed\n"
    "  --estimator NAME     how state and parameters are estimated together\n"
    "  --adaptation NAME    how the parameter noise is set\n"
    "  --mitigation NAME    what is done against collective bounce\n"
    "  --aircraft FILE      watch the margin to collective bounce with the response of this helicopter (STABILITY);\n"
    "                       `lever aircraft` writes such a file, firmware/port/linux/aircraft.h says what is in it\n"
    "  --snapshots SECONDS  also send the whole state so often (SNAPSHOT; 0.5 is 6 % of a bus of 1 Mbit/s), so that a\n"
    "                       log may begin anywhere: `lever replay` starts from one, and proves itself by the others\n"
    "  --id-offset N        identifiers are higher by N than those in lever.dbc, for a second lever on a bus: 0x40, "
    "say\n"
    "  --id-base N          identifiers have 29 bits, and are those in lever.dbc plus N: 0x18FF0000, say\n"
    "  --lock-step          time is that of the samples alone: for simulations that may pause; never beside a motor\n"
    "  --verbose            also print all settings, and every change of mode\n"
    "  --help, --version    print this, or the version, and exit\n"
    "\n"
    "Options take effect in the order given. SIGINT (Ctrl-C) or SIGTERM ends it with a line of totals and status 0.\n"
    "If the interface goes down or away, or the host hangs up, it waits and goes on with the estimate as it was.\n"
    "Without --lock-step torque fades to zero when no sample comes, and a MOTOR_COMMAND older than 20 ms is dropped.\n"
    "Exit status 1: the interface cannot be used; 2: the command line or a settings file is wrong.\n"
    "\n"
    "A session on a virtual interface:\n"
    "\n"
    "    sudo modprobe vcan\n"
    "    sudo ip link add dev vcan0 type vcan && sudo ip link set vcan0 up\n"
    "    lever_can --can vcan0 --lock-step --set theta_noise=0.002 &\n"
    "    candump -L vcan0 > session.log &             # watch or record everything on the bus\n"
    "    lever sim steady --interface socketcan --channel vcan0\n"
    "\n"
    "The same without a kernel that has CAN:\n"
    "\n"
    "    lever_can --pty lever0 --lock-step --set theta_noise=0.002 &\n"
    "    lever sim steady --interface slcan --channel lever0\n"
    "\n";

static const struct option known[] = {
    {"can", required_argument, NULL, 'c'},
    {"slcan", required_argument, NULL, 'l'},
    {"pty", required_argument, NULL, 'p'},
    {"serial", required_argument, NULL, 'r'},
    {"settings", required_argument, NULL, 'f'},
    {"set", required_argument, NULL, 's'},
    {"model", required_argument, NULL, '='},
    {"preload", required_argument, NULL, '='},
    {"estimator", required_argument, NULL, '='},
    {"adaptation", required_argument, NULL, '='},
    {"mitigation", required_argument, NULL, '='},
    {"aircraft", required_argument, NULL, 'a'},
    {"snapshots", required_argument, NULL, 'n'},
    {"id-offset", required_argument, NULL, 'o'},
    {"id-base", required_argument, NULL, 'b'},
    {"lock-step", no_argument, NULL, 'k'},
    {"verbose", no_argument, NULL, 'v'},
    {"help", no_argument, NULL, 'h'},
    {"version", no_argument, NULL, 'V'},
    {NULL, 0, NULL, 0},
};

static bool refuse(settings_error_t *error, const char *what, const char *which)
{
    (void)snprintf(error->text, sizeof error->text, "%.200s%.200s", what, which);
    return false;
}

static FILE *open_file(const char *path, settings_error_t *error)
{
    FILE *file = fopen(path, "r");

    if (file == NULL) {
        (void)snprintf(error->text, sizeof error->text, "%.200s: %s", path, strerror(errno));
    }
    return file;
}

static bool read_settings(lever_config_t *config, const char *path, settings_error_t *error)
{
    FILE *file = open_file(path, error);
    const bool good = (file != NULL) && settings_read(config, file, path, error);

    if (file != NULL) {
        (void)fclose(file);
    }
    return good;
}

static bool read_aircraft(options_t *options, const char *path, settings_error_t *error)
{
    FILE *file = open_file(path, error);

    options->has_aircraft = (file != NULL) && aircraft_read(&options->aircraft, file, path, error);
    if (file != NULL) {
        (void)fclose(file);
    }
    return options->has_aircraft;
}

/* The last one counts, as with every option. */
static void choose(options_t *options, enum options_medium medium, const char *interface)
{
    options->medium = medium;
    options->interface = interface;
}

static bool read_snapshots(options_t *options, const char *argument, settings_error_t *error)
{
    char *end = NULL;
    const double seconds = strtod(argument, &end);

    if ((end == argument) || (*end != '\0') || !((seconds >= SNAPSHOTS_LEAST) && (seconds <= SNAPSHOTS_MOST))) {
        return refuse(error, "--snapshots takes seconds, from 0.1 to 10: ", argument);
    }
    const double rounded = (1.0e6 * seconds) + 0.5;
    options->snapshot_us = (uint32_t)rounded;
    return true;
}

/* Of the two options, the last one counts. */
static bool read_identifiers(
    options_t *options, const char *argument, uint32_t greatest, uint32_t flag, settings_error_t *error)
{
    char *end = NULL;

    errno = 0;
    const unsigned long long shift = strtoull(argument, &end, 0);
    if ((argument[0] < '0') || (argument[0] > '9') || (*end != '\0') || (errno != 0) || (shift > greatest)) {
        (void)snprintf(error->text, sizeof error->text, "%s takes a number from 0 to 0x%X: %.200s",
            (flag != 0u) ? "--id-base" : "--id-offset", (unsigned)greatest, argument);
        return false;
    }
    options->identifiers = (uint32_t)shift + flag;
    return true;
}

static bool read_option(options_t *options, int option, const char *name, const char *argument, settings_error_t *error)
{
    bool good = true;

    switch (option) {
    case 'c':
        choose(options, OPTIONS_MEDIUM_CAN, argument);
        break;
    case 'l':
        choose(options, OPTIONS_MEDIUM_SLCAN, argument);
        break;
    case 'p':
        choose(options, OPTIONS_MEDIUM_PTY, argument);
        break;
    case 'r':
        choose(options, OPTIONS_MEDIUM_SERIAL, argument);
        break;
    case 'f':
        good = read_settings(&options->config, argument, error);
        break;
    case 'a':
        good = read_aircraft(options, argument, error);
        break;
    case 's':
        good = settings_assign(&options->config, argument, error);
        break;
    case '=':
        good = settings_set(&options->config, name, argument, error);
        break;
    case 'n':
        good = read_snapshots(options, argument, error);
        break;
    case 'o':
        good = read_identifiers(options, argument, IDENTIFIERS_OFFSET_MAX, 0u, error);
        break;
    case 'b':
        good = read_identifiers(options, argument, IDENTIFIERS_BASE_MAX, IDENTIFIERS_EXTENDED, error);
        break;
    case 'k':
        options->lock_step = true;
        break;
    case 'v':
        options->verbose = true;
        break;
    case 'h':
        options->action = OPTIONS_HELP;
        break;
    default:
        options->action = OPTIONS_VERSION;
        break;
    }
    return good;
}

/* What must hold for the options together. */
static bool check(const options_t *options, int rest, char *argv[], settings_error_t *error)
{
    const char *bad = lever_config_check(&options->config);

    if (argv[rest] != NULL) {
        return refuse(error, "no argument is expected outside the options: ", argv[rest]);
    }
    if (bad != NULL) {
        return refuse(error, bad, ": does not fit the other settings");
    }
    if ((options->action == OPTIONS_RUN) && (options->interface == NULL)) {
        return refuse(error, "which interface? Say --can vcan0 or --pty lever0, for instance; --help tells more", "");
    }
    return true;
}

bool options_read(options_t *options, int argc, char *argv[], settings_error_t *error)
{
    int which = 0;

    (void)memset(options, 0, sizeof *options);
    lever_build_config(&options->config);
    options->identifiers = LEVER_IDENTIFIERS;
    options->has_aircraft = (lever_build_aircraft() != NULL);
    if (options->has_aircraft) {
        options->aircraft = *lever_build_aircraft();
    }
    opterr = 0;
    optind = 0; /* from the start, also when called again */
    int option = getopt_long(argc, argv, ":", known, &which);
    while (option != -1) {
        if (option == ':') {
            return refuse(error, "a value is missing after ", argv[optind - 1]);
        }
        if (option == '?') {
            return refuse(error, "unknown option (see --help): ", argv[optind - 1]);
        }
        if (!read_option(options, option, known[which].name, optarg, error)) {
            return false;
        }
        option = getopt_long(argc, argv, ":", known, &which);
    }
    return check(options, optind, argv, error);
}

void options_print_help(void)
{
    lever_config_t config;

    lever_build_config(&config);
    (void)fputs(help, stdout);
    (void)puts("Settings, with their defaults:\n");
    settings_write(&config, stdout);
}

void options_print_version(void)
{
    (void)printf("lever_can %d.%d.%d\n", LEVER_VERSION_MAJOR, LEVER_VERSION_MINOR, LEVER_VERSION_PATCH);
}
