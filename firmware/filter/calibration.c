#include "filter/calibration.h"

#include <math.h>
#include <string.h>

#define MEMORY 20.0f /* [s] */
#define STATED 2.0f  /* an error is beyond what is stated from so many standard deviations on, */
#define NOISE 4.0f   /* and so many of those of the innovations; */
#define AGAIN 0.75f  /* it is within again from this part of both on */

void calibration_start(calibration_t *calibration)
{
    (void)memset(calibration, 0, sizeof *calibration);
}

void calibration_step(
    calibration_t *calibration, const cdkf_t *cdkf, const score_t score[CDKF_CALIBRATION], float period)
{
    const float keep = 1.0f - (period / MEMORY);
    const float part = calibration->wrong ? AGAIN : 1.0f;
    bool wrong = false;
    for (uint32_t c = 0u; c < (uint32_t)CDKF_CALIBRATION; c++) {
        score_t *sum = &calibration->score[c];
        const float sigma = cdkf->considered_sigma[c];
        sum->vector = (keep * sum->vector) + score[c].vector;
        sum->information = (keep * sum->information) + score[c].information;
        /* vector = information b + noise of variance information */
        const float limit = (STATED * (sigma * sum->information)) + (NOISE * sqrtf(sum->information));
        wrong = wrong || (fabsf(sum->vector) > (part * limit));
    }
    calibration->wrong = wrong;
}
