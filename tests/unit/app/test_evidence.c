/* Each item of evidence must be found, within its time and with its hysteresis, and nothing where nothing is wrong. */
#include "app/evidence.h"
#include "lever_cdkf.h"

#include "random.h"
#include "test.h"

#include <math.h>
#include <string.h>

enum { SAMPLES = 20 }; /* in a block */

#define PERIOD 1.0e-3f

static evidence_t evidence;
static setup_t setup;
static lever_config_t config;
static cdkf_t cdkf;
static random_source_t source;
static float surprise; /* nis / nis_size of the samples of the next blocks; 0: none has an output */

void setUp(void)
{
    lever_config_default(&config);
    setup.settings = &config.settings;
    setup.model = (uint8_t)LEVER_MODEL_LEVER;
    setup.constants.inertia = 1.0f;
    (void)memset(&cdkf, 0, sizeof cdkf);
    cdkf.trust = 1.0f;
    cdkf.scaling.prior = (prior_t){.sigma = {0.5f, 0.5f, 0.5f}};
    cdkf.scaling.positive = true;
    evidence_start(&evidence);
    source.state = 21u;
    surprise = 0.0f;
}

/* --- stuck signals ------------------------------------------------------------------------------------------------ */

/* The end of a block of an arm that is known. */
static void end_block(void)
{
    const evidence_block_t block = {
        .setup = &setup, .period = (float)SAMPLES * PERIOD, .known = true, .verdict = (uint8_t)VERDICT_REST};
    for (uint32_t k = 0u; (k < (uint32_t)SAMPLES) && (surprise > 0.0f); k++) {
        evidence_add_nis(&evidence, surprise);
    }
    evidence_end_block(&evidence, &cdkf, &block);
}

/* But for EXCITATION: motion is not fed here. */
static uint32_t faults_shown(void)
{
    return evidence.faults & ~(uint32_t)LEVER_FAULT_EXCITATION;
}

static bool is_stuck(void)
{
    return evidence_has(&evidence, EVIDENCE_THETA_STUCK) || evidence_has(&evidence, EVIDENCE_THETA_DOT_STUCK) ||
           evidence_has(&evidence, EVIDENCE_BASE_STUCK);
}

static bool has_just_stuck(void)
{
    const bool before = is_stuck();
    end_block();
    return is_stuck() && !before;
}

/* A block at whose end signal `which` is at a value and the others at one never seen before; true when one has just
 * been found stuck. */
static bool block(uint32_t which, float value)
{
    for (uint32_t i = 0u; i < (uint32_t)SIGNAL_COUNT; i++) {
        const float other = (float)random_normal(&source);
        (void)evidence_sees(&evidence, (enum signal)i, (i == which) ? value : other);
    }
    return has_just_stuck();
}

static bool is_alive(uint32_t which, float value)
{
    return evidence_sees(&evidence, (enum signal)which, value);
}

/* 100 ms without a change, when the innovations say that something is wrong; said once, and no longer as soon as it
 * changes. */
/* R32 */
TEST(a_signal_that_stands_still_against_the_innovations_is_stuck)
{
    for (uint32_t which = 0u; which < (uint32_t)SIGNAL_COUNT; which++) {
        setUp();
        TEST_ASSERT_FALSE(block(which, 0.5f));
        surprise = 4.0f;
        for (uint32_t k = 0u; k < 4u; k++) {
            TEST_ASSERT_TRUE(!block(which, 0.5f) && is_alive(which, 0.5f));
        }
        TEST_ASSERT_TRUE(block(which, 0.5f));
        TEST_ASSERT_TRUE(!is_alive(which, 0.5f) && is_stuck());
        surprise = 1.0f; /* without the signal nothing surprises any more */
        TEST_ASSERT_TRUE(!block(which, 0.5f) && !is_alive(which, 0.5f));
        TEST_ASSERT_FALSE(is_alive(which, 0.6f)); /* until the end of the block */
        TEST_ASSERT_FALSE(block(which, 0.6f));
        TEST_ASSERT_TRUE(is_alive(which, 0.6f) && !is_stuck());
    }
}

/* Its sender says so itself: then it is missing, not stuck, however long, and counts anew when it is back. */
TEST(a_signal_that_is_not_sent_or_not_valid_is_not_stuck)
{
    surprise = 4.0f;
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_FALSE(block((uint32_t)SIGNAL_THETA, 0.5f));
    }
    for (uint32_t k = 0u; k < 50u; k++) {
        TEST_ASSERT_FALSE(has_just_stuck());
    }
    for (uint32_t k = 0u; k < 4u; k++) {
        TEST_ASSERT_FALSE(block((uint32_t)SIGNAL_THETA, 0.5f));
    }
    TEST_ASSERT_TRUE(block((uint32_t)SIGNAL_THETA, 0.5f));
    TEST_ASSERT_FALSE(has_just_stuck() || is_stuck());
}

/* Innovations tell it late of the base acceleration; but one that has changed in 20 blocks on end never
 * stands still. */
TEST(a_base_acceleration_that_always_changed_is_stuck_without_the_innovations)
{
    for (uint32_t changes = 19u; changes <= 20u; changes++) {
        bool stuck = false;
        setUp();
        for (uint32_t k = 0u; k < changes; k++) {
            stuck = block((uint32_t)SIGNAL_BASE, 1.0f + (float)k) || stuck;
        }
        for (uint32_t k = 0u; k < 10u; k++) {
            stuck = block((uint32_t)SIGNAL_BASE, (float)changes) || stuck;
        }
        TEST_ASSERT_EQUAL(changes == 20u, stuck);
        for (uint32_t k = 0u; k < 18u; k++) { /* having stood still, it is not taken for granted any more */
            (void)block((uint32_t)SIGNAL_BASE, 0.5f + (float)k);
        }
        for (uint32_t k = 0u; k < 10u; k++) {
            TEST_ASSERT_FALSE(block((uint32_t)SIGNAL_BASE, 0.1f));
        }
    }
}

TEST(an_angle_that_stands_still_without_a_surprise_rests)
{
    for (uint32_t k = 0u; k < 50u; k++) {
        TEST_ASSERT_FALSE(block((uint32_t)SIGNAL_THETA, (k < 25u) ? (float)k : 0.5f));
    }
}

TEST(the_fast_mean_of_nis_is_over_a_tenth_of_a_second)
{
    surprise = 3.0f;
    for (uint32_t k = 0u; k < 5u; k++) {
        end_block();
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 1.0 + (2.0 * (1.0 - exp(-1.0))), (double)evidence.nis_fast);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 1.0 + (2.0 * (1.0 - pow(0.8, 5.0))), (double)evidence.nis_fast);
}

/* A single sample counts as at most 100, and a block without an output not at all. */
TEST(the_means_of_nis_take_the_mean_of_a_block)
{
    evidence_block_t block = {.setup = &setup, .period = 0.02f};
    evidence_add_nis(&evidence, 1.0e3f);
    for (uint32_t k = 0u; k < 3u; k++) {
        evidence_add_nis(&evidence, 2.0f);
    }
    evidence_end_block(&evidence, &cdkf, &block);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 1.0f + (0.2f * 25.5f), evidence.nis_fast);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 1.0f + ((0.02f / config.settings.excitation_time) * 25.5f), evidence.nis_slow);
    const evidence_t before = evidence;
    evidence_end_block(&evidence, &cdkf, &block);
    TEST_ASSERT_TRUE((evidence.nis_fast == before.nis_fast) && (evidence.nis_slow == before.nis_slow));
    evidence_note(&evidence, EVIDENCE_UNSETTLED, true);
    evidence_add_nis(&evidence, 2.0f);
    block.period = 10.0f;
    evidence_end_block(&evidence, &cdkf, &block);
    TEST_ASSERT_TRUE((evidence.nis_fast == 2.0f) && (evidence.nis_slow == before.nis_slow));
}

/* --- spikes ------------------------------------------------------------------------------------------------------- */

/* Output i so many standard deviations off: of its state 3 in the directions of the parameters and 4 in its own, so 5,
 * and 12 of its noise, so 13 in all; in mrad, or 0.01 rad/s. */
static bool is_spike(uint32_t i, float sigmas, float level)
{
    static const cdkf_t belief = {.x = {0.1f, -0.2f},
        .s = {[9] = 2.0e-3f, 1.0e-3f, 2.0e-3f, 0.02f, 0.01f, 0.02f},
        .s_xx = {4.0e-3f, 0.0f, 0.0f, 0.04f},
        .output_noise = {12.0e-3f, 0.12f}};
    const float sigma = (i == 0u) ? 13.0e-3f : 0.13f;
    return evidence_refuses_output(&evidence, &belief, i, belief.x[i] + (sigmas * sigma), level, PERIOD);
}

/* R34 */
TEST(a_rate_before_an_outage_says_nothing_of_motion_after_it)
{
    evidence_start(&evidence);
    evidence_add_motion(&evidence, 1u, 2.0f, PERIOD, PERIOD);
    evidence_add_motion(&evidence, 1u, 2.0f, TRIM_OUTAGE, PERIOD);
    surprise = 1.0f;
    end_block();
    TEST_ASSERT_TRUE((evidence.motion.fast == 0.0f) && (evidence.motion.slow == 0.0f));
    for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
        evidence_add_motion(&evidence, 1u, ((k % 2u) == 0u) ? 3.0f : 2.0f, PERIOD, PERIOD);
    }
    end_block();
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, 0.2f * 6.0f, evidence.motion.fast);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, (0.02f / config.settings.excitation_time) * 6.0f, evidence.motion.slow);
    for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) { /* noise: of no sign */
        evidence_add_motion(&evidence, 1u, ((k % 2u) == 0u) ? 30.0f : -30.0f, PERIOD, PERIOD);
    }
    end_block();
    TEST_ASSERT_TRUE((evidence.motion.fast < 0.0f) && (evidence.motion.slow == 0.0f));
}

/* Samples of the longest sample_period that come a little late. */
TEST(a_sample_that_follows_the_last_one_says_something_of_motion)
{
    static const float elapsed[] = {0.021f, 0.029f, 0.031f};
    config.settings.sample_period = 0.02f;
    for (uint32_t k = 0u; k < 3u; k++) {
        evidence_start(&evidence);
        evidence_add_motion(&evidence, 1u, 1.0f, elapsed[k], config.settings.sample_period);
        evidence_add_motion(&evidence, 1u, 1.0f, elapsed[k], config.settings.sample_period);
        TEST_ASSERT_EQUAL(k < 2u, evidence.motion.sum > 0.0f);
    }
}

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
        const bool before = evidence_has(&evidence, EVIDENCE_BASE);
        const double error = (before ? 0.0 : 1.0) - gain;
        considered_t *considered = &cdkf.considered[CDKF_BASE_GAIN];
        considered->vector = (float)((information * error) + (sqrt(information) * random_normal(&source)));
        considered->information = (float)information;
        end_block();
        said += (evidence_has(&evidence, EVIDENCE_BASE) && !before) ? 1u : 0u;
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
        TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_BASE));
        TEST_ASSERT_EQUAL_UINT32(0u, respond(50u, 1.0, 1000.0));
        TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_BASE));
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
        TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_BASE));
        (void)respond(500u, gains[k], 1.0e5);
        TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_BASE));
    }
}

/* A lever that swings at 3 Hz, as its two sensors see it. */
typedef struct swing {
    double amplitude; /* [rad] */
    double gain;      /* of the angle */
    double rate_gain;
    double offset; /* of the rate [rad/s] */
    double late;   /* by which the rate is later than the angle [s] */
    double noise;  /* of the angle [rad] */
    double jump;   /* of the angle at half of the time [rad] */
    bool alone;    /* the rate is measured only each other sample */
} swing_t;

static float previous[CDKF_OUTPUTS]; /* the sample */

/* Two seconds of it. Returns after how many blocks angle and rate did not agree, 0: they did all the time. */
static uint32_t apart_after(swing_t swing)
{
    const double omega = 6.283185307 * 3.0;
    uint32_t after = 0u;
    for (uint32_t block = 1u; block <= 100u; block++) {
        for (uint32_t k = 0u; k < (uint32_t)SAMPLES; k++) {
            const double time = 1.0e-3 * (double)((20u * block) + k);
            const double rest = 0.35 + ((block > 50u) ? swing.jump : 0.0);
            const double angle = rest + (swing.gain * swing.amplitude * sin(omega * time));
            const double rate = swing.rate_gain * swing.amplitude * omega * cos(omega * (time - swing.late));
            const float y[] = {(float)(angle + (swing.noise * random_normal(&source))), (float)(rate + swing.offset)};
            evidence_add_outputs(&evidence, previous, y, !swing.alone || ((k % 2u) == 0u), PERIOD, PERIOD);
            (void)memcpy(previous, y, sizeof previous);
        }
        const bool before = evidence_has(&evidence, EVIDENCE_KINEMATICS);
        end_block();
        if (evidence_has(&evidence, EVIDENCE_KINEMATICS) && !before && (after == 0u)) {
            after = block;
        }
    }
    return after;
}

static const swing_t agreeing = {.amplitude = 0.01, .gain = 1.0, .rate_gain = 1.0, .noise = 5.0e-4};

/* R33 */
TEST(an_angle_that_is_not_the_integral_of_the_rate_is_found_within_a_second)
{
    static const double gains[][2] = {
        {1.3, 1.0}, {0.7, 1.0}, {0.0, 1.0}, {2.0, 1.0}, {1.0, -1.0}, {1.0, 0.5}, {1.0, 1.5}};
    for (uint32_t i = 0u; i < (sizeof gains / sizeof gains[0]); i++) {
        setUp();
        swing_t swing = agreeing;
        TEST_ASSERT_EQUAL_UINT32(0u, apart_after(swing));
        swing.gain = gains[i][0];
        swing.rate_gain = gains[i][1];
        const uint32_t after = apart_after(swing);
        TEST_ASSERT_TRUE((after >= 1u) && (after <= 30u));
        evidence_show(&evidence);
        TEST_ASSERT_EQUAL_HEX32(LEVER_FAULT_THETA | LEVER_FAULT_THETA_DOT, faults_shown());
        (void)apart_after(agreeing);
        TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_KINEMATICS));
    }
}

/* As of a clock that is 10 % fast or slow. */
TEST(a_gain_that_is_off_by_a_tenth_is_found_within_two_seconds)
{
    static const double gains[] = {0.9, 1.1};
    for (uint32_t i = 0u; i < 2u; i++) {
        setUp();
        swing_t swing = agreeing;
        swing.rate_gain = gains[i];
        TEST_ASSERT_TRUE(apart_after(swing) != 0u);
    }
}

/* Offsets, delays, noise and jumps of the one or the other, a gain within 4 %, and what was not measured together, say
 * nothing of the gain; nor does too little motion. */
TEST(what_is_no_gain_of_angle_or_rate_is_not_taken_for_one)
{
    static const swing_t swings[] = {{0.01, 1.0, 1.0, 0.05, 0.0, 5.0e-4, 0.0, false},
        {0.01, 1.0, 1.0, 0.0, 0.01, 5.0e-4, 0.0, false}, {0.01, 1.0, 1.0, 0.0, 0.0, 1.0e-2, 0.0, false},
        {0.01, 1.0, 1.0, 0.0, 0.0, 5.0e-4, 0.1, false}, {0.01, 1.04, 1.0, 0.0, 0.0, 5.0e-4, 0.0, false},
        {0.01, 0.96, 1.0, 0.0, 0.0, 5.0e-4, 0.0, false}, {0.01, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0, true}};
    for (uint32_t i = 0u; i < (sizeof swings / sizeof swings[0]); i++) {
        setUp();
        TEST_ASSERT_EQUAL_UINT32(0u, apart_after(agreeing));
        TEST_ASSERT_EQUAL_UINT32(0u, apart_after(swings[i]));
    }
    setUp();
    TEST_ASSERT_EQUAL_UINT32(0u, apart_after((swing_t){.amplitude = 0.001, .gain = 2.0, .rate_gain = 1.0}));
}

TEST(a_motion_of_a_milliradian_is_the_least_that_says_anything)
{
    static const double amplitudes[] = {0.0013, 0.0017}; /* 0.93 of it passes, over the root of two */
    for (uint32_t i = 0u; i < 2u; i++) {
        setUp();
        const swing_t swing = {.amplitude = amplitudes[i], .gain = 2.0, .rate_gain = 1.0};
        TEST_ASSERT_EQUAL(i == 1u, apart_after(swing) != 0u);
    }
}

/* And it says nothing of the base while it is there, nor ends without motion. */
TEST(angle_and_rate_that_do_not_agree_say_nothing_of_the_base)
{
    swing_t swing = agreeing;
    swing.gain = 2.0;
    (void)apart_after(swing);
    evidence.base = (score_t){-100.0f, 100.0f};
    end_block();
    TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_BASE));
    swing.amplitude = 0.0;
    (void)apart_after(swing);
    TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_KINEMATICS));
}

/* Without motion nothing would ever say that a sensor is right again, and torque, which might, waits for that. */
/* R35 */
TEST(what_nothing_confirms_for_half_a_minute_holds_no_more)
{
    static const enum evidence_id which[] = {EVIDENCE_KINEMATICS, EVIDENCE_BASE};
    for (uint32_t i = 0u; i < (sizeof which / sizeof which[0]); i++) {
        for (uint32_t k = 0u; k < 2u; k++) {
            setUp();
            evidence_note(&evidence, which[i], true);
            for (uint32_t n = 0u; n < (1490u + (20u * k)); n++) {
                end_block();
            }
            TEST_ASSERT_EQUAL(k == 0u, evidence_has(&evidence, which[i]));
        }
    }
}

/* Two seconds of samples of 1 ms in blocks of 20: asked is a sine of 3 Hz, measured a gain times that, a sine of 4 Hz
 * and a bias. Returns after how many blocks it was wrong, 0: never. */
static uint32_t torque_wrong_with_bias(double amplitude, double gain, double other, double bias)
{
    uint32_t after = 0u;
    for (uint32_t block = 1u; block <= 100u; block++) {
        for (uint32_t k = 0u; k < 20u; k++) {
            const double time = 1.0e-3 * (double)((20u * block) + k);
            const double asked = amplitude * sin(6.283185307 * 3.0 * time);
            const double measured = (gain * asked) + (other * sin(6.283185307 * 4.0 * time)) + bias;
            evidence_follow_command(&evidence, (float)asked, 1.0f);
            if ((k % (uint32_t)EVIDENCE_TORQUE_EVERY) == 0u) {
                evidence_add_torque(&evidence, (float)measured);
            }
        }
        const bool before = evidence_has(&evidence, EVIDENCE_MOTOR);
        end_block();
        if (evidence_has(&evidence, EVIDENCE_MOTOR) && !before && (after == 0u)) {
            after = block;
        }
    }
    return after;
}

static uint32_t torque_wrong_after(double amplitude, double gain, double other)
{
    return torque_wrong_with_bias(amplitude, gain, other, 0.0);
}

/* A bias of the sensor, or a constant torque, neither hides a motor that does other than it is asked nor is one. */
/* R37 */
TEST(a_bias_of_the_torque_hides_no_motor)
{
    static const double gain[] = {-1.0, 0.0, 2.0, 1.0};
    for (uint32_t i = 0u; i < (sizeof gain / sizeof gain[0]); i++) {
        setUp();
        (void)torque_wrong_with_bias(0.3, 1.0, 0.0, 1.0);
        TEST_ASSERT_EQUAL_UINT32(0u, torque_wrong_with_bias(0.3, 1.0, 0.0, 1.0));
        (void)torque_wrong_with_bias(0.3, gain[i], 0.0, 1.0);
        TEST_ASSERT_EQUAL(gain[i] != 1.0, evidence_has(&evidence, EVIDENCE_MOTOR));
    }
}

/* It holds one value from now on, which may be far from the last. */
/* R32 */
TEST(a_torque_that_stays_what_it_is_is_wrong)
{
    setUp();
    (void)torque_wrong_after(0.3, 1.0, 0.0);
    TEST_ASSERT_UINT32_WITHIN(35u, 40u, torque_wrong_with_bias(0.3, 0.0, 0.0, 0.3));
    TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_MOTOR));
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
        setUp();
        TEST_ASSERT_EQUAL_UINT32(0u, torque_wrong_after(row[i].amplitude, 1.0, 0.0));
        TEST_ASSERT_EQUAL(row[i].wrong, torque_wrong_after(row[i].amplitude, row[i].gain, row[i].other) != 0u);
        TEST_ASSERT_EQUAL(row[i].wrong, evidence_has(&evidence, EVIDENCE_MOTOR));
    }
}

TEST(a_torque_that_follows_again_is_right_and_without_dither_nothing_is_said)
{
    (void)torque_wrong_after(0.3, 1.0, 0.0);
    TEST_ASSERT_LESS_THAN_UINT32(60u, torque_wrong_after(0.3, 2.0, 0.0));
    TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_MOTOR));
    (void)torque_wrong_after(0.3, 1.0, 0.0);
    TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_MOTOR));
    (void)torque_wrong_after(0.3, -1.0, 0.0);
    TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_MOTOR));
    for (uint32_t k = 0u; k < 5u; k++) {
        (void)torque_wrong_after(0.0, 0.0, 0.2);
    }
    TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_MOTOR));
}

/* A measured torque, or a motor, that is off by less than makes the verdict. */
/* R33 */
TEST(a_gain_of_the_torque_that_is_off_by_a_fifth_shows_within_two_seconds)
{
    static const struct {
        double gain;
        double other;
        bool shown;
    } row[] = {{1.0, 0.0, false}, {0.7, 0.0, true}, {0.8, 0.0, true}, {0.88, 0.0, false}, {1.25, 0.0, true},
        {1.12, 0.0, false}, {0.8, 0.3, false}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        setUp();
        (void)torque_wrong_after(0.3, 1.0, 0.0);
        TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_TORQUE_GAIN));
        TEST_ASSERT_EQUAL_UINT32(0u, torque_wrong_after(0.3, row[i].gain, row[i].other));
        evidence_show(&evidence);
        TEST_ASSERT_EQUAL(row[i].shown, evidence_has(&evidence, EVIDENCE_TORQUE_GAIN));
        TEST_ASSERT_EQUAL_HEX32(row[i].shown ? LEVER_FAULT_CALIBRATION : 0u, faults_shown());
    }
}

/* --- the clock ---------------------------------------------------------------------------------------------------- */

/* Blocks of so many sample periods that take so much time, until the evidence of the clock is as wanted [s]. */
static float clock_until(bool wanted, uint32_t periods, float rate)
{
    float time = 0.0f;
    while ((evidence_has(&evidence, EVIDENCE_CLOCK) != wanted) && (time < 10.0f)) {
        const evidence_block_t block = {.setup = &setup,
            .period = rate * ((float)periods * PERIOD),
            .known = true,
            .verdict = (uint8_t)VERDICT_REST};
        for (uint32_t k = 0u; k < periods; k++) {
            evidence_add_time(&evidence, rate * PERIOD, PERIOD);
        }
        evidence_end_block(&evidence, &cdkf, &block);
        time += block.period;
    }
    return time;
}

/* Blocks may be of any length. 5 % are allowed; of 7 % the mean over 0.25 s is 5 after 0.25 ln 3.5 = 0.31 s. */
/* R30 */
TEST(a_clock_at_another_rate_shows_within_half_a_second)
{
    static const float right[] = {0.96f, 1.0f, 1.04f};
    static const float wrong[] = {0.5f, 0.9f, 0.93f, 1.07f, 1.1f, 1.4f};
    static const uint32_t periods[] = {1u, 20u, 100u};
    for (uint32_t k = 0u; k < (sizeof periods / sizeof periods[0]); k++) {
        for (uint32_t i = 0u; i < (sizeof right / sizeof right[0]); i++) {
            setUp();
            TEST_ASSERT_TRUE(clock_until(true, periods[k], right[i]) >= 10.0f);
        }
        for (uint32_t i = 0u; i < (sizeof wrong / sizeof wrong[0]); i++) {
            TEST_ASSERT_TRUE(clock_until(true, periods[k], wrong[i]) < 0.5f);
            evidence_show(&evidence);
            TEST_ASSERT_EQUAL_HEX32(LEVER_FAULT_CALIBRATION, faults_shown());
            TEST_ASSERT_TRUE(clock_until(false, periods[k], 1.0f) < 1.0f);
        }
    }
}

/* Intervals as a clock of low resolution, or a sender that is late now and then, has them [sample_period]; lost samples. */
/* R30 */
TEST(intervals_that_are_right_in_the_mean_are_no_clock_at_another_rate)
{
    static const float patterns[][4] = {
        {0.8f, 0.8f, 0.8f, 1.6f}, {0.4f, 1.6f, 0.4f, 1.6f}, {0.1f, 1.9f, 1.0f, 1.0f}, {2.0f, 1.0f, 3.0f, 1.0f}};
    for (uint32_t i = 0u; i < (sizeof patterns / sizeof patterns[0]); i++) {
        setUp();
        for (uint32_t block = 0u; block < 200u; block++) {
            for (uint32_t k = 0u; k < 4u; k++) {
                const float interval = patterns[i][k];
                const float periods = (interval > 1.5f) ? floorf(interval + 0.5f) : 1.0f;
                evidence_add_time(&evidence, interval * PERIOD, PERIOD);
                evidence_add_lost(&evidence, PERIOD, (uint32_t)periods - 1u);
            }
            end_block();
            TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_CLOCK));
        }
    }
}

/* What a motor does is compared with its command 3 ms ago, as a lag of first order: after 3 ms 1 - 1/e of a step, by
 * steps of a millisecond 1 - (2/3)^3. */
TEST(a_motor_follows_its_command_with_a_lag)
{
    for (uint32_t k = 0u; k < 3u; k++) {
        evidence_follow_command(&evidence, 1.0f, PERIOD);
    }
    TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, 19.0f / 27.0f, evidence.commanded);
    evidence_follow_command(&evidence, -1.0f, 0.01f);
    TEST_ASSERT_EQUAL_FLOAT(-1.0f, evidence.commanded);
    evidence_add_torque(&evidence, -0.5f);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, evidence.torque.expected);
    TEST_ASSERT_EQUAL_FLOAT(0.25f, evidence.torque.measured);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, evidence.torque.product);
    TEST_ASSERT_EQUAL_FLOAT(0.0025f, evidence.other_torque); /* a hundredth of the square of what is other */
}

/* So many blocks in which the base acceleration has steps of this size, and the lever stands still between its motions.
 * Returns by how much the excess has grown. */
static float stick(uint32_t blocks, float step)
{
    const float before = evidence.sticking.excess;
    for (uint32_t k = 0u; k < blocks; k++) {
        const float base = ((k % 2u) == 0u) ? step : -step;
        const float rate = ((k % 10u) < 5u) ? 0.0f : 0.2f;
        (void)evidence_sees(&evidence, SIGNAL_BASE, base);
        for (uint32_t i = 0u; i < (uint32_t)SAMPLES; i++) {
            evidence.motion.slow = 0.02f;
            evidence.motion.fast = 0.02f;
            sticking_add(&evidence.sticking, rate, PERIOD);
        }
        evidence.awake = 1.0f;
        end_block();
    }
    return evidence.sticking.excess - before;
}

/* A lever that stands still while the base shakes it sticks; where the base has become calm it may. */
/* R60 */
TEST(a_standstill_counts_while_the_base_goes_on)
{
    TEST_ASSERT_TRUE(stick(200u, 1.0f) > 1.0f);
    setUp();
    (void)stick(100u, 1.0f);
    (void)stick(20u, 0.1f); /* in squares a hundredth: less than a tenth after 0.23 s */
    TEST_ASSERT_EQUAL_FLOAT(0.0f, stick(50u, 0.1f));
    TEST_ASSERT_TRUE(fabsf(stick(200u, 0.1f)) > 0.0f); /* it is what is usual now: a tenth after 2.2 s */
    setUp();
    (void)stick(100u, 1.0f);
    (void)stick(20u, 0.4f); /* a sixth is no calm */
    TEST_ASSERT_TRUE(fabsf(stick(50u, 0.4f)) > 0.0f);
}

/* Angle and rate are compared over a line between samples of 10.5 ms, or one and a half periods, and where neither
 * jumps by 0.03 rad more than the other. */
TEST(angle_and_rate_are_compared_from_sample_to_sample_only)
{
    static const struct {
        float period;
        float elapsed;
        float angle; /* by which the angle changes [rad], */
        float rate;  /* and the integral of the rate */
        bool on;
    } row[] = {{0.001f, 0.0104f, 0.01f, 0.01f, true}, {0.001f, 0.0106f, 0.01f, 0.01f, false},
        {0.01f, 0.0149f, 0.01f, 0.01f, true}, {0.01f, 0.0151f, 0.01f, 0.01f, false},
        {0.001f, 0.001f, 0.029f, 0.0f, true}, {0.001f, 0.001f, 0.031f, 0.0f, false},
        {0.001f, 0.001f, 0.02f, -0.02f, false}, {0.001f, 0.001f, 0.05f, 0.04f, true},
        {0.001f, 0.001f, -0.031f, 0.0f, false}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        setUp();
        const float rate = row[i].rate / row[i].elapsed;
        const float before[] = {0.3f, rate};
        const float now[] = {0.3f + row[i].angle, rate};
        evidence_add_outputs(&evidence, before, before, true, 0.001f, row[i].period);
        evidence_add_outputs(&evidence, before, before, true, 1.0f, row[i].period);
        TEST_ASSERT_TRUE(evidence.kinematics.passed[0] == 0.0f);
        evidence_add_outputs(&evidence, before, now, true, row[i].elapsed, row[i].period);
        TEST_ASSERT_EQUAL(row[i].on, fabsf(evidence.kinematics.passed[0]) > 0.0f);
        evidence_add_outputs(&evidence, now, now, false, 0.001f, row[i].period);
        evidence_add_outputs(&evidence, now, now, true, 0.001f, row[i].period);
        TEST_ASSERT_TRUE(evidence.kinematics.passed[0] == 0.0f); /* the one before was not a pair */
    }
}

TEST(it_starts_long_after_a_change_and_without_a_ratio_that_nothing_is_known_of)
{
    TEST_ASSERT_EQUAL_FLOAT(EVIDENCE_LONG_AGO, evidence.since_change);
    evidence.ratio[EVIDENCE_NOISE] = 0.9f;
    evidence.ratio[EVIDENCE_BASE] = 0.9f;
    end_block();
    TEST_ASSERT_EQUAL_FLOAT(EVIDENCE_LONG_AGO, evidence.since_change);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, evidence.ratio[EVIDENCE_NOISE]);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, evidence.ratio[EVIDENCE_BASE]);
}

/* From a standard deviation of 0.35 of the gain on, there may be doubt of the base. */
TEST(doubt_of_the_base_begins_before_it_is_sure)
{
    static const float sigma[] = {0.34f, 0.36f};
    for (uint32_t i = 0u; i < 2u; i++) {
        setUp();
        const float information = (1.0f / (sigma[i] * sigma[i])) / 0.96f; /* a block of 20 ms forgets 4 % */
        evidence.base = (score_t){0.5f * information, information};
        end_block();
        TEST_ASSERT_FLOAT_WITHIN(1.0e-3f, (i == 0u) ? (0.5f / 0.6f) : 0.0f, evidence.ratio[EVIDENCE_BASE]);
    }
}

/* Of a base that has been given up, and of one that is not sure, the ratio is at most 1. */
TEST(a_ratio_of_the_base_above_one_is_evidence)
{
    for (uint32_t i = 0u; i < 2u; i++) {
        setUp();
        const float information = (i == 0u) ? 50.0f : 200.0f; /* standard deviations of 0.14 and 0.07 */
        evidence.base = (score_t){information, information};  /* a gain of 0 */
        end_block();
        TEST_ASSERT_EQUAL(i == 1u, evidence_has(&evidence, EVIDENCE_BASE));
        TEST_ASSERT_EQUAL(i == 1u, evidence.ratio[EVIDENCE_BASE] > 1.0f);
        TEST_ASSERT_TRUE(evidence.ratio[EVIDENCE_BASE] > 0.99f);
    }
}

/* Sums forget with 0.5 s, and while the base is wrong with 0.2 s; from a standard deviation of 0.1 on, and 0.2, they
 * count: of a gain of 0 and of 1. Until the base is wrong that deviation is larger where innovations are. Nothing is
 * held against it before the arm is known, but while the parameters are held. */
TEST(the_verdict_on_the_base_waits_until_it_is_sure)
{
    static const struct {
        float information;
        float period;
        float nis;
        bool before;
        bool is;
        float kept;
    } row[] = {{50.0f, 0.02f, 1.0f, false, false, 48.0f}, {5.0f, 0.02f, 1.0f, true, true, 4.5f},
        {99.0f, 1e-9f, 1.0f, false, false, 99.0f}, {101.0f, 1e-9f, 1.0f, false, true, 0.0f},
        {99.0f, 1e-9f, 0.5f, false, false, 99.0f}, {395.0f, 1e-9f, 4.0f, false, false, 395.0f},
        {405.0f, 1e-9f, 4.0f, false, true, 0.0f}, {24.0f, 1e-9f, 1.0f, true, true, 24.0f},
        {26.0f, 1e-9f, 1.0f, true, false, 0.0f}, {26.0f, 1e-9f, 4.0f, true, false, 0.0f}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        const evidence_block_t block = {.setup = &setup, .period = row[i].period, .held = true};
        setUp();
        evidence_note(&evidence, EVIDENCE_BASE, row[i].before);
        evidence.nis_fast = row[i].nis;
        evidence.base.information = row[i].information;
        evidence.base.vector = row[i].before ? -row[i].information : row[i].information;
        evidence_end_block(&evidence, &cdkf, &block);
        TEST_ASSERT_EQUAL(row[i].is, evidence_has(&evidence, EVIDENCE_BASE));
        TEST_ASSERT_FLOAT_WITHIN(1.0e-4f, row[i].kept, evidence.base.information);
    }
    for (uint32_t i = 0u; i < 3u; i++) {
        const evidence_block_t block = {.setup = &setup, .period = 0.02f, .known = (i == 1u)};
        setUp();
        evidence_note(&evidence, EVIDENCE_HANDS, i == 2u);
        evidence_note(&evidence, EVIDENCE_BASE, true);
        evidence.base.information = 1.0f;
        evidence_end_block(&evidence, &cdkf, &block);
        TEST_ASSERT_EQUAL(i == 1u, evidence_has(&evidence, EVIDENCE_BASE));
        TEST_ASSERT_EQUAL(i == 1u, evidence.base.information > 0.0f);
    }
    evidence_resume(&evidence);
    TEST_ASSERT_TRUE(!evidence_has(&evidence, EVIDENCE_BASE) && (evidence.base.information == 0.0f));
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
        {1.0f, 0.752f, 1.0e-3f, true, false}, {1.0f, 0.74f, 1.0e-3f, true, true}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        const float product = row[i].gain * row[i].asked;
        setUp();
        config.settings.sample_period = row[i].sample_period;
        evidence.torque = (agreement_t){row[i].asked, row[i].gain * product, product};
        evidence_note(&evidence, EVIDENCE_MOTOR, row[i].before);
        end_block();
        TEST_ASSERT_EQUAL(row[i].is, evidence_has(&evidence, EVIDENCE_MOTOR));
    }
}

/* R56 */
TEST(a_rest_is_shown_from_the_start_and_lasts_so_much_longer_than_the_lack_of_motion)
{
    TEST_ASSERT_EQUAL_UINT32(LEVER_FAULT_EXCITATION, evidence.faults);
    end_block();
    for (uint32_t k = 1u; k <= 20u; k++) {
        evidence.motion.slow = 1.0f;
        evidence.motion.fast = 1.0f;
        end_block();
        evidence_show(&evidence);
        TEST_ASSERT_EQUAL(k < 15u, evidence_has(&evidence, EVIDENCE_REST));
        TEST_ASSERT_EQUAL_UINT32((k < 15u) ? (uint32_t)LEVER_FAULT_EXCITATION : 0u, evidence.faults);
    }
}

/* Both means, against the least that is set and a fifth of the noise's variance. */
TEST(there_is_rest_where_either_mean_of_motion_is_too_small)
{
    static const struct {
        float slow;
        float fast;
        bool rests;
    } row[] = {{1.01f, 0.26f, false}, {0.99f, 0.26f, true}, {1.01f, 0.24f, true}, {0.99f, 2.0f, true}};
    for (uint32_t i = 0u; i < 4u; i++) {
        setUp();
        config.settings.excitation_least = 0.02f;
        cdkf.output_noise[1] = 0.06f;
        const float least = (0.02f * 0.02f) + (0.2f * 0.06f * 0.06f);
        for (uint32_t k = 0u; k < 15u; k++) {
            evidence.motion.slow = row[i].slow * least;
            evidence.motion.fast = row[i].fast * least;
            end_block();
        }
        TEST_ASSERT_EQUAL(row[i].rests, evidence_has(&evidence, EVIDENCE_REST));
    }
}

/* --- changes ------------------------------------------------------------------------------------------------------ */

/* Blocks of 20 ms from a change on: the fast mean of NIS that each verdict allows, and what is found at its end. */
/* R58 */
TEST(a_change_has_to_explain_the_innovations_within_its_probation)
{
    static const struct {
        float since; /* before the block [s] */
        float nis;
        uint8_t verdict;
        bool known;
        bool before;
        bool is;
    } row[] = {{0.1f, 3.1f, VERDICT_NEW, true, false, true}, {0.1f, 2.9f, VERDICT_NEW, true, false, false},
        {0.1f, 3.1f, VERDICT_NEW, false, false, false}, {0.03f, 3.1f, VERDICT_REGRIP, true, false, false},
        {0.28f, 1.9f, VERDICT_NEW, true, false, true}, {0.28f, 1.7f, VERDICT_NEW, true, false, false},
        {0.28f, 1.9f, VERDICT_NEW, false, false, false}, {0.31f, 9.0f, VERDICT_NEW, true, false, false},
        {9.0f, 1.4f, VERDICT_NOISE, true, true, true}, {9.0f, 1.2f, VERDICT_NOISE, true, true, false}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        const evidence_block_t block = {
            .setup = &setup, .period = 0.02f, .known = row[i].known, .verdict = row[i].verdict};
        setUp();
        evidence.since_change = row[i].since;
        evidence.nis_fast = row[i].nis;
        evidence_note(&evidence, EVIDENCE_NOISE, row[i].before);
        evidence_end_block(&evidence, &cdkf, &block);
        TEST_ASSERT_EQUAL(row[i].is, evidence_has(&evidence, EVIDENCE_NOISE));
    }
}

TEST(torque_of_somebody_else_is_more_than_the_noise_of_the_sensor)
{
    evidence.other_torque = 2.4e-3f;
    TEST_ASSERT_FALSE(evidence_has_other_torque(&evidence));
    evidence.other_torque = 2.6e-3f;
    TEST_ASSERT_TRUE(evidence_has_other_torque(&evidence));
}

/* A comparison with parameters that were held begins anew when they learn again. */
TEST(parameters_that_learn_again_have_no_past)
{
    evidence.base = (score_t){-100.0f, 100.0f};
    evidence_note(&evidence, EVIDENCE_BASE, true);
    evidence.whiteness.time = 3.0f;
    evidence_resume(&evidence);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, evidence.base.information);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, evidence.whiteness.time);
    TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_BASE));
}

/* Where noise is not estimated, nothing would end it. */
TEST(noise_that_is_not_estimated_has_not_grown)
{
    config.settings.noise_window = 0.0f;
    evidence.since_change = 0.1f;
    evidence.nis_fast = 9.0f;
    end_block();
    TEST_ASSERT_FALSE(evidence_has(&evidence, EVIDENCE_NOISE));
}

/* One is reported from the end of its probation for three seconds; learnt with noise as it was for the first. */
TEST(a_change_passes_through_its_stages)
{
    evidence_begin_change(&evidence, false, false);
    TEST_ASSERT_TRUE(!evidence_has(&evidence, EVIDENCE_REGRIP) && (evidence.since_change > 0.28f));
    evidence_begin_change(&evidence, true, false);
    TEST_ASSERT_TRUE(evidence_has(&evidence, EVIDENCE_REGRIP) && (evidence.since_change == 0.0f));
    for (uint32_t k = 1u; k <= 200u; k++) {
        const double since = 0.02 * (double)k;
        end_block();
        TEST_ASSERT_EQUAL(since < 0.038, evidence_has(&evidence, EVIDENCE_REGRIP));
        if (fabs(since - 1.0) > 0.01) { /* sums of 0.02f are rounded */
            TEST_ASSERT_EQUAL(since < 1.0, evidence_has(&evidence, EVIDENCE_NEW));
        }
        TEST_ASSERT_EQUAL((since > 0.289) && (since < 3.285), evidence_has(&evidence, EVIDENCE_CHANGE));
    }
}

/* A sensor that fits neither of two pilots is found again; what one of them looked like says nothing of the other. */
TEST(calibration_is_judged_anew_with_another_pilot_and_not_when_one_has_changed)
{
    for (uint32_t opened = 0u; opened < 2u; opened++) {
        setUp();
        evidence.calibration.score[CDKF_BASE_GAIN] = (score_t){1.0e3f, 1.0f};
        evidence_set(&evidence, EVIDENCE_CALIBRATION, 2.0f);
        evidence_begin_change(&evidence, true, opened == 1u);
        TEST_ASSERT_EQUAL(opened == 0u, evidence_has(&evidence, EVIDENCE_CALIBRATION));
        TEST_ASSERT_EQUAL(opened == 0u, evidence.calibration.score[CDKF_BASE_GAIN].vector > 0.0f);
    }
}

/* A drift of so many standard deviations; again only after change_memory, while hands are on and the base is not in
 * doubt. */
TEST(a_change_is_found_once_and_not_while_something_else_is_to_be_judged_first)
{
    static const struct {
        float drift;
        float since;
        float hands;
        float base;
        float threshold;
        bool known;
        bool is;
    } row[] = {{6.0f, 10.0f, 0.0f, 0.0f, 30.0f, true, true}, {3.0f, 10.0f, 0.0f, 0.0f, 30.0f, true, false},
        {6.0f, 10.0f, 0.0f, 0.0f, 0.0f, true, false}, {6.0f, 1.0f, 0.0f, 0.0f, 30.0f, true, true},
        {6.0f, 0.2f, 0.0f, 0.0f, 30.0f, true, false}, {6.0f, 1.0f, 0.0f, 0.0f, 30.0f, false, false},
        {6.0f, 1.0f, 0.05f, 0.0f, 30.0f, true, false}, {6.0f, 10.0f, 0.05f, 0.0f, 30.0f, false, true},
        {6.0f, 10.0f, 0.0f, 0.7f, 30.0f, true, false}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        const evidence_block_t block = {.setup = &setup, .period = 0.02f, .known = row[i].known};
        const float drift = row[i].drift;
        const correction_t correction = {
            .w = {drift, drift, drift}, .covariance = {1.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f}};
        setUp();
        config.settings.change_threshold = row[i].threshold;
        evidence.since_change = row[i].since;
        evidence.ratio[EVIDENCE_HANDS] = row[i].hands;
        evidence.ratio[EVIDENCE_BASE] = row[i].base;
        TEST_ASSERT_EQUAL(row[i].is, evidence_of_change(&evidence, &cdkf, &correction, &block));
    }
}

/* As far as innovations are larger than expected. */
TEST(unknown_torque_is_a_part_between_none_and_all)
{
    static const float nis[] = {0.9f, 1.2f, 1.6f, 2.0f, 5.0f};
    static const float part[] = {0.0f, 0.0f, 0.5f, 1.0f, 1.0f};
    for (uint32_t i = 0u; i < 5u; i++) {
        evidence.nis_fast = nis[i];
        TEST_ASSERT_FLOAT_WITHIN(1.0e-5f, part[i], evidence_of_torque(&evidence));
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
        const bool jump = input_gate_step(&evidence.input[INPUT_TORQUE], value - last, PERIOD);
        TEST_ASSERT_EQUAL(off, jump);
        last = jump ? last : value;
    }
    while (input_gate_step(&evidence.input[INPUT_TORQUE], 1.0f, PERIOD)) {
        refused++;
    }
    TEST_ASSERT_UINT32_WITHIN(1u, 19u, refused);
    TEST_ASSERT_FALSE(input_gate_step(&evidence.input[INPUT_BASE], 1.9f, PERIOD)); /* does no harm */
    TEST_ASSERT_TRUE(input_gate_step(&evidence.input[INPUT_BASE], 2.1f, PERIOD));
}
