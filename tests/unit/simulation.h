/* Samples of a lever with an arm on it, linear about its trim, in double precision. What the estimator makes of a
 * lever that is not linear is compared with the float64 oracle (tests/python/oracle). */
#ifndef UNIT_SIMULATION_H
#define UNIT_SIMULATION_H

#include "lever_cdkf.h"
#include "random.h"

#define SIMULATION_TRIM 0.34906585

/* theta_ddot = base (z_ddot + space z_dot) + torque tau_m - stiffness (theta - trim) - damping theta_dot */
typedef struct plant {
    double stiffness;
    double damping;
    double base;
    double torque;
    double space;
} plant_t;

typedef struct simulation {
    plant_t plant;
    random_source_t source;
    double base_rms;        /* base acceleration [m/s^2] */
    double torque_rms;      /* motor torque [N m] */
    double process_noise;   /* random walk of theta_dot [rad/s/sqrt(s)] */
    double theta_noise;     /* of a sample [rad] */
    double theta_dot_noise; /* [rad/s] */
    double time;
    double z_dot;
    double theta; /* as it is */
    double theta_dot;
    double z_ddot;
    double tau_m;
    double measured_theta;
    double measured_theta_dot;
} simulation_t;

/* The lever of firmware/THEORY.md with such a pilot. */
static inline plant_t plant_of_lever(double m_p, double c_p, double k_p)
{
    const double rise = 0.45 * cos(SIMULATION_TRIM);
    const double inertia = 0.020 + (0.225 * 0.225 * 1.2) + (0.45 * 0.45 * m_p);
    return (plant_t){((rise * rise * k_p) + 5.0) / inertia, ((rise * rise * c_p) + 0.5) / inertia,
        -rise * (0.6 + m_p) / inertia, 1.0 / inertia, 0.0};
}

/* A pilot who is not the first guess of the model, 0.1 g and 0.3 N m rms, and noise as the settings expect it. */
static inline simulation_t simulation_of(uint8_t model)
{
    static const plant_t plants[LEVER_MODEL_COUNT] = {[LEVER_MODEL_LINEAR_PHYSICAL] = {656.0, 18.75, 1.0, 0.3125, 0.0},
        [LEVER_MODEL_LINEAR_BLACK_BOX] = {620.0, 19.0, -2.8, 0.0, 0.0},
        [LEVER_MODEL_HAND] = {620.0, 19.0, -2.365, 1.7036, 12.0}};
    return (simulation_t){
        .plant = (model == (uint8_t)LEVER_MODEL_LEVER) ? plant_of_lever(3.2, 60.0, 2100.0) : plants[model],
        .source = {4711u},
        .base_rms = 0.98,
        .torque_rms = (model == (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL) ? 1.6 : 0.3,
        .process_noise = 0.05,
        .theta_noise = 1.0e-3,
        .theta_dot_noise = 1.0e-2,
        .theta = SIMULATION_TRIM};
}

static inline double simulation_sines(double time, double a, double b, double c)
{
    const double turn = 6.283185307179586 * time;
    return sqrt(2.0 / 3.0) * (sin(turn * a) + sin((turn * b) + 1.3) + sin((turn * c) + 4.0));
}

static inline double simulation_acceleration(
    const simulation_t *s, double theta, double theta_dot, const double input[2])
{
    const plant_t *p = &s->plant;
    return (p->base * (input[0] + (p->space * s->z_dot))) + (p->torque * input[1]) -
           (p->stiffness * (theta - SIMULATION_TRIM)) - (p->damping * theta_dot);
}

/* On to the next sample: the midpoint rule, with the mean of the inputs. */
static inline void simulation_advance(simulation_t *s, double period)
{
    const double half = 0.5 * period;
    const double before[2] = {s->z_ddot, s->tau_m};
    s->time += period;
    s->z_ddot = s->base_rms * simulation_sines(s->time, 1.7, 3.3, 5.9);
    s->tau_m = s->torque_rms * simulation_sines(s->time, 2.3, 4.1, 7.7);
    const double input[2] = {0.5 * (before[0] + s->z_ddot), 0.5 * (before[1] + s->tau_m)};
    const double rate = s->theta_dot + (half * simulation_acceleration(s, s->theta, s->theta_dot, before));
    s->z_dot += half * input[0];
    const double change = period * simulation_acceleration(s, s->theta + (half * s->theta_dot), rate, input);
    s->z_dot += half * input[0];
    s->theta += period * rate;
    s->theta_dot += change + (s->process_noise * sqrt(period) * random_normal(&s->source));
    s->measured_theta = s->theta + (s->theta_noise * random_normal(&s->source));
    s->measured_theta_dot = s->theta_dot + (s->theta_dot_noise * random_normal(&s->source));
}

#endif
