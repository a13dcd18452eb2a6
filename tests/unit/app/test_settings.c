/* The table of settings and the check of a configuration: what is wrong is named. */
#include "lever_cdkf.h"

#include <math.h>

#include "test.h"

static lever_config_t config;
static lever_memory_t memory;

void setUp(void)
{
    lever_config_default(&config);
}

static void assert_refused(const char *name)
{
    TEST_ASSERT_EQUAL_STRING(name, lever_config_check(&config));
    TEST_ASSERT_NULL(lever_init(&memory, &config));
}

/* R28 */
TEST(a_setting_out_of_its_range_is_named_and_its_limits_are_within)
{
    float *const value = (float *)(void *)&config.settings; /* an array of them: lever_cdkf.h */
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const lever_setting_t *row = lever_setting(i);
        const float beyond[] = {nextafterf(row->least, -INFINITY), nextafterf(row->greatest, INFINITY), NAN};
        for (uint32_t k = 0u; k < 3u; k++) {
            value[i] = beyond[k];
            assert_refused(row->name);
        }
        for (uint32_t k = 0u; k < 2u; k++) {
            value[i] = (k == 0u) ? row->least : row->greatest;
            const char *wrong = lever_config_check(&config); /* alone it is right */
            TEST_ASSERT_TRUE((wrong == NULL) || (wrong[0] == 'g'));
        }
        value[i] = row->value;
    }
    TEST_ASSERT_NULL(lever_setting(lever_setting_count()));
}

/* R28 */
TEST(choices_that_are_not_known_and_settings_that_do_not_go_together_are_named)
{
    uint8_t *const choice[] = {
        &config.model, &config.preload, &config.estimator, &config.adaptation, &config.mitigation};
    static const uint8_t count[] = {
        LEVER_MODEL_COUNT, LEVER_PRELOAD_COUNT, LEVER_ESTIMATOR_COUNT, LEVER_ADAPTATION_COUNT, LEVER_MITIGATION_COUNT};
    static const char *const name[] = {"model", "preload", "estimator", "adaptation", "mitigation"};
    for (uint32_t i = 0u; i < 5u; i++) {
        *choice[i] = (uint8_t)(count[i] - 1u);
        TEST_ASSERT_NULL(lever_config_check(&config));
        *choice[i] = count[i];
        assert_refused(name[i]);
        *choice[i] = 0u;
    }
    config.settings.trim_corner = 2.0f;
    config.settings.gap_limit = 1.01f * (1.5f / 2.0f);
    assert_refused("gap_limit");
    config.settings.gap_limit = 0.75f;
    TEST_ASSERT_NULL(lever_config_check(&config));
    config.settings.sample_period = 0.01f;
    config.settings.gap_limit = 0.0199f;
    assert_refused("gap_limit");
    config.settings.gap_limit = 0.02f;
    TEST_ASSERT_NULL(lever_config_check(&config));
    config.settings.sample_period = 5.0e-4f;
    config.settings.z_ddot_delay = 5.01e-3f; /* more than ten samples */
    assert_refused("z_ddot_delay");
    config.settings.z_ddot_delay = 5.0e-3f;
    TEST_ASSERT_NULL(lever_config_check(&config));
    TEST_ASSERT_NULL(lever_init(NULL, &config));
    TEST_ASSERT_NULL(lever_init(&memory, NULL));
}
