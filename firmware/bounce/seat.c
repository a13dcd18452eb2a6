#include "bounce/seat.h"

#include <stdbool.h>
#include <stdint.h>

#define SEAT_STEP_MOST 0.02f /* step [s] */

float seat_bent(seat_t *seat, float z_ddot, float elapsed)
{
    const lever_aircraft_t *aircraft = seat->aircraft;
    const bool goes_on = (elapsed > 0.0f) && (elapsed <= SEAT_STEP_MOST);
    const float half = 0.5f * elapsed;
    const float middle = 0.5f * (seat->z_ddot + z_ddot);
    float at_seat = aircraft->seat_direct * z_ddot;
    for (uint32_t k = 0u; k < aircraft->seat_modes; k++) {
        const lever_seat_mode_t *mode = &aircraft->seat[k];
        const float place = seat->place[k];
        const float rate = seat->rate[k];
        if (goes_on) {
            const float force = middle - (mode->damping * rate) - (mode->stiffness * (place + (half * rate)));
            const float change = (elapsed * force) / (1.0f + (half * (mode->damping + (half * mode->stiffness))));
            seat->place[k] = place + (elapsed * (rate + (0.5f * change)));
            seat->rate[k] = rate + change;
        } else {
            seat->place[k] = z_ddot / mode->stiffness;
            seat->rate[k] = 0.0f;
        }
        at_seat += (mode->by_rate * seat->rate[k]) + (mode->by_place * seat->place[k]);
    }
    seat->z_ddot = z_ddot;
    return at_seat;
}
