/* When and how the parameters learn: once every learn_period, with a random walk that is adapted, more of it after a
 * sudden change of the pilot, and with the measurement and process noise that the innovations show. And what the
 * innovations of a block say against the model, the sensors and the settings.
 */
#ifndef APP_LEARNING_H
#define APP_LEARNING_H

#include "app/grip_force.h"
#include "app/hands.h"
#include "app/monitor.h"
#include "app/setup.h"
#include "filter/calibration.h"
#include "filter/cdkf.h"
#include "filter/change_detection.h"
#include "filter/noise_estimation.h"
#include "filter/whiteness.h"

#include <stdbool.h>

typedef struct learning {
    change_detection_t change;
    noise_estimation_t noise;
    whiteness_t whiteness;
    calibration_t calibration;
    monitor_t monitor;
    hands_t hands;
    grip_force_t force;
    snapshot_t kept[2]; /* the belief one and two KEEP_PERIODs ago, to be taken back */
    float kept_ago;     /* time since the first [s] */
    float elapsed;      /* since the parameters learnt last [s] */
    float wait;         /* time until anything is taught: what was before has to die away [s] */
    float changed;      /* time left to report a change [s] */
    float gripping;     /* time left until a new grip is complete; 0: none is under way [s] */
    bool calm;          /* innovations have been as expected since the last change */
    bool held_again;    /* it is the first after hands off */
    bool moved;         /* it is complete, and has moved the lever: levels and state are to begin anew */
    bool bounded;       /* a parameter rests on a bound */
} learning_t;

/* Starts, for parameters at their first guess. */
void learning_start(learning_t *learning, const setup_t *setup, cdkf_t *cdkf);

/* What may be learnt from a sample. */
typedef struct lesson {
    bool walks;    /* the parameters may learn and walk: not frozen, nor aligning */
    bool measured; /* there was an output, the base acceleration is valid, and the levels have settled */
    bool excited;  /* there was enough motion lately: at rest, only the walk goes on */
} lesson_t;

/* After the measurement update with a sample, `elapsed` seconds after the last one. Sensors, hands and model are judged
 * in every mode, once a learn_period; the parameters learn where they may walk. Returns true at the end of a block. */
bool learning_step(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, const lesson_t *lesson, float elapsed);

/* The parameters learn again, from now on, after having been held: verdicts that compare with their response begin
 * anew. */
void learning_resume(learning_t *learning, cdkf_t *cdkf);

/* After `elapsed` seconds without samples: the parameters learn what is pending, and walk for that time. */
void learning_skip(learning_t *learning, const setup_t *setup, cdkf_t *cdkf, float elapsed);

#endif
