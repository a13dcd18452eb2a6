/* What a model of arm and lever is: a const descriptor with the propagation of sigma points, names, units and bounds.
 *
 * All models have the state x = [theta, theta_dot] (in preload trim: their deviations from the trim), three parameters p, the inputs u = [z_ddot, tau_m] and the outputs
 * y = x. Propagation returns the increment over one step, x_next - x, not x_next: differences of sigma points are then
 * differences of small numbers, which is what keeps a float filter alive when measurement noise is near float resolution.
 */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#define MODEL_INVERSE_TURN 0.159154943f /* 1 / (2 pi) */

enum {
    MODEL_STATES = 2,
    MODEL_PARAMETERS = 3,
    MODEL_PARAMETER_POINTS = 1 + (2 * MODEL_PARAMETERS),
    MODEL_POINTS = MODEL_PARAMETER_POINTS + (2 * MODEL_STATES)
};

/* The sigma points of state and parameters, for one call of the model: [0] is the mean; then a pair for each column of
 * the parameters' factor, in which the state moves along with the parameters; then a pair for each column of the state's
 * own factor, at the mean parameters. */
typedef struct model_points {
    float x[MODEL_POINTS][MODEL_STATES];
    float p[MODEL_PARAMETER_POINTS][MODEL_PARAMETERS]; /* in the units of the model */
} model_points_t;

/* What is constant in a lever: derived once from the settings, so that a propagation does not redo it. */
typedef struct model_constants {
    float length;              /* l [m] */
    float length_squared;      /* l^2 [m^2] */
    float inertia;             /* eta^2 m_l l^2 + J_l [kg m^2] */
    float mass_moment;         /* eta m_l [kg] */
    float damping;             /* c_l [N m s/rad] */
    float stiffness;           /* k_l [N m/rad] */
    float arm_preload_sine;    /* sine of the arm's preload angle (preload fixed) */
    float lever_preload_angle; /* the lever's preload angle [rad] (preload fixed) */
    bool trim;                 /* preload trim instead of fixed */
} model_constants_t;

/* What is the same for every sigma point of a step. */
typedef struct model_step {
    float period;    /* [s] */
    float z_ddot;    /* base acceleration, mean over the step [m/s^2] */
    float tau_m;     /* motor torque, mean over the step [N m] */
    float origin;    /* angle that the state's theta counts from [rad]; 0 unless preload trim */
    float trim;      /* trim angle [rad] */
    float trim_sine; /* and its sine */
} model_step_t;

typedef struct model_parameter {
    const char *name;
    const char *unit;
    float least; /* bounds the estimate is kept in */
    float greatest;
} model_parameter_t;

typedef struct model_dynamics {
    float natural_frequency; /* undamped [Hz] */
    float damping_ratio;     /* [1] */
} model_dynamics_t;

typedef struct model {
    const char *name;
    model_parameter_t parameter[MODEL_PARAMETERS];
    bool positive; /* all parameters are, and are estimated on a logarithmic scale; else on a linear one */

    /* Increments of the state over the step, for all points at once: what they share is computed once. */
    void (*propagate)(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
        float increment[MODEL_POINTS][MODEL_STATES]);

    /* Natural frequency and damping ratio of the model linearised about the trim. */
    model_dynamics_t (*dynamics)(
        const model_constants_t *constants, const model_step_t *step, const float p[MODEL_PARAMETERS]);
} model_t;

extern const model_t model_lever;            /* nonlinear lever: m_p, c_p, k_p */
extern const model_t model_linear_physical;  /* mass, spring and damper: m, c, k */
extern const model_t model_linear_black_box; /* second-order system: a21, a22, b21 */

#endif
