/* The involuntary motion: of sines, the response of the estimated arm in closed form; no bias, no jump. */
#include "bounce/involuntary.h"

#include <complex.h>
#include <math.h>

#include "test.h"

#define FULL_TURN 6.283185307179586
#define PERIOD 1.0e-3 /* [s] */
#define CORNER 0.2    /* [Hz] */
#define IMAGINARY ((double complex)I)

/* The lever of firmware/THEORY.md, held by an arm of 2.5 kg, 18 N s/m, 1500 N/m. */
static const model_dynamics_t arm = {.stiffness = 461.0f, .damping = 6.3f, .forcing = -2.23f, .torque = 1.70f};
static const model_constants_t lever = {.length = 0.45f};
static const model_step_t about = {.period = (float)PERIOD, .trim_sine = 0.342f, .trim_cosine = 0.940f};

static involuntary_t motion;

void setUp(void)
{
    involuntary_start(&motion, 0.0f);
}

/* What is left of a sine behind the high-pass of the arm, and that of the base's velocity. */
static double complex high_pass(double complex s)
{
    const double corner = FULL_TURN * CORNER;
    const double complex first = sqrt(2.0) * corner * s;
    return ((s * s) + first) / ((s * s) + first + (corner * corner));
}

static double complex high_pass_of_velocity(double complex s)
{
    const double corner = FULL_TURN * CORNER;
    return (s * s) / ((s * s) + (sqrt(2.0) * corner * s) + (corner * corner));
}

/* The angle for a sine of 1 of base or torque [rad]: over the last five seconds of fifteen, by its Fourier coefficient. */
static double complex response_of(
    const model_dynamics_t *dynamics, const model_constants_t *constants, double frequency, bool by_torque, float ahead)
{
    double complex sum = 0.0;
    for (uint32_t k = 0u; k < 15000u; k++) {
        const double phase = FULL_TURN * frequency * PERIOD;
        model_step_t step = about;
        step.z_ddot = by_torque ? 0.0f : (float)sin(phase * (double)k);
        step.tau_m = by_torque ? (float)sin(phase * ((double)k - 0.5)) : 0.0f; /* held since the last sample */
        TEST_ASSERT_TRUE(involuntary_step(&motion, dynamics, constants, &step, (float)CORNER));
        if (k >= 10000u) {
            const double angle = (double)involuntary_angle(&motion, ahead);
            sum += 4.0e-4 * angle * (sin(phase * (double)k) + (IMAGINARY * cos(phase * (double)k)));
        }
    }
    return sum;
}

static void assert_response(double complex expected, double complex found)
{
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * cabs(expected), 0.0, cabs(found - expected));
}

static const double frequencies[] = {1.0, 2.0, 3.0, 4.0, 6.0, 8.0};

TEST_EACH(6, of_a_base_that_moves_it_is_the_response_of_the_arm)
{
    const double complex s = IMAGINARY * FULL_TURN * frequencies[test_round];
    const double complex expected =
        (double)arm.forcing / ((s * s) + ((double)arm.damping * s) + (double)arm.stiffness) * high_pass(s);
    assert_response(expected, response_of(&arm, &lever, frequencies[test_round], false, 0.0f));
    involuntary_start(&motion, 0.0f);
    assert_response(expected * (1.0 + (0.01 * s)), response_of(&arm, &lever, frequencies[test_round], false, 0.01f));
}

/* From 2 Hz on within a hundredth, the high-pass included. */
TEST_EACH(5, of_bounce_it_takes_all)
{
    const double frequency = frequencies[1u + test_round];
    const double complex s = IMAGINARY * FULL_TURN * frequency;
    const double complex expected = (double)arm.forcing / ((s * s) + ((double)arm.damping * s) + (double)arm.stiffness);
    const double complex found = response_of(&arm, &lever, frequency, false, 0.0f);
    TEST_ASSERT_DOUBLE_WITHIN(0.012 * cabs(expected), 0.0, cabs(found - expected));
}

TEST_EACH(6, of_a_motor_it_is_the_response_of_the_arm)
{
    const double complex s = IMAGINARY * FULL_TURN * frequencies[test_round];
    const double complex expected = (double)arm.torque / ((s * s) + ((double)arm.damping * s) + (double)arm.stiffness);
    assert_response(expected, response_of(&arm, &lever, frequencies[test_round], true, 0.0f));
}

/* A hand that is damped in space, too: forcing (z_ddot + space z_dot). */
TEST_EACH(6, of_a_hand_that_is_damped_in_space_it_has_the_zero)
{
    model_dynamics_t hand = arm;
    hand.forcing = -1.0f / (0.45f * 0.940f);
    hand.space = 8.5f;
    const double complex s = IMAGINARY * FULL_TURN * frequencies[test_round];
    const double complex drive = high_pass(s) + ((double)hand.space / s * high_pass_of_velocity(s));
    const double complex expected =
        (double)hand.forcing * drive / ((s * s) + ((double)hand.damping * s) + (double)hand.stiffness);
    assert_response(expected, response_of(&hand, &lever, frequencies[test_round], false, 0.0f));
}

/* A trunk that gives way on its seat moves where the arm rests: firmware/model/base_motion.h. */
TEST_EACH(6, of_a_trunk_on_its_seat_it_has_its_resonance)
{
    model_dynamics_t on_seat = arm;
    model_constants_t seated = lever;
    on_seat.arm_stiffness = 450.0f;
    on_seat.arm_damping = 5.5f;
    seated.seat_stiffness = 800.0f;
    seated.seat_damping = 22.0f;
    const double complex s = IMAGINARY * FULL_TURN * frequencies[test_round];
    const double complex seat =
        -(1.0 / (0.45 * 0.940)) / ((s * s) + ((double)seated.seat_damping * s) + (double)seated.seat_stiffness);
    const double complex by_seat = ((double)on_seat.arm_stiffness + ((double)on_seat.arm_damping * s)) * seat;
    const double complex expected = (((double)on_seat.forcing * high_pass(s)) + (by_seat * high_pass_of_velocity(s))) /
                                    ((s * s) + ((double)arm.damping * s) + (double)arm.stiffness);
    assert_response(expected, response_of(&on_seat, &seated, frequencies[test_round], false, 0.0f));
}

TEST(a_bias_of_the_accelerometer_is_forgotten)
{
    for (uint32_t k = 0u; k < 10000u; k++) {
        model_step_t step = about;
        step.z_ddot = 1.0f;
        (void)involuntary_step(&motion, &arm, &lever, &step, (float)CORNER);
    }
    TEST_ASSERT_TRUE(fabsf(motion.theta) < 1.0e-6f);
    involuntary_start(&motion, 9.81f);
    model_step_t step = about;
    step.z_ddot = 9.81f;
    (void)involuntary_step(&motion, &arm, &lever, &step, (float)CORNER);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.theta);
}

/* Half the stiffness from one sample to the next: angle and rate go on where they are. */
TEST(parameters_that_change_make_no_jump)
{
    (void)response_of(&arm, &lever, 3.0, false, 0.0f);
    const involuntary_t before = motion;
    model_dynamics_t other = arm;
    other.stiffness *= 0.5f;
    other.damping *= 3.0f;
    model_step_t step = about;
    (void)involuntary_step(&motion, &other, &lever, &step, (float)CORNER);
    TEST_ASSERT_FLOAT_WITHIN(1.1f * (float)PERIOD * fabsf(before.theta_dot), before.theta, motion.theta);
}

/* From a fifth of the samples, and over a gap of 100 ms. */
TEST(it_goes_on_through_gaps)
{
    double greatest = 0.0;
    for (uint32_t k = 0u; k < 2000u; k++) {
        model_step_t step = about;
        step.period = (k == 1000u) ? 0.1f : 5.0e-3f;
        step.z_ddot = (float)sin(FULL_TURN * 3.0 * 5.0e-3 * (double)k);
        TEST_ASSERT_TRUE(involuntary_step(&motion, &arm, &lever, &step, (float)CORNER));
        greatest = fmax(greatest, fabs((double)motion.theta));
    }
    const double complex s = IMAGINARY * FULL_TURN * 3.0;
    const double expected = cabs((double)arm.forcing / ((s * s) + ((double)arm.damping * s) + (double)arm.stiffness));
    TEST_ASSERT_TRUE(greatest < (2.0 * expected));
}

/* In parts of at most 20 ms. */
TEST(a_long_step_is_taken_in_parts)
{
    static const float period[] = {0.02f, 0.021f, 0.035f, 0.05f, 0.1f};
    static const uint32_t parts[] = {1u, 2u, 2u, 3u, 5u};
    for (uint32_t i = 0u; i < 5u; i++) {
        involuntary_t whole;
        model_step_t step = about;
        step.z_ddot = 2.0f;
        step.tau_m = 0.5f;
        step.period = period[i];
        involuntary_start(&whole, 0.0f);
        TEST_ASSERT_TRUE(involuntary_step(&whole, &arm, &lever, &step, (float)CORNER));
        setUp();
        step.period /= (float)parts[i];
        for (uint32_t k = 0u; k < parts[i]; k++) {
            TEST_ASSERT_TRUE(involuntary_step(&motion, &arm, &lever, &step, (float)CORNER));
        }
        TEST_ASSERT_EQUAL_FLOAT(motion.theta, whole.theta);
        TEST_ASSERT_EQUAL_FLOAT(motion.theta_dot, whole.theta_dot);
    }
}

/* A black box may be such. */
TEST(an_arm_that_is_not_stable_is_refused)
{
    model_dynamics_t unstable[3] = {arm, arm, arm};
    unstable[0].stiffness = -1.0f;
    unstable[1].damping = 0.0f;
    unstable[2].damping = NAN;
    for (uint32_t i = 0u; i < 3u; i++) {
        model_step_t step = about;
        (void)response_of(&arm, &lever, 3.0, false, 0.0f);
        step.z_ddot = 2.0f;
        TEST_ASSERT_FALSE(involuntary_step(&motion, &unstable[i], &lever, &step, (float)CORNER));
        TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.theta);
        TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.theta_dot);
    }
}

TEST(an_angle_is_plausible_up_to_its_limit)
{
    model_step_t step = about;
    step.period = 0.0f;
    motion.theta = 25.0f;
    TEST_ASSERT_TRUE(involuntary_step(&motion, &arm, &lever, &step, (float)CORNER));
    TEST_ASSERT_EQUAL_FLOAT(25.0f, motion.theta);
    motion.theta = 26.0f;
    TEST_ASSERT_FALSE(involuntary_step(&motion, &arm, &lever, &step, (float)CORNER));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.theta);
}
