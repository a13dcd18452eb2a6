/* Identification torque: band-limited noise for the lever's motor, small, limited, and faded in and out.
 *
 * With base acceleration alone the common scale of m_p, c_p, k_p is hardly observable; a known torque of 0.3 to 0.5 N m
 * rms makes it so (DESIGN section 3).
 */
#ifndef APP_DITHER_H
#define APP_DITHER_H

#include "filter/detrend.h"

#include <stdbool.h>
#include <stdint.h>

typedef struct dither {
    detrend_corner_t low; /* corners of the band */
    detrend_corner_t high;
    detrend_t high_pass;
    float low_pass; /* output of the low-pass, and its rate [1/s] */
    float low_pass_rate;
    float scale;    /* makes the filtered noise 1 rms */
    float limit;    /* [N m] */
    float fade;     /* [s] */
    float target;   /* commanded rms [N m] */
    float level;    /* rms now [N m] */
    float slope;    /* of level [N m/s] */
    float torque;   /* for the next sample [N m] */
    uint32_t noise; /* state of the generator */
} dither_t;

/* Off. Corners and fade as in lever_settings.def. Computes the rms of the band, which takes 16384 filter steps. */
void dither_init(dither_t *dither, float low, float high, float period, float limit, float fade);

/* Fades to `rms` [N m]; 0 is off. */
void dither_set(dither_t *dither, float rms);

/* One sample of `period` seconds: renews dither->torque. */
void dither_step(dither_t *dither, float period);

/* Fading or on. */
bool dither_is_on(const dither_t *dither);

#endif
