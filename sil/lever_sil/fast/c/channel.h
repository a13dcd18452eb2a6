/* A lever of lanes.h, its sensors, and the firmware on a bus that delivers what the caller says: frames may be lost,
 * changed, late, repeated or foreign, and readings wrong. For lever_sil/faults.
 */
#ifndef CHANNEL_H
#define CHANNEL_H

#include "lanes.h"

#include <stdbool.h>
#include <stdint.h>

enum channel_signal {
    CHANNEL_THETA,
    CHANNEL_THETA_DOT,
    CHANNEL_TAU_M,
    CHANNEL_Z_DDOT,
    CHANNEL_GRIP_FORCE,
    CHANNEL_SIGNALS
};

enum channel_kind { CHANNEL_LEVER, CHANNEL_BASE, CHANNEL_GRIP, CHANNEL_OTHER };

/* A frame that the firmware receives. */
typedef struct channel_frame {
    uint32_t at;       /* sample at which it arrives */
    uint32_t of;       /* sample that it carries */
    uint32_t id;       /* identifier with which it arrives */
    uint8_t kind;      /* enum channel_kind: what it carries; OTHER: `change` is its data */
    uint8_t counter;   /* of E2E */
    uint8_t data_id;   /* first of the DataIDList that its CRC is made with */
    uint8_t length;    /* with which it arrives */
    uint8_t change[8]; /* flips these bits on the way */
} channel_frame_t;

/* What a sensor reads: factor * (true + noise) of the sample `source`, plus error. NaN is marked invalid; what is infinite
 * is marked valid and has the code for "not available". */
typedef struct channel_sensor {
    const double *noise;
    const uint32_t *source;
    const double *factor;
    const double *error;
} channel_sensor_t;

typedef struct channel {
    /* given; arrays have a value for each sample */
    lanes_t lane;        /* of width 1 */
    double decay;        /* of the difference between torque and command, in a sample period */
    double step_seconds; /* of the port's clock, from sample to sample */
    const double *z_ddot;
    const double *grip_force; /* NULL: there is no sensor */
    channel_sensor_t sensor[CHANNEL_SIGNALS];
    const uint32_t *time_us; /* what the sender of BASE_SAMPLE has for its time */
    const channel_frame_t *frame;
    uint32_t frames;
    uint32_t stride; /* samples between two estimates that are kept */
    /* kept */
    double *tau_m; /* torque that acts [N m] */
    double *asked; /* MOTOR_COMMAND at the end of the sample [N m] */
    struct lever_health *health;
    struct lever_estimate *estimate;
    uint32_t result[4];  /* frames by enum lever_frame_result */
    uint32_t unanswered; /* steps that did not end with STATE_ESTIMATE */
    /* state; zero at the start */
    uint32_t next; /* frame */
    uint32_t silent_us;
    double motor; /* the last MOTOR_COMMAND [N m] */
} channel_t;

/* Runs the samples from `first` to `last` - 1. */
void channel_run(channel_t *channel, struct lever *lever, uint32_t first, uint32_t last);

#endif
