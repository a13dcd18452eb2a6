/* The trim: which signals pass its high-pass, and what it does when an output is missing. */
#include "filter/trim.h"

#include "test.h"

#include <math.h>

#define CORNER 1.0f    /* [Hz] */
#define PERIOD 1.0e-3f /* [s] */

static trim_t trim;

void setUp(void)
{
    trim_start(&trim, 0.35f, CORNER, true);
}

/* --- trim --------------------------------------------------------------------------------------------------------- */

/* An input after a sample period. */
static float pass_input(enum trim_signal input, float value)
{
    float passed = value;
    trim_inputs(&trim, &passed, input, 1u, PERIOD);
    return passed;
}

TEST(in_preload_fixed_signals_stay_and_only_the_trim_angle_follows)
{
    const bool valid[MODEL_STATES] = {true, true};
    trim_start(&trim, 0.35f, CORNER, false);
    TEST_ASSERT_TRUE(trim.unsettled == 0.0f);
    for (uint32_t k = 0u; k < 5000u; k++) {
        float y[MODEL_STATES] = {0.5f, 0.25f};
        (void)trim_outputs(&trim, y, valid, PERIOD);
        TEST_ASSERT_TRUE((y[0] == 0.5f) && (y[1] == 0.25f) && (pass_input(TRIM_Z_DDOT, 3.0f) == 3.0f));
    }
    trim_set_origin(&trim);
    TEST_ASSERT_TRUE((trim.origin[0] == 0.0f) && (trim.origin[1] == 0.0f));
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 0.5f, trim_angle(&trim));
}

TEST(nothing_can_be_learnt_for_nine_tenths_of_the_corners_period)
{
    trim_start(&trim, 0.35f, 0.5f, true);
    TEST_ASSERT_EQUAL_FLOAT(1.8f, trim.unsettled);
    trim.unsettled = -1.0f;
    trim_unsettle(&trim);
    TEST_ASSERT_EQUAL_FLOAT(1.8f, trim.unsettled);
}

TEST(outages_in_a_row_add_up_to_twice_that_time)
{
    trim_start(&trim, 0.35f, 0.5f, true);
    trim.unsettled = 1.0f;
    trim_unsettle(&trim);
    TEST_ASSERT_EQUAL_FLOAT(2.8f, trim.unsettled);
    trim_unsettle(&trim);
    TEST_ASSERT_EQUAL_FLOAT(3.6f, trim.unsettled);
}

/* --- outages ------------------------------------------------------------------------------------------------------ */

/* So many samples with only theta_dot valid (1), only theta (0), or neither (2); the last answer of trim_outputs(). */
static bool run_without(uint32_t missing, uint32_t samples)
{
    bool back = false;
    for (uint32_t k = 0u; k < samples; k++) {
        const bool valid[MODEL_STATES] = {missing == 0u, missing == 1u};
        float y[MODEL_STATES] = {0.35f, 0.0f};
        back = trim_outputs(&trim, y, valid, PERIOD);
    }
    return back;
}

TEST(a_missing_level_waits_after_20_ms)
{
    (void)run_without(1u, 20u);
    TEST_ASSERT_TRUE(!trim_is_waiting(&trim, 0u) && (trim_angle(&trim) == 0.35f));
    (void)run_without(1u, 1u);
    TEST_ASSERT_TRUE(trim_is_waiting(&trim, 0u) && !trim_is_waiting(&trim, 1u));
    (void)run_without(1u, 1000u);
    TEST_ASSERT_TRUE(trim_angle(&trim) == 0.35f);
    for (uint32_t k = 0u; k < (uint32_t)TRIM_SECTIONS; k++) {
        TEST_ASSERT_TRUE(trim.output[0].section[k].slope == 0.0f);
    }
}

/* A lever that moves on during an outage of up to 1 / corner, 159 ms, has not moved from its level; after a longer one
 * the level stands where it was. */
TEST(a_level_goes_on_over_an_outage_that_is_not_too_long)
{
    for (uint32_t lost = 159u; lost <= 161u; lost += 2u) {
        float y[MODEL_STATES] = {0.35f, 0.0f};
        setUp();
        for (uint32_t k = 0u; k < 5000u; k++) {
            const bool valid[MODEL_STATES] = {(k < 4000u) || (k >= (4000u + lost)), false};
            const float ramp = 0.35f + (1.0e-4f * (float)k);
            y[0] = ramp;
            (void)trim_outputs(&trim, y, valid, PERIOD);
            if (k == (4000u + lost)) {
                TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, (lost == 159u) ? 0.0f : 1.61e-2f, y[0]);
            }
        }
    }
}

TEST(the_end_of_an_outage_is_said_once_and_a_short_one_is_none)
{
    (void)run_without(2u, 20u);
    TEST_ASSERT_FALSE(run_without(0u, 1u));
    (void)run_without(2u, 30u);
    TEST_ASSERT_TRUE(trim_is_waiting(&trim, 0u) && trim_is_waiting(&trim, 1u));
    TEST_ASSERT_TRUE(run_without(0u, 1u));
    TEST_ASSERT_FALSE(run_without(0u, 1u));
    TEST_ASSERT_TRUE(run_without(1u, 1u)); /* the other comes back later */
}
