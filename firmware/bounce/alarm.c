#include "bounce/alarm.h"

#define ALARM_SIGMA_MOST 3.0f /* an arm that is less certain says nothing [dB] */
#define QUANTILE 0.842f       /* 80 % of a normal distribution lie below that many standard deviations */
#define MISMATCH_DOUBT                                                                                                 \
    1.5f /* by so much a margin has to be further below the limit where the model does not fit [dB] */

/* Hysteresis: entering and leaving a state both need 80 % confidence in the arm. An error of the table lasts for the
 * flight, so that waiting makes it no smaller: who made the table has the limit for that. */
static bool is_below(bool was_below, float limit, const margin_t *margin)
{
    const float doubt = QUANTILE * margin->arm_sigma;
    return (margin->gain + (was_below ? -doubt : doubt)) < limit;
}

uint8_t alarm_next(uint8_t state, const margin_t *margin, const lever_aircraft_t *aircraft, bool carried, bool doubtful)
{
    const bool is_alarm = (state == (uint8_t)LEVER_BOUNCE_ALARM);
    const bool known = carried && (margin->arm_sigma <= ALARM_SIGMA_MOST); /* NaN is not */
    const float limit = aircraft->alarm - ((doubtful && !is_alarm) ? MISMATCH_DOUBT : 0.0f);
    uint8_t next = (uint8_t)LEVER_BOUNCE_CLEAR;
    if (known && is_below(is_alarm, limit, margin)) {
        next = (uint8_t)LEVER_BOUNCE_ALARM;
    } else if (!known || doubtful) {
        next = is_alarm ? state : (uint8_t)LEVER_BOUNCE_UNKNOWN;
    } else if (is_below(state >= (uint8_t)LEVER_BOUNCE_WARNING, aircraft->warning, margin)) {
        next = (uint8_t)LEVER_BOUNCE_WARNING;
    } else {
        /* clear */
    }
    return next;
}
