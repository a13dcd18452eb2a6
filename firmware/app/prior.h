/* What the settings say of each model's parameters before the first sample, and of how they walk. */
#ifndef APP_PRIOR_H
#define APP_PRIOR_H

#include "filter/adaptation.h"
#include "filter/parameter_filter.h"
#include "lever_cdkf.h"

#include <stdbool.h>

/* What an instance runs with: the choices, which commands change, and the caller's settings. */
typedef struct setup {
    const lever_settings_t *settings;
    uint8_t model;      /* enum lever_model */
    uint8_t preload;    /* enum lever_preload */
    uint8_t estimator;  /* enum lever_estimator */
    uint8_t adaptation; /* enum lever_adaptation */
} setup_t;

/* First guess and standard deviation of the parameters of the chosen model. */
prior_t prior_of(const setup_t *setup);

/* How their walk is set; `positive` as in model_t. */
adaptation_t adaptation_of(const setup_t *setup, bool positive);

#endif
