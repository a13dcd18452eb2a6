/* Delays the outputs, the torques and the grip force by whole sample periods, so that they meet the acceleration of an
 * accelerometer that is later than they are. To extrapolate the acceleration instead would raise its gain: at 4 ms and
 * 500 Hz by 9 % at 17 Hz. Estimates are then of that much earlier. */
#ifndef APP_DELAY_LINE_H
#define APP_DELAY_LINE_H

#include "lever_cdkf.h"

#include <stdint.h>

enum { DELAY_LINE_MOST = 10, DELAY_LINE_SIGNALS = 5 };

/* A ring of the last samples. One that was lost has no valid signal. */
typedef struct delay_line {
    float value[DELAY_LINE_MOST][DELAY_LINE_SIGNALS]; /* theta, theta_dot, tau_m, grip force, commanded torque */
    uint8_t valid[DELAY_LINE_MOST];                   /* a bit each, of the first four */
    uint8_t next;
} delay_line_t;

void delay_line_start(delay_line_t *line);

/* Exchanges the delayed signals of the sample, and the torque commanded before it [N m], for those `length` sample periods
 * earlier, at most DELAY_LINE_MOST; 0 changes nothing. `periods`: since the last sample; those between were lost. */
void delay_line_pass(delay_line_t *line, uint32_t length, uint32_t periods, lever_sample_t *sample, float *commanded);

#endif
