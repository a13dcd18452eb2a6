/* From the accelerometer to the pilot's seat, on a cabin that bends:
 *
 *     T(s) = direct + sum (rate_k s + place_k) / (s^2 + damping_k s + stiffness_k)      (lever_aircraft_t)
 *
 * by the implicit midpoint rule. What follows takes the acceleration at the seat: the estimate is that of the arm then,
 * not of arm and cabin. */
#ifndef BOUNCE_SEAT_H
#define BOUNCE_SEAT_H

#include "lever_cdkf.h"

#include <stdbool.h>
#include <stddef.h>

typedef struct seat {
    const lever_aircraft_t *aircraft; /* NULL, or none of its modes: the accelerometer is at the seat */
    float place[LEVER_SEAT_MODES];
    float rate[LEVER_SEAT_MODES];
    float z_ddot; /* at the accelerometer, of the last sample [m/s^2] */
} seat_t;

/* z_ddot at the seat [m/s^2] of that at the accelerometer, on a cabin that bends, `elapsed` [s] after the last one; 0, or
 * after a gap: at rest. */
float seat_bent(seat_t *seat, float z_ddot, float elapsed);

/* The same on any cabin. */
static inline float seat_step(seat_t *seat, float z_ddot, float elapsed)
{
    const bool bends = (seat->aircraft != NULL) && (seat->aircraft->seat_modes > 0u);
    return bends ? seat_bent(seat, z_ddot, elapsed) : z_ddot;
}

#endif
