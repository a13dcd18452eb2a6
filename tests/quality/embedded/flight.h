/* An arm and lever in flight, in single-precision arithmetic that is the same on every machine, and what happens to them. */
#ifndef EMBEDDED_FLIGHT_H
#define EMBEDDED_FLIGHT_H

#include <stdint.h>

#include "lever_cdkf.h"

#define FLIGHT_PERIOD_US 1000u
#define FLIGHT_TRIM 0.35f /* [rad] */

/* theta_ddot = base z_ddot + torque tau_m - stiffness (theta - trim) - damping theta_dot. */
typedef struct arm {
    uint32_t random; /* state of the generator */
    float base;
    float torque;
    float stiffness;
    float damping;
    float trim;
    float shaken; /* amplitude of the base acceleration, 1: as in flight */
    float driven; /* of the motor's torque */
    float noise;  /* of the sensors, 1: as the settings have it */
    float z_ddot;
    float tau_m;
    float theta;
    float theta_dot;
    float force; /* of the hand */
} arm_t;

/* What happens: changes the configuration before the flight, or the arm at a millisecond, or what the sensors say of
 * it. Returns false when that sample is not sent. */
typedef struct scene {
    const char *name;
    void (*configure)(lever_config_t *config);
    void (*happens)(arm_t *arm, uint32_t ms);
    bool (*spoils)(arm_t *arm, uint32_t ms, lever_sample_t *sample);
} scene_t;

extern const scene_t scenes[];
extern const uint32_t scene_count;

/* 3.5 Hz and a damping ratio of 0.3. */
arm_t arm_start(uint32_t seed);

/* Uniform in [-1, 1): a linear congruential generator. */
float arm_noise(arm_t *arm);
uint32_t arm_random(arm_t *arm, uint32_t below);

/* The next sample, everything valid. */
lever_sample_t arm_sample(arm_t *arm, uint32_t ms);

/* Settings drawn anywhere in their ranges, until the configuration is usable. */
void draw_settings(lever_config_t *config, arm_t *arm);

#endif
