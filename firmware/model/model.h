/* What a model of the pilot's arm on the lever is: a const descriptor with its response to a step, names, units and
 * bounds.
 *
 * All models have the state x = [theta, theta_dot] (in preload trim: deviations from the trim), three parameters p,
 * the inputs u = [z_ddot, tau_m] and the outputs y = x. Over a step of T seconds theta_dot changes by what the model
 * says, and theta by T (theta_dot + change / 2): the midpoint rule, the same for all models. Models return changes,
 * not new values, and points are given by their offsets from the mean. So differences are those of small numbers,
 * which single precision needs when the measurement noise is near its resolution.
 */
#ifndef MODEL_MODEL_H
#define MODEL_MODEL_H

#include <stdbool.h>
#include <stdint.h>

#define MODEL_INVERSE_TURN 0.159154943f /* 1 / (2 pi) */
#define MODEL_GRAVITY 9.80665f          /* [m/s^2] */
#define MODEL_THETA_MOST 25.0f          /* no angle beyond is plausible: a few turns [rad] */

enum {
    MODEL_STATES = 2,
    MODEL_PARAMETERS = 3,
    MODEL_POINTS = 1 + (2 * MODEL_PARAMETERS), /* sigma points of the parameters: the mean, then + and - of each pair */
    MODEL_COEFFICIENTS = 4
};

/* What a step needs of the parameters p, computed once for many steps. The meaning is the model's. */
typedef struct model_coefficients {
    float c[MODEL_COEFFICIENTS];
} model_coefficients_t;

/* The sigma points of the parameters with the states that go with them, all for one call of the model. */
typedef struct model_points {
    float x[MODEL_STATES];                        /* at the mean */
    float offset[MODEL_PARAMETERS][MODEL_STATES]; /* the states of a pair are x + offset and x - offset */
    const model_coefficients_t *coefficients;     /* [MODEL_POINTS] */
} model_points_t;

/* The change f of theta_dot over a step [rad/s]. */
typedef struct model_response {
    float mean;                                /* f at the mean */
    float slope[MODEL_STATES];                 /* df / dtheta and df / dtheta_dot there */
    float base;                                /* df / dz_ddot there */
    float torque;                              /* df / dtau_m there */
    float difference[MODEL_PARAMETERS];        /* of each pair: f(+) - f(-) */
    float second_difference[MODEL_PARAMETERS]; /* f(+) + f(-) - 2 f(mean) */
} model_response_t;

/* Constants of the lever, derived from the settings once. */
typedef struct model_constants {
    float length;              /* l [m] */
    float length_squared;      /* l^2 [m^2] */
    float inertia;             /* eta^2 m_l l^2 + J_l [kg m^2] */
    float mass_moment;         /* eta m_l [kg] */
    float damping;             /* c_l [N m s/rad] */
    float stiffness;           /* k_l [N m/rad] */
    float arm_preload_sine;    /* sine of the arm's preload angle (preload fixed) */
    float lever_preload_angle; /* the lever's preload angle [rad] (preload fixed) */
    float hand_inertia;        /* of lever and hand where the model does not know the mass [kg m^2] */
    float seat_stiffness;      /* of the trunk on its seat, per mass [1/s^2]; 0: the seat is rigid */
    float seat_damping;        /* [1/s] */
    bool trim;                 /* preload trim instead of fixed */
} model_constants_t;

/* What is the same for every sigma point of a step. */
typedef struct model_step {
    float period;    /* [s] */
    float z_ddot;    /* base acceleration, mean over the step [m/s^2] */
    float seat;      /* base_motion.h, for the models that use it [rad] */
    float seat_dot;  /* [rad/s] */
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

/* theta_ddot + damping theta_dot + stiffness theta
 *   = forcing (z_ddot + space z_dot) + arm_stiffness seat + arm_damping seat_dot + torque tau_m */
typedef struct model_dynamics {
    float stiffness;     /* [1/s^2] */
    float damping;       /* [1/s] */
    float forcing;       /* [unit of theta / m] */
    float space;         /* [1/s] */
    float arm_stiffness; /* [1/s^2] */
    float arm_damping;   /* [1/s] */
    float torque;        /* [1/(kg m^2)] */
} model_dynamics_t;

typedef struct model {
    const char *name;
    model_parameter_t parameter[MODEL_PARAMETERS];
    bool uses_base_motion;
    bool positive; /* all parameters are, and are estimated on a logarithmic scale; else on a linear one */

    void (*prepare)(
        const model_constants_t *constants, const float p[MODEL_PARAMETERS], model_coefficients_t *coefficients);

    /* The response of all points in one call, so that they share its trigonometry. */
    void (*respond)(const model_constants_t *constants, const model_step_t *step, const model_points_t *points,
        model_response_t *response);

    /* The model linearised about the trim: its angle, sine and cosine in `step`. */
    model_dynamics_t (*dynamics)(
        const model_constants_t *constants, const model_step_t *step, const model_coefficients_t *coefficients);
} model_t;

/* Both differences of a pair whose changes are the fractions period force / inertia: one division. */
static inline void model_response_pair(model_response_t *response, uint32_t pair, float period, float plus_force,
    float plus_inertia, float minus_force, float minus_inertia)
{
    const float gain = period / (plus_inertia * minus_inertia);
    const float plus = (plus_force * minus_inertia) * gain;
    const float minus = (minus_force * plus_inertia) * gain;
    response->difference[pair] = plus - minus;
    response->second_difference[pair] = (plus - response->mean) + (minus - response->mean);
}

extern const model_t model_lever;            /* nonlinear lever: m_p, c_p, k_p */
extern const model_t model_linear_physical;  /* mass, spring and damper: m, c, k */
extern const model_t model_linear_black_box; /* second-order system: a21, a22, b21 */
extern const model_t model_lever_on_seat;    /* the same, and the pilot's trunk gives way on its seat */
extern const model_t model_hand;             /* Mayo's hand: k_hand, c_hand, c_space */

#endif
