/* What a model of arm and lever is: a const descriptor with the response of sigma points, names, units and bounds.
 *
 * All models have the state x = [theta, theta_dot] (in preload trim: their deviations from the trim), three parameters p, the
 * inputs u = [z_ddot, tau_m] and the outputs y = x. Over a step of T seconds theta_dot changes by what the model says, and
 * theta by T (theta_dot + change / 2): the midpoint rule, which is the same for all of them. Sigma points are told apart by
 * their offsets from the mean, and changes instead of new values are told of them: differences are then differences of small
 * numbers, which is what keeps a float filter alive when measurement noise is near float resolution.
 */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#define MODEL_INVERSE_TURN 0.159154943f /* 1 / (2 pi) */

enum {
    MODEL_STATES = 2,
    MODEL_PARAMETERS = 3,
    MODEL_PAIRS = MODEL_PARAMETERS + MODEL_STATES,
    MODEL_PARAMETER_POINTS = 1 + (2 * MODEL_PARAMETERS),
    MODEL_COEFFICIENTS = 4
};

/* What a step needs of the parameters p, made of them once for many steps. What each is, is the model's. */
typedef struct model_arm {
    float coefficient[MODEL_COEFFICIENTS];
} model_arm_t;

/* The sigma points of state and parameters, for one call of the model: the mean; then a pair for each column of the
 * parameters' factor, in which the state moves along with the parameters; then a pair for each column of the state's own
 * factor, at the mean parameters. */
typedef struct model_points {
    float x[MODEL_STATES];                   /* the mean */
    float offset[MODEL_PAIRS][MODEL_STATES]; /* the states of a pair are x + offset and x - offset */
    const model_arm_t *arm; /* [MODEL_PARAMETER_POINTS]: of the mean; of + and - of each parameter pair */
} model_points_t;

/* How theta_dot changes over a step [rad/s]: at the mean; and of each pair the difference, f(+) - f(-), and the bend,
 * f(+) + f(-) - 2 f(mean). */
typedef struct model_response {
    float mean;
    float difference[MODEL_PAIRS];
    float bend[MODEL_PAIRS];
} model_response_t;

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
    float trim_sine; /* its sine and cosine */
    float trim_cosine;
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

    void (*prepare)(const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_arm_t *arm);

    /* The response of all points at once: what they share is computed once. */
    void (*respond)(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
        model_response_t *response);

    /* Natural frequency and damping ratio of the model linearised about the trim: its angle, sine and cosine in `step`. */
    model_dynamics_t (*dynamics)(const model_constants_t *constants, const model_step_t *step, const model_arm_t *arm);
} model_t;

/* Takes down what a pair of points has given. */
static inline void model_response_pair(model_response_t *response, uint32_t pair, float plus, float minus)
{
    response->difference[pair] = plus - minus;
    response->bend[pair] = (plus - response->mean) + (minus - response->mean);
}

extern const model_t model_lever;            /* nonlinear lever: m_p, c_p, k_p */
extern const model_t model_linear_physical;  /* mass, spring and damper: m, c, k */
extern const model_t model_linear_black_box; /* second-order system: a21, a22, b21 */

#endif
