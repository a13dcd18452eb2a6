/* The two linear models against their equations integrated in double by Runge and Kutta, and their dynamics against the
 * closed form of a free decay. */
#include "../math/dense.h"
#include "increments.h"
#include "model/linear.h"
#include "plant.h"
#include "unity.h"

enum { FINE = 200, REPEATS = 300, L = MODEL_PARAMETERS };

#define TURN 6.283185307179586

/* A model, its parameters and the plant that they stand for. */
typedef struct subject {
    const model_t *model;
    double p[L];
    plant_t plant;
} subject_t;

static random_source_t source;

void setUp(void)
{
    source.state = 41u;
}

void tearDown(void)
{
}

static subject_t physical(double m, double c, double k)
{
    const subject_t subject = {&model_linear_physical, {m, c, k}, plant_physical(m, c, k)};
    return subject;
}

static subject_t black_box(double a21, double a22, double b21)
{
    const subject_t subject = {&model_linear_black_box, {a21, a22, b21}, plant_black_box(a21, a22, b21)};
    return subject;
}

/* Arms of all sizes; the black box of either sign in everything. */
static subject_t random_subject(uint32_t repeat)
{
    if ((repeat % 2u) == 0u) {
        return physical(random_between(&source, 1.0, 5.0), random_between(&source, 10.0, 150.0),
            random_between(&source, 200.0, 4000.0));
    }
    return black_box(random_between(&source, -1500.0, 500.0), random_between(&source, -80.0, 30.0),
        random_between(&source, -5.0, 5.0));
}

/* --- the truth ---------------------------------------------------------------------------------------------------- */

/* `period` seconds on, in FINE steps, under constant inputs. */
static void move(plant_t *plant, double period, double z_ddot, double tau_m)
{
    for (uint32_t k = 0u; k < (uint32_t)FINE; k++) {
        plant_runge_kutta(plant, period / (double)FINE, z_ddot, tau_m);
    }
}

/* --- the model's side --------------------------------------------------------------------------------------------- */

/* Where the model is told that things are. Trim, preload angle and origin all differ. */
typedef struct frame {
    model_constants_t constants;
    model_step_t step;
} frame_t;

static frame_t frame_of(bool trim, double period, double z_ddot, double tau_m)
{
    const frame_t frame = {.constants = {.lever_preload_angle = -0.21f, .trim = trim},
        .step = {.period = (float)period,
            .z_ddot = (float)z_ddot,
            .tau_m = (float)tau_m,
            .origin = trim ? 0.37f : 0.0f,
            .trim = 0.37f}};
    return frame;
}

static double rest_of(const frame_t *frame)
{
    return frame->constants.trim ? (double)frame->step.trim : (double)frame->constants.lever_preload_angle;
}

static model_arm_t arm_of(const subject_t *subject, const frame_t *frame)
{
    const float p[L] = {(float)subject->p[0], (float)subject->p[1], (float)subject->p[2]};
    model_arm_t arm;
    subject->model->prepare(&frame->constants, p, &arm);
    return arm;
}

/* Another subject of the same model, parameters scaled; where the frame lets it rest, moved away from there. */
static subject_t relative(const subject_t *subject, const frame_t *frame, double scale, double x, double x_dot)
{
    subject_t other = (subject->model == &model_linear_physical)
                          ? physical(scale * subject->p[0], subject->p[1] / scale, scale * scale * subject->p[2])
                          : black_box(scale * subject->p[0], subject->p[1] / scale, scale * subject->p[2]);
    other.plant.trim = rest_of(frame);
    other.plant.theta = other.plant.trim + x;
    other.plant.theta_dot = x_dot;
    return other;
}

/* Sigma points about a state 0.1 rad from where the frame lets it rest, on its way with 0.8 rad/s. Pairs are apart by more
 * and more, in units of `spread`, and each parameter point has an arm of its own. `own`: what each point stands for. */
static model_points_t spread_points(const subject_t *subject, const frame_t *frame, double spread,
    model_arm_t arms[MODEL_PARAMETER_POINTS], subject_t own[POINTS])
{
    model_points_t points = {.arm = arms};
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        const double apart = 2.0 * spread * (double)(point_pair(i) + 1u);
        const double away = point_sign(i) * apart;
        const bool has_arm = (i < (uint32_t)MODEL_PARAMETER_POINTS);
        own[i] = relative(subject, frame, has_arm ? (1.0 + (spread * (double)i)) : 1.0, 0.1 + (0.1 * away), 0.8 - away);
        if (has_arm) {
            arms[i] = arm_of(&own[i], frame);
        }
        points.offset[point_pair(i)][0] = (float)(0.1 * apart);
        points.offset[point_pair(i)][1] = (float)-apart;
    }
    points.x[0] = (float)(own[0].plant.theta - (double)frame->step.origin);
    points.x[1] = (float)own[0].plant.theta_dot;
    return points;
}

/* Error of one step, the greatest of all points, in x [rad] and x_dot [rad/s]. */
static void step_error(const subject_t *subject, const frame_t *frame, double spread, double error[2])
{
    subject_t own[POINTS];
    model_arm_t arms[MODEL_PARAMETER_POINTS];
    const model_points_t points = spread_points(subject, frame, spread, arms, own);
    double increment[POINTS][MODEL_STATES];
    increments_of(subject->model, &frame->constants, &frame->step, &points, increment);
    error[0] = 0.0;
    error[1] = 0.0;
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        plant_t plant = own[i].plant;
        move(&plant, (double)frame->step.period, (double)frame->step.z_ddot, (double)frame->step.tau_m);
        error[0] = greater_of(error[0], fabs(increment[i][0] - (plant.theta - own[i].plant.theta)));
        error[1] = greater_of(error[1], fabs(increment[i][1] - (plant.theta_dot - own[i].plant.theta_dot)));
    }
}

/* All points alike, x from where the frame lets it rest. */
static void propagate_alike(
    const subject_t *subject, const frame_t *frame, double x, double x_dot, double increment[MODEL_STATES])
{
    const subject_t moving = relative(subject, frame, 1.0, x, x_dot);
    const float mean[MODEL_STATES] = {
        (float)(moving.plant.theta - (double)frame->step.origin), (float)moving.plant.theta_dot};
    const model_arm_t arm = arm_of(&moving, frame);
    model_arm_t arms[MODEL_PARAMETER_POINTS];
    const model_points_t points = points_alike(mean, &arm, arms);
    double increments[POINTS][MODEL_STATES];
    increments_of(subject->model, &frame->constants, &frame->step, &points, increments);
    increment[0] = increments[0][0];
    increment[1] = increments[0][1];
}

/* --- motion ------------------------------------------------------------------------------------------------------- */

static void test_every_point_follows_the_equation_with_its_own_state_and_parameters(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        const subject_t subject = random_subject(repeat);
        const bool trim = (repeat % 4u) < 2u;
        const frame_t frame =
            frame_of(trim, 1.0e-4, random_between(&source, -5.0, 5.0), random_between(&source, -3.0, 3.0));
        double error[2];
        step_error(&subject, &frame, 0.04, error);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-9, 0.0, error[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 0.0, error[1]);
    }
}

static void test_halving_the_step_makes_the_error_of_a_step_eight_times_smaller(void)
{
    const subject_t subjects[] = {
        physical(2.5, 42.0, 1500.0), black_box(-465.0, -13.7, -2.2), black_box(300.0, 20.0, 2.0)};
    for (uint32_t k = 0u; k < 3u; k++) {
        const frame_t coarse = frame_of(true, 2.0e-3, 2.0, 1.5);
        const frame_t fine = frame_of(true, 1.0e-3, 2.0, 1.5);
        double error[2];
        double halved[2];
        step_error(&subjects[k], &coarse, 0.0, error);
        step_error(&subjects[k], &fine, 0.0, halved);
        TEST_ASSERT_DOUBLE_WITHIN(0.5, 8.0, error[0] / halved[0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.5, 8.0, error[1] / halved[1]);
    }
}

static void test_rests_at_the_trim_or_at_the_preload_angle_of_the_lever(void)
{
    const subject_t subjects[] = {physical(2.5, 42.0, 1500.0), black_box(-465.0, -13.7, -2.2)};
    for (uint32_t k = 0u; k < 4u; k++) {
        const frame_t frame = frame_of(k < 2u, 1.0e-3, 0.0, 0.0);
        double increment[MODEL_STATES];
        propagate_alike(&subjects[k % 2u], &frame, 0.0, 0.0, increment);
        TEST_ASSERT_TRUE((increment[0] == 0.0) && (increment[1] == 0.0));
    }
}

/* From rest, in a step too short for anything else. */
static void test_base_and_torque_push_with_the_sign_and_size_of_the_equations(void)
{
    const frame_t base = frame_of(true, 1.0e-4, 3.0, 0.0);
    const frame_t torque = frame_of(true, 1.0e-4, 0.0, 3.0);
    const subject_t mass = physical(2.0, 42.0, 1500.0);
    const subject_t box = black_box(-465.0, -13.7, -2.2);
    double increment[MODEL_STATES];
    propagate_alike(&mass, &base, 0.0, 0.0, increment);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 3.0e-4, increment[1]);
    propagate_alike(&mass, &torque, 0.0, 0.0, increment);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 1.5e-4, increment[1]);
    propagate_alike(&box, &base, 0.0, 0.0, increment);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, -6.6e-4, increment[1]);
    propagate_alike(&box, &torque, 0.0, 0.0, increment);
    TEST_ASSERT_TRUE((increment[0] == 0.0) && (increment[1] == 0.0));
}

static void test_without_stiffness_and_damping_it_flies(void)
{
    const subject_t box = black_box(0.0, 0.0, 2.0);
    const frame_t frame = frame_of(false, 1.0e-2, 3.0, 0.0);
    double increment[MODEL_STATES];
    propagate_alike(&box, &frame, 5.0, 1.0, increment);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-8, 1.0e-2 + (0.5 * 6.0 * 1.0e-4), increment[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-8, 6.0e-2, increment[1]);
}

static void test_heavy_damping_and_a_long_step_still_decay(void)
{
    const subject_t subjects[] = {physical(0.05, 600.0, 1.0), black_box(-1.0, -320.0, 0.0)};
    const frame_t frame = frame_of(true, 2.0e-2, 0.0, 0.0);
    for (uint32_t k = 0u; k < 2u; k++) {
        double x_dot = 1.0;
        for (uint32_t repeat = 0u; repeat < 20u; repeat++) {
            double increment[MODEL_STATES];
            propagate_alike(&subjects[k], &frame, 0.0, x_dot, increment);
            TEST_ASSERT_TRUE(fabs(x_dot + increment[1]) < fabs(x_dot));
            x_dot += increment[1];
        }
    }
}

static void test_negative_damping_grows_in_any_step(void)
{
    for (uint32_t k = 1u; k <= 320u; k++) {
        const subject_t box = black_box(0.0, (double)k, 0.0);
        const frame_t frame = frame_of(true, ((k % 2u) == 0u) ? 2.0e-2 : 6.25e-2, 0.0, 0.0);
        double increment[MODEL_STATES];
        propagate_alike(&box, &frame, 0.0, 1.0, increment);
        TEST_ASSERT_TRUE(isfinite(increment[0]) && isfinite(increment[1]));
        TEST_ASSERT_TRUE(increment[1] > (double)k * (double)frame.step.period);
    }
}

/* --- pairs -------------------------------------------------------------------------------------------------------- */

/* What x_dot would change by if everything pulled the same way [rad/s]: rounding is in units of it. */
static double size_of_change(const model_points_t *points, const frame_t *frame)
{
    double greatest = 0.0;
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETER_POINTS; i++) {
        const float *of = points->arm[i].coefficient;
        const double own =
            fabs((double)of[LINEAR_STIFFNESS]) + fabs((double)of[LINEAR_DAMPING]); /* of 1 rad, 1 rad/s */
        const double base = fabs((double)of[LINEAR_BASE] * (double)frame->step.z_ddot);
        const double torque = fabs((double)of[LINEAR_TORQUE] * (double)frame->step.tau_m);
        greatest = greater_of(greatest, (double)frame->step.period * (own + base + torque));
    }
    return greatest;
}

static void test_pairs_are_what_their_points_are_by_themselves(void)
{
    const double spreads[] = {0.04, 4.0e-5, 4.0e-8};
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        const subject_t subject = random_subject(repeat);
        const frame_t frame = frame_of((repeat % 4u) < 2u, 1.0e-3, 2.0, 1.5);
        model_arm_t arms[MODEL_PARAMETER_POINTS];
        subject_t own[POINTS];
        const model_points_t points = spread_points(&subject, &frame, spreads[repeat % 3u], arms, own);
        const double error = pair_error(subject.model, &frame.constants, &frame.step, &points);
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)FLT_EPSILON * size_of_change(&points, &frame), 0.0, error);
    }
}

/* The rule that linear.h states, of the offset alone: however small it is, no difference of great numbers is in it. */
static void test_state_pairs_answer_to_their_offset_alone(void)
{
    const double spreads[] = {1.0, 1.0e-6, 1.0e-20};
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        const subject_t subject = random_subject(repeat);
        const frame_t frame = frame_of((repeat % 4u) < 2u, 1.0e-3, 2.0, 1.5);
        model_arm_t arms[MODEL_PARAMETER_POINTS];
        subject_t own[POINTS];
        const model_points_t points = spread_points(&subject, &frame, spreads[repeat % 3u], arms, own);
        model_response_t response;
        subject.model->respond(&frame.constants, &frame.step, &points, &response);
        const double half = 0.5 * (double)frame.step.period;
        const double slow = half * subject.plant.linear.damping;
        const double gain = 2.0 * (double)frame.step.period * ((slow > 0.0) ? (1.0 / (1.0 + slow)) : (1.0 - slow));
        for (uint32_t j = (uint32_t)L; j < (uint32_t)MODEL_PAIRS; j++) {
            const double rate = (double)points.offset[j][1];
            const double spring = subject.plant.linear.stiffness * ((double)points.offset[j][0] + (half * rate));
            const double damper = subject.plant.linear.damping * rate;
            const double rounding = 4.0 * (double)FLT_EPSILON * gain * (fabs(spring) + fabs(damper));
            TEST_ASSERT_DOUBLE_WITHIN(rounding, -gain * (spring + damper), (double)response.difference[j]);
            TEST_ASSERT_TRUE(response.bend[j] == 0.0f);
        }
    }
}

/* --- dynamics ----------------------------------------------------------------------------------------------------- */

/* A free decay with natural frequency f and damping ratio zeta < 1, from 1 at rest. */
static double free_decay(double f, double zeta, double time)
{
    const double omega = TURN * f;
    const double damped = omega * sqrt(1.0 - (zeta * zeta));
    return exp(-zeta * omega * time) * (cos(damped * time) + (zeta * omega / damped * sin(damped * time)));
}

static void test_dynamics_are_those_of_a_free_decay(void)
{
    uint32_t oscillating = 0u;
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        subject_t subject = random_subject(repeat);
        const frame_t frame = frame_of((repeat % 4u) < 2u, 1.0e-3, 0.0, 0.0);
        const model_arm_t arm = arm_of(&subject, &frame);
        const model_dynamics_t found = subject.model->dynamics(&frame.constants, &frame.step, &arm);
        if ((found.natural_frequency > 0.0f) && (fabsf(found.damping_ratio) < 0.99f)) {
            const double wanted = free_decay((double)found.natural_frequency, (double)found.damping_ratio, 0.1);
            subject.plant.theta = subject.plant.trim + 1.0;
            move(&subject.plant, 0.1, 0.0, 0.0);
            TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, wanted, subject.plant.theta - subject.plant.trim);
            oscillating++;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT32((uint32_t)REPEATS / 2u, oscillating);
}

static void test_an_aperiodic_arm_has_the_damping_ratio_of_its_equation(void)
{
    const float p[L] = {1.0f, 60.0f, 100.0f}; /* omega = 10 rad/s, c = 60 = 2 zeta m omega */
    model_arm_t arm;
    model_linear_physical.prepare(NULL, p, &arm);
    const model_dynamics_t found = model_linear_physical.dynamics(NULL, NULL, &arm);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 10.0 / TURN, (double)found.natural_frequency);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 3.0, (double)found.damping_ratio);
}

static void test_without_a_restoring_stiffness_there_is_no_frequency(void)
{
    const float a21[] = {0.0f, 1.0e-6f, 300.0f};
    for (uint32_t k = 0u; k < 3u; k++) {
        const float p[L] = {a21[k], -10.0f, 1.0f};
        model_arm_t arm;
        model_linear_black_box.prepare(NULL, p, &arm);
        const model_dynamics_t found = model_linear_black_box.dynamics(NULL, NULL, &arm);
        TEST_ASSERT_TRUE((found.natural_frequency == 0.0f) && (found.damping_ratio == 0.0f));
    }
}

/* --- descriptors -------------------------------------------------------------------------------------------------- */

static void assert_parameter(
    const model_parameter_t *parameter, const char *name, const char *unit, float signal_least, float signal_greatest)
{
    TEST_ASSERT_EQUAL_STRING(name, parameter->name);
    TEST_ASSERT_EQUAL_STRING(unit, parameter->unit);
    TEST_ASSERT_TRUE((parameter->least >= signal_least) && (parameter->greatest <= signal_greatest));
    TEST_ASSERT_TRUE(parameter->least < parameter->greatest);
}

static void test_parameters_have_their_names_and_units_and_fit_into_their_can_signals(void)
{
    const model_t *model = &model_linear_physical;
    TEST_ASSERT_EQUAL_STRING("linear_physical", model->name);
    assert_parameter(&model->parameter[0], "m", "kg", 0.001f, 65.535f);
    assert_parameter(&model->parameter[1], "c", "N s/m", 0.01f, 655.35f);
    assert_parameter(&model->parameter[2], "k", "N/m", 0.1f, 6553.5f);
    model = &model_linear_black_box;
    TEST_ASSERT_EQUAL_STRING("linear_black_box", model->name);
    assert_parameter(&model->parameter[0], "a21", "1/s^2", -3276.8f, 3276.7f);
    assert_parameter(&model->parameter[1], "a22", "1/s", -327.68f, 327.67f);
    assert_parameter(&model->parameter[2], "b21", "1", -32.768f, 32.767f);
}

static void test_only_the_black_box_takes_either_sign(void)
{
    TEST_ASSERT_TRUE(model_linear_physical.positive && model_lever.positive);
    TEST_ASSERT_FALSE(model_linear_black_box.positive);
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        TEST_ASSERT_TRUE(model_linear_physical.parameter[i].least > 0.0f); /* log-scaled */
        TEST_ASSERT_TRUE(model_linear_black_box.parameter[i].least < 0.0f);
        TEST_ASSERT_TRUE(model_linear_black_box.parameter[i].greatest > 0.0f);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_point_follows_the_equation_with_its_own_state_and_parameters);
    RUN_TEST(test_halving_the_step_makes_the_error_of_a_step_eight_times_smaller);
    RUN_TEST(test_rests_at_the_trim_or_at_the_preload_angle_of_the_lever);
    RUN_TEST(test_base_and_torque_push_with_the_sign_and_size_of_the_equations);
    RUN_TEST(test_without_stiffness_and_damping_it_flies);
    RUN_TEST(test_heavy_damping_and_a_long_step_still_decay);
    RUN_TEST(test_negative_damping_grows_in_any_step);
    RUN_TEST(test_pairs_are_what_their_points_are_by_themselves);
    RUN_TEST(test_state_pairs_answer_to_their_offset_alone);
    RUN_TEST(test_dynamics_are_those_of_a_free_decay);
    RUN_TEST(test_an_aperiodic_arm_has_the_damping_ratio_of_its_equation);
    RUN_TEST(test_without_a_restoring_stiffness_there_is_no_frequency);
    RUN_TEST(test_parameters_have_their_names_and_units_and_fit_into_their_can_signals);
    RUN_TEST(test_only_the_black_box_takes_either_sign);
    return UNITY_END();
}
