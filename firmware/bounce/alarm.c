#include "bounce/alarm.h"

#define ALARM_SIGMA_MOST 3.0f /* a gain margin that is less certain says nothing [dB] */
#define QUANTILE 0.842f       /* 80 % of a normal distribution lie below that many standard deviations */

/* Whether a state with this limit goes on, or begins: it needs to be sure of either. */
static bool is_below(bool was_below, float limit, const margin_t *margin)
{
    const float doubt = QUANTILE * margin->gain_sigma;
    return (margin->gain + (was_below ? -doubt : doubt)) < limit;
}

uint8_t alarm_next(uint8_t state, const margin_t *margin, const lever_aircraft_t *aircraft, bool carried)
{
    uint8_t next = (uint8_t)LEVER_BOUNCE_CLEAR;
    if (!(carried && (margin->gain_sigma <= ALARM_SIGMA_MOST))) { /* NaN is not */
        next = (state == (uint8_t)LEVER_BOUNCE_ALARM) ? state : (uint8_t)LEVER_BOUNCE_UNKNOWN;
    } else if (is_below(state == (uint8_t)LEVER_BOUNCE_ALARM, aircraft->alarm, margin)) {
        next = (uint8_t)LEVER_BOUNCE_ALARM;
    } else if (is_below(state >= (uint8_t)LEVER_BOUNCE_WARNING, aircraft->warning, margin)) {
        next = (uint8_t)LEVER_BOUNCE_WARNING;
    } else {
        /* clear */
    }
    return next;
}
