/* Single samples: what is missing, invalid, implausible, late, twice; time that wraps or starts anew. */
#include "app/instance.h"
#include "math/bounds.h"
#include "model/model.h"
#include "rig.h"

enum { SIGNALS = 4 }; /* theta, theta_dot, tau_m, z_ddot */

static const uint32_t fault_of[SIGNALS] = {
    LEVER_FAULT_THETA, LEVER_FAULT_THETA_DOT, LEVER_FAULT_TORQUE, LEVER_FAULT_BASE};

static lever_config_t other_config;
static lever_memory_t other_memory;
static lever_t *other; /* for comparison */

void setUp(void)
{
    lever_config_default(&config);
    start();
    other_config = config;
    other = lever_init(&other_memory, &other_config);
}

/* The same good samples into both. */
static void run_both(uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        const lever_sample_t sample = sample_after(1u);
        (void)lever_update(lever, &sample);
        (void)lever_update(other, &sample);
    }
}

static float *value_of(lever_sample_t *sample, uint32_t which)
{
    float *const values[SIGNALS] = {&sample->theta, &sample->theta_dot, &sample->tau_m, &sample->z_ddot};
    return values[which];
}

static void invalidate(lever_sample_t *sample, uint32_t which)
{
    bool *const valid[SIGNALS] = {
        &sample->theta_valid, &sample->theta_dot_valid, &sample->tau_m_valid, &sample->z_ddot_valid};
    *valid[which] = false;
    *value_of(sample, which) = NAN; /* not to be read */
}

/* --- what is missing or wrong ------------------------------------------------------------------------------------- */

/* R31 */
TEST(a_value_that_is_not_finite_or_plausible_is_corrupt_and_counts_as_missing_and_one_marked_invalid_is_not_read)
{
    const float bad[] = {NAN, INFINITY, -INFINITY, 1.1e4f};
    uint32_t corrupt = 0u;
    (void)run(3000u);
    TEST_ASSERT_EQUAL_UINT32(0u, health().faults);
    TEST_ASSERT_EQUAL_UINT8(2u, estimate().nis_size);
    for (uint32_t which = 0u; which < (uint32_t)SIGNALS; which++) {
        for (uint32_t b = 0u; b <= 4u; b++) {
            lever_sample_t sample = sample_after(1u);
            if (b == 4u) {
                invalidate(&sample, which);
            } else {
                *value_of(&sample, which) = bad[b];
                corrupt++;
            }
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
            TEST_ASSERT_EQUAL_UINT32(corrupt, health().corrupt);
            TEST_ASSERT_EQUAL_UINT32(fault_of[which], health().faults);
            TEST_ASSERT_EQUAL_UINT8((which < 2u) ? 1u : 2u, estimate().nis_size);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
}

/* During alignment, when no output is a spike, and at the first sample, from which no input can jump. */
TEST(a_value_is_plausible_up_to_its_limit)
{
    static const float limit[SIGNALS] = {MODEL_THETA_MOST, 1.0e4f, 1.0e4f, 1.0e4f};
    for (uint32_t which = 0u; which <= (uint32_t)SIGNALS; which++) {
        for (uint32_t beyond = 0u; beyond < 2u; beyond++) {
            start();
            (void)run(((which == 2u) || (which == 3u)) ? 0u : 10u);
            lever_sample_t sample = sample_after(1u);
            sample.grip_force_valid = true;
            float *value = (which < (uint32_t)SIGNALS) ? value_of(&sample, which) : &sample.grip_force;
            *value = ((beyond == 1u) ? 1.2f : 1.0f) * ((which < (uint32_t)SIGNALS) ? limit[which] : 1.0e4f);
            (void)lever_update(lever, &sample);
            TEST_ASSERT_EQUAL_UINT32(beyond, health().corrupt);
        }
    }
}

/* In whole periods, rounded; a clock that advances by less than a quarter of one as good as stands. */
TEST(time_that_passes_is_counted_in_periods)
{
    static const uint32_t elapsed_us[] = {1400u, 1600u, 2300u, 2600u, 300u, 200u, 1500u, 250u};
    static const uint32_t lost[] = {0u, 1u, 1u, 2u, 0u, 0u, 0u, 0u};
    for (uint32_t k = 0u; k < 8u; k++) {
        start();
        (void)run(400u);
        lever_sample_t sample = sample_after(1u);
        sample.time_us += elapsed_us[k] - (uint32_t)PERIOD_US;
        (void)lever_update(lever, &sample);
        TEST_ASSERT_EQUAL_UINT32(lost[k], health().lost);
        TEST_ASSERT_EQUAL(k == 5u, has_fault(LEVER_FAULT_CLOCK));
    }
}

TEST(not_a_number_in_the_very_first_sample_does_no_harm)
{
    for (uint32_t which = 0u; which < (uint32_t)SIGNALS; which++) {
        start();
        lever_sample_t sample = sample_after(1u);
        *value_of(&sample, which) = NAN;
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, lever_update(lever, &sample));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run(1000u));
        TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
    }
}

/* What was asked of the motor until the sample is what a perfect torque sensor would have said; without dither,
 * nothing. */
TEST(without_measured_torque_the_torque_asked_for_counts)
{
    double largest = 0.0;
    for (uint32_t k = 0u; k < 3000u; k++) {
        lever_sample_t sample = sample_after(1u);
        if ((k % 500u) == 400u) {
            lever_command_t command = command_none();
            command.dither_rms = 0.3f;
            TEST_ASSERT_TRUE(lever_command(lever, &command) && lever_command(other, &command));
        }
        sample.tau_m = health_of(other).torque;
        largest = fmax(largest, fabs((double)sample.tau_m));
        (void)lever_update(other, &sample);
        invalidate(&sample, 2u);
        (void)lever_update(lever, &sample);
        assert_same_estimates(other, lever);
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_TORQUE));
    }
    TEST_ASSERT_TRUE(largest > 0.3);
}

/* --- time --------------------------------------------------------------------------------------------------------- */

/* R30 */
TEST(a_sample_that_comes_twice_or_is_older_is_late_and_changes_nothing)
{
    const uint32_t older_us[] = {0u, 5000u, 1800000000u, 0x80000000u}; /* half a turn of the clock is 36 minutes */
    run_both(1501u);                                                   /* settled */
    lever_sample_t sample = sample_after(0u);
    sample.theta += 0.1f;
    for (uint32_t k = 0u; k < 4u; k++) {
        sample.time_us = time_us - older_us[k];
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &sample));
        TEST_ASSERT_EQUAL_UINT32(k + 1u, health().late);
        TEST_ASSERT_EQUAL_UINT32(1501u, health().samples);
        TEST_ASSERT_EQUAL_UINT32(0u, health().faults & ~(uint32_t)LEVER_FAULT_CLOCK);
    }
    assert_same_estimates(lever, other);
    run_both(100u);
    assert_same_estimates(lever, other);
    TEST_ASSERT_EQUAL_UINT32(0u, health().faults);
}

/* So many good samples whose clock lags behind by `lag_us`; the mode after the last. */
static enum lever_mode run_lagging(uint32_t count, uint32_t lag_us)
{
    enum lever_mode mode = LEVER_MODE_INIT;
    for (uint32_t k = 0u; k < count; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.time_us -= lag_us;
        mode = lever_update(lever, &sample);
    }
    return mode;
}

/* So many samples of which each takes `more_us` longer than it should, one in `lost` does not come (0: all do), and one
 * signal is invalid (SIGNALS: none). Returns whether CALIBRATION shows. */
static bool run_slower(uint32_t count, uint32_t more_us, uint32_t lost, uint32_t without)
{
    for (uint32_t k = 1u; k <= count; k++) {
        lever_sample_t sample = sample_after(1u);
        time_us += more_us;
        sample.time_us = time_us;
        if (without < (uint32_t)SIGNALS) {
            invalidate(&sample, without);
        }
        if ((lost == 0u) || ((k % lost) != 0u)) {
            (void)lever_update(lever, &sample);
        }
    }
    return has_fault(LEVER_FAULT_CALIBRATION);
}

/* In ALIGN, RUN and FROZEN, whatever is missing. Lost samples alone, also half of them, are no clock. */
/* R30 */
TEST(a_clock_that_is_a_tenth_fast_shows_in_every_mode_and_lost_samples_do_not)
{
    static const uint32_t lost[] = {0u, 5u, 2u};
    for (uint32_t i = 0u; i < (sizeof lost / sizeof lost[0]); i++) {
        for (uint32_t without = 0u; without <= (uint32_t)SIGNALS; without++) {
            for (uint32_t mode = 0u; mode < 3u; mode++) {
                start();
                (void)run((mode == 0u) ? 1u : 2000u);
                lever_command_t command = command_none();
                command.request = (uint8_t)((mode == 2u) ? LEVER_REQUEST_FREEZE : LEVER_REQUEST_RUN);
                TEST_ASSERT_TRUE(lever_command(lever, &command));
                TEST_ASSERT_FALSE(run_slower(280u, 0u, lost[i], without));
                TEST_ASSERT_TRUE(run_slower(500u, 100u, lost[i], without));
                TEST_ASSERT_FALSE(run_slower(1000u, 0u, lost[i], without));
            }
        }
    }
}

/* A sender that restarts its clock is late for gap_limit; then the estimator aligns anew, parameters kept, and runs. */
/* R30 */
TEST(a_clock_that_starts_anew_is_followed_after_gap_limit)
{
    const uint32_t lags_us[] = {2000000000u, 1000000u};
    for (uint32_t k = 0u; k < 2u; k++) {
        start();
        (void)run(3000u);
        const lever_estimate_t before = estimate();
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(500u, lags_us[k])); /* gap_limit 0.5 s */
        const lever_estimate_t late = estimate();
        TEST_ASSERT_EQUAL_MEMORY(&before, &late, sizeof before);
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, run_lagging(2u, lags_us[k]));
        const lever_estimate_t followed = estimate();
        TEST_ASSERT_EQUAL_UINT32(time_us - lags_us[k], followed.time_us);
        assert_same_parameters(&before, &followed);
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(301u, lags_us[k]));
        (void)run_lagging(2000u, lags_us[k]);
        TEST_ASSERT_EQUAL_UINT32(0u, health().faults);
        TEST_ASSERT_EQUAL_UINT32(501u, health().late);
    }
}

/* A clock that stands, or jumps to and fro, is never a new one; nor is one whose late samples a good one interrupts. */
TEST(late_samples_that_do_not_advance_are_no_new_clock)
{
    (void)run(1000u);
    const lever_sample_t standing = sample_after(1u);
    for (uint32_t k = 0u; k < 2000u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, lever_update(lever, &standing));
    }
    TEST_ASSERT_EQUAL_UINT32(1999u, health().late);
    for (uint32_t k = 0u; k < 2000u; k++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(1u, ((k % 2u) == 0u) ? 10000000u : 5000000u));
    }
    time_us = standing.time_us;
    for (uint32_t k = 1u; k <= 1200u; k++) {
        const uint32_t lag_us = (time_us + 1000u) - (1000u * k); /* of an old clock */
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, run_lagging(1u, ((k % 300u) == 0u) ? 0u : lag_us));
    }
    TEST_ASSERT_EQUAL_UINT32(1005u, health().samples);
}

/* Samples so many milliseconds before the last good one; of a clock that starts anew they advance by gap_limit on end,
 * from one to the next by no more. A good one (0) begins it again, as does one that stands. */
TEST(a_new_clock_advances_by_gap_limit_on_end)
{
    static const struct {
        uint32_t before_us[5];
        enum lever_mode mode;
    } row[] = {{{10000000u, 9500000u}, LEVER_MODE_ALIGN}, {{10000000u, 9500001u}, LEVER_MODE_RUN},
        {{10000000u, 9499999u, 9000000u}, LEVER_MODE_RUN}, {{10000000u, 9600000u, 9500000u}, LEVER_MODE_ALIGN},
        {{10000000u, 0u, 9600000u, 9450000u}, LEVER_MODE_RUN},
        {{10000000u, 9600000u, 9600000u, 9450000u}, LEVER_MODE_RUN}};
    (void)run(1000u);
    const lever_memory_t before = memory;
    const uint32_t then_us = time_us;
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        enum lever_mode mode = LEVER_MODE_RUN;
        memory = before;
        for (uint32_t k = 0u; (k < 5u) && ((k < 2u) || (row[i].before_us[k] != 0u)); k++) {
            lever_sample_t sample = sample_after(0u);
            sample.time_us = (row[i].before_us[k] == 0u) ? (then_us + 1000u) : (then_us - row[i].before_us[k]);
            mode = lever_update(lever, &sample);
        }
        TEST_ASSERT_EQUAL(row[i].mode, mode);
    }
}

/* There is nothing to extrapolate from. */
TEST(the_first_base_acceleration_is_taken_as_it_is_whatever_the_delay)
{
    config.settings.z_ddot_delay = 5.0e-3f;
    start();
    lever_sample_t sample = sample_after(1u);
    sample.z_ddot = 2.0f;
    (void)lever_update(lever, &sample);
    TEST_ASSERT_EQUAL_FLOAT(2.0f, lever->estimator.last_z_ddot);
}

/* All but the base is held back by the delay, rounded up to whole samples: the estimate says of when it is. */
TEST(an_estimate_is_of_the_time_that_a_late_accelerometer_shows)
{
    static const struct {
        float delay; /* [s] */
        uint32_t late_us;
    } row[] = {{0.0f, 0u}, {0.9e-3f, 1000u}, {1.0e-3f, 1000u}, {1.1e-3f, 2000u}, {9.5e-3f, 10000u}, {1.0e-2f, 10000u}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        float theta[12];
        config.settings.z_ddot_delay = row[i].delay;
        start();
        for (uint32_t k = 0u; k < 500u; k++) {
            const lever_sample_t sample = sample_after(1u);
            theta[k % 12u] = sample.theta;
            (void)lever_update(lever, &sample);
        }
        const lever_estimate_t now = estimate();
        TEST_ASSERT_EQUAL_UINT32(time_us - row[i].late_us, now.time_us);
        TEST_ASSERT_FLOAT_WITHIN(4.0f * 1.0e-3f, theta[(499u - (row[i].late_us / 1000u)) % 12u], now.theta);
        TEST_ASSERT_EQUAL_FLOAT(theta[(499u - (row[i].late_us / 1000u)) % 12u],
            lever->estimator.learning.evidence.stillness[SIGNAL_THETA].now);
    }
}

TEST(the_time_of_an_estimate_is_rounded_to_the_nearest_microsecond)
{
    config.settings.sample_period = 3.3333e-4f;
    config.settings.z_ddot_delay = 3.0e-4f; /* one sample */
    start();
    const lever_sample_t sample = sample_after(1u);
    (void)lever_update(lever, &sample);
    TEST_ASSERT_EQUAL_UINT32(time_us - 333u, estimate().time_us);
}

/* What is left of a delay lies between two samples of the base: a ramp of it comes out where it is. */
TEST(a_delay_between_two_samples_is_on_the_line_between_them)
{
    config.settings.z_ddot_delay = 1.25e-3f;
    start();
    for (uint32_t k = 0u; k < 100u; k++) {
        lever_sample_t sample = sample_after(1u);
        sample.z_ddot = 0.1f * (float)k;
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 0.1f * (99.0f - 0.75f), lever->estimator.last_z_ddot);
}

/* Into both, the angle of the one off by `offset`. Returns the faults that it shows at any time. */
static uint32_t run_off(uint32_t count, float offset)
{
    uint32_t faults = 0u;
    for (uint32_t k = 0u; k < count; k++) {
        lever_sample_t sample = sample_after(1u);
        (void)lever_update(other, &sample);
        sample.theta += offset;
        (void)lever_update(lever, &sample);
        faults |= health().faults;
    }
    return faults;
}

static void request_both(enum lever_request what)
{
    lever_command_t command = command_none();
    command.request = (uint8_t)what;
    TEST_ASSERT_TRUE(lever_command(lever, &command) && lever_command(other, &command));
}

/* An angle that jumps while the rate goes on has another offset: that teaches nothing. While the parameters are held
 * they do not belong to the angle shown, until it is back. */
/* R33 */
TEST(an_angle_that_jumps_without_the_rate_has_another_offset)
{
    const uint32_t wrong = (uint32_t)LEVER_FAULT_INNOVATION | (uint32_t)LEVER_FAULT_CHANGE |
                           (uint32_t)LEVER_FAULT_MISMATCH | (uint32_t)LEVER_FAULT_BASE | (uint32_t)LEVER_FAULT_SETTLING;
    run_both(8000u);
    for (uint32_t frozen = 0u; frozen <= 1u; frozen++) {
        request_both((frozen != 0u) ? LEVER_REQUEST_FREEZE : LEVER_REQUEST_RUN);
        const uint32_t at_first = run_off(40u, 0.1f);
        const uint32_t then = run_off(2000u, 0.1f);
        TEST_ASSERT_EQUAL_UINT32((uint32_t)LEVER_FAULT_THETA, at_first & (wrong | (uint32_t)LEVER_FAULT_THETA));
        TEST_ASSERT_EQUAL_UINT32(0u, then & wrong);
        TEST_ASSERT_EQUAL(frozen != 0u, has_fault(LEVER_FAULT_THETA));
        TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.1f, estimate().theta - estimate_of(other).theta);
        TEST_ASSERT_EQUAL_UINT32(0u, run_off(2000u, 0.0f) & wrong);
        TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_THETA));
        TEST_ASSERT_FLOAT_WITHIN(0.01f * estimate_of(other).natural_frequency, estimate_of(other).natural_frequency,
            estimate().natural_frequency);
    }
}

/* While the parameters are held, jumps add up: what is left counts above 0.02 rad, until the angle is measured anew
 * after an outage. */
/* R33 */
TEST(what_is_left_of_an_offset_counts)
{
    static const struct {
        float back; /* of 0.1 rad */
        bool wrong;
    } row[] = {{0.075f, true}, {0.085f, false}, {0.1f, false}};
    run_both(8000u);
    request_both(LEVER_REQUEST_FREEZE);
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        (void)run_off(1000u, 0.1f);
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_THETA));
        (void)run_off(1000u, 0.1f - row[i].back);
        TEST_ASSERT_EQUAL(row[i].wrong, has_fault(LEVER_FAULT_THETA));
        for (uint32_t k = 0u; k < 30u; k++) {
            lever_sample_t sample = sample_after(1u);
            (void)lever_update(other, &sample);
            sample.theta_valid = false;
            (void)lever_update(lever, &sample);
        }
        (void)run_off(1000u, 0.1f - row[i].back);
        TEST_ASSERT_FALSE(has_fault(LEVER_FAULT_THETA));
        (void)run_off(1000u, 0.0f);
        lever->estimator.learning.evidence.offset = 0.0f;
        (void)run_off(40u, 0.0f);
    }
}

/* An angle that is back from an outage where it was not expected, as a sensor that read a constant, is where it is now:
 * what the levels would pass on of the jump would be taken for motion. */
/* R33 */
TEST(an_angle_that_is_back_elsewhere_teaches_nothing)
{
    const uint32_t wrong = (uint32_t)LEVER_FAULT_INNOVATION | (uint32_t)LEVER_FAULT_CHANGE |
                           (uint32_t)LEVER_FAULT_MISMATCH | (uint32_t)LEVER_FAULT_BASE;
    run_both(8000u);
    for (uint32_t k = 0u; k < 500u; k++) {
        lever_sample_t sample = sample_after(1u);
        (void)lever_update(other, &sample);
        sample.theta_valid = false;
        (void)lever_update(lever, &sample);
    }
    TEST_ASSERT_EQUAL_UINT32(0u, run_off(2000u, 0.3f) & wrong);
    TEST_ASSERT_FLOAT_WITHIN(0.02f * estimate_of(other).natural_frequency, estimate_of(other).natural_frequency,
        estimate().natural_frequency);
}

/* The pilot moves the lever as fast: rate and angle agree, whatever the filter expected, and no offset is taken. */
TEST(an_angle_that_the_rate_explains_has_no_other_offset)
{
    run_both(8000u);
    for (uint32_t k = 0u; k < 400u; k++) {
        lever_sample_t sample = sample_after(1u);
        const float moved = lesser(1.0e-3f * (float)k, 0.1f); /* at 1 rad/s */
        sample.theta += moved;
        sample.theta_dot += (k < 100u) ? 1.0f : 0.0f;
        (void)lever_update(lever, &sample);
        TEST_ASSERT_FALSE(evidence_has(&lever->estimator.learning.evidence, EVIDENCE_OFFSET));
        TEST_ASSERT_EQUAL_FLOAT(0.0f, lever->estimator.learning.evidence.offset);
    }
}

/* Half of the torque samples are missing. Where somebody else has driven the motor, the torque is then not known, and nothing is
 * learnt from it; where the motor did what it was asked, it still does. */
/* R31 */
TEST(a_missing_torque_is_unknown_where_somebody_else_was_driving)
{
    for (uint32_t other_drives = 0u; other_drives <= 1u; other_drives++) {
        setUp();
        simulation.torque_rms = (other_drives == 1u) ? 0.5 : 0.0;
        (void)run(2000u);
        for (uint32_t k = 0u; k < 30u; k++) { /* longer than an outage */
            lever_sample_t sample = sample_after(1u);
            invalidate(&sample, 2u);
            const float last = lever->estimator.last_tau_m;
            (void)lever_update(lever, &sample);
            TEST_ASSERT_EQUAL_FLOAT((other_drives == 1u) ? last : 0.0f, lever->estimator.last_tau_m);
            TEST_ASSERT_EQUAL(other_drives == 1u, evidence_has(&lever->estimator.learning.evidence, EVIDENCE_MISSING));
        }
        TEST_ASSERT_TRUE(has_fault(LEVER_FAULT_TORQUE));
        (void)run(1u);
        TEST_ASSERT_FALSE(evidence_has(&lever->estimator.learning.evidence, EVIDENCE_MISSING));
        TEST_ASSERT_EQUAL(other_drives == 1u, has_fault(LEVER_FAULT_SETTLING)); /* the level of the torque */
    }
}

/* R30 */
TEST(time_may_wrap_at_2_to_the_32)
{
    const uint32_t shift = UINT32_MAX - 400000u; /* wraps 0.4 s after the start, running */
    for (uint32_t k = 0u; k < 2000u; k++) {
        lever_sample_t sample = sample_after(1u);
        (void)lever_update(lever, &sample);
        sample.time_us += shift;
        (void)lever_update(other, &sample);
    }
    lever_estimate_t wrapped = estimate_of(other);
    const lever_estimate_t plain = estimate();
    TEST_ASSERT_EQUAL_UINT32(plain.time_us + shift, wrapped.time_us);
    wrapped.time_us = plain.time_us;
    TEST_ASSERT_EQUAL_MEMORY(&plain, &wrapped, sizeof plain);
    TEST_ASSERT_EQUAL_UINT32(0u, health_of(other).lost + health_of(other).late);
}
