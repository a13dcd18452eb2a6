/* Settings from text: names, numbers, ranges, files, and what the messages say. */
#define _POSIX_C_SOURCE 200809L

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lever_cdkf.h"
#include "port/linux/settings.h"
#include "unity.h"

static lever_config_t config;
static settings_error_t error;

void setUp(void)
{
    lever_config_default(&config);
    (void)memset(&error, 0, sizeof error);
}

void tearDown(void)
{
}

/* A file that is open, or the end of the test. */
static FILE *opened(FILE *file)
{
    if (file == NULL) {
        (void)fputs("cannot open a file\n", stderr);
        abort();
    }
    return file;
}

static bool read_text(const char *text, size_t size)
{
    FILE *file = opened(tmpfile());

    TEST_ASSERT_EQUAL_size_t(size, fwrite(text, 1u, size, file));
    TEST_ASSERT_EQUAL_INT(0, fseek(file, 0, SEEK_SET));
    const bool good = settings_read(&config, file, "lever.txt", &error);
    (void)fclose(file);
    return good;
}

static void assert_refused(const char *assignment, const char *message)
{
    lever_config_t before;

    (void)memcpy(&before, &config, sizeof before);
    TEST_ASSERT_FALSE_MESSAGE(settings_assign(&config, assignment, &error), assignment);
    TEST_ASSERT_EQUAL_STRING(message, error.text);
    TEST_ASSERT_EQUAL_MEMORY(&before, &config, sizeof before);
}

static void test_a_setting_changes_itself_alone(void)
{
    lever_config_t expected;

    lever_config_default(&expected);
    expected.settings.theta_noise = 0.002f;
    TEST_ASSERT_TRUE(settings_set(&config, "theta_noise", "2e-3", &error));
    TEST_ASSERT_EQUAL_MEMORY(&expected, &config, sizeof expected);
}

static void test_every_setting_takes_both_its_limits_and_nothing_beyond(void)
{
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const lever_setting_t *setting = lever_setting(i);
        char text[64];
        float value = 0.0f;

        (void)snprintf(text, sizeof text, "%.9g", (double)setting->least);
        TEST_ASSERT_TRUE_MESSAGE(settings_set(&config, setting->name, text, &error), error.text);
        (void)memcpy(&value, (const unsigned char *)&config.settings + (i * sizeof value), sizeof value);
        TEST_ASSERT_EQUAL_MEMORY(&setting->least, &value, sizeof value);
        (void)snprintf(text, sizeof text, "%.9g", (double)setting->greatest);
        TEST_ASSERT_TRUE_MESSAGE(settings_set(&config, setting->name, text, &error), error.text);
        (void)memcpy(&value, (const unsigned char *)&config.settings + (i * sizeof value), sizeof value);
        TEST_ASSERT_EQUAL_MEMORY(&setting->greatest, &value, sizeof value);

        (void)snprintf(text, sizeof text, "%.9g", 1.001 * (double)setting->greatest);
        TEST_ASSERT_FALSE(settings_set(&config, setting->name, text, &error));
        (void)snprintf(text, sizeof text, "%.9g", (double)setting->least - (1.0e-3 * (double)setting->greatest));
        TEST_ASSERT_FALSE(settings_set(&config, setting->name, text, &error));
    }
}

static void test_the_choices_go_by_name(void)
{
    TEST_ASSERT_TRUE(settings_assign(&config, "preload=fixed", &error));
    TEST_ASSERT_EQUAL_UINT8(LEVER_PRELOAD_FIXED, config.preload);
    TEST_ASSERT_TRUE(settings_assign(&config, " adaptation = annealing ", &error));
    TEST_ASSERT_EQUAL_UINT8(LEVER_ADAPTATION_ANNEALING, config.adaptation);
    TEST_ASSERT_TRUE(settings_assign(&config, "model = linear_black_box", &error));
    TEST_ASSERT_EQUAL_UINT8(LEVER_MODEL_LINEAR_BLACK_BOX, config.model);
    TEST_ASSERT_TRUE(settings_assign(&config, "estimator = joint", &error));
    TEST_ASSERT_EQUAL_UINT8(LEVER_ESTIMATOR_JOINT, config.estimator);
    TEST_ASSERT_NULL(lever_config_check(&config));
}

/* A value added to an enum of the façade without a name here would be unreachable from the command line. */
static void test_every_value_of_a_choice_has_a_name(void)
{
    static const struct {
        const char *choice;
        int values;
    } choices[] = {{"model", LEVER_MODEL_COUNT}, {"preload", LEVER_PRELOAD_COUNT}, {"estimator", LEVER_ESTIMATOR_COUNT},
        {"adaptation", LEVER_ADAPTATION_COUNT}};

    for (size_t i = 0u; i < (sizeof choices / sizeof choices[0]); i++) {
        char names[128];
        int count = 1;
        TEST_ASSERT_TRUE(settings_choice_names(choices[i].choice, names, sizeof names));
        for (const char *comma = strchr(names, ','); comma != NULL; comma = strchr(comma + 1, ',')) {
            count++;
        }
        TEST_ASSERT_EQUAL_INT_MESSAGE(choices[i].values, count, choices[i].choice);
    }
}

static void test_what_is_wrong_is_said(void)
{
    assert_refused("theta_nose = 1", "\"theta_nose\" is not a setting; lever_can --help lists them");
    assert_refused("theta_noise", "\"theta_noise\" has no \"=\": write name = value");
    assert_refused("theta_noise = 5", "theta_noise: 5 is out of range, which is 1e-07 to 0.2 rad");
    assert_refused(
        "theta_noise = 1 mrad", "theta_noise: \"1 mrad\" is not a number (give it in rad, without the unit)");
    assert_refused("theta_noise =", "theta_noise: \"\" is not a number (give it in rad, without the unit)");
    assert_refused("theta_noise = nan", "theta_noise: \"nan\" is not a number (give it in rad, without the unit)");
    assert_refused(
        "theta_noise = 0x1p-9", "theta_noise: \"0x1p-9\" is not a number (give it in rad, without the unit)");
    assert_refused("gap_limit = 1e99", "gap_limit: 1e+99 is out of range, which is 0.01 to 1 s");
    assert_refused("preload = loose", "preload: \"loose\" is not known; it can be fixed, trim");
    assert_refused("preload =", "preload: \"\" is not known; it can be fixed, trim");
}

static void test_an_assignment_that_is_too_long_is_an_error(void)
{
    char text[600];

    (void)memset(text, '=', sizeof text);
    text[sizeof text - 1u] = '\0';
    assert_refused(text, "longer than 510 characters");
}

static void test_a_file_may_have_a_byte_order_mark_comments_blanks_and_either_line_ending(void)
{
    static const char text[] =
        "\xEF\xBB\xBF# a comment\n\n  theta_noise=0.003 # [rad] why\r\n\tm_p = 3\npreload = fixed";

    TEST_ASSERT_TRUE_MESSAGE(read_text(text, sizeof text - 1u), error.text);
    TEST_ASSERT_EQUAL_FLOAT(0.003f, config.settings.theta_noise);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, config.settings.m_p);
    TEST_ASSERT_EQUAL_UINT8(LEVER_PRELOAD_FIXED, config.preload);
}

static void test_the_last_of_two_equal_names_counts(void)
{
    static const char text[] = "m_p = 3\nm_p = 4\n";

    TEST_ASSERT_TRUE(read_text(text, sizeof text - 1u));
    TEST_ASSERT_EQUAL_FLOAT(4.0f, config.settings.m_p);
}

static void test_an_error_in_a_file_says_where(void)
{
    static const char text[] = "m_p = 3\n\n# fine\nk_p = stiff\n";

    TEST_ASSERT_FALSE(read_text(text, sizeof text - 1u));
    TEST_ASSERT_EQUAL_STRING(
        "lever.txt:4: k_p: \"stiff\" is not a number (give it in N/m, without the unit)", error.text);
}

static void test_a_line_that_is_too_long_is_an_error(void)
{
    char text[700];

    (void)memset(text, ' ', sizeof text);
    (void)memcpy(text, "m_p = 3\n", 8u);
    TEST_ASSERT_FALSE(read_text(text, sizeof text));
    TEST_ASSERT_EQUAL_STRING("lever.txt:2: the line is longer than 510 bytes", error.text);
}

static void test_a_nul_is_an_error(void)
{
    static const char text[] = "m_p = 3\n# \0\n";

    TEST_ASSERT_FALSE(read_text(text, sizeof text - 1u));
    TEST_ASSERT_EQUAL_STRING("lever.txt:2: is not text", error.text);
}

static void test_a_file_that_cannot_be_read_is_an_error(void)
{
    FILE *folder = opened(fopen("/", "r"));

    TEST_ASSERT_FALSE(settings_read(&config, folder, "/", &error));
    TEST_ASSERT_EQUAL_STRING("/: cannot be read", error.text);
    (void)fclose(folder);
}

static void test_what_is_written_reads_back_the_same(void)
{
    lever_config_t written;
    FILE *file = opened(tmpfile());

    TEST_ASSERT_TRUE(settings_assign(&config, "m_p = 1.23456789", &error));
    TEST_ASSERT_TRUE(settings_assign(&config, "adaptation = fixed", &error));
    (void)memcpy(&written, &config, sizeof written);
    settings_write(&config, file);
    TEST_ASSERT_EQUAL_INT(0, fseek(file, 0, SEEK_SET));
    (void)memset(&config, 0, sizeof config);
    TEST_ASSERT_TRUE_MESSAGE(settings_read(&config, file, "written", &error), error.text);
    TEST_ASSERT_EQUAL_MEMORY(&written, &config, sizeof written);
    (void)fclose(file);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_setting_changes_itself_alone);
    RUN_TEST(test_every_setting_takes_both_its_limits_and_nothing_beyond);
    RUN_TEST(test_the_choices_go_by_name);
    RUN_TEST(test_every_value_of_a_choice_has_a_name);
    RUN_TEST(test_what_is_wrong_is_said);
    RUN_TEST(test_an_assignment_that_is_too_long_is_an_error);
    RUN_TEST(test_a_file_may_have_a_byte_order_mark_comments_blanks_and_either_line_ending);
    RUN_TEST(test_the_last_of_two_equal_names_counts);
    RUN_TEST(test_an_error_in_a_file_says_where);
    RUN_TEST(test_a_line_that_is_too_long_is_an_error);
    RUN_TEST(test_a_nul_is_an_error);
    RUN_TEST(test_a_file_that_cannot_be_read_is_an_error);
    RUN_TEST(test_what_is_written_reads_back_the_same);
    return UNITY_END();
}
