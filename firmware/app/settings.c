/* The table of settings: lever_settings.def as rows, to read, to take the defaults from and to check against. */
#include "app/delay_line.h"
#include "lever_cdkf.h"
#include "math/crc32.h"

#include <stddef.h>
#include <string.h>

static const lever_setting_t table[] = {
#define LEVER_SETTING(name, unit, value, least, greatest, meaning) {#name, unit, meaning, value, least, greatest},
#include "lever_settings.def"
};

#define SETTINGS (sizeof(table) / sizeof(table[0]))

/* cppcheck-suppress misra-c2012-2.3 ; D5 */
typedef char settings_are_as_many_floats[(sizeof(lever_settings_t) == (SETTINGS * sizeof(float))) ? 1 : -1];

uint32_t lever_setting_count(void)
{
    return (uint32_t)SETTINGS;
}

const lever_setting_t *lever_setting(uint32_t index)
{
    return (index < lever_setting_count()) ? &table[index] : NULL;
}

void lever_config_default(lever_config_t *config)
{
    float value[SETTINGS];
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        value[i] = table[i].value;
    }
    /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    (void)memcpy(&config->settings, value, sizeof value); /* an array of floats, as checked above */
    config->model = (uint8_t)LEVER_MODEL_LEVER;
    config->preload = (uint8_t)LEVER_PRELOAD_TRIM;
    config->estimator = (uint8_t)LEVER_ESTIMATOR_DUAL;
    config->adaptation = (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO;
    config->mitigation = (uint8_t)LEVER_MITIGATION_NONE;
}

uint32_t lever_settings_crc(const lever_settings_t *settings)
{
    uint32_t words[SETTINGS];
    /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    (void)memcpy(words, settings, sizeof words);
    uint32_t crc = CRC32_START;
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        crc = crc32_shift(crc ^ words[i], 32u);
    }
    return ~crc;
}

/* The name of the first setting out of its range (a NaN is), or NULL. */
static const char *settings_check(const lever_settings_t *settings)
{
    float value[SETTINGS];
    /* cppcheck-suppress misra-c2012-21.15 ; D2 */
    (void)memcpy(value, settings, sizeof value);
    const char *wrong = NULL;
    for (uint32_t i = 0u; (i < lever_setting_count()) && (wrong == NULL); i++) {
        if (!((value[i] >= table[i].least) && (value[i] <= table[i].greatest))) {
            wrong = table[i].name;
        }
    }
    return wrong;
}

/* The name of the first setting that does not go with another, or NULL. Through a gap the high-pass behind trim_corner
 * is stepped in SUBSTEPS_MOST parts of it (prediction.c), 12, each of an angle of 2 pi product / 12, with the product of
 * both. The sections lose accuracy as that angle grows; at a product of 1.5, +-2 sigma still cover 97 %. A gap_limit of
 * less than two sample periods takes a late sample for a gap, and aligns for ever. The delay has to fit into its line. */
static const char *combination_check(const lever_settings_t *settings)
{
    const bool late = (settings->z_ddot_delay > ((float)DELAY_LINE_MOST * settings->sample_period));
    const bool fits = ((settings->gap_limit * settings->trim_corner) <= 1.5f) &&
                      (settings->gap_limit >= (2.0f * settings->sample_period));
    const char *wrong = late ? "z_ddot_delay" : NULL;
    return fits ? wrong : "gap_limit";
}

const char *lever_config_check(const lever_config_t *config)
{
    const char *wrong = settings_check(&config->settings);
    if (wrong == NULL) {
        wrong = combination_check(&config->settings);
    }
    if (config->mitigation >= (uint8_t)LEVER_MITIGATION_COUNT) {
        wrong = "mitigation";
    }
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
