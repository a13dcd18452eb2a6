/* Identification torque: band-limited noise for the lever's motor, small, and faded in and out. What it asks for leaves
 * through torque_gate.h.
 *
 * With base acceleration alone the common scale of m_p, c_p, k_p is hardly observable; a known torque of 0.3 to 0.5 N m
 * rms makes it so.
 */
#ifndef APP_DITHER_H
#define APP_DITHER_H

#include "filter/trim.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct dither {
    float low; /* corners of the band [rad / step] */
    float high;
    float scale;    /* makes the filtered noise 1 rms */
    float rms_most; /* [N m] */
    float fade;     /* steps of a fade */
    high_pass_t high_pass;
    float low_pass; /* output of the low-pass, and its rate in corners */
    float low_pass_rate;
    float target;   /* commanded rms [N m] */
    float level;    /* rms now [N m] */
    float slope;    /* of level [N m / step] */
    uint32_t noise; /* state of the generator */
} dither_t;

/* Off. Corners [Hz], sample_period and dither_fade [s] as in lever_settings.def; no command exceeds rms_most [N m]. */
void dither_init(dither_t *dither, float low, float high, float period, float rms_most, float fade);

/* Off at once, the generator as new. */
void dither_reset(dither_t *dither);

/* Fades to `rms` [N m]; 0 is off. `at_once`: nothing leaves now, so there is nothing to fade. */
void dither_set(dither_t *dither, float rms, bool at_once);

/* One sample period, however long the last one really was: the torque for the next sample [N m]. */
float dither_step(dither_t *dither);

/* Fading or on. */
bool dither_is_on(const dither_t *dither);

#endif
