#include "filter/calibration.h"
#include "math/share.h"

#include <math.h>
#include <string.h>

#define CALIBRATION_MEMORY 20.0f /* [s] */
#define CALIBRATION_NOW 0.5f     /* [s] [base_late_10ms] */
#define STATED 2.0f              /* an error may be so many standard deviations of what is stated, */
#define NOISE 4.0f               /* and so many of those of the innovations [base_gain_up, angle_gain] */
#define LIMIT_MIN 1.0e-9f        /* information underflows to 0 before the vector does */

void calibration_start(calibration_t *calibration)
{
    (void)memset(calibration, 0, sizeof *calibration);
}

/* Adds a block. Returns the error that the sum says over what it may be, where that is larger than `largest`. */
static float add(score_t *sum, const score_t *score, float keep, float stated, float largest)
{
    sum->vector = (keep * sum->vector) + score->vector;
    sum->information = (keep * sum->information) + score->information;
    /* vector = information b + noise of variance information */
    const float limit = (stated * sum->information) + (NOISE * sqrtf(sum->information)) + LIMIT_MIN;
    const float size = fabsf(sum->vector);
    return (size > (largest * limit)) ? (size / limit) : largest;
}

float calibration_step(calibration_t *calibration, const cdkf_t *cdkf, float period)
{
    const float keep = 1.0f - (period * (1.0f / CALIBRATION_MEMORY));
    const float keep_now = 1.0f - share_of(period, CALIBRATION_NOW);
    float largest = 0.0f;
    for (uint32_t c = 0u; c < (uint32_t)CDKF_CALIBRATION; c++) {
        const score_t score = cdkf_constant_score(cdkf, c);
        const float stated = STATED * cdkf->considered_sigma[c];
        largest = add(&calibration->score[c], &score, keep, stated, largest);
        largest = add(&calibration->now[c], &score, keep_now, stated, largest);
    }
    return largest;
}
