/* The levers of batch/plant.py, which shares nothing with plants.h: many runs side by side. */
#ifndef LANES_H
#define LANES_H

#include <stdint.h>

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

#endif
