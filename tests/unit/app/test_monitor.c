/* What makes a signal unbelievable: that it stands still, an output far from what is expected, a response to the base
 * that is not about once what it should be. Each must be found, and none where nothing is wrong. */
#include "app/monitor.h"

#include "random.h"
#include "test.h"

enum { SAMPLES = 20 }; /* in a block */

#define PERIOD 1.0e-3f

static monitor_t monitor;
static random_source_t source;

void setUp(void)
{
    monitor_start(&monitor);
    source.state = 21u;
}

/* --- stuck signals ------------------------------------------------------------------------------------------------ */

static void surprise(double ratio, uint32_t samples)
{
    for (uint32_t k = 0u; k < samples; k++) {
        monitor_add(&monitor, (float)ratio, PERIOD);
    }
}

/* A block at whose end signal `which` is at a value and the others at one never seen before; true when one has just
 * been found stuck. */
static bool block(uint32_t which, float value)
{
    for (uint32_t i = 0u; i < (uint32_t)MONITOR_SIGNALS; i++) {
        const float other = (float)random_normal(&source);
        (void)monitor_is_alive(&monitor, (enum monitor_signal)i, (i == which) ? value : other);
    }
    return monitor_has_just_stuck(&monitor);
}

static bool is_alive(uint32_t which, float value)
{
    return monitor_is_alive(&monitor, (enum monitor_signal)which, value);
}

/* 100 ms without a change, when the innovations say that something is wrong; said once, and no longer as soon as it
 * changes. */
/* R32 */
TEST(a_signal_that_stands_still_against_the_innovations_is_stuck)
{
    for (uint32_t which = 0u; which < (uint32_t)MONITOR_SIGNALS; which++) {
        setUp();
        TEST_ASSERT_FALSE(block(which, 0.5f));
        surprise(4.0, 300u);
        for (uint32_t k = 0u; k < 4u; k++) {
            TEST_ASSERT_TRUE(!block(which, 0.5f) && is_alive(which, 0.5f));
        }
        TEST_ASSERT_TRUE(block(which, 0.5f));
        TEST_ASSERT_TRUE(!is_alive(which, 0.5f) && monitor_has_stuck(&monitor));
        surprise(1.0, 1000u); /* without the signal nothing surprises any more */
        TEST_ASSERT_TRUE(!block(which, 0.5f) && !is_alive(which, 0.5f));
        TEST_ASSERT_FALSE(is_alive(which, 0.6f)); /* until the end of the block */
        TEST_ASSERT_FALSE(block(which, 0.6f));
        TEST_ASSERT_TRUE(is_alive(which, 0.6f) && !monitor_has_stuck(&monitor));
    }
}

/* Its sender says so itself: then it is missing, not stuck, however long, and counts anew when it is back. */
TEST(a_signal_that_is_not_sent_or_not_valid_is_not_stuck)
{
    surprise(4.0, 300u);
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_FALSE(block((uint32_t)MONITOR_THETA, 0.5f));
    }
    for (uint32_t k = 0u; k < 50u; k++) {
        TEST_ASSERT_FALSE(monitor_has_just_stuck(&monitor));
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_FALSE(block((uint32_t)MONITOR_THETA, 0.5f));
    }
    TEST_ASSERT_TRUE(block((uint32_t)MONITOR_THETA, 0.5f));
    TEST_ASSERT_FALSE(monitor_has_just_stuck(&monitor) || monitor_has_stuck(&monitor));
}

/* Innovations tell it late of the base acceleration; but one that has changed in 20 blocks on end never
 * stands still. */
TEST(a_base_acceleration_that_always_changed_is_stuck_without_the_innovations)
{
    for (uint32_t changes = 19u; changes <= 20u; changes++) {
        bool stuck = false;
        setUp();
        for (uint32_t k = 0u; k < changes; k++) {
            stuck = block((uint32_t)MONITOR_Z_DDOT, 1.0f + (float)k) || stuck;
        }
        for (uint32_t k = 0u; k < 10u; k++) {
            stuck = block((uint32_t)MONITOR_Z_DDOT, (float)changes) || stuck;
        }
        TEST_ASSERT_EQUAL(changes == 20u, stuck);
        for (uint32_t k = 0u; k < 18u; k++) { /* having stood still, it is not taken for granted any more */
            (void)block((uint32_t)MONITOR_Z_DDOT, 0.5f + (float)k);
        }
        for (uint32_t k = 0u; k < 10u; k++) {
            TEST_ASSERT_FALSE(block((uint32_t)MONITOR_Z_DDOT, 0.1f));
        }
    }
}

TEST(an_angle_that_stands_still_without_a_surprise_rests)
{
    for (uint32_t k = 0u; k < 50u; k++) {
        TEST_ASSERT_FALSE(block((uint32_t)MONITOR_THETA, (k < 25u) ? (float)k : 0.5f));
    }
}

TEST(surprise_is_the_mean_of_nis_over_a_tenth_of_a_second)
{
    surprise(3.0, 100u);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 1.0 + (2.0 * (1.0 - exp(-1.0))), (double)monitor.surprise);
    monitor_start(&monitor);
    surprise(1.0e3, 1u);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, 1.0f + (0.01f * 99.0f), monitor.surprise);
    monitor_add(&monitor, 2.0f, 10.0f);
    TEST_ASSERT_TRUE(monitor.surprise == 2.0f);
}

/* --- spikes ------------------------------------------------------------------------------------------------------- */

/* Output i so many standard deviations off: of its state 3 in the directions of the parameters and 4 in its own, so 5,
 * and 12 of its noise, so 13 in all; in mrad, or 0.01 rad/s. */
static bool is_spike(uint32_t i, float sigmas, float level)
{
    static const cdkf_t cdkf = {.x = {0.1f, -0.2f},
        .s = {[9] = 2.0e-3f, 1.0e-3f, 2.0e-3f, 0.02f, 0.01f, 0.02f},
        .s_xx = {4.0e-3f, 0.0f, 0.0f, 0.04f},
        .output_noise = {12.0e-3f, 0.12f}};
    const float sigma = (i == 0u) ? 13.0e-3f : 0.13f;
    return monitor_is_spike(&monitor, &cdkf, i, cdkf.x[i] + (sigmas * sigma), level, PERIOD);
}

/* R34 */
TEST(an_output_beyond_eight_standard_deviations_is_refused)
{
    for (uint32_t i = 0u; i < (uint32_t)CDKF_OUTPUTS; i++) {
        TEST_ASSERT_TRUE(!is_spike(i, 7.9f, 1.0f) && !is_spike(i, -7.9f, 1.0f));
        TEST_ASSERT_TRUE(is_spike(i, 8.1f, 1.0f) && is_spike(i, -8.1f, 1.0f));
        TEST_ASSERT_TRUE(
            !is_spike(i, 15.8f, 4.0f) && is_spike(i, 16.2f, 4.0f)); /* innovations are twice as large anyway */
    }
}

TEST(what_lasts_for_20_ms_is_no_spike)
{
    for (uint32_t repeat = 0u; repeat < 3u; repeat++) {
        for (uint32_t k = 0u; k < 19u; k++) {
            TEST_ASSERT_TRUE(is_spike(0u, 100.0f, 1.0f));
            TEST_ASSERT_FALSE(is_spike(1u, 1.0f, 1.0f));
        }
        TEST_ASSERT_FALSE(is_spike(0u, (repeat == 1u) ? 1.0f : 100.0f, 1.0f) && (repeat == 1u));
        (void)is_spike(0u, 100.0f, 1.0f);
        TEST_ASSERT_EQUAL(repeat == 1u, is_spike(0u, 100.0f, 1.0f));
        TEST_ASSERT_TRUE(is_spike(1u, 100.0f, 1.0f)); /* each output for itself */
        TEST_ASSERT_FALSE(is_spike(0u, 1.0f, 1.0f) || is_spike(1u, 1.0f, 1.0f));
    }
}

/* --- the base ----------------------------------------------------------------------------------------------------- */

/* Blocks with the base acceleration so many times the measured one, of which the filter expects it once, or not at all
 * while it is not used: the score is of the gain's error. The response is known to 1 / sqrt(rate) in a second. Returns
 * how often it has been said that it is wrong. */
static uint32_t respond(uint32_t blocks, double gain, double rate)
{
    uint32_t said = 0u;
    for (uint32_t k = 0u; k < blocks; k++) {
        const double information = rate * (double)SAMPLES * (double)PERIOD;
        const double error = (monitor.base_wrong ? 0.0 : 1.0) - gain;
        const score_t sudden = {
            (float)((information * error) + (sqrt(information) * random_normal(&source))), (float)information};
        said += monitor_step(&monitor, &sudden, (float)SAMPLES * PERIOD) ? 1u : 0u;
    }
    return said;
}

/* No sensor, the wrong sign, the wrong unit: within a second, said once; and used again within one when it is right. */
/* R33 */
TEST(a_wrong_base_is_found_and_trusted_again)
{
    const double gains[] = {0.0, -1.0, 9.81, 2.0};
    for (uint32_t k = 0u; k < 4u; k++) {
        setUp();
        (void)respond(500u, 1.0, 1000.0);
        TEST_ASSERT_EQUAL_UINT32(1u, respond(50u, gains[k], 1000.0));
        TEST_ASSERT_EQUAL_UINT32(0u, respond(5000u, gains[k], 1000.0));
        TEST_ASSERT_TRUE(monitor.base_wrong);
        TEST_ASSERT_EQUAL_UINT32(0u, respond(50u, 1.0, 1000.0));
        TEST_ASSERT_FALSE(monitor.base_wrong);
        TEST_ASSERT_EQUAL_UINT32(0u, respond(5000u, 1.0, 1000.0));
    }
}

/* Gains between: not wrong enough to be refused, not right enough to be trusted again. */
TEST(the_verdict_on_the_base_has_hysteresis)
{
    const double gains[] = {0.55, 1.45};
    const double beyond[] = {0.0, 9.81};
    for (uint32_t k = 0u; k < 2u; k++) {
        setUp();
        TEST_ASSERT_EQUAL_UINT32(0u, respond(500u, gains[k], 1.0e5));
        (void)respond(100u, beyond[k], 1.0e5);
        TEST_ASSERT_TRUE(monitor.base_wrong);
        (void)respond(500u, gains[k], 1.0e5);
        TEST_ASSERT_TRUE(monitor.base_wrong);
    }
}

/* Two seconds of samples of 1 ms in blocks of 20: asked is a sine of 3 Hz, measured a gain times that and a sine of 4 Hz.
 * Returns after how many blocks it was wrong, 0: never. */
static uint32_t torque_wrong_after(monitor_t *of, double amplitude, double gain, double other)
{
    uint32_t after = 0u;
    for (uint32_t block = 1u; block <= 100u; block++) {
        for (uint32_t k = 0u; k < 20u; k++) {
            const double time = 1.0e-3 * (double)((20u * block) + k);
            const double asked = amplitude * sin(6.283185307 * 3.0 * time);
            const double measured = (gain * asked) + (other * sin(6.283185307 * 4.0 * time));
            if (monitor_takes_torque(k)) {
                monitor_add_torque(of, (float)asked, (float)measured);
            }
        }
        if (monitor_judge_torque(of, 0.02f, 1.0e-3f) && (after == 0u)) {
            after = block;
        }
    }
    return after;
}

TEST(a_torque_that_does_not_follow_what_is_asked_is_wrong)
{
    static const struct {
        double amplitude;
        double gain;
        double other;
        bool wrong;
    } row[] = {{0.3, 1.0, 0.0, false}, {0.3, 0.8, 0.0, false}, {0.3, 1.25, 0.0, false}, {0.3, 0.5, 0.0, true},
        {0.3, 2.0, 0.0, true}, {0.3, -1.0, 0.0, true}, {0.3, 0.0, 0.0, true}, {0.3, 1.0, 0.6, false},
        {0.3, 0.0, 0.3, false}, {0.02, -1.0, 0.0, false}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        monitor_t fresh;
        monitor_start(&fresh);
        TEST_ASSERT_EQUAL_UINT32(0u, torque_wrong_after(&fresh, row[i].amplitude, 1.0, 0.0));
        TEST_ASSERT_EQUAL(row[i].wrong, torque_wrong_after(&fresh, row[i].amplitude, row[i].gain, row[i].other) != 0u);
        TEST_ASSERT_EQUAL(row[i].wrong, fresh.torque_wrong);
    }
}

TEST(a_torque_that_follows_again_is_right_and_without_dither_nothing_is_said)
{
    monitor_t fresh;
    monitor_start(&fresh);
    (void)torque_wrong_after(&fresh, 0.3, 1.0, 0.0);
    TEST_ASSERT_LESS_THAN_UINT32(60u, torque_wrong_after(&fresh, 0.3, 2.0, 0.0));
    TEST_ASSERT_TRUE(fresh.torque_wrong);
    (void)torque_wrong_after(&fresh, 0.3, 1.0, 0.0);
    TEST_ASSERT_FALSE(fresh.torque_wrong);
    (void)torque_wrong_after(&fresh, 0.3, -1.0, 0.0);
    TEST_ASSERT_TRUE(fresh.torque_wrong);
    for (uint32_t k = 0u; k < 5u; k++) {
        (void)torque_wrong_after(&fresh, 0.0, 0.0, 0.2);
    }
    TEST_ASSERT_FALSE(fresh.torque_wrong);
}

/* Sums forget with 0.5 s, and while the base is wrong with 0.2 s; from a standard deviation of 0.1 on, and 0.35, they
 * count: of a gain of 0 and of 1. */
TEST(the_verdict_on_the_base_waits_until_it_is_sure)
{
    static const struct {
        float information;
        float period;
        bool before;
        bool is;
        float kept;
    } row[] = {{50.0f, 0.02f, false, false, 48.0f}, {5.0f, 0.02f, true, true, 4.5f}, {99.0f, 0.0f, false, false, 99.0f},
        {101.0f, 0.0f, false, true, 0.0f}, {8.0f, 0.0f, true, true, 8.0f}, {8.3f, 0.0f, true, false, 0.0f}};
    static const score_t nothing = {0.0f, 0.0f};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        setUp();
        monitor.base_wrong = row[i].before;
        monitor.base.information = row[i].information;
        monitor.base.vector = row[i].before ? -row[i].information : row[i].information;
        (void)monitor_step(&monitor, &nothing, row[i].period);
        TEST_ASSERT_EQUAL(row[i].is, monitor.base_wrong);
        TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, row[i].kept, monitor.base.information);
    }
    monitor.base_wrong = true;
    monitor.base.information = 1.0f;
    monitor_trust_base(&monitor);
    TEST_ASSERT_TRUE(!monitor.base_wrong && (monitor.base.information == 0.0f));
}

/* Sums over samples of 1 ms of which every eighth counts: from 0.025 on they say something. A quarter off is right
 * again. */
TEST(the_verdict_on_the_torque_waits_until_enough_is_asked)
{
    static const struct {
        float asked;
        float gain;
        float sample_period;
        bool before;
        bool is;
    } row[] = {{0.024f, -1.0f, 1.0e-3f, false, false}, {0.026f, -1.0f, 1.0e-3f, false, true},
        {4.0e-4f, -1.0f, 0.0625f, false, false}, {0.0f, 1.0f, 1.0e-3f, true, false},
        {1.0f, 0.75f, 1.0e-3f, true, false}, {1.0f, 0.74f, 1.0e-3f, true, true}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        const float product = row[i].gain * row[i].asked;
        setUp();
        monitor.torque = (agreement_t){row[i].asked, row[i].gain * product, product};
        monitor.torque_wrong = row[i].before;
        (void)monitor_judge_torque(&monitor, 0.02f, row[i].sample_period);
        TEST_ASSERT_EQUAL(row[i].is, monitor.torque_wrong);
    }
}

/* --- jumps of inputs ---------------------------------------------------------------------------------------------- */

/* Motion of 0.3 N m at 10 Hz, and every fiftieth sample 30 N m off; a step is believed after 20 ms. */
/* R31 */
TEST(an_input_far_from_where_it_was_is_a_jump_for_20_ms)
{
    float last = 0.0f;
    uint32_t refused = 0u;
    for (uint32_t k = 1u; k <= 5000u; k++) {
        const bool off = ((k % 50u) == 0u);
        const float value = (0.42f * (float)sin(0.0628 * (double)k)) + (off ? 30.0f : 0.0f);
        const bool jump = monitor_is_jump(&monitor, MONITOR_TORQUE, value - last, PERIOD);
        TEST_ASSERT_EQUAL(off, jump);
        last = jump ? last : value;
    }
    while (monitor_is_jump(&monitor, MONITOR_TORQUE, 1.0f, PERIOD)) {
        refused++;
    }
    TEST_ASSERT_UINT32_WITHIN(1u, 19u, refused);
    TEST_ASSERT_FALSE(monitor_is_jump(&monitor, MONITOR_BASE, 1.9f, PERIOD)); /* does no harm */
    TEST_ASSERT_TRUE(monitor_is_jump(&monitor, MONITOR_BASE, 2.1f, PERIOD));
}
