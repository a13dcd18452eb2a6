/* Samples of a simulated lever: the plant in double, excited by several sines of base acceleration and of torque, with
 * noise on the plant and on its sensors. */
#ifndef UNIT_MODEL_SIMULATION_H
#define UNIT_MODEL_SIMULATION_H

#include "../math/random.h"
#include "plant.h"

enum { SIMULATION_SUBSTEPS = 4 };

typedef struct simulation {
    plant_t plant;
    random_source_t source;
    double base_rms;        /* of the base acceleration [m/s^2] */
    double torque_rms;      /* of the motor torque [N m] */
    double process_noise;   /* random walk of theta_dot [rad/s/sqrt(s)] */
    double theta_noise;     /* of a sample [rad] */
    double theta_dot_noise; /* [rad/s] */
    double time;            /* of the sample [s] */
    double z_ddot;          /* sample: inputs are exact */
    double tau_m;
    double theta;
    double theta_dot;
} simulation_t;

/* A pilot who is not the estimator's first guess, 0.1 g and 0.3 N m rms, and noise as the settings expect it. */
static inline simulation_t simulation_typical(void)
{
    simulation_t simulation = {.plant = plant_typical(),
        .source = {4711u},
        .base_rms = 0.98,
        .torque_rms = 0.3,
        .process_noise = 0.05,
        .theta_noise = 1.0e-3,
        .theta_dot_noise = 1.0e-2};
    simulation.plant.m_p = 3.2;
    simulation.plant.c_p = 60.0;
    simulation.plant.k_p = 2100.0;
    simulation.theta = simulation.plant.theta;
    return simulation;
}

/* Five sines of equal power; rms 1. */
static inline double simulation_multisine(double time, const double frequency[5])
{
    double sum = 0.0;
    for (uint32_t k = 0u; k < 5u; k++) {
        sum += sin(6.283185307179586 * ((frequency[k] * time) + (0.2 * (double)(k * k))));
    }
    return sum * sqrt(2.0 / 5.0);
}

/* On to the sample `period` seconds later; between samples, inputs are straight lines. */
static inline void simulation_advance(simulation_t *simulation, double period)
{
    static const double shaking[5] = {1.3, 2.1, 3.4, 4.7, 6.1};
    static const double torque[5] = {1.7, 2.9, 3.9, 5.3, 8.2};
    const double h = period / (double)SIMULATION_SUBSTEPS;
    simulation->time += period;
    const double z_ddot = simulation->base_rms * simulation_multisine(simulation->time, shaking);
    const double tau_m = simulation->torque_rms * simulation_multisine(simulation->time, torque);
    for (uint32_t k = 0u; k < (uint32_t)SIMULATION_SUBSTEPS; k++) {
        const double along = ((double)k + 0.5) / (double)SIMULATION_SUBSTEPS;
        const double base = simulation->z_ddot + (along * (z_ddot - simulation->z_ddot));
        simulation->plant.z_dot += 0.5 * h * base;
        plant_runge_kutta(&simulation->plant, h, base, simulation->tau_m + (along * (tau_m - simulation->tau_m)));
        simulation->plant.z_dot += 0.5 * h * base;
        simulation->plant.theta_dot += simulation->process_noise * sqrt(h) * random_normal(&simulation->source);
    }
    simulation->z_ddot = z_ddot;
    simulation->tau_m = tau_m;
    simulation->theta = simulation->plant.theta + (simulation->theta_noise * random_normal(&simulation->source));
    simulation->theta_dot =
        simulation->plant.theta_dot + (simulation->theta_dot_noise * random_normal(&simulation->source));
}

#endif
