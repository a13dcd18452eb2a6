/* The mitigation, fed by a lever that its model has right: how it opens and closes, its bounds, what it lets through. */
#include "bounce/mitigation.h"

#include <math.h>
#include <string.h>

#include "test.h"

#define FULL_TURN 6.283185307179586
#define PERIOD_US 1000u
#define SILENCE_US 20000u
#define JUMP 3.5e-3f  /* 0.2 degrees [rad] */
#define NATURAL 3.417 /* natural frequency of the arm [Hz] */

static const model_dynamics_t arm = {.stiffness = 461.0f, .damping = 6.3f, .forcing = -2.23f, .torque = 1.70f};
static const model_constants_t lever = {.length = 0.45f};

static lever_config_t config;
static mitigation_t mitigation;
static mitigation_sample_t sample;
static bool on;

/* The lever: the arm's motion times `likeness`, and what the pilot does on purpose. */
static double seconds;
static double shaking; /* of the base [m/s^2] */
static double frequency;
static double likeness;
static double purpose; /* angle and frequency of that */
static double purpose_frequency;
static double moved[2]; /* angle, rate of the arm's motion */

void setUp(void)
{
    lever_config_default(&config);
    (void)memset(&mitigation, 0, sizeof mitigation);
    seconds = 0.0;
    shaking = 1.0;
    frequency = NATURAL;
    likeness = 1.0;
    purpose = 0.0;
    purpose_frequency = 0.5;
    (void)memset(moved, 0, sizeof moved);
    sample = (mitigation_sample_t){.dynamics = &arm,
        .constants = &lever,
        .step = {.period = 1.0e-6f * (float)PERIOD_US, .trim_cosine = 0.940f},
        .elapsed_us = PERIOD_US,
        .silence_us = SILENCE_US,
        .mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION,
        .advances = true,
        .permitted = true,
        .sensed = true,
        .rated = true,
        .fits = true};
}

static lever_correction_t now(void)
{
    return mitigation_correction(&mitigation);
}

/* The lever to the next sample, with the torque that was asked for, which is left out of `tau_m`. */
static void move(void)
{
    const double period = 1.0e-6 * (double)PERIOD_US;
    const double before = shaking * sin(FULL_TURN * frequency * seconds);
    seconds += period;
    const double z_ddot = shaking * sin(FULL_TURN * frequency * seconds);
    const double torque = (double)sample.drive * (double)mitigation.damping;
    const double middle = moved[0] + (0.5 * period * moved[1]);
    const double acceleration = ((double)arm.forcing * 0.5 * (before + z_ddot)) + ((double)arm.torque * torque) -
                                ((double)arm.stiffness * middle) - ((double)arm.damping * moved[1]);
    const double change = period * acceleration / (1.0 + (0.5 * period * (double)arm.damping));
    moved[0] += period * (moved[1] + (0.5 * change));
    moved[1] += change;
    const double turn = FULL_TURN * purpose_frequency;
    sample.theta = (float)(0.35 + (likeness * moved[0]) + (purpose * sin(turn * seconds)));
    sample.theta_dot = (float)((likeness * moved[1]) + (purpose * turn * cos(turn * seconds)));
    sample.step.z_ddot = (float)z_ddot;
    sample.step.tau_m = (float)torque;
}

static void run(uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        move();
        on = mitigation_step(&mitigation, &config.settings, &sample);
    }
}

/* So many samples, or where there is to be none, so many milliseconds; the correction at no time jumps. */
static void run_without_jump(uint32_t count, bool silent)
{
    float last = now().angle;
    for (uint32_t k = 0u; k < count; k++) {
        if (silent) {
            mitigation_idle(&mitigation, 1000u);
        } else {
            run(1u);
        }
        TEST_ASSERT_FLOAT_WITHIN(JUMP, last, now().angle);
        last = now().angle;
    }
}

/* --- opening and closing ------------------------------------------------------------------------------------------ */

TEST(it_is_passive_at_first_and_on_within_a_second)
{
    run(1u);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, now().angle);
    run_without_jump(999u, false);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    TEST_ASSERT_TRUE(mitigation.open);
}

/* A base as quiet as in a hangar says nothing about the arm. */
TEST(it_waits_until_the_lever_moves)
{
    shaking = 1.0e-3;
    run(5000u);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, now().angle);
    shaking = 1.0;
    run(1000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, mitigation.trust);
    shaking = 1.0e-3;
    run(5000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, mitigation.trust);
}

typedef enum cause {
    NOT_PERMITTED,
    NOT_SENSED,
    NO_RATE,
    CLOCK_STANDS,
    THETA_STUCK,
    BASE_STUCK,
    SILENCE,
    CHOSEN_OFF,
    CAUSES
} cause_t;

static void spoil(cause_t cause)
{
    sample.permitted = (cause != NOT_PERMITTED);
    sample.sensed = (cause != NOT_SENSED);
    sample.rated = (cause != NO_RATE);
    sample.advances = (cause != CLOCK_STANDS);
    sample.same_theta = (cause == THETA_STUCK);
    sample.same_z_ddot = (cause == BASE_STUCK);
    sample.mitigation =
        (cause == CHOSEN_OFF) ? (uint8_t)LEVER_MITIGATION_NONE : (uint8_t)LEVER_MITIGATION_CANCELLATION_AND_DAMPING;
}

/* With the largest correction there is: 0.2 rad. */
TEST_EACH(CAUSES, whatever_closes_it_has_it_passive_within_100_ms_without_a_jump)
{
    const cause_t cause = (cause_t)test_round;
    sample.mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION_AND_DAMPING;
    sample.drive = 1.0f;
    shaking = 3.0;
    frequency = 2.0;
    run(3000u);
    for (uint32_t k = 0u; (k < 1000u) && (fabsf(now().angle) < 0.01f); k++) {
        run(1u);
    }
    TEST_ASSERT_TRUE((fabsf(now().angle) >= 0.01f) && (fabsf(mitigation.damping) > 0.0f));
    spoil(cause);
    run_without_jump(98u, cause == SILENCE);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, now().angle);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, now().weight);
    if (cause != SILENCE) {
        run(2u);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, mitigation.damping);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, mitigation.expected_damping);
        run(160u); /* however long it lasts */
    }
    TEST_ASSERT_TRUE((cause == CHOSEN_OFF) || !mitigation.open);
    TEST_ASSERT_TRUE((cause != CHOSEN_OFF) || !on);
}

/* Of 0.2 rad, the slope of the fade is what may jump most. */
TEST(a_full_correction_fades_without_a_jump)
{
    run(3000u);
    for (float last = 0.2f; mitigation.weight > 0.0f;) {
        mitigation.correction = 0.2f;
        mitigation_idle(&mitigation, 1000u);
        TEST_ASSERT_FLOAT_WITHIN(JUMP, last, now().angle);
        last = now().angle;
    }
}

/* Samples that are lost now and then, and spikes. */
TEST(a_moment_without_sensors_changes_nothing)
{
    run(3000u);
    for (uint32_t k = 0u; k < 50u; k++) {
        sample.sensed = false;
        run(10u);
        sample.sensed = true;
        run(1u);
        mitigation_idle(&mitigation, 9000u);
        TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    }
}

/* A coarse sensor in a quiet cabin: 20 samples the same, then 40; all that it has been before may become three times as
 * long. */
TEST(what_is_often_the_same_is_not_stuck)
{
    static const uint32_t lengths[] = {20u, 40u, 100u, 254u};
    run(3000u);
    for (uint32_t i = 0u; i < (sizeof lengths / sizeof lengths[0]); i++) {
        for (uint32_t k = 0u; k < 20u; k++) {
            sample.same_theta = false;
            sample.same_z_ddot = false;
            run(1u);
            sample.same_theta = ((k % 2u) == 0u);
            sample.same_z_ddot = !sample.same_theta;
            run(lengths[i]);
            TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
        }
    }
}

/* What was usual is forgotten, by a sample in 256. */
TEST(a_sensor_that_was_quiet_long_ago_is_stuck_as_soon_as_any)
{
    run(3000u);
    sample.same_z_ddot = true;
    run(20u);
    sample.same_z_ddot = false;
    run(21u * 256u);
    spoil(BASE_STUCK);
    run(22u);
    TEST_ASSERT_TRUE(mitigation.open);
    run(1u);
    TEST_ASSERT_FALSE(mitigation.open);
}

/* It is stuck after more than 22 ms, and more than eight samples or three times as many as it usually is the same for: at
 * 100 Hz 22 ms are two samples, which any two may be. What was usual for one sample is forgotten by now. */
TEST(a_sensor_is_stuck_after_22_ms_and_more_samples_than_is_usual)
{
    static const struct {
        uint32_t period_us;
        uint8_t longest;
        uint32_t samples;
    } row[] = {{1000u, 0u, 23u}, {449u, 0u, 49u}, {10000u, 0u, 9u}, {1000u, 20u, 69u}, {10000u, 1u, 9u}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        for (uint32_t which = 0u; which < 2u; which++) {
            setUp();
            run(2u);
            mitigation.samples = (uint8_t)((row[i].longest == 1u) ? 0u : 1u);
            *((which == 0u) ? &mitigation.theta : &mitigation.z_ddot) =
                (mitigation_reading_t){.longest = row[i].longest};
            sample.elapsed_us = row[i].period_us;
            sample.step.period = 1.0e-6f * (float)row[i].period_us;
            spoil((which == 0u) ? THETA_STUCK : BASE_STUCK);
            run(row[i].samples - 1u);
            TEST_ASSERT_TRUE(mitigation.open);
            run(1u);
            TEST_ASSERT_FALSE(mitigation.open);
        }
    }
}

TEST(it_comes_back_within_a_second)
{
    for (uint32_t cause = 0u; cause < (uint32_t)CHOSEN_OFF; cause++) {
        setUp();
        run(3000u);
        spoil((cause_t)cause);
        if (cause == (uint32_t)SILENCE) {
            mitigation_idle(&mitigation, 500000u);
            sample.step.period = 0.5f;
            sample.elapsed_us = 500000u;
            run(1u);
        } else {
            run(500u);
        }
        TEST_ASSERT_EQUAL_FLOAT(0.0f, now().weight);
        sample.step.period = 1.0e-6f * (float)PERIOD_US;
        sample.elapsed_us = PERIOD_US;
        spoil(CAUSES);
        run_without_jump(1500u, false);
        TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    }
}

/* A lever without a sensor of its rate, from the beginning. */
TEST(a_rate_that_was_never_measured_is_not_missed)
{
    sample.rated = false;
    run(1500u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
}

/* --- whether the model is right ----------------------------------------------------------------------------------- */

/* What would add to the motion fades; a model that is wrong by a quarter takes most of it away. */
TEST(the_estimated_arm_is_used_only_while_it_helps)
{
    static const struct {
        double likeness;
        float trust;
    } row[] = {{1.0, 1.0f}, {1.4, 1.0f}, {0.75, 1.0f}, {0.45, 0.0f}, {0.0, 0.0f}, {-1.0, 0.0f}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        setUp();
        run(3000u);
        likeness = row[i].likeness;
        run(3000u);
        TEST_ASSERT_EQUAL_FLOAT(row[i].trust, mitigation.trust);
        likeness = 1.0;
        run(3000u);
        TEST_ASSERT_EQUAL_FLOAT(1.0f, mitigation.trust);
        TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    }
}

/* A base acceleration that does not fit the motion ends the trust in what follows from it, and nothing else. */
TEST(a_wrong_base_acceleration_is_not_used)
{
    run(3000u);
    sample.fits = false;
    run_without_jump(100u, false);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, mitigation.trust);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    sample.fits = true;
    run(1000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, mitigation.trust);
}

/* Motion that the estimated arm does not explain, at two frequencies at once, is taken away by two notches; of the
 * pilot's own at half a hertz nothing is. */
TEST(what_the_arm_does_not_explain_is_notched)
{
    for (uint32_t i = 0u; i < 5000u; i++) {
        move();
        sample.theta =
            0.35f + (0.01f * (float)sin(FULL_TURN * 3.0 * seconds)) + (0.005f * (float)sin(FULL_TURN * 6.5 * seconds));
        sample.fits = false;
        on = mitigation_step(&mitigation, &config.settings, &sample);
    }
    double corrected = 0.0;
    for (uint32_t i = 0u; i < 4000u; i++) {
        move();
        sample.theta =
            0.35f + (0.01f * (float)sin(FULL_TURN * 3.0 * seconds)) + (0.005f * (float)sin(FULL_TURN * 6.5 * seconds));
        on = mitigation_step(&mitigation, &config.settings, &sample);
        const double left = ((double)sample.theta - 0.35) + (double)now().angle;
        corrected += left * left;
    }
    TEST_ASSERT_TRUE(sqrt(corrected / 4000.0) < (0.35 * sqrt(0.5 * ((0.01 * 0.01) + (0.005 * 0.005)))));
}

/* The pilot moves the lever by 5 degrees: that neither ends the correction nor is in it. */
TEST(motion_on_purpose_is_left_alone)
{
    static float alone[4000];
    for (uint32_t k = 0u; k < 4000u; k++) {
        run(1u);
        alone[k] = now().angle;
    }
    setUp();
    purpose = 0.09;
    for (uint32_t k = 0u; k < 4000u; k++) {
        run(1u);
        if (k >= 2000u) {
            TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
            TEST_ASSERT_EQUAL_FLOAT(alone[k], now().angle);
        }
    }
}

TEST(a_model_that_is_no_stable_arm_is_not_used)
{
    model_dynamics_t unstable = arm;
    unstable.damping = -1.0f;
    run(3000u);
    sample.dynamics = &unstable;
    run_without_jump(100u, false);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, mitigation.trust);
    TEST_ASSERT_FLOAT_WITHIN(2.0e-4f, 0.0f, now().angle);
}

/* --- what it does ------------------------------------------------------------------------------------------------- */

/* The rms of the lever's angle plus correction over the next four seconds, and of the lever's alone. */
static void measure(double *corrected, double *passive)
{
    double sum[2] = {0.0, 0.0};
    for (uint32_t k = 0u; k < 4000u; k++) {
        run(1u);
        const double angle = (double)sample.theta - 0.35;
        sum[0] += (angle + (double)now().angle) * (angle + (double)now().angle);
        sum[1] += angle * angle;
    }
    *corrected = sqrt(sum[0] / 4000.0);
    *passive = sqrt(sum[1] / 4000.0);
}

TEST(cancellation_takes_the_involuntary_part_away)
{
    static const double frequencies[] = {2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.5, 8.0};
    for (uint32_t with_damping = 0u; with_damping < 2u; with_damping++) {
        for (uint32_t i = 0u; i < (sizeof frequencies / sizeof frequencies[0]); i++) {
            double corrected = 0.0;
            double passive = 0.0;
            setUp();
            sample.drive = 1.0f;
            sample.mitigation = (with_damping != 0u) ? (uint8_t)LEVER_MITIGATION_CANCELLATION_AND_DAMPING
                                                     : (uint8_t)LEVER_MITIGATION_CANCELLATION;
            frequency = frequencies[i];
            run(10000u);
            measure(&corrected, &passive);
            TEST_ASSERT_TRUE(corrected < (0.03 * passive)); /* 99.9 % of its power */
        }
    }
}

TEST(no_correction_and_no_torque_exceeds_its_limit)
{
    sample.mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION_AND_DAMPING;
    sample.drive = 1.0f;
    config.settings.correction_limit = 0.01f;
    config.settings.damping_limit = 0.5f;
    shaking = 20.0;
    float most[2] = {0.0f, 0.0f};
    for (uint32_t k = 0u; k < 3000u; k++) {
        run(1u);
        most[0] = fmaxf(most[0], fabsf(now().angle));
        most[1] = fmaxf(most[1], fabsf(mitigation.damping));
    }
    TEST_ASSERT_EQUAL_FLOAT(0.01f, most[0]);
    TEST_ASSERT_EQUAL_FLOAT(0.5f, most[1]);
}

/* Torque over rate at a frequency, of a lever that is moved so: along the rate and across it. */
static void torque_at(double at, double *along, double *across)
{
    setUp();
    sample.mitigation = (uint8_t)LEVER_MITIGATION_DAMPING;
    config.settings.damping_limit = 10.0f;
    shaking = 0.0;
    purpose = 0.01;
    purpose_frequency = at;
    run(3000u);
    *along = 0.0;
    *across = 0.0;
    for (uint32_t k = 0u; k < 4000u; k++) {
        run(1u);
        const double turn = FULL_TURN * at;
        *along += 5.0e-4 * (double)mitigation.damping * cos(turn * seconds) / (purpose * turn);
        *across += 5.0e-4 * (double)mitigation.damping * sin(turn * seconds) / (purpose * turn);
    }
}

/* That of the band-pass in closed form: 1/(1 + s/high) s/(s + low). */
TEST(damping_is_torque_against_the_rate)
{
    static const double frequencies[] = {0.5, 1.0, 2.0, 3.5, 5.0, 8.0, 12.0};
    for (uint32_t i = 0u; i < (sizeof frequencies / sizeof frequencies[0]); i++) {
        const double low = 1.5 / frequencies[i];
        const double high = frequencies[i] / 8.0;
        const double scale = 6.0 / ((1.0 + (low * low)) * (1.0 + (high * high)));
        double along = 0.0;
        double across = 0.0;
        torque_at(frequencies[i], &along, &across);
        TEST_ASSERT_DOUBLE_WITHIN(0.2, -scale * (1.0 + (low * high)), along);
        TEST_ASSERT_DOUBLE_WITHIN(0.2, -scale * (high - low), across);
        TEST_ASSERT_TRUE(along < -0.5);
    }
}

/* A correction is of no account there, nor the model. */
TEST(damping_needs_no_model)
{
    sample.mitigation = (uint8_t)LEVER_MITIGATION_DAMPING;
    likeness = -1.0;
    run(3000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, mitigation.damping_weight);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, now().angle);
}

/* Gain and phase of lever plus correction, of a lever that is moved at a frequency besides. */
static void notch_at(double at, double *gain, double *phase)
{
    double along = 0.0;
    double across = 0.0;
    setUp();
    sample.mitigation = (uint8_t)LEVER_MITIGATION_NOTCH;
    shaking = 0.3;
    frequency = 3.25; /* whole periods in four seconds, as all of them */
    purpose = 1.0e-3;
    purpose_frequency = at;
    run(4000u);
    for (uint32_t k = 0u; k < 4000u; k++) {
        run(1u);
        const double angle = ((double)sample.theta - 0.35 + (double)now().angle) / purpose;
        along += 5.0e-4 * angle * sin(FULL_TURN * at * seconds);
        across += 5.0e-4 * angle * cos(FULL_TURN * at * seconds);
    }
    *gain = hypot(along, across);
    *phase = atan2(across, along);
}

/* (1 - x^2) / (1 - x^2 + 2 zeta i x), x = frequency over natural frequency, zeta = 0.5. */
TEST(a_notch_is_one)
{
    static const double frequencies[] = {0.25, 0.5, 1.0, 2.0, 5.0, 8.0};
    double gain = 0.0;
    double phase = 0.0;
    for (uint32_t i = 0u; i < (sizeof frequencies / sizeof frequencies[0]); i++) {
        const double x = frequencies[i] / NATURAL;
        const double rest = 1.0 - (x * x);
        notch_at(frequencies[i], &gain, &phase);
        TEST_ASSERT_DOUBLE_WITHIN(0.025, fabs(rest) / hypot(rest, x), gain);
        TEST_ASSERT_DOUBLE_WITHIN(0.03, atan2((rest > 0.0) ? -x : x, fabs(rest)), phase);
    }
    notch_at(3.5, &gain, &phase);
    TEST_ASSERT_TRUE(gain < 0.1);
}

/* Of an arm whose frequency is beyond what the step can follow: it moves by 0.8 of what comes in. */
TEST(a_notch_is_stable_however_stiff_the_arm)
{
    static const model_dynamics_t stiff = {.stiffness = 4.0e6f, .damping = 6.3f, .forcing = -2.23f, .torque = 1.70f};
    sample.mitigation = (uint8_t)LEVER_MITIGATION_NOTCH;
    run(100u);
    sample.dynamics = &stiff;
    (void)memset(&mitigation.notch, 0, sizeof mitigation.notch);
    run(1u);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, 0.8f * sample.theta, mitigation.notch.band_pass);
}

TEST(one_correction_fades_before_the_other_begins)
{
    run(3000u);
    sample.mitigation = (uint8_t)LEVER_MITIGATION_NOTCH;
    run_without_jump(80u, false);
    TEST_ASSERT_TRUE(mitigation.notches && (now().weight < 0.1f));
    run_without_jump(1000u, false);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    sample.mitigation = (uint8_t)LEVER_MITIGATION_CANCELLATION;
    run_without_jump(1080u, false);
    TEST_ASSERT_FALSE(mitigation.notches);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
}

/* Of 20 ms, the longest sample period there is. */
TEST(after_a_tenth_of_a_second_without_a_sample_it_begins_anew)
{
    static const float period[] = {0.09f, 0.12f};
    for (uint32_t k = 0u; k < 2u; k++) {
        setUp();
        run(3000u);
        sample.step.period = period[k];
        (void)mitigation_step(&mitigation, &config.settings, &sample);
        TEST_ASSERT_EQUAL(k == 1u, now().weight == 0.0f);
    }
}

TEST(with_slow_samples_it_is_passive_in_time_too)
{
    sample.silence_us = 25000u;
    sample.elapsed_us = 20000u;
    sample.step.period = 0.02f;
    mitigation.explained = true;
    for (uint32_t k = 0u; k < 100u; k++) {
        (void)mitigation_step(&mitigation, &config.settings, &sample);
        mitigation.explained = true;
    }
    TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    mitigation_idle(&mitigation, 20000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, now().weight);
    for (uint32_t k = 0u; k < 15u; k++) {
        mitigation_idle(&mitigation, 5000u);
    }
    TEST_ASSERT_EQUAL_FLOAT(0.0f, now().weight);
}

/* A motor that no longer is to damp fades out before the mitigation is done. */
TEST(damping_that_is_chosen_away_fades)
{
    sample.mitigation = (uint8_t)LEVER_MITIGATION_DAMPING;
    run(3000u);
    TEST_ASSERT_EQUAL_FLOAT(1.0f, mitigation.damping_weight);
    sample.mitigation = (uint8_t)LEVER_MITIGATION_NONE;
    run(35u);
    TEST_ASSERT_TRUE(on);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.5f, mitigation.damping_weight);
    run(36u);
    TEST_ASSERT_FALSE(on);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, mitigation.damping);
}
