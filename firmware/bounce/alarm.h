/* From the margin to warning and alarm, with hysteresis. */
#ifndef BOUNCE_ALARM_H
#define BOUNCE_ALARM_H

#include "bounce/margin.h"
#include "lever_cdkf.h"

#include <stdbool.h>
#include <stdint.h>

/* What the margin stands on. */
typedef struct alarm_basis {
    bool carried;  /* health lets it be believed */
    bool doubtful; /* but the arm is not quite what the model assumes: there may be an alarm, and nothing else */
} alarm_basis_t;

/* The next state, of enum lever_bounce. */
uint8_t alarm_next(uint8_t state, const margin_t *margin, const lever_aircraft_t *aircraft, alarm_basis_t basis);

#endif
