/* The pilot's side of loop.h, without the firmware: sensors, lever and cabin. */
#ifndef PILOT_H
#define PILOT_H

#include "loop.h"

/* Keeps the true signals of this sample, from which its sensors read. */
void pilot_note(loop_t *loop);

/* What a sensor reads at this sample; NaN: it is marked invalid. */
double pilot_reading(const loop_t *loop, enum loop_signal which);

/* The same of the base acceleration, which with a cabin depends on the run. */
double pilot_base(const loop_t *loop);

/* Whether a frame can carry a value of so many steps of its field, as in the codec of host_tools; NaN does not fit. */
bool pilot_fits(const loop_field_t *field, double steps);

/* Bits of a value at their place, with the bit that says that it is valid. As the codec of host_tools: rounded in double
 * precision, half to even; what does not fit is not available. */
uint64_t pilot_bits(const loop_field_t *field, double value);

/* The value of the field in a payload. */
double pilot_value(const loop_field_t *field, uint64_t payload);

/* After this sample: a correction that is too old counts as none. */
void pilot_age_correction(loop_t *loop);

/* Lever and cabin to the next sample, with what the firmware asks for. The caller counts the sample. */
void pilot_advance(loop_t *loop);

#endif
