/* The levers of batch/plant.py, which shares nothing with plants.h: many runs side by side, by themselves or with
 * the firmware in the loop as in batch/firmware.py.
 */
#ifndef LANES_H
#define LANES_H

#include <stdbool.h>
#include <stdint.h>

struct lever; /* of lever_cdkf.h */
struct lever_command;
struct lever_estimate;
struct lever_health;

/* A value for each sample and lane: value[sample * step + lane]. */
typedef struct lane_column {
    const double *value;
    uint64_t step; /* 0: the same at all samples */
} lane_column_t;

/* Equation of motion and names are those of plant.Plant. */
typedef struct lanes {
    uint32_t count; /* samples */
    uint32_t width; /* lanes */
    double period;  /* [s] */
    double length;
    double damping;
    double stiffness;
    lane_column_t drive;
    lane_column_t torque;
    lane_column_t rest;
    lane_column_t spring;
    lane_column_t damper;
    lane_column_t inverse;
    lane_column_t friction;
    lane_column_t kick;
    double *theta;     /* [count][width], the first row given: [rad] */
    double *theta_dot; /* likewise [rad/s] */
} lanes_t;

/* Moves all lanes from sample `first` to sample `last`. */
void lanes_move(const lanes_t *lanes, uint32_t first, uint32_t last);

/* Moves the only lane from sample i to sample i + 1, with further torque [N m] at its begin and end. */
void lanes_advance(const lanes_t *lanes, uint32_t i, double begin, double end);

/* The firmware of each lane, and what it gets to see. */
typedef struct lanes_loop {
    struct lever *const *lever; /* [width] */
    uint32_t period_us;
    uint32_t keep_alive;                 /* samples between two commands */
    const struct lever_command *command; /* which */
    double decay;                        /* of the difference between torque and command, in a sample period */
    bool loses_whole;                    /* a lost sample never comes; otherwise it lacks all but z_ddot */
    const uint8_t *lost;                 /* [count][width] */
    lane_column_t z_ddot;                /* true [m/s^2] */
    lane_column_t noise[4];              /* of theta, theta_dot, tau_m, z_ddot */
    double *tau_m;                       /* [count][width], the first row given: motor torque that acts [N m] */
    double *asked;                       /* [width]: what the firmware asks for, 0 at the start */
    uint32_t stride;                     /* samples between two notes */
    uint64_t rows;                       /* notes of a lane */
    struct lever_estimate *estimate;     /* [width][rows] */
    struct lever_health *health;
} lanes_loop_t;

/* The same with the firmware: it takes the samples from `first` to `last` - 1. */
void lanes_close(const lanes_t *lanes, const lanes_loop_t *loop, uint32_t first, uint32_t last);

#endif
