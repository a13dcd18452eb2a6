/* Warning and alarm: entered and left when that is four times as likely as not. */
#include "bounce/alarm.h"

#include <math.h>

#include "test.h"

#define WARNING 3.0f
#define ALARM 1.5f
#define SURE 0.85f /* a little more than the standard deviations of 80 % */

static const lever_aircraft_t aircraft = {.warning = WARNING, .alarm = ALARM};

static uint8_t next(enum lever_bounce state, float gain, float sigma, bool carried)
{
    const margin_t margin = {.gain = gain, .arm_sigma = sigma};
    return alarm_next((uint8_t)state, &margin, &aircraft, carried, false);
}

static uint8_t next_doubtful(enum lever_bounce state, float gain)
{
    const margin_t margin = {.gain = gain, .arm_sigma = 1.0f};
    return alarm_next((uint8_t)state, &margin, &aircraft, true, true);
}

/* R44 */
TEST(a_state_is_entered_and_left_when_it_is_sure)
{
    static const struct {
        enum lever_bounce from;
        float gain;
        enum lever_bounce to;
    } row[] = {
        {LEVER_BOUNCE_UNKNOWN, 10.0f, LEVER_BOUNCE_CLEAR},
        {LEVER_BOUNCE_CLEAR, WARNING - 0.8f, LEVER_BOUNCE_CLEAR},
        {LEVER_BOUNCE_CLEAR, WARNING - SURE, LEVER_BOUNCE_WARNING},
        {LEVER_BOUNCE_WARNING, WARNING + 0.8f, LEVER_BOUNCE_WARNING},
        {LEVER_BOUNCE_WARNING, WARNING + SURE, LEVER_BOUNCE_CLEAR},
        {LEVER_BOUNCE_WARNING, ALARM - 0.8f, LEVER_BOUNCE_WARNING},
        {LEVER_BOUNCE_WARNING, ALARM - SURE, LEVER_BOUNCE_ALARM},
        {LEVER_BOUNCE_CLEAR, ALARM - SURE, LEVER_BOUNCE_ALARM},
        {LEVER_BOUNCE_UNKNOWN, ALARM - SURE, LEVER_BOUNCE_ALARM},
        {LEVER_BOUNCE_ALARM, ALARM + 0.8f, LEVER_BOUNCE_ALARM},
        {LEVER_BOUNCE_ALARM, ALARM + SURE, LEVER_BOUNCE_WARNING},
        {LEVER_BOUNCE_ALARM, WARNING + SURE, LEVER_BOUNCE_CLEAR},
    };
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        TEST_ASSERT_EQUAL_UINT8_MESSAGE(row[i].to, next(row[i].from, row[i].gain, 1.0f, true), "a row of the table");
    }
}

/* R44 */
TEST(a_margin_that_nothing_carries_says_nothing_and_leaves_an_alarm)
{
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, next(LEVER_BOUNCE_CLEAR, 10.0f, 1.0f, false));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, next(LEVER_BOUNCE_WARNING, -9.0f, 1.0f, false));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, next(LEVER_BOUNCE_WARNING, -9.0f, 3.1f, true));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, next(LEVER_BOUNCE_CLEAR, -9.0f, NAN, true));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_ALARM, next(LEVER_BOUNCE_ALARM, 10.0f, 1.0f, false));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_ALARM, next(LEVER_BOUNCE_ALARM, 10.0f, 3.1f, true));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_CLEAR, next(LEVER_BOUNCE_ALARM, 10.0f, 2.9f, true));
}

/* R44 */
TEST(with_a_model_that_does_not_fit_there_is_an_alarm_or_nothing)
{
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, next_doubtful(LEVER_BOUNCE_CLEAR, 10.0f));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, next_doubtful(LEVER_BOUNCE_WARNING, WARNING - SURE));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_UNKNOWN, next_doubtful(LEVER_BOUNCE_CLEAR, ALARM - SURE - 1.4f));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_ALARM, next_doubtful(LEVER_BOUNCE_CLEAR, ALARM - SURE - 1.6f));
    TEST_ASSERT_EQUAL_UINT8(LEVER_BOUNCE_ALARM, next_doubtful(LEVER_BOUNCE_ALARM, 10.0f));
}
