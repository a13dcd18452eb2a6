/* What an instance runs with: its choices, and what follows from them and the settings. */
#ifndef APP_SETUP_H
#define APP_SETUP_H

#include "filter/adaptation.h"
#include "filter/noise_estimation.h"
#include "lever_cdkf.h"
#include "model/model.h"
#include "model/scaling.h"

#include <stdbool.h>

typedef struct setup {
    const lever_settings_t *settings; /* the caller's */
    const model_t *model_in_use;
    model_constants_t constants;
    float base_scale;      /* true over measured base acceleration, */
    float torque_scale;    /* and torque */
    float delay_rest;      /* by which the accelerometer is less late than delay_samples, in sample periods */
    uint8_t delay_samples; /* that the other signals are delayed by */
    uint8_t model;         /* enum lever_model; commands change this and the following */
    uint8_t preload;       /* enum lever_preload */
    uint8_t estimator;     /* enum lever_estimator */
    uint8_t adaptation;    /* enum lever_adaptation */
} setup_t;

/* The model of an enum lever_model; NULL when there is none. */
const model_t *setup_model(uint8_t model);

/* Renews what follows from the choices: after a change of model or preload. */
void setup_choose(setup_t *setup);

/* First guess and standard deviation of the parameters of the chosen model. */
prior_t setup_prior(const setup_t *setup);

/* How their random walk is adapted. */
adaptation_t setup_adaptation(const setup_t *setup);

/* What the noise estimation starts from. */
noise_setting_t setup_noise(const setup_t *setup);

#endif
