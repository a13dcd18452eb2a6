/* The table of settings and the check of a configuration: every setting at, and just beyond, both of its limits. */
#include "lever_cdkf.h"

#include "model/model.h"
#include "unity.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

static lever_config_t config;
static lever_memory_t memory;

void setUp(void)
{
    lever_config_default(&config);
}

void tearDown(void)
{
}

/* lever_settings_t is an array of floats in the order of the table. */
static float *setting(lever_config_t *of, uint32_t index)
{
    return (float *)(void *)((uint8_t *)&of->settings + (index * sizeof(float)));
}

static uint32_t index_named(const char *name)
{
    uint32_t index = 0u;
    while ((index < lever_setting_count()) && (strcmp(lever_setting(index)->name, name) != 0)) {
        index++;
    }
    TEST_ASSERT_LESS_THAN_UINT32_MESSAGE(lever_setting_count(), index, name);
    return index;
}

static float *setting_named(lever_config_t *of, const char *name)
{
    return setting(of, index_named(name));
}

static const lever_setting_t *row_named(const char *name)
{
    return lever_setting(index_named(name));
}

static void assert_refused(const char *name)
{
    TEST_ASSERT_EQUAL_STRING(name, lever_config_check(&config));
    TEST_ASSERT_NULL(lever_init(&memory, &config));
}

/* --- table -------------------------------------------------------------------------------------------------------- */

static void test_table_has_a_row_for_every_float_of_the_struct(void)
{
    TEST_ASSERT_EQUAL_UINT32(sizeof(lever_settings_t) / sizeof(float), lever_setting_count());
}

static void test_a_row_beyond_the_table_is_null(void)
{
    TEST_ASSERT_NULL(lever_setting(lever_setting_count()));
    TEST_ASSERT_NULL(lever_setting(UINT32_MAX));
}

static void test_every_default_lies_within_its_limits(void)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const lever_setting_t *row = lever_setting(i);
        TEST_ASSERT_TRUE_MESSAGE(row->least < row->greatest, row->name);
        TEST_ASSERT_TRUE_MESSAGE((row->value >= row->least) && (row->value <= row->greatest), row->name);
    }
}

static void test_every_row_says_unit_and_meaning(void)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const lever_setting_t *row = lever_setting(i);
        TEST_ASSERT_TRUE_MESSAGE(strlen(row->unit) > 0u, row->name);
        TEST_ASSERT_TRUE_MESSAGE(strlen(row->meaning) > 10u, row->name);
    }
}

static void test_names_are_unique(void)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        for (uint32_t j = 0u; j < i; j++) {
            TEST_ASSERT_TRUE(strcmp(lever_setting(i)->name, lever_setting(j)->name) != 0);
        }
    }
}

static void test_rows_are_in_the_order_of_the_struct(void)
{
    TEST_ASSERT_EQUAL_PTR(&config.settings.sample_period, setting_named(&config, "sample_period"));
    TEST_ASSERT_EQUAL_PTR(&config.settings.lever_inertia, setting_named(&config, "lever_inertia"));
    TEST_ASSERT_EQUAL_PTR(&config.settings.k_p_sigma, setting_named(&config, "k_p_sigma"));
    TEST_ASSERT_EQUAL_PTR(&config.settings.publish_period, setting_named(&config, "publish_period"));
}

static void test_defaults_are_those_of_the_table(void)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        TEST_ASSERT_TRUE_MESSAGE(*setting(&config, i) == lever_setting(i)->value, lever_setting(i)->name);
    }
    TEST_ASSERT_EQUAL_UINT8(LEVER_MODEL_LEVER, config.model);
    TEST_ASSERT_EQUAL_UINT8(LEVER_PRELOAD_TRIM, config.preload);
    TEST_ASSERT_EQUAL_UINT8(LEVER_ESTIMATOR_DUAL, config.estimator);
    TEST_ASSERT_EQUAL_UINT8(LEVER_ADAPTATION_ROBBINS_MONRO, config.adaptation);
}

/* --- check -------------------------------------------------------------------------------------------------------- */

static void test_the_default_configuration_is_accepted(void)
{
    TEST_ASSERT_NULL(lever_config_check(&config));
    TEST_ASSERT_NOT_NULL(lever_init(&memory, &config));
}

static void test_every_setting_is_accepted_at_both_limits(void)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const lever_setting_t *row = lever_setting(i);
        const float limits[2] = {row->least, row->greatest};
        for (uint32_t k = 0u; k < 2u; k++) {
            setUp();
            *setting(&config, i) = limits[k];
            TEST_ASSERT_NULL_MESSAGE(lever_config_check(&config), row->name);
        }
    }
}

static void test_every_setting_is_refused_by_name_beyond_its_limits_and_when_not_finite(void)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const lever_setting_t *row = lever_setting(i);
        const float beyond[] = {
            nextafterf(row->least, -INFINITY), nextafterf(row->greatest, INFINITY), NAN, INFINITY, -INFINITY};
        for (uint32_t k = 0u; k < 5u; k++) {
            setUp();
            *setting(&config, i) = beyond[k];
            assert_refused(row->name);
        }
    }
}

static void test_no_accepted_dither_band_is_empty(void)
{
    config.settings.dither_low = row_named("dither_low")->greatest;
    config.settings.dither_high = row_named("dither_high")->least;
    TEST_ASSERT_NULL(lever_config_check(&config));
    TEST_ASSERT_TRUE(config.settings.dither_low < config.settings.dither_high);
}

/* At trim_corner 3 and gap_limit 1 a few gaps drove all parameters to their bounds. */
static void test_settings_that_do_not_go_together_are_refused_by_name(void)
{
    const struct {
        float sample_period;
        float gap_limit;
        float trim_corner;
        bool accepted;
    } rows[] = {{1.0e-3f, 1.0f, 3.0f, false}, {1.0e-3f, 1.0f, 1.51f, false}, {1.0e-3f, 1.0f, 1.5f, true},
        {1.0e-3f, 0.5f, 3.0f, true}, {2.0e-2f, 3.9e-2f, 1.0f, false}, {2.0e-2f, 4.0e-2f, 1.0f, true}};
    for (uint32_t k = 0u; k < (sizeof rows / sizeof rows[0]); k++) {
        config.settings.sample_period = rows[k].sample_period;
        config.settings.gap_limit = rows[k].gap_limit;
        config.settings.trim_corner = rows[k].trim_corner;
        TEST_ASSERT_EQUAL_STRING(rows[k].accepted ? NULL : "gap_limit", lever_config_check(&config));
        TEST_ASSERT_EQUAL(rows[k].accepted, lever_init(&memory, &config) != NULL);
    }
}

/* CRC-32 a byte at a time, as IEEE 802.3 has it. */
static uint32_t crc_by_bytes(const uint8_t *bytes, size_t count)
{
    uint32_t crc = UINT32_MAX;
    for (size_t i = 0u; i < count; i++) {
        crc ^= bytes[i];
        for (uint32_t bit = 0u; bit < 8u; bit++) {
            crc = ((crc & 1u) != 0u) ? ((crc >> 1u) ^ 0xEDB88320u) : (crc >> 1u);
        }
    }
    return ~crc;
}

static void test_the_crc_of_the_settings_tells_every_one_of_them(void)
{
    const uint32_t crc = lever_settings_crc(&config.settings);
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        lever_config_t other = config;
        *setting(&other, i) = nextafterf(*setting(&other, i), 1.0e9f);
        TEST_ASSERT_TRUE(lever_settings_crc(&other.settings) != crc);
    }
    TEST_ASSERT_EQUAL_HEX32(0xCBF43926u, crc_by_bytes((const uint8_t *)"123456789", 9u));
    uint8_t bytes[sizeof(lever_settings_t)];
    for (uint32_t i = 0u; i < sizeof bytes; i++) {
        uint32_t word = 0u;
        (void)memcpy(&word, setting(&config, i / 4u), sizeof word);
        bytes[i] = (uint8_t)((word >> (8u * (i % 4u))) & 0xFFu);
    }
    TEST_ASSERT_EQUAL_HEX32(crc_by_bytes(bytes, sizeof bytes), crc);
}

static void test_first_guesses_are_accepted_within_the_bounds_of_the_model_and_nowhere_else(void)
{
    const model_t *const models[] = {&model_lever, &model_linear_physical, &model_linear_black_box, &model_hand};
    for (uint32_t k = 0u; k < ((uint32_t)LEVER_MODEL_COUNT * (uint32_t)LEVER_PARAMETERS); k++) {
        const model_parameter_t *parameter =
            &models[k / (uint32_t)LEVER_PARAMETERS]->parameter[k % (uint32_t)LEVER_PARAMETERS];
        const lever_setting_t *row = row_named(parameter->name);
        TEST_ASSERT_TRUE(row->least == parameter->least);
        TEST_ASSERT_TRUE(row->greatest == parameter->greatest);
        TEST_ASSERT_EQUAL_STRING(parameter->unit, row->unit);
    }
}

static void test_unknown_choices_are_refused_by_name(void)
{
    config.model = (uint8_t)LEVER_MODEL_COUNT;
    assert_refused("model");
    setUp();
    config.preload = (uint8_t)LEVER_PRELOAD_COUNT;
    assert_refused("preload");
    setUp();
    config.estimator = (uint8_t)LEVER_ESTIMATOR_COUNT;
    assert_refused("estimator");
    setUp();
    config.adaptation = (uint8_t)LEVER_ADAPTATION_COUNT;
    assert_refused("adaptation");
}

static void test_keep_is_no_choice_for_a_configuration(void)
{
    config.adaptation = (uint8_t)LEVER_KEEP;
    assert_refused("adaptation");
}

/* --- init --------------------------------------------------------------------------------------------------------- */

static void test_a_refused_configuration_leaves_the_memory_alone(void)
{
    lever_memory_t before;
    (void)memset(&memory, 0x5A, sizeof memory);
    before = memory;
    config.settings.theta_noise = NAN;
    TEST_ASSERT_NULL(lever_init(&memory, &config));
    TEST_ASSERT_EQUAL_MEMORY(&before, &memory, sizeof memory);
}

static void test_init_refuses_null(void)
{
    TEST_ASSERT_NULL(lever_init(NULL, &config));
    TEST_ASSERT_NULL(lever_init(&memory, NULL));
}

static void test_parameters_have_names_and_units_and_nothing_beyond(void)
{
    static const char *const names[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {
        {"m_p", "c_p", "k_p"}, {"m", "c", "k"}, {"a21", "a22", "b21"}, {"k_hand", "c_hand", "c_space"}};
    static const char *const units[LEVER_MODEL_COUNT][LEVER_PARAMETERS] = {
        {"kg", "N s/m", "N/m"}, {"kg", "N s/m", "N/m"}, {"1/s^2", "1/s", "1"}, {"1/s^2", "1/s", "1/s"}};
    for (uint8_t model = 0u; model < (uint8_t)LEVER_MODEL_COUNT; model++) {
        for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
            TEST_ASSERT_EQUAL_STRING(names[model][i], lever_parameter_name(model, i));
            TEST_ASSERT_EQUAL_STRING(units[model][i], lever_parameter_unit(model, i));
        }
    }
    TEST_ASSERT_NULL(lever_parameter_name((uint8_t)LEVER_MODEL_LEVER, (uint32_t)LEVER_PARAMETERS));
    TEST_ASSERT_NULL(lever_parameter_unit((uint8_t)LEVER_MODEL_LEVER, (uint32_t)LEVER_PARAMETERS));
    TEST_ASSERT_NULL(lever_parameter_name((uint8_t)LEVER_MODEL_COUNT, 0u));
    TEST_ASSERT_NULL(lever_parameter_unit((uint8_t)LEVER_MODEL_COUNT, 0u));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_table_has_a_row_for_every_float_of_the_struct);
    RUN_TEST(test_a_row_beyond_the_table_is_null);
    RUN_TEST(test_every_default_lies_within_its_limits);
    RUN_TEST(test_every_row_says_unit_and_meaning);
    RUN_TEST(test_names_are_unique);
    RUN_TEST(test_rows_are_in_the_order_of_the_struct);
    RUN_TEST(test_defaults_are_those_of_the_table);
    RUN_TEST(test_the_default_configuration_is_accepted);
    RUN_TEST(test_every_setting_is_accepted_at_both_limits);
    RUN_TEST(test_every_setting_is_refused_by_name_beyond_its_limits_and_when_not_finite);
    RUN_TEST(test_no_accepted_dither_band_is_empty);
    RUN_TEST(test_settings_that_do_not_go_together_are_refused_by_name);
    RUN_TEST(test_the_crc_of_the_settings_tells_every_one_of_them);
    RUN_TEST(test_first_guesses_are_accepted_within_the_bounds_of_the_model_and_nowhere_else);
    RUN_TEST(test_unknown_choices_are_refused_by_name);
    RUN_TEST(test_keep_is_no_choice_for_a_configuration);
    RUN_TEST(test_a_refused_configuration_leaves_the_memory_alone);
    RUN_TEST(test_init_refuses_null);
    RUN_TEST(test_parameters_have_names_and_units_and_nothing_beyond);
    return UNITY_END();
}
