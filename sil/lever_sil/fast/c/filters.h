/* The Kalman filters of study/baselines in double precision: joint_ekf.py, dual_ekf.py, joint_ukf.py and algorithm1.py say
 * where they are from.
 */
#ifndef FILTERS_H
#define FILTERS_H

#include <stdbool.h>
#include <stdint.h>

enum filter_kind { FILTER_JOINT_EKF = 0, FILTER_DUAL_EKF = 1, FILTER_JOINT_UKF = 2, FILTER_PARAMETERS = 3 };
enum filter_model_kind { FILTER_LEVER = 0, FILTER_PHYSICAL = 1, FILTER_BLACK_BOX = 2 };
enum filter_limits {
    FILTER_STATES = 2,
    FILTER_W = 3, /* parameters */
    FILTER_Z = 5, /* [w; x] */
    FILTER_POINTS = 11
};

/* lever_cdkf/models: lever.py, linear.py. */
typedef struct filter_model {
    uint32_t kind; /* enum filter_model_kind */
    bool trims;    /* preload trim; otherwise fixed */
    double length;
    double own_inertia; /* without the arm */
    double own_moment;
    double damping;
    double stiffness;
    double gravity;
    double arm_preload_angle;
    double rest; /* with preload fixed: of the lever's own spring, or of a linear model */
} filter_model_t;

/* What a filter is given: data.Batch and Knowledge of one run. Arrays have a value for each sample. */
typedef struct filter_given {
    uint32_t kind; /* enum filter_kind */
    filter_model_t model;
    double period; /* [s] */
    bool positive; /* w is the logarithm of the parameters */
    double guess[FILTER_W];
    double sigma[FILTER_W];   /* of signed parameters, in physical units */
    double sigma_w[FILTER_W]; /* of w, at the start */
    double walk_w[FILTER_W];  /* [1/sqrt(s)] */
    double output_noise[FILTER_STATES];
    double process[FILTER_STATES][FILTER_STATES]; /* covariance over `steps` samples, or one */
    uint32_t steps;                               /* of FILTER_PARAMETERS: samples ahead */
    double difference;                            /* half-width of central differences */
    const double (*y)[FILTER_STATES];
    const double (*u)[FILTER_STATES];
    const double *trim;
    const uint8_t (*missing)[FILTER_STATES]; /* which of y the joint filters skip; NULL: none */
} filter_given_t;

/* What it says after the samples `at`, which rise: `count` values of each. */
typedef struct filter_said {
    const int64_t *at;
    uint32_t count;
    double (*w)[FILTER_W];
    double (*covariance)[FILTER_W][FILTER_W];
    double *nis;
} filter_said_t;

void filter_run(const filter_given_t *given, const filter_said_t *said);

#endif
