/* Every model against its equation of motion in double: the response to a step against the discretisation that the
 * headers state, that against the equation integrated by Runge and Kutta, and the dynamics against the equation
 * linearised numerically. */
#include "../math/dense.h"
#include "constants.h"
#include "unity.h"

enum { MODELS = 4, KINDS = 2 * MODELS, REPEATS = 300, FINE = 200, L = MODEL_PARAMETERS };

#define TRIM 0.37

typedef struct subject {
    const model_t *model;
    model_constants_t constants;
    model_step_t step;
    plant_t plant; /* in motion */
    double p[L];
} subject_t;

static const model_t *const models[MODELS] = {
    &model_lever, &model_linear_physical, &model_linear_black_box, &model_hand};
static random_source_t source;

void setUp(void)
{
    source.state = 11u;
}

void tearDown(void)
{
}

/* --- subjects ----------------------------------------------------------------------------------------------------- */

/* The plant with other parameters, in the same state. */
static plant_t plant_with(const subject_t *subject, const double p[L])
{
    plant_t plant = subject->plant;
    if (subject->model == &model_linear_physical) {
        plant.linear = plant_physical(p[0], p[1], p[2]).linear;
    } else if (subject->model == &model_linear_black_box) {
        plant.linear = plant_black_box(p[0], p[1], p[2]).linear;
    } else if (subject->model == &model_hand) {
        const double inertia = (0.25 * 0.45 * 0.45 * 1.2) + 0.020 + (0.45 * 0.45 * 2.5);
        plant.linear = (plant_linear_t){p[0], p[1], -1.0 / (0.45 * cos(TRIM)), 1.0 / inertia, p[2]};
    } else {
        plant.m_p = p[0];
        plant.c_p = p[1];
        plant.k_p = p[2];
    }
    return plant;
}

/* Model kind / 2, in preload trim when kind is even. Trim, preload angles and origin differ, so that mixing them up
 * shows. */
static subject_t subject_of(uint32_t kind, const double p[L], double period, double z_ddot, double tau_m)
{
    subject_t subject = {.model = models[kind / 2u], .plant = plant_typical(), .p = {p[0], p[1], p[2]}};
    plant_t *plant = &subject.plant;
    plant->is_linear = (kind >= 2u);
    plant->follows_trim = ((kind % 2u) == 0u);
    plant->arm_preload_angle = 0.44;
    plant->lever_preload_angle = -0.17;
    plant->trim = TRIM;
    plant->z_dot = 0.3;
    plant->stiffness = 9.0;
    *plant = plant_with(&subject, p);
    subject.constants = constants_of(plant);
    subject.step = (model_step_t){.period = (float)period,
        .z_ddot = (float)z_ddot,
        .seat_dot = (float)(-plant->z_dot / (0.45 * cos(TRIM))),
        .tau_m = (float)tau_m,
        .origin = 0.31f,
        .trim = (float)plant->trim,
        .trim_sine = (float)sin(plant->trim),
        .trim_cosine = (float)cos(plant->trim)};
    if (plant->is_linear && !plant->follows_trim) {
        plant->trim = plant->lever_preload_angle; /* where a linear system rests */
    }
    plant->theta = plant->trim;
    return subject;
}

static subject_t random_subject(uint32_t kind, double period)
{
    const double least[MODELS][L] = {{1.0, 10.0, 200.0}, {1.0, 10.0, 200.0}, {-1500.0, -80.0, -5.0}, {200.0, 3.0, 1.0}};
    const double greatest[MODELS][L] = {
        {5.0, 150.0, 4000.0}, {5.0, 150.0, 4000.0}, {500.0, 30.0, 5.0}, {1500.0, 40.0, 30.0}};
    double p[L];
    for (uint32_t i = 0u; i < (uint32_t)L; i++) {
        p[i] = random_between(&source, least[kind / 2u][i], greatest[kind / 2u][i]);
    }
    const double z_ddot = random_between(&source, -5.0, 5.0);
    subject_t subject = subject_of(kind, p, period, z_ddot, random_between(&source, -3.0, 3.0));
    subject.plant.theta += random_between(&source, -0.1, 0.1);
    subject.plant.theta_dot = random_between(&source, -1.5, 1.5);
    subject.plant.z_dot = random_between(&source, -0.5, 0.5);
    subject.step.seat_dot = (float)(-subject.plant.z_dot / (0.45 * cos(TRIM)));
    return subject;
}

/* --- the discretisation in double --------------------------------------------------------------------------------- */

static double acceleration(const subject_t *subject, const plant_t *plant, double theta, double theta_dot)
{
    return plant_acceleration(plant, theta, theta_dot, (double)subject->step.z_ddot, (double)subject->step.tau_m);
}

/* Linearly implicit midpoint: acceleration at the middle angle, over 1 + T/2 d; for d < 0 times 1 - T/2 d. */
static double change_of(const subject_t *subject, const plant_t *plant)
{
    const double period = (double)subject->step.period;
    const double middle = plant->theta + (0.5 * period * plant->theta_dot);
    const double damping = acceleration(subject, plant, middle, 0.0) - acceleration(subject, plant, middle, 1.0);
    const double half = 0.5 * period * damping;
    const double change = period * acceleration(subject, plant, middle, plant->theta_dot);
    return (half > 0.0) ? (change / (1.0 + half)) : (change * (1.0 - half));
}

/* What theta_dot would change by if everything pulled the same way [rad/s]: rounding is in units of it. */
static double size_of_change(const subject_t *subject)
{
    const plant_t *plant = &subject->plant;
    const double h = 1.0e-4;
    const double at = plant_acceleration(plant, plant->theta, 0.0, 0.0, 0.0);
    const double spring = fabs(plant_acceleration(plant, plant->theta + h, 0.0, 0.0, 0.0) - at) / h;
    const double damper = fabs(plant_acceleration(plant, plant->theta, 1.0, 0.0, 0.0) - at);
    const double base = fabs(plant_acceleration(plant, plant->theta, 0.0, 1.0, 0.0) - at);
    const double torque = fabs(plant_acceleration(plant, plant->theta, 0.0, 0.0, 1.0) - at);
    return (double)subject->step.period * (spring + (2.0 * damper) + (15.0 * base) + (3.0 * torque));
}

/* --- the model's side --------------------------------------------------------------------------------------------- */

/* Response to a step; pair j has the parameters p (1 +- spread (j + 1) / 10), and a state that is so far apart. */
static model_response_t respond(const subject_t *subject, double spread, plant_t plants[MODEL_POINTS])
{
    model_coefficients_t coefficients[MODEL_POINTS];
    model_points_t points = {
        .x = {(float)(subject->plant.theta - (double)subject->step.origin), (float)subject->plant.theta_dot},
        .coefficients = coefficients};
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        const uint32_t j = (k == 0u) ? 0u : ((k - 1u) / 2u);
        const double away = (k == 0u) ? 0.0 : (((k % 2u) == 1u) ? spread : -spread) * (double)(j + 1u);
        const double p[L] = {subject->p[0] * (1.0 + (0.1 * away)), subject->p[1] * (1.0 - (0.1 * away)),
            subject->p[2] * (1.0 + (0.2 * away))};
        const float single[L] = {(float)p[0], (float)p[1], (float)p[2]};
        subject->model->prepare(&subject->constants, single, &coefficients[k]);
        plants[k] = plant_with(subject, p);
        plants[k].theta += 0.03 * away;
        plants[k].theta_dot -= 0.3 * away;
        points.offset[j][0] = (float)(0.03 * spread * (double)(j + 1u));
        points.offset[j][1] = (float)(-0.3 * spread * (double)(j + 1u));
    }
    model_response_t response;
    subject->model->respond(&subject->constants, &subject->step, &points, &response);
    return response;
}

static double mean_change(const subject_t *subject)
{
    plant_t plants[MODEL_POINTS];
    return (double)respond(subject, 0.0, plants).mean;
}

static void test_mean_differences_and_second_differences_are_those_of_the_discretisation(void)
{
    const double spreads[] = {1.0, 1.0e-2, 0.0};
    for (uint32_t repeat = 0u; repeat < (uint32_t)(3 * REPEATS); repeat++) {
        plant_t plants[MODEL_POINTS];
        const subject_t subject = random_subject(repeat % (uint32_t)KINDS, 1.0e-3);
        const model_response_t found = respond(&subject, spreads[repeat % 3u], plants);
        const double rounding = 8.0 * (double)FLT_EPSILON * size_of_change(&subject);
        const double mean = change_of(&subject, &plants[0]);
        TEST_ASSERT_DOUBLE_WITHIN(rounding, mean, (double)found.mean);
        for (uint32_t j = 0u; j < (uint32_t)L; j++) {
            const double plus = change_of(&subject, &plants[1u + (2u * j)]);
            const double minus = change_of(&subject, &plants[2u + (2u * j)]);
            TEST_ASSERT_DOUBLE_WITHIN(2.0 * rounding, plus - minus, (double)found.difference[j]);
            TEST_ASSERT_DOUBLE_WITHIN(2.0 * rounding, plus + minus - (2.0 * mean), (double)found.second_difference[j]);
        }
    }
}

static void test_slope_is_the_derivative_of_the_discretisation_by_the_state(void)
{
    const double h = 1.0e-5;
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        plant_t plants[MODEL_POINTS];
        const double period = ((repeat % 2u) == 0u) ? 1.0e-3 : 2.0e-2;
        const subject_t subject = random_subject(repeat % (uint32_t)KINDS, period);
        const model_response_t found = respond(&subject, 0.0, plants);
        plant_t above = subject.plant;
        plant_t below = subject.plant;
        above.theta += h;
        below.theta -= h;
        const double by_theta = (change_of(&subject, &above) - change_of(&subject, &below)) / (2.0 * h);
        above = subject.plant;
        below = subject.plant;
        above.theta_dot += h;
        below.theta_dot -= h;
        const double by_rate = (change_of(&subject, &above) - change_of(&subject, &below)) / (2.0 * h);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * size_of_change(&subject), by_theta, (double)found.slope[0]);
        TEST_ASSERT_DOUBLE_WITHIN(2.0e-6 * size_of_change(&subject), by_rate, (double)found.slope[1]);
    }
}

/* --- the equation of motion --------------------------------------------------------------------------------------- */

/* What a step of the model is off by in theta [rad] and theta_dot [rad/s]; theta by the midpoint rule that all models
 * share. */
static void error_of_step(const subject_t *subject, double error[2])
{
    const double period = (double)subject->step.period;
    const double change = mean_change(subject);
    plant_t plant = subject->plant;
    for (uint32_t k = 0u; k < (uint32_t)FINE; k++) {
        plant_runge_kutta(&plant, period / (double)FINE, (double)subject->step.z_ddot, (double)subject->step.tau_m);
    }
    error[0] = fabs(subject->plant.theta + (period * (subject->plant.theta_dot + (0.5 * change))) - plant.theta);
    error[1] = fabs(subject->plant.theta_dot + change - plant.theta_dot);
}

static void test_a_step_follows_the_equation_of_motion(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        const subject_t subject = random_subject(repeat % (uint32_t)KINDS, 1.0e-4);
        double error[2];
        error_of_step(&subject, error);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-9, 0.0, error[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-6, 0.0, error[1]);
    }
}

static void test_halving_the_step_makes_its_error_eight_times_smaller(void)
{
    const double p[MODELS][L] = {{2.5, 42.0, 1500.0}, {2.5, 42.0, 1500.0}, {300.0, 20.0, 2.0}, {500.0, 13.5, 9.0}};
    for (uint32_t kind = 0u; kind < (uint32_t)KINDS; kind++) {
        double error[2][2];
        for (uint32_t k = 0u; k < 2u; k++) {
            subject_t subject = subject_of(kind, p[kind / 2u], (k == 0u) ? 2.0e-3 : 1.0e-3, 2.0, 1.5);
            subject.plant.theta += 0.1;
            subject.plant.theta_dot = 1.0;
            error_of_step(&subject, error[k]);
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.5, 8.0, error[0][0] / error[1][0]);
        TEST_ASSERT_DOUBLE_WITHIN(0.5, 8.0, error[0][1] / error[1][1]);
    }
}

/* In preload fixed the lever's arm rests where its spring bears its weight. */
static void test_at_rest_it_stays_at_rest(void)
{
    const double p[MODELS][L] = {{2.5, 42.0, 1500.0}, {2.5, 42.0, 1500.0}, {-465.0, -13.7, -2.2}, {500.0, 13.5, 9.0}};
    for (uint32_t kind = 0u; kind < (uint32_t)KINDS; kind++) {
        subject_t subject = subject_of(kind, p[kind / 2u], 1.0e-3, 0.0, 0.0);
        subject.step.seat_dot = 0.0f;
        if (kind == 1u) {
            const double mu = (subject.plant.mass_position * subject.plant.mass) + subject.plant.m_p;
            const double bears = PLANT_GRAVITY * mu / (subject.plant.k_p * subject.plant.length);
            subject.plant.theta = -0.17; /* of the lever's own spring */
            subject.constants.arm_preload_sine = (float)(sin(-0.17) + bears);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-7, 0.0, mean_change(&subject));
    }
}

/* The arm hangs on a trunk that has moved by s = seat l cos(trim): its spring and damper pull by l cos(theta) (k_p s + c_p
 * s_dot) more. To first order in seat. */
static void test_a_trunk_that_gives_way_pulls_by_spring_and_damper_of_the_arm(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        subject_t subject = random_subject(0u, 1.0e-3);
        plant_t *plant = &subject.plant;
        plant->theta = plant->trim + random_between(&source, -0.02, 0.02);
        const double rigid = mean_change(&subject);
        const double seat = random_between(&source, -0.004, 0.004);
        const double seat_dot = random_between(&source, -0.1, 0.1);
        const double inertia = plant_inertia(plant);
        const double rise = plant->length * cos(plant->trim);
        const double pull = rise * rise * ((plant->k_p * seat) + (plant->c_p * seat_dot)) / inertia;
        subject.model = &model_lever_on_seat;
        subject.step.seat = (float)seat;
        subject.step.seat_dot = (float)seat_dot;
        subject.step.tau_m -= (float)((plant->stiffness * seat) + (plant->damping * seat_dot));
        const double size = rise * rise * ((plant->k_p * 0.004) + (plant->c_p * 0.1)) / inertia;
        TEST_ASSERT_DOUBLE_WITHIN(0.05 * 1.0e-3 * size, 1.0e-3 * pull, mean_change(&subject) - rigid);
    }
}

static void test_heavy_damping_and_a_long_step_still_decay(void)
{
    const double p[MODELS][L] = {{0.3, 400.0, 200.0}, {0.05, 600.0, 1.0}, {-1.0, -320.0, 0.0}, {20.0, 320.0, 0.1}};
    for (uint32_t model = 0u; model < (uint32_t)MODELS; model++) {
        subject_t subject = subject_of(2u * model, p[model], 2.0e-2, 0.0, 0.0);
        subject.step.seat_dot = 0.0f;
        for (double rate = 1.0; fabs(rate) > 1.0e-6;) {
            subject.plant.theta_dot = rate;
            const double next = rate + mean_change(&subject);
            TEST_ASSERT_TRUE(fabs(next) < fabs(rate));
            rate = next;
        }
    }
}

static void test_negative_damping_grows_in_any_step(void)
{
    for (uint32_t k = 1u; k <= 320u; k++) {
        const double p[L] = {0.0, (double)k, 0.0};
        subject_t subject = subject_of(4u, p, ((k % 2u) == 0u) ? 2.0e-2 : 6.25e-2, 0.0, 0.0);
        subject.plant.theta_dot = 1.0;
        TEST_ASSERT_TRUE(mean_change(&subject) > (double)k * (double)subject.step.period);
        TEST_ASSERT_TRUE(isfinite(mean_change(&subject)));
    }
}

/* --- dynamics ----------------------------------------------------------------------------------------------------- */

static model_dynamics_t dynamics_of(const subject_t *subject)
{
    const float p[L] = {(float)subject->p[0], (float)subject->p[1], (float)subject->p[2]};
    model_coefficients_t coefficients;
    subject->model->prepare(&subject->constants, p, &coefficients);
    return subject->model->dynamics(&subject->constants, &subject->step, &coefficients);
}

static void test_dynamics_are_those_of_the_equation_linearised_at_the_trim(void)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        const subject_t subject = random_subject(repeat % (uint32_t)KINDS, 1.0e-3);
        const model_dynamics_t found = dynamics_of(&subject);
        const double stiffness = plant_stiffness(&subject.plant);
        const double damping = plant_damping(&subject.plant);
        const double forcing = plant_forcing(&subject.plant);
        TEST_ASSERT_DOUBLE_WITHIN(1.0e-5 * (fabs(stiffness) + 1.0), stiffness, (double)found.stiffness);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-6 * fabs(damping), damping, (double)found.damping);
        TEST_ASSERT_DOUBLE_WITHIN(5.0e-6 * fabs(forcing), forcing, (double)found.forcing);
        TEST_ASSERT_EQUAL_FLOAT((float)subject.plant.linear.space, found.space);
    }
}

static void test_a_lever_that_falls_has_a_negative_stiffness(void)
{
    const double soft[L] = {2.5, 42.0, 50.0};
    subject_t subject = subject_of(1u, soft, 1.0e-3, 0.0, 0.0);
    subject.constants.stiffness = 0.0f;
    subject.step.trim_sine = sinf(1.3f);
    subject.step.trim_cosine = cosf(1.3f);
    TEST_ASSERT_TRUE(dynamics_of(&subject).stiffness < 0.0f);
}

/* --- descriptors -------------------------------------------------------------------------------------------------- */

/* Bounds fit into the CAN signals (lever.dbc) and hold every pilot of the design with room. */
static void test_descriptors_have_names_units_and_bounds(void)
{
    static const model_t expected[MODELS] = {{.name = "lever",
                                                 .parameter = {{"m_p", "kg", 0.001f, 65.535f},
                                                     {"c_p", "N s/m", 0.01f, 655.35f}, {"k_p", "N/m", 0.1f, 6553.5f}}},
        {.name = "linear_physical",
            .parameter = {{"m", "kg", 0.001f, 65.535f}, {"c", "N s/m", 0.01f, 655.35f}, {"k", "N/m", 0.1f, 6553.5f}}},
        {.name = "linear_black_box",
            .parameter = {{"a21", "1/s^2", -3276.8f, 3276.7f}, {"a22", "1/s", -327.68f, 327.67f},
                {"b21", "1", -32.768f, 32.767f}}},
        {.name = "hand",
            .parameter = {{"k_hand", "1/s^2", 0.1f, 6553.4f}, {"c_hand", "1/s", 0.01f, 655.34f},
                {"c_space", "1/s", 0.01f, 655.34f}}}};
    const float arm[2][L] = {{1.0f, 10.0f, 200.0f}, {5.0f, 150.0f, 4000.0f}};
    const float hand[2][L] = {{100.0f, 4.0f, 2.0f}, {2000.0f, 60.0f, 40.0f}};
    for (uint32_t model = 0u; model < (uint32_t)MODELS; model++) {
        const float (*pilot)[L] = (model == 3u) ? hand : arm;
        TEST_ASSERT_EQUAL_STRING(expected[model].name, models[model]->name);
        TEST_ASSERT_EQUAL(model != 2u, models[model]->positive);
        for (uint32_t i = 0u; i < (uint32_t)L; i++) {
            const model_parameter_t *parameter = &models[model]->parameter[i];
            const model_parameter_t *signal = &expected[model].parameter[i];
            TEST_ASSERT_EQUAL_STRING(signal->name, parameter->name);
            TEST_ASSERT_EQUAL_STRING(signal->unit, parameter->unit);
            TEST_ASSERT_TRUE((parameter->least >= signal->least) && (parameter->greatest <= signal->greatest));
            TEST_ASSERT_TRUE((model == 2u) || (parameter->least <= 0.5f * pilot[0][i]));
            TEST_ASSERT_TRUE((model == 2u) || (parameter->greatest >= 1.5f * pilot[1][i]));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_mean_differences_and_second_differences_are_those_of_the_discretisation);
    RUN_TEST(test_slope_is_the_derivative_of_the_discretisation_by_the_state);
    RUN_TEST(test_a_step_follows_the_equation_of_motion);
    RUN_TEST(test_halving_the_step_makes_its_error_eight_times_smaller);
    RUN_TEST(test_at_rest_it_stays_at_rest);
    RUN_TEST(test_a_trunk_that_gives_way_pulls_by_spring_and_damper_of_the_arm);
    RUN_TEST(test_heavy_damping_and_a_long_step_still_decay);
    RUN_TEST(test_negative_damping_grows_in_any_step);
    RUN_TEST(test_dynamics_are_those_of_the_equation_linearised_at_the_trim);
    RUN_TEST(test_a_lever_that_falls_has_a_negative_stiffness);
    RUN_TEST(test_descriptors_have_names_units_and_bounds);
    return UNITY_END();
}
