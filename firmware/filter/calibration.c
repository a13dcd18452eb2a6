#include "filter/calibration.h"

#include <math.h>
#include <string.h>

#define CALIBRATION_MEMORY 20.0f /* [s] */
#define STATED 2.0f              /* an error may be so many standard deviations of what is stated, */
#define NOISE 4.0f               /* and so many of those of the innovations [base_gain_up, angle_gain] */
#define LIMIT_MIN 1.0e-9f        /* information underflows to 0 before the vector does */

void calibration_start(calibration_t *calibration)
{
    (void)memset(calibration, 0, sizeof *calibration);
}

float calibration_step(calibration_t *calibration, const cdkf_t *cdkf, float period)
{
    const float keep = 1.0f - (period * (1.0f / CALIBRATION_MEMORY));
    float largest = 0.0f;
    for (uint32_t c = 0u; c < (uint32_t)CDKF_CALIBRATION; c++) {
        const score_t score = cdkf_constant_score(cdkf, c);
        score_t *sum = &calibration->score[c];
        sum->vector = (keep * sum->vector) + score.vector;
        sum->information = (keep * sum->information) + score.information;
        /* vector = information b + noise of variance information */
        const float limit =
            (STATED * (cdkf->considered_sigma[c] * sum->information)) + (NOISE * sqrtf(sum->information)) + LIMIT_MIN;
        if (fabsf(sum->vector) > (largest * limit)) {
            largest = fabsf(sum->vector) / limit;
        }
    }
    return largest;
}
