/* From the margin to warning and alarm, with hysteresis. */
#ifndef BOUNCE_ALARM_H
#define BOUNCE_ALARM_H

#include "bounce/margin.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

/* The next state, of enum lever_bounce. `carried`: health lets the margin be believed. `doubtful`: but the arm is not what
 * the model assumes, so that there may be an alarm, and nothing else. */
uint8_t alarm_next(
    uint8_t state, const margin_t *margin, const lever_aircraft_t *aircraft, bool carried, bool doubtful);

#endif
