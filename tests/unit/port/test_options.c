/* The command line of lever_can, and what opening an interface says when it cannot be done. */
#define _POSIX_C_SOURCE 200809L

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "lever_cdkf.h"
#include "port/linux/options.h"
#include "port/linux/socketcan.h"
#include "unity.h"

enum { MOST_WORDS = 20, WORD_BYTES = 64 };

static options_t options;
static settings_error_t error;
static char file_name[] = "/tmp/lever_test_options_XXXXXX";

void setUp(void)
{
    (void)memset(&error, 0, sizeof error);
}

void tearDown(void)
{
}

/* Reads a command line of words that are separated by one space. */
static bool read_line(const char *line)
{
    static char words[MOST_WORDS][WORD_BYTES];
    static char program[] = "lever_can";
    char *argv[MOST_WORDS + 2] = {program};
    int argc = 1;

    while (*line != '\0') {
        const size_t length = strcspn(line, " ");
        TEST_ASSERT_LESS_THAN_size_t(WORD_BYTES, length);
        TEST_ASSERT_LESS_OR_EQUAL_INT(MOST_WORDS, argc);
        (void)memcpy(words[argc - 1], line, length);
        words[argc - 1][length] = '\0';
        argv[argc] = words[argc - 1];
        argc++;
        line += length + ((line[length] == ' ') ? 1u : 0u);
    }
    return options_read(&options, argc, argv, &error);
}

static void assert_refused(const char *line, const char *message)
{
    TEST_ASSERT_FALSE_MESSAGE(read_line(line), line);
    TEST_ASSERT_EQUAL_STRING(message, error.text);
}

static void test_the_interface_alone_gives_the_defaults(void)
{
    lever_config_t expected;

    lever_config_default(&expected);
    TEST_ASSERT_TRUE(read_line("--can vcan0"));
    TEST_ASSERT_EQUAL_INT(OPTIONS_RUN, options.action);
    TEST_ASSERT_EQUAL_STRING("vcan0", options.interface);
    TEST_ASSERT_FALSE(options.verbose);
    TEST_ASSERT_FALSE(options.lock_step); /* supervised */
    TEST_ASSERT_EQUAL_MEMORY(&expected, &options.config, sizeof expected);
}

static void test_each_medium_has_its_option_and_the_last_counts(void)
{
    static const struct {
        const char *line;
        const char *interface;
        enum options_medium medium;
    } media[] = {{"--can vcan0", "vcan0", OPTIONS_MEDIUM_CAN},
        {"--slcan /dev/ttyACM0", "/dev/ttyACM0", OPTIONS_MEDIUM_SLCAN}, {"--pty lever0", "lever0", OPTIONS_MEDIUM_PTY},
        {"--serial /dev/ttyS0:9600", "/dev/ttyS0:9600", OPTIONS_MEDIUM_SERIAL},
        {"--can vcan0 --pty lever0", "lever0", OPTIONS_MEDIUM_PTY}};

    for (size_t i = 0u; i < (sizeof media / sizeof media[0]); i++) {
        TEST_ASSERT_TRUE(read_line(media[i].line));
        TEST_ASSERT_EQUAL_INT(media[i].medium, options.medium);
        TEST_ASSERT_EQUAL_STRING(media[i].interface, options.interface);
    }
}

static void test_choices_and_settings_reach_the_configuration(void)
{
    TEST_ASSERT_TRUE(read_line("--can can1 --preload fixed --adaptation annealing --model lever --estimator dual "
                               "--set m_p=3 --set theta_noise=0.002 --verbose --lock-step"));
    TEST_ASSERT_TRUE(options.lock_step);
    TEST_ASSERT_EQUAL_UINT8(LEVER_PRELOAD_FIXED, options.config.preload);
    TEST_ASSERT_EQUAL_UINT8(LEVER_ADAPTATION_ANNEALING, options.config.adaptation);
    TEST_ASSERT_EQUAL_FLOAT(3.0f, options.config.settings.m_p);
    TEST_ASSERT_EQUAL_FLOAT(0.002f, options.config.settings.theta_noise);
    TEST_ASSERT_TRUE(options.verbose);
}

static void test_the_later_of_file_and_option_counts(void)
{
    char line[256];

    (void)snprintf(line, sizeof line, "--can can1 --set m_p=3 --settings %s --set c_p=30", file_name);
    TEST_ASSERT_TRUE_MESSAGE(read_line(line), error.text);
    TEST_ASSERT_EQUAL_FLOAT(4.0f, options.config.settings.m_p);
    TEST_ASSERT_EQUAL_FLOAT(30.0f, options.config.settings.c_p);
}

static void test_help_and_version_need_no_interface(void)
{
    TEST_ASSERT_TRUE(read_line("--help"));
    TEST_ASSERT_EQUAL_INT(OPTIONS_HELP, options.action);
    TEST_ASSERT_TRUE(read_line("--version"));
    TEST_ASSERT_EQUAL_INT(OPTIONS_VERSION, options.action);
}

static void test_what_is_wrong_is_said(void)
{
    assert_refused("", "which interface? Say --can vcan0 or --pty lever0, for instance; --help tells more");
    assert_refused("--can", "a value is missing after --can");
    assert_refused("--pty", "a value is missing after --pty");
    assert_refused("--can vcan0 --fast", "unknown option (see --help): --fast");
    assert_refused("--can vcan0 vcan1", "no argument is expected outside the options: vcan1");
    assert_refused("--can vcan0 --preload loose", "preload: \"loose\" is not known; it can be fixed, trim");
    assert_refused("--can vcan0 --set m_p=0", "m_p: 0 is out of range, which is 0.3 to 10 kg");
    assert_refused("--can vcan0 --settings /no/such", "/no/such: No such file or directory");
}

static void test_an_interface_that_cannot_be_opened_is_explained(void)
{
    socketcan_t socketcan;
    const int socket_of_kernel = socket(AF_CAN, SOCK_RAW, 1); /* CAN_RAW */
    const bool kernel_has_can = (socket_of_kernel >= 0) || (errno != EAFNOSUPPORT);

    TEST_ASSERT_FALSE(socketcan_open(&socketcan, "nosuchcan0", STDIN_FILENO));
    TEST_ASSERT_NOT_NULL(strstr(socketcan.reason, kernel_has_can ? "no such interface" : "this kernel has no CAN"));
    socketcan_close(&socketcan);
    TEST_ASSERT_FALSE(socketcan_open(&socketcan, "sixteen_letters_", STDIN_FILENO));
    TEST_ASSERT_EQUAL_STRING("an interface name has 1 to 15 characters", socketcan.reason);
    TEST_ASSERT_FALSE(socketcan_open(&socketcan, "", STDIN_FILENO));
    socketcan_close(&socketcan);
    if (socket_of_kernel >= 0) {
        (void)close(socket_of_kernel);
    }
}

int main(void)
{
    static const char text[] = "m_p = 4\nc_p = 40\n";
    const int file = mkstemp(file_name);
    int result = 1;

    if ((file >= 0) && (write(file, text, sizeof text - 1u) == (ssize_t)(sizeof text - 1u)) && (close(file) == 0)) {
        UNITY_BEGIN();
        RUN_TEST(test_the_interface_alone_gives_the_defaults);
        RUN_TEST(test_each_medium_has_its_option_and_the_last_counts);
        RUN_TEST(test_choices_and_settings_reach_the_configuration);
        RUN_TEST(test_the_later_of_file_and_option_counts);
        RUN_TEST(test_help_and_version_need_no_interface);
        RUN_TEST(test_what_is_wrong_is_said);
        RUN_TEST(test_an_interface_that_cannot_be_opened_is_explained);
        result = UNITY_END();
    }
    (void)unlink(file_name);
    return result;
}
