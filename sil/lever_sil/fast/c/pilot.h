/* The pilot's side of loop.h, without the firmware: sensors, lever and cabin. */
#ifndef PILOT_H
#define PILOT_H

#include "loop.h"

/* Keeps the true signals of this sample, from which its sensors read. */
void pilot_note(loop_t *loop);

/* Returns the reading of a sensor at a sample up to this one; NaN: it is marked invalid. */
double pilot_reading(const loop_t *loop, enum loop_signal which, uint32_t sample);

/* Returns the time that the sender of a sample gives it [us]. */
uint32_t pilot_time_us(const loop_t *loop, uint32_t sample);

/* Whether a frame can carry a value; NaN does not fit. */
bool pilot_fits(const loop_field_t *field, double value);

/* The nearest value that a frame can carry, half to even. In double precision, as the codec of host_tools has it: the
 * firmware's codec then has nothing to round. */
double pilot_rounded(const loop_field_t *field, double value);

/* The readings of a sample as frames, without E2E protection. */
void pilot_lever_sample(const loop_t *loop, uint32_t sample, struct lever_frame *frame);
void pilot_base_sample(const loop_t *loop, uint32_t sample, struct lever_frame *frame);
void pilot_grip_sample(const loop_t *loop, uint32_t sample, struct lever_frame *frame);

/* After this sample: a correction that is too old counts as none. */
void pilot_age_correction(loop_t *loop);

/* Lever and cabin to the next sample, with what the firmware asks for. The caller counts the sample. */
void pilot_advance(loop_t *loop);

#endif
