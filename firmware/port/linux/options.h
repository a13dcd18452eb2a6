/* The command line of lever_can. */
#ifndef LEVER_PORT_OPTIONS_H
#define LEVER_PORT_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "lever_cdkf.h"
#include "port/linux/settings.h"

enum options_action { OPTIONS_RUN = 0, OPTIONS_HELP = 1, OPTIONS_VERSION = 2 };

enum options_medium {
    OPTIONS_MEDIUM_NONE = 0,
    OPTIONS_MEDIUM_CAN = 1,    /* SocketCAN interface */
    OPTIONS_MEDIUM_SLCAN = 2,  /* serial device with an SLCAN adapter */
    OPTIONS_MEDIUM_PTY = 3,    /* pseudo-terminal with an SLCAN host, who sees us as the adapter */
    OPTIONS_MEDIUM_SERIAL = 4, /* serial device with such a host */
};

typedef struct options {
    enum options_action action;
    enum options_medium medium;
    const char *interface; /* its name; of argv */
    bool verbose;
    bool lock_step;        /* see loop.h */
    uint32_t snapshot_us;  /* from one SNAPSHOT to the next; 0: none */
    uint32_t identifiers;  /* port/identifiers.h */
    lever_config_t config; /* checked */
    bool has_aircraft;
    lever_aircraft_t aircraft; /* as it stands in its file */
} options_t;

/* Reads the command line. Options take effect in the order given, so a --set after --settings has the last word.
 * Returns false, with `error` filled in, if it cannot be followed. */
bool options_read(options_t *options, int argc, char *argv[], settings_error_t *error);

/* Writes the help, or name and version, to standard output. */
void options_print_help(void);
void options_print_version(void);

#endif
