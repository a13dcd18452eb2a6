/* The estimator behind an FMU (controller.c), and where its samples come from: variables (controller_signals.c), or the
 * frames of a bus (controller_bus.c, with event mode). */
#ifndef CONTROLLER_H
#define CONTROLLER_H

#include "fmu.h"
#include "fmu_config.h"
#include "lever_cdkf.h"

#define CONTROLLER_IDLE_US 5000u /* without a sample, after which lever_idle() is called */

enum {
#define FMU_VARIABLE(name, type, role, unit, start, meaning) AT_##name,
#include "controller.def"
    FIRST_SETTING
};

enum {
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) SETTING_##name,
#include "lever_settings.def"
    SETTINGS
};

enum {
    FIRST_BUS = (int)FIRST_SETTING + (int)SETTINGS,
    BEFORE_BUS = FIRST_BUS - 1,
#ifdef FMU_EVENTS
#define FMU_VARIABLE(name, type, role, unit, start, meaning) AT_##name,
#include "controller_bus.def"
#endif
    MODEL_VARIABLES
};

#ifdef FMU_EVENTS
enum { CAN_BYTES = 65536 }; /* of operations that are received, and are to send */

typedef struct controller_input {
    uint64_t sample_us;       /* last step, or call of lever_idle() */
    uint64_t back_us;         /* when the node, off the bus, is back on it */
    uint32_t received;        /* bytes */
    uint32_t ready;           /* bytes */
    uint32_t transmit_errors; /* of the node's error counters */
    uint32_t receive_errors;
    uint32_t status; /* enum can_status */
    uint32_t faults; /* that have been reported */
    uint32_t mode;
    uint32_t bus_offs;
    uint32_t dropped;    /* frames, since the last report to the estimator */
    uint8_t is_received; /* Rx_Clock ticks */
    uint8_t is_ticking;  /* Tx_Clock does, and has not been asked yet */
    uint8_t is_sent;     /* the importer takes what is ready in this event */
    uint8_t rx[CAN_BYTES];
    uint8_t tx[CAN_BYTES];
} controller_input_t;
#else
typedef struct controller_input {
    uint64_t commanded; /* sample of the last command */
    double dither_rms;  /* of it; NaN: there was none yet */
    uint32_t idle_us;   /* without a sample, since lever_idle() */
    uint32_t missing;   /* inputs that have been reported as missing, a bit each */
    uint32_t faults;    /* that have been reported */
    uint32_t mode;
    uint8_t freezes;
    uint8_t resets;
} controller_input_t;
#endif

typedef struct controller {
    lever_memory_t memory;
    lever_config_t config;
    lever_t *lever;
    controller_input_t input; /* state besides the estimator's */
} controller_t;

/* Says what is new since the last sample, as events. */
void controller_report(fmu_t *fmu);

/* --- where samples come from -------------------------------------------------------------------------------------- */

/* At the start, of an input of zeros, with the estimator ready: sets the period of `fmu`. */
void input_start(fmu_t *fmu);

/* One period. */
void input_step(fmu_t *fmu);

/* Whether a parameter of the input may have a value; says so otherwise. */
bool input_accepts(fmu_t *fmu, uint32_t variable, double value);

/* Whether these bytes can be a controller_input_t. */
bool input_is_usable(const uint8_t *bytes);

#endif
