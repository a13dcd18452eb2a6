/* What every model keeps to at its limits: rest, heavy and negative damping, a lever that falls, a trunk that gives
 * way. What they compute otherwise is compared with the float64 oracle (tests/python/oracle). */
#include "model/base_motion.h"
#include "model/model.h"
#include "random.h"
#include "test.h"

#include <math.h>
#include <string.h>

enum { MODELS = 4, KINDS = 2 * MODELS, L = MODEL_PARAMETERS };

#define TRIM 0.37
#define GRAVITY 9.80665

static const model_t *const models[MODELS] = {
    &model_lever, &model_linear_physical, &model_linear_black_box, &model_hand};

/* A model with its constants, at an angle [rad] and rate. Trim, preload angles and origin differ, so that mixing
 * them up shows. */
typedef struct subject {
    const model_t *model;
    model_constants_t constants;
    model_step_t step;
    double theta;
    double theta_dot;
    float p[L];
} subject_t;

/* Model kind / 2, at rest, in preload trim when kind is even. */
static subject_t subject_of(uint32_t kind, const float p[L], float period)
{
    const bool trim = ((kind % 2u) == 0u);
    return (subject_t){.model = models[kind / 2u],
        .constants = {.length = 0.45f,
            .length_squared = 0.2025f,
            .inertia = 0.08075f,
            .mass_moment = 0.6f,
            .damping = 0.5f,
            .stiffness = 9.0f,
            .arm_preload_sine = sinf(0.44f),
            .lever_preload_angle = -0.17f,
            .hand_inertia = 0.587f,
            .trim = trim},
        .step = {.period = period,
            .origin = 0.31f,
            .trim = (float)TRIM,
            .trim_sine = (float)sin(TRIM),
            .trim_cosine = (float)cos(TRIM)},
        .theta = trim ? TRIM : -0.17, /* where a linear system rests */
        .p = {p[0], p[1], p[2]}};
}

/* What a step changes theta_dot by, with all sigma points in the same place. */
static double mean_change(const subject_t *subject)
{
    model_coefficients_t coefficients[MODEL_POINTS];
    const model_points_t points = {
        .x = {(float)(subject->theta - (double)subject->step.origin), (float)subject->theta_dot},
        .coefficients = coefficients};
    model_response_t response;
    (void)memset(coefficients, 0xFF, sizeof coefficients); /* not a number: each model sets all of them */
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        subject->model->prepare(&subject->constants, subject->p, &coefficients[k]);
    }
    subject->model->respond(&subject->constants, &subject->step, &points, &response);
    return (double)response.mean;
}

/* In preload fixed the lever's arm rests where its spring bears its weight. */
TEST_EACH(KINDS, at_rest_it_stays_at_rest)
{
    static const float p[MODELS][L] = {
        {2.5f, 42.0f, 1500.0f}, {2.5f, 42.0f, 1500.0f}, {-465.0f, -13.7f, -2.2f}, {500.0f, 13.5f, 9.0f}};
    subject_t subject = subject_of(test_round, p[test_round / 2u], 1.0e-3f);
    if (test_round == 1u) {
        subject.constants.arm_preload_sine = (float)(sin(-0.17) + (GRAVITY * 3.1 / (1500.0 * 0.45)));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, 0.0, mean_change(&subject));
}

/* The arm hangs on a trunk that has moved by s = seat l cos(trim): its spring and damper pull by l cos(theta) (k_p s
 * + c_p s_dot) more. To first order in seat. */
TEST(a_trunk_that_gives_way_pulls_by_spring_and_damper_of_the_arm)
{
    random_source_t source = {11u};
    for (uint32_t repeat = 0u; repeat < 100u; repeat++) {
        const double k = random_between(&source, 200.0, 4000.0);
        const double c = random_between(&source, 10.0, 150.0);
        const double seat = random_between(&source, -0.004, 0.004);
        const double seat_dot = random_between(&source, -0.1, 0.1);
        const float p[L] = {(float)random_between(&source, 1.0, 5.0), (float)c, (float)k};
        subject_t subject = subject_of(0u, p, 1.0e-3f);
        subject.step.z_ddot = (float)random_between(&source, -5.0, 5.0);
        subject.step.tau_m = 1.5f;
        subject.theta += random_between(&source, -0.02, 0.02);
        subject.theta_dot = random_between(&source, -1.5, 1.5);
        const double rigid = mean_change(&subject);
        const double inertia = 0.08075 + (0.2025 * (double)p[0]);
        const double gain = 1.0e-3 * 0.2025 * cos(TRIM) * cos(TRIM) / inertia;
        subject.model = &model_lever_on_seat;
        subject.step.seat = (float)seat;
        subject.step.seat_dot = (float)seat_dot;
        subject.step.tau_m -= (float)((9.0 * seat) + (0.5 * seat_dot));
        const double tolerance = 0.08 * gain * ((k * 0.004) + (c * 0.1));
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, gain * ((k * seat) + (c * seat_dot)), mean_change(&subject) - rigid);
    }
}

TEST_EACH(MODELS, heavy_damping_and_a_long_step_still_decay)
{
    static const float p[MODELS][L] = {
        {0.3f, 400.0f, 200.0f}, {0.05f, 600.0f, 1.0f}, {-1.0f, -320.0f, 0.0f}, {20.0f, 320.0f, 0.1f}};
    subject_t subject = subject_of(2u * test_round, p[test_round], 2.0e-2f);
    for (double rate = 1.0; fabs(rate) > 1.0e-6;) {
        subject.theta_dot = rate;
        const double next = rate + mean_change(&subject);
        TEST_ASSERT_TRUE(fabs(next) < fabs(rate));
        rate = next;
    }
}

TEST(negative_damping_grows_in_any_step)
{
    for (uint32_t k = 1u; k <= 320u; k++) {
        const float p[L] = {0.0f, (float)k, 0.0f};
        subject_t subject = subject_of(4u, p, ((k % 2u) == 0u) ? 2.0e-2f : 6.25e-2f);
        subject.theta_dot = 1.0;
        TEST_ASSERT_TRUE(mean_change(&subject) > (double)k * (double)subject.step.period);
        TEST_ASSERT_TRUE(isfinite(mean_change(&subject)));
    }
}

TEST(a_lever_that_falls_has_a_negative_stiffness)
{
    static const float soft[L] = {2.5f, 42.0f, 50.0f};
    subject_t subject = subject_of(1u, soft, 1.0e-3f);
    model_coefficients_t coefficients;
    subject.constants.stiffness = 0.0f;
    subject.step.trim_sine = sinf(1.3f);
    subject.step.trim_cosine = cosf(1.3f);
    subject.model->prepare(&subject.constants, subject.p, &coefficients);
    TEST_ASSERT_TRUE(subject.model->dynamics(&subject.constants, &subject.step, &coefficients).stiffness < 0.0f);
}

TEST(a_trim_beyond_78_degrees_is_taken_for_that)
{
    const model_constants_t constants = {.length = 0.5f};
    const float cosine[] = {0.25f, 0.2f, 0.1f};
    const float angle[] = {8.0f, 10.0f, 10.0f};
    for (uint32_t k = 0u; k < 3u; k++) {
        const model_step_t step = {.trim_cosine = cosine[k]};
        TEST_ASSERT_EQUAL_FLOAT(angle[k], base_motion_angle(&constants, &step));
    }
}

/* 0.1 Hz. */
TEST(a_soft_seat_is_a_seat)
{
    const model_constants_t constants = {.length = 0.5f, .seat_stiffness = 0.4f};
    model_step_t step = {.period = 0.01f, .z_ddot = -1.0f, .trim_cosine = 1.0f};
    base_motion_t motion = {0.0f, 0.0f};
    for (uint32_t k = 0u; k < 100u; k++) {
        base_motion_step(&motion, &constants, &step);
    }
    TEST_ASSERT_FLOAT_WITHIN(0.005f, (1.0f - cosf(sqrtf(0.4f))) / 0.4f, motion.seat);
}
