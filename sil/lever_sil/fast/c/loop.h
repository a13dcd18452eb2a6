/* The closed loop at the speed of C, for Python: plant, sensors and firmware, sample by sample, from columns that are
 * made beforehand. Of a scenario as in lever_sil/run/loop.py; of a lever of lever_sil/batch, also with frames that are
 * lost, changed, late, repeated or foreign.
 *
 * The firmware is the caller's instance, used through its façade. Nothing here allocates.
 */
#ifndef LOOP_H
#define LOOP_H

#include "aircraft.h"
#include "lanes.h"
#include "plants.h"

#include <stdbool.h>
#include <stdint.h>

struct lever; /* of lever_cdkf.h */
struct lever_command;
struct lever_estimate;
struct lever_frame;
struct lever_health;
struct lever_recorder;
struct lever_stability;

enum loop_signal { LOOP_THETA, LOOP_THETA_DOT, LOOP_TAU_M, LOOP_GRIP_FORCE, LOOP_Z_DDOT, LOOP_SIGNALS };

enum loop_limits {
    LOOP_PENDING = 32,   /* frames of the estimator that wait to be taken */
    LOOP_SNAPSHOTS = 32, /* of a snapshot that follow a sample, at most */
    LOOP_FRAMES = 96     /* that a sample can bring into the record, at most */
};

/* A value as a frame carries it, by the DBC: a multiple of `step`, at most `most` of them. */
typedef struct loop_field {
    double step;
    double most;
} loop_field_t;

/* A sensor of a signal that depends on the run: gain * value, so much later, plus offset. */
typedef struct loop_sensor {
    double gain;
    const double *offset;  /* a value a sample */
    uint32_t whole;        /* delay in sample periods, */
    double part;           /* and what is beyond */
    const int64_t *source; /* faults: the reading is factor * reading[source] + error; NULL: there are none */
    const double *factor;
    const double *error; /* NaN: marked invalid */
    loop_field_t field;
} loop_sensor_t;

enum loop_content { LOOP_LEVER_SAMPLE, LOOP_BASE_SAMPLE, LOOP_GRIP_SAMPLE, LOOP_OTHER };

/* A frame that the firmware receives. */
typedef struct loop_arrival {
    uint32_t at;       /* sample at which it arrives */
    uint32_t of;       /* sample that it carries */
    uint32_t id;       /* identifier with which it arrives */
    uint8_t content;   /* enum loop_content; of OTHER, `change` is its data */
    uint8_t counter;   /* of E2E */
    uint8_t data_id;   /* first of the DataIDList that its CRC is made with */
    uint8_t length;    /* with which it arrives */
    uint8_t change[8]; /* flips these bits on the way */
} loop_arrival_t;

/* A cabin that the lever moves. */
typedef struct loop_cabin {
    bool exists; /* otherwise the base moves by itself */
    aircraft_t aircraft;
    double period;  /* between two samples [s] */
    double rest;    /* angle of the lever at which the aircraft is trimmed [rad] */
    double outside; /* of the cabin's speed, what is felt besides its acceleration [1/s]: plants/mayo_plant.py */
    double *seat;   /* z_ddot of the pilot's seat, of which the first value is given [m/s^2], */
    double *felt;   /* and of the plant: the same with what of its speed is felt [m/s^2] */
    double speed;   /* upwards; state [m/s] */
} loop_cabin_t;

typedef struct loop {
    /* given; arrays have a value for each sample */
    uint32_t count;     /* samples */
    uint32_t period_us; /* between two of them */
    bool by_frames;     /* encoded, with E2E protection; otherwise by structs */
    bool has_grip;      /* there is a sensor of the grip force */
    plant_t plant;
    /* NULL: none. Otherwise its only lane moves in place of `plant`; of the signals tau_m is kept, theta and theta_dot are
     * the lane's own arrays, and the others are given. */
    lanes_t *lanes;
    double motor_decay; /* with lanes: of the difference between torque and command, in a sample period */
    loop_cabin_t cabin; /* with one signal[LOOP_Z_DDOT], at the accelerometer, has its first value */
    loop_sensor_t sensor[LOOP_SIGNALS];
    const double *base;                      /* measured z_ddot [m/s^2]; NaN: marked invalid. NULL: by its sensor */
    loop_field_t torque_field;               /* of MOTOR_COMMAND */
    loop_field_t correction_field;           /* of CORRECTION */
    const uint8_t *no_lever;                 /* the frame is never sent */
    const uint8_t *no_base;                  /* likewise */
    struct lever_recorder *recorder;         /* by frames, sends snapshots; NULL: none does */
    const uint32_t *time_us;                 /* what the sender has for the time of the samples; NULL: as they are */
    const double *torque;                    /* asked of the motor besides what the firmware asks for [N m] */
    uint32_t commands;                       /* before which samples there is a COMMAND, */
    const uint32_t *command_sample;          /* rising, */
    const struct lever_command *command;     /* and which, by structs, */
    const struct lever_frame *command_frame; /* or by frames */
    const loop_arrival_t *arrival;           /* by frames: all that arrive, with the COMMANDs; NULL: what is sent */
    uint32_t arrivals;
    uint32_t stride;          /* an estimate is kept after every so many-th sample, from the first on, */
    uint32_t health_stride;   /* and health after every so many-th */
    uint32_t frame_room;      /* 0: frames are not kept */
    uint32_t most_unanswered; /* samples in a row without an estimate, that end the run */
    /* kept */
    double *signal[LOOP_SIGNALS]; /* the true values, at every sample */
    double *asked_of_motor;       /* [N m]; NULL: not kept */
    struct lever_estimate *estimate;
    struct lever_health *health;
    struct lever_stability *stability; /* NULL: not kept */
    uint16_t *frame_id;                /* frames, both ways, in the order in which they are sent and taken, */
    uint32_t *frame_sample;
    uint8_t (*frame_data)[8];
    uint32_t frames;     /* and how many they are */
    uint32_t result[4];  /* arrivals by enum lever_frame_result */
    uint32_t unanswered; /* samples without an estimate */
    uint32_t misplaced;  /* estimates of other samples */
    uint32_t refused;    /* commands */
    /* state; zero at the start */
    uint32_t sample;
    uint32_t next_command;
    uint32_t unanswered_in_a_row;
    uint32_t next_arrival;
    uint32_t idle_us;   /* without a sample, since the firmware was told so; not by frames that are all sent */
    uint32_t silent_us; /* without a sample */
    double asked;       /* what the firmware asks of the motor [N m], */
    double correction;  /* and adds to the lever's angle that the flight control computer reads [rad] */
    uint32_t pending;
    uint16_t pending_id[LOOP_PENDING];
    uint8_t pending_data[LOOP_PENDING][8];
} loop_t;

/* Goes on to the sample `until`, or to where there is no room for the frames of one more, or the estimator has been
 * silent for too long. Returns the sample that is next. */
uint32_t loop_advance(loop_t *loop, struct lever *lever, uint32_t until);

#endif
