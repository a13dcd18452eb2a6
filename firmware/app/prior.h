/* What the settings say of each model's parameters before the first sample, and of how they walk. */
#ifndef APP_PRIOR_H
#define APP_PRIOR_H

#include "filter/adaptation.h"
#include "filter/parameter_filter.h"
#include "lever_cdkf.h"

#include <stdbool.h>

/* First guess and standard deviation of the parameters of the chosen model. */
prior_t prior_of(const lever_config_t *config);

/* How their walk is set; `positive` as in model_t. */
adaptation_t adaptation_of(const lever_config_t *config, bool positive);

#endif
