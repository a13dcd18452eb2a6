/* The line that holds signals back for a late accelerometer: samples are known by their number, so that it shows where each
 * of them comes out. */
#include "app/delay_line.h"

#include "test.h"

static delay_line_t line;
static uint32_t sent; /* samples so far, lost ones included */

void setUp(void)
{
    delay_line_start(&line);
    sent = 0u;
}

/* Sample number `sent`, `periods` after the last; each signal has the number in it. The flags are bits of the number. */
static lever_sample_t pass(uint32_t length, uint32_t periods, float *commanded)
{
    sent += periods;
    const float number = (float)sent;
    lever_sample_t sample = {.time_us = sent,
        .theta = number,
        .theta_dot = number + 0.1f,
        .tau_m = number + 0.2f,
        .z_ddot = number + 0.3f,
        .grip_force = number + 0.4f,
        .theta_valid = ((sent & 1u) != 0u),
        .theta_dot_valid = ((sent & 2u) != 0u),
        .tau_m_valid = ((sent & 4u) != 0u),
        .z_ddot_valid = true,
        .grip_force_valid = ((sent & 8u) != 0u)};
    *commanded = number + 0.5f;
    delay_line_pass(&line, length, periods, &sample, commanded);
    return sample;
}

static void check_is(uint32_t number, const lever_sample_t *sample, float commanded)
{
    const float value = (float)number;
    TEST_ASSERT_EQUAL_FLOAT(value, sample->theta);
    TEST_ASSERT_EQUAL_FLOAT(value + 0.1f, sample->theta_dot);
    TEST_ASSERT_EQUAL_FLOAT(value + 0.2f, sample->tau_m);
    TEST_ASSERT_EQUAL_FLOAT(value + 0.4f, sample->grip_force);
    TEST_ASSERT_EQUAL_FLOAT(value + 0.5f, commanded);
    TEST_ASSERT_EQUAL((number & 1u) != 0u, sample->theta_valid);
    TEST_ASSERT_EQUAL((number & 2u) != 0u, sample->theta_dot_valid);
    TEST_ASSERT_EQUAL((number & 4u) != 0u, sample->tau_m_valid);
    TEST_ASSERT_EQUAL((number & 8u) != 0u, sample->grip_force_valid);
}

static void check_nothing_is_valid(const lever_sample_t *sample)
{
    TEST_ASSERT_FALSE(
        sample->theta_valid || sample->theta_dot_valid || sample->tau_m_valid || sample->grip_force_valid);
}

/* Time and base acceleration are those of now; the rest comes out `length` samples later, and before that nothing does. */
/* R59 */
TEST(signals_come_out_as_many_samples_later)
{
    for (uint32_t length = 0u; length <= (uint32_t)DELAY_LINE_MOST; length++) {
        setUp();
        for (uint32_t k = 1u; k <= 40u; k++) {
            float commanded;
            const lever_sample_t sample = pass(length, 1u, &commanded);
            TEST_ASSERT_EQUAL_UINT32(k, sample.time_us);
            TEST_ASSERT_EQUAL_FLOAT((float)k + 0.3f, sample.z_ddot);
            TEST_ASSERT_TRUE(sample.z_ddot_valid);
            if (k <= length) {
                check_nothing_is_valid(&sample);
            } else {
                check_is(k - length, &sample, commanded);
            }
        }
    }
}

/* A sample that was lost is none when it would come out; those around it keep their places. */
TEST(lost_samples_take_their_places)
{
    for (uint32_t lost = 1u; lost <= 20u; lost++) {
        float commanded;
        setUp();
        for (uint32_t k = 0u; k < 12u; k++) {
            (void)pass(7u, 1u, &commanded);
        }
        for (uint32_t k = 0u; k < 30u; k++) {
            const lever_sample_t sample = pass(7u, (k == 0u) ? (lost + 1u) : 1u, &commanded);
            const uint32_t number = sent - 7u;
            if ((number > 12u) && (number <= (12u + lost))) {
                check_nothing_is_valid(&sample);
                TEST_ASSERT_EQUAL_FLOAT(13.5f + (float)lost, commanded); /* the one of after the gap */
            } else {
                check_is(number, &sample, commanded);
            }
        }
    }
}
