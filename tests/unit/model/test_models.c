/* What every model keeps to at its limits: rest, heavy and negative damping, a lever that falls. */
#include "../math/random.h"
#include "constants.h"
#include "test.h"

enum { MODELS = 4, KINDS = 2 * MODELS, REPEATS = 300, L = MODEL_PARAMETERS };

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

/* --- the model's side --------------------------------------------------------------------------------------------- */

/* What a step changes theta_dot by, with all sigma points in the same place. */
static double mean_change(const subject_t *subject)
{
    const float p[L] = {(float)subject->p[0], (float)subject->p[1], (float)subject->p[2]};
    model_coefficients_t coefficients[MODEL_POINTS];
    const model_points_t points = {
        .x = {(float)(subject->plant.theta - (double)subject->step.origin), (float)subject->plant.theta_dot},
        .coefficients = coefficients};
    model_response_t response;
    for (uint32_t k = 0u; k < (uint32_t)MODEL_POINTS; k++) {
        subject->model->prepare(&subject->constants, p, &coefficients[k]);
    }
    subject->model->respond(&subject->constants, &subject->step, &points, &response);
    return (double)response.mean;
}

/* --- limits ------------------------------------------------------------------------------------------------------- */

/* In preload fixed the lever's arm rests where its spring bears its weight. */
TEST(at_rest_it_stays_at_rest)
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
TEST(a_trunk_that_gives_way_pulls_by_spring_and_damper_of_the_arm)
{
    for (uint32_t repeat = 0u; repeat < (uint32_t)REPEATS; repeat++) {
        const double p[L] = {random_between(&source, 1.0, 5.0), random_between(&source, 10.0, 150.0),
            random_between(&source, 200.0, 4000.0)};
        subject_t subject = subject_of(0u, p, 1.0e-3, random_between(&source, -5.0, 5.0), 1.5);
        plant_t *plant = &subject.plant;
        plant->theta_dot = random_between(&source, -1.5, 1.5);
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

TEST(heavy_damping_and_a_long_step_still_decay)
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

TEST(negative_damping_grows_in_any_step)
{
    for (uint32_t k = 1u; k <= 320u; k++) {
        const double p[L] = {0.0, (double)k, 0.0};
        subject_t subject = subject_of(4u, p, ((k % 2u) == 0u) ? 2.0e-2 : 6.25e-2, 0.0, 0.0);
        subject.plant.theta_dot = 1.0;
        TEST_ASSERT_TRUE(mean_change(&subject) > (double)k * (double)subject.step.period);
        TEST_ASSERT_TRUE(isfinite(mean_change(&subject)));
    }
}

static model_dynamics_t dynamics_of(const subject_t *subject)
{
    const float p[L] = {(float)subject->p[0], (float)subject->p[1], (float)subject->p[2]};
    model_coefficients_t coefficients;
    subject->model->prepare(&subject->constants, p, &coefficients);
    return subject->model->dynamics(&subject->constants, &subject->step, &coefficients);
}

TEST(a_lever_that_falls_has_a_negative_stiffness)
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
TEST(descriptors_have_names_units_and_bounds)
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
