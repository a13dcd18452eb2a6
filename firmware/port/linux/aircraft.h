/* The response of a helicopter from a text file, for lever_aircraft(). The same lines are read by
 * host_tools/lever_cdkf/firmware/aircraft.py, with numbers, blanks, comments and line ends as in a settings file
 * (settings.h):
 *
 *     # z_ddot over the lever's angle
 *     gain_sigma = 0.1       # how well the gain is known, relative to it [1]
 *     phase_sigma = 0.1      # [rad]
 *     warning = 5            # gain margin below which there is a warning [dB]; 5 without this line
 *     alarm = 4              # and an alarm [dB]; 4 without this line
 *     1.5  -12.1  4.2        # frequency [Hz], real and imaginary part [(m/s^2)/rad]; 3 to LEVER_AIRCRAFT_POINTS lines
 *     seat_direct = 1        # where the accelerometer is not at the seat: lever_seat_mode_t, up to LEVER_SEAT_MODES lines
 *     seat  0  -0.3  1.6  710
 */
#ifndef LEVER_PORT_AIRCRAFT_H
#define LEVER_PORT_AIRCRAFT_H

#include <stdbool.h>
#include <stdio.h>

#include "lever_cdkf.h"
#include "port/linux/settings.h"

/* Reads a whole file; `path` is only for the messages. False, with `error` filled in, when it holds no such response;
 * whether the estimator takes it is for lever_aircraft() to say. */
bool aircraft_read(lever_aircraft_t *aircraft, FILE *file, const char *path, settings_error_t *error);

/* Why lever_aircraft() refuses one. */
#define AIRCRAFT_REFUSED                                                                                               \
    "the response of the aircraft cannot be used: it needs 3 frequencies or more that rise from above 0, sigmas from " \
    "0 "                                                                                                               \
    "to 1, and a warning not below the alarm"

#endif
