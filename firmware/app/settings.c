/* The table of settings, its defaults and its check: lever_settings.def expanded three times. */
#include "lever_cdkf.h"

#include <stddef.h>

static const lever_setting_t table[] = {
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) {#name, unit, meaning, value, least, greatest},
#include "lever_settings.def"
};

uint32_t lever_setting_count(void)
{
    return (uint32_t)(sizeof(table) / sizeof(table[0]));
}

const lever_setting_t *lever_setting(uint32_t index)
{
    return (index < lever_setting_count()) ? &table[index] : NULL;
}

void lever_config_default(lever_config_t *config)
{
    config->model = (uint8_t)LEVER_MODEL_LEVER;
    config->preload = (uint8_t)LEVER_PRELOAD_TRIM;
    config->estimator = (uint8_t)LEVER_ESTIMATOR_DUAL;
    config->adaptation = (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO;
/* cppcheck-suppress misra-c2012-20.7 ; D1 */
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) config->settings.name = (value);
#include "lever_settings.def"
}

/* The name of the first setting out of its range (a NaN is), or NULL. */
static const char *settings_check(const lever_settings_t *settings)
{
    const char *wrong = NULL;
/* cppcheck-suppress misra-c2012-20.7 ; D1 */
#define LEVER_SETTING(name, unit, value, low, high, meaning)                                                           \
    if ((wrong == NULL) && !((settings->name >= (low)) && (settings->name <= (high)))) {                               \
        wrong = #name;                                                                                                 \
    }
#include "lever_settings.def"
    return wrong;
}

const char *lever_config_check(const lever_config_t *config)
{
    const char *wrong = settings_check(&config->settings);
    if (config->adaptation >= (uint8_t)LEVER_ADAPTATION_COUNT) {
        wrong = "adaptation";
    }
    if (config->estimator >= (uint8_t)LEVER_ESTIMATOR_COUNT) {
        wrong = "estimator";
    }
    if (config->preload >= (uint8_t)LEVER_PRELOAD_COUNT) {
        wrong = "preload";
    }
    if (config->model >= (uint8_t)LEVER_MODEL_COUNT) {
        wrong = "model";
    }
    return wrong;
}
