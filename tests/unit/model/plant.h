/* The lever and the pilot's arm in double precision: the truth of the tests. The equation of firmware/THEORY.md
 * as it stands, gravity and preload spelt out, integrated by Runge and Kutta's fourth-order rule; or a linear
 * system instead. */
#ifndef UNIT_MODEL_PLANT_H
#define UNIT_MODEL_PLANT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

#define PLANT_GRAVITY 9.80665

/* theta_ddot = -stiffness (theta - trim) - damping theta_dot + base (z_ddot + space z_dot) + torque tau_m */
typedef struct plant_linear {
    double stiffness; /* [1/s^2] */
    double damping;   /* [1/s] */
    double base;
    double torque;
    double space; /* [1/s] */
} plant_linear_t;

typedef struct plant {
    bool is_linear; /* what is moved is `linear`, and the lever's own values do not matter */
    plant_linear_t linear;
    double length;              /* [m] */
    double mass;                /* of the lever [kg] */
    double mass_position;       /* [1] */
    double inertia;             /* [kg m^2] */
    double damping;             /* [N m s/rad] */
    double stiffness;           /* [N m/rad] */
    double arm_preload_angle;   /* preload fixed [rad] */
    double lever_preload_angle; /* preload fixed [rad] */
    double trim;                /* preload trim: angle at which the lever rests [rad] */
    bool follows_trim;          /* preload trim instead of fixed */
    double m_p;                 /* [kg] */
    double c_p;                 /* [N s/m] */
    double k_p;                 /* [N/m] */
    double theta;               /* [rad] */
    double theta_dot;           /* [rad/s] */
    double z_dot;               /* of the base [m/s] */
} plant_t;

/* The working values of firmware/THEORY.md, at rest at 20 degrees. */
static inline plant_t plant_typical(void)
{
    const plant_t plant = {.length = 0.45,
        .mass = 1.2,
        .mass_position = 0.5,
        .inertia = 0.020,
        .damping = 0.5,
        .stiffness = 5.0,
        .arm_preload_angle = 0.34906585,
        .lever_preload_angle = 0.34906585,
        .trim = 0.34906585,
        .follows_trim = true,
        .m_p = 2.5,
        .c_p = 42.0,
        .k_p = 1500.0,
        .theta = 0.34906585};
    return plant;
}

/* Mass, damper and spring on a base, and a second-order system, at rest at 20 degrees. */
static inline plant_t plant_physical(double m, double c, double k)
{
    plant_t plant = plant_typical();
    plant.is_linear = true;
    plant.linear = (plant_linear_t){k / m, c / m, 1.0, 1.0 / m, 0.0};
    return plant;
}

static inline plant_t plant_black_box(double a21, double a22, double b21)
{
    plant_t plant = plant_typical();
    plant.is_linear = true;
    plant.linear = (plant_linear_t){-a21, -a22, b21, 0.0, 0.0};
    return plant;
}

/* Mayo's hand on the typical lever, at 20 degrees; the motor moves the pilot's mass of the first guess. */
static inline plant_t plant_hand(double k, double c, double space)
{
    plant_t plant = plant_typical();
    const double rise = plant.length * cos(plant.trim);
    plant.is_linear = true;
    plant.linear = (plant_linear_t){k, c, -1.0 / rise, 1.0 / 0.587, space};
    return plant;
}

/* M [kg m^2] */
static inline double plant_inertia(const plant_t *plant)
{
    const double centre = plant->mass_position * plant->length;
    return plant->inertia + (centre * centre * plant->mass) + (plant->length * plant->length * plant->m_p);
}

/* theta_ddot of the lever [rad/s^2] */
static inline double plant_lever_acceleration(
    const plant_t *plant, double theta, double theta_dot, double z_ddot, double tau_m)
{
    const double l = plant->length;
    const double mu = (plant->mass_position * plant->mass) + plant->m_p;
    double arm_rest = sin(plant->arm_preload_angle);
    double lever_rest = plant->lever_preload_angle;
    if (plant->follows_trim) {
        arm_rest = sin(plant->trim) + (PLANT_GRAVITY * mu / (plant->k_p * l));
        lever_rest = plant->trim;
    }
    const double damper = ((plant->c_p * l * l * cos(theta) * cos(theta)) + plant->damping) * theta_dot;
    const double gravity = PLANT_GRAVITY * l * mu * cos(theta);
    const double arm_spring = l * l * plant->k_p * (sin(theta) - arm_rest) * cos(theta);
    const double lever_spring = plant->stiffness * (theta - lever_rest);
    const double base = l * mu * cos(theta) * z_ddot;
    return (tau_m - base - damper - gravity - arm_spring - lever_spring) / plant_inertia(plant);
}

/* theta_ddot [rad/s^2] */
static inline double plant_acceleration(
    const plant_t *plant, double theta, double theta_dot, double z_ddot, double tau_m)
{
    const plant_linear_t *linear = &plant->linear;
    const double own = -(linear->stiffness * (theta - plant->trim)) - (linear->damping * theta_dot);
    return plant->is_linear
               ? (own + (linear->base * (z_ddot + (linear->space * plant->z_dot))) + (linear->torque * tau_m))
               : plant_lever_acceleration(plant, theta, theta_dot, z_ddot, tau_m);
}

/* One Runge-Kutta step of `h` seconds with constant inputs. */
static inline void plant_runge_kutta(plant_t *plant, double h, double z_ddot, double tau_m)
{
    const double x = plant->theta;
    const double v = plant->theta_dot;
    const double a1 = plant_acceleration(plant, x, v, z_ddot, tau_m);
    const double v2 = v + (0.5 * h * a1);
    const double a2 = plant_acceleration(plant, x + (0.5 * h * v), v2, z_ddot, tau_m);
    const double v3 = v + (0.5 * h * a2);
    const double a3 = plant_acceleration(plant, x + (0.5 * h * v2), v3, z_ddot, tau_m);
    const double v4 = v + (h * a3);
    const double a4 = plant_acceleration(plant, x + (h * v3), v4, z_ddot, tau_m);
    plant->theta += h / 6.0 * (v + (2.0 * v2) + (2.0 * v3) + v4);
    plant->theta_dot += h / 6.0 * (a1 + (2.0 * a2) + (2.0 * a3) + a4);
}

#endif
