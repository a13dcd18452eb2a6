/* The truths of plants/ in motion. Equations, integration and the order of every operation are those of the Python
 * modules, which are the reference: lever_plant.py, linear_plant.py (also Mayo's hands), two_dof_plant.py,
 * hysteretic_plant.py, reflex_plant.py.
 */
#ifndef PLANTS_H
#define PLANTS_H

#include <stdbool.h>
#include <stdint.h>

enum plant_kind { PLANT_LEVER = 0, PLANT_LINEAR = 1, PLANT_TWO_DOF = 2, PLANT_HYSTERETIC = 3, PLANT_REFLEX = 4 };

enum plant_limits { PLANT_COLUMNS = 9, PLANT_ELEMENTS = 10 };

/* What is constant in a lever; SI units. */
typedef struct plant_lever {
    double length;
    double damping;
    double stiffness;
    double friction;
    double stop_rate;
    double own_inertia; /* without the arm */
    double own_moment;
    double weight; /* gravity, where no balance carries the lever */
} plant_lever_t;

/* The Maxwell elements of an arm with structural damping: hysteretic_plant.Power, and their decay in a substep. */
typedef struct plant_elements {
    double spring;
    double damper;
    double springs[PLANT_ELEMENTS];
    double until_middle[PLANT_ELEMENTS];
    double decay[PLANT_ELEMENTS];
    double stretched[PLANT_ELEMENTS];
} plant_elements_t;

/* A stretch reflex. */
typedef struct plant_reflex {
    double middle; /* half a sample period [s] */
    double late;   /* its delay after the middle of a period [sample periods] */
} plant_reflex_t;

/* A pilot on his lever. Arrays have a value for each sample. */
typedef struct plant {
    /* given */
    uint32_t kind; /* enum plant_kind */
    uint32_t substeps;
    double step;       /* length of a substep [s] */
    double lag_middle; /* what is left after half a substep, and a whole one, between torque and command */
    double lag;
    double kick; /* standard deviation of what process noise adds to theta_dot in a substep [rad/s] */
    bool has_grip_force;
    const double *column[PLANT_COLUMNS]; /* coefficients(), in the Python module of the kind */
    const double *z_ddot;                /* base acceleration [m/s^2], linear between the samples */
    const double *disturbance;           /* [N m], likewise */
    const double *normal;                /* process noise: `substeps` normal numbers for each period */
    plant_lever_t lever;
    plant_elements_t elements;
    plant_reflex_t reflex;
    double *reflex_force; /* PLANT_REFLEX: room for a value a sample [N] */
    /* state: as given, the lever at rest */
    double theta;      /* [rad] */
    double theta_dot;  /* [rad/s] */
    double tau_m;      /* motor torque that acts [N m] */
    double grip_force; /* mean since the last sample [N], with has_grip_force */
    double s;          /* trunk of PLANT_TWO_DOF [m], [m/s] */
    double s_dot;
    double rest_sine; /* PLANT_HYSTERETIC: sine of the trim of the period before */
    double forces[PLANT_ELEMENTS];
} plant_t;

/* From sample `period` to the next one, with the torque `command` [N m] held. */
void plant_advance(plant_t *plant, uint32_t period, double command);

/* From the first of `count` samples to the last, with the torques `command` [N m], of which each is held for a period. Gives
 * theta [rad], theta_dot [rad/s] and tau_m [N m] at the samples. */
void plant_move(plant_t *plant, const double *command, uint32_t count, double *theta, double *theta_dot, double *tau_m);

#endif
