/* Where single precision hurts most: measurement noise near its resolution, R set to match, little process noise. Most
 * known filters turn to NaN, stick, or are silently wrong by 30 to 60 % here. Through the C API. */
#include "rig.h"

enum {
    COMBINATIONS = LEVER_MODEL_COUNT * LEVER_PRELOAD_COUNT * LEVER_ESTIMATOR_COUNT * LEVER_ADAPTATION_COUNT,
    RUNS = 10 * COMBINATIONS
};

static lever_config_t config;
static lever_memory_t memory;
static lever_t *lever;
static rig_t rig;
static double truth[LEVER_PARAMETERS];

void setUp(void)
{
    lever_config_default(&config);
    rig = rig_of(config.model, truth);
}

void tearDown(void)
{
}

/* Noise of the simulation, and what the filter is told of it. */
static void start(double theta_noise, double theta_dot_noise, double process_noise)
{
    rig.simulation.theta_noise = theta_noise;
    rig.simulation.theta_dot_noise = theta_dot_noise;
    rig.simulation.process_noise = process_noise;
    config.settings.theta_noise = (float)theta_noise;
    config.settings.theta_dot_noise = (float)theta_dot_noise;
    config.settings.theta_dot_process_noise = (float)process_noise;
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
}

/* Every parameter within 2 % from `from` to `to` seconds, never a restart. */
static void assert_within_two_per_cent(uint32_t from, uint32_t to)
{
    (void)rig_run(&rig, lever, 1000u * from);
    for (uint32_t tenth = 0u; tenth < (10u * (to - from)); tenth++) {
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 100u));
        const lever_estimate_t estimate = rig_estimate(lever);
        for (uint32_t i = 0u; i < 3u; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(0.02 * fabs(truth[i]), truth[i], (double)estimate.parameter[i]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
}

static void test_a_microradian_converges_within_two_per_cent_and_stays(void)
{
    start(1.0e-6, 1.0e-5, 5.0e-4);
    assert_within_two_per_cent(10u, 60u);
}

static void test_a_microradian_with_every_model_estimator_and_adaptation(void)
{
    for (uint32_t run = 0u; run < (uint32_t)(LEVER_MODEL_COUNT * LEVER_ESTIMATOR_COUNT * LEVER_ADAPTATION_COUNT);
        run++) {
        lever_config_default(&config);
        config.model = (uint8_t)(run % (uint32_t)LEVER_MODEL_COUNT);
        config.estimator = (uint8_t)((run / (uint32_t)LEVER_MODEL_COUNT) % (uint32_t)LEVER_ESTIMATOR_COUNT);
        config.adaptation = (uint8_t)(run / (uint32_t)(LEVER_MODEL_COUNT * LEVER_ESTIMATOR_COUNT));
        rig = rig_of(config.model, truth);
        start(1.0e-6, 1.0e-5, 5.0e-4);
        assert_within_two_per_cent(20u, 60u);
    }
}

/* The lever has to fall into its springs first, which shows the filter how wrong its first guess is a million times more
 * clearly than it can be right about anything: what it then believes must be honest. */
static void test_a_microradian_with_preload_fixed_stays_within_four_sigma(void)
{
    config.preload = (uint8_t)LEVER_PRELOAD_FIXED;
    rig.simulation.plant.follows_trim = false;
    rig.simulation.plant.arm_preload_angle = 0.4;
    config.settings.arm_preload_angle = 0.4f;
    start(1.0e-6, 1.0e-5, 5.0e-4);
    for (uint32_t k = 0u; k < 60u; k++) {
        (void)rig_run(&rig, lever, 1000u);
        const lever_estimate_t estimate = rig_estimate(lever);
        for (uint32_t i = 0u; i < 3u; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(
                4.0 * (double)estimate.parameter_sigma[i], truth[i], (double)estimate.parameter[i]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
}

static void test_a_microradian_with_annealing(void)
{
    config.adaptation = (uint8_t)LEVER_ADAPTATION_ANNEALING;
    start(1.0e-6, 1.0e-5, 5.0e-4);
    assert_within_two_per_cent(20u, 60u);
}

static void test_a_microradian_with_a_fixed_walk(void)
{
    config.adaptation = (uint8_t)LEVER_ADAPTATION_FIXED;
    start(1.0e-6, 1.0e-5, 5.0e-4);
    assert_within_two_per_cent(10u, 60u);
}

/* Each model and estimator in turn for a minute, with the noise given and then the settings that `set` changes. */
static void assert_never_loses_the_factor(
    void (*set)(lever_settings_t *), double theta_noise, double theta_dot_noise, double process_noise)
{
    for (uint32_t run = 0u; run < (uint32_t)(LEVER_MODEL_COUNT * LEVER_ESTIMATOR_COUNT); run++) {
        lever_config_default(&config);
        config.model = (uint8_t)(run % (uint32_t)LEVER_MODEL_COUNT);
        config.estimator = (uint8_t)(run / (uint32_t)LEVER_MODEL_COUNT);
        rig = rig_of(config.model, truth);
        start(theta_noise, theta_dot_noise, process_noise);
        set(&config.settings);
        lever = lever_init(&memory, &config);
        (void)rig_run(&rig, lever, 60000u);
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

static void set_every_walk(lever_settings_t *s, float share)
{
    float *const walks[] = {&s->m_p_walk, &s->c_p_walk, &s->k_p_walk, &s->m_walk, &s->c_walk, &s->k_walk};
    for (uint32_t i = 0u; i < 6u; i++) {
        *walks[i] = share;
    }
    s->a21_walk = 3200.0f * share;
    s->a22_walk = 320.0f * share;
    s->b21_walk = 32.0f * share;
}

static void set_nothing(lever_settings_t *s)
{
    (void)s;
}

static void test_the_least_noise_that_the_settings_allow_never_loses_the_factor(void)
{
    assert_never_loses_the_factor(set_nothing, 1.0e-7, 1.0e-6, 5.0e-4);
}

static void set_no_walk(lever_settings_t *s)
{
    set_every_walk(s, 0.0f);
}

static void test_the_least_of_all_noise_settings_never_loses_the_factor(void)
{
    assert_never_loses_the_factor(set_no_walk, 1.0e-7, 1.0e-6, 0.0);
}

/* More than there is: the filter believes in next to nothing. */
static void set_greatest_noise(lever_settings_t *s)
{
    set_every_walk(s, 1.0f);
    s->walk_ceiling = 100.0f;
    s->theta_noise = 0.2f;
    s->theta_dot_noise = 2.0f;
    s->theta_process_noise = 1.0f;
    s->theta_dot_process_noise = 10.0f;
}

static void test_the_greatest_of_all_noise_settings_never_loses_the_factor(void)
{
    assert_never_loses_the_factor(set_greatest_noise, 1.0e-3, 1.0e-2, 0.05);
}

/* Every combination of choices in turn; about half of the settings anywhere between their limits, the others as they are. */
static void draw_config(random_source_t *source, uint32_t run)
{
    float *value = (float *)(void *)&config.settings; /* an array in the order of the table */
    lever_config_default(&config);
    uint8_t *const choices[4] = {&config.model, &config.preload, &config.estimator, &config.adaptation};
    const uint32_t counts[4] = {(uint32_t)LEVER_MODEL_COUNT, (uint32_t)LEVER_PRELOAD_COUNT,
        (uint32_t)LEVER_ESTIMATOR_COUNT, (uint32_t)LEVER_ADAPTATION_COUNT};
    for (uint32_t i = 0u; i < 4u; i++) {
        *choices[i] = (uint8_t)(run % counts[i]);
        run /= counts[i];
    }
    for (uint32_t i = 0u; i < lever_setting_count(); i++) {
        const double least = (double)lever_setting(i)->least;
        const double greatest = (double)lever_setting(i)->greatest;
        const double share = 2.0 * random_unit(source);
        if (share < 1.0) {
            value[i] = (float)((least > 0.0) ? (least * pow(greatest / least, share))
                                             : (least + (share * (greatest - least))));
            value[i] = fminf(fmaxf(value[i], lever_setting(i)->least), lever_setting(i)->greatest);
        }
    }
    lever_settings_t *s = &config.settings; /* what must go together, does */
    s->gap_limit = fmaxf(fminf(s->gap_limit, 1.5f / s->trim_corner), 2.0f * s->sample_period);
    TEST_ASSERT_NULL(lever_config_check(&config));
}

static void assert_finite(void)
{
    const lever_estimate_t estimate = rig_estimate(lever);
    TEST_ASSERT_TRUE(isfinite(estimate.theta) && isfinite(estimate.theta_dot) && isfinite(estimate.nis));
    TEST_ASSERT_TRUE(isfinite(estimate.theta_sigma) && isfinite(estimate.theta_dot_sigma) && isfinite(estimate.trim));
    TEST_ASSERT_TRUE(isfinite(estimate.natural_frequency) && isfinite(estimate.natural_frequency_sigma));
    TEST_ASSERT_TRUE(isfinite(estimate.damping_ratio) && isfinite(estimate.damping_ratio_sigma));
    for (uint32_t i = 0u; i < 3u; i++) {
        TEST_ASSERT_TRUE(isfinite(estimate.parameter[i]) && isfinite(estimate.parameter_sigma[i]));
    }
    TEST_ASSERT_TRUE(fabsf(rig_health(lever).torque) <= config.settings.torque_limit); /* NaN is not */
}

static void test_any_accepted_configuration_stays_finite_without_a_restart(void)
{
    random_source_t source = {99u};
    for (uint32_t run = 0u; run < RUNS; run++) {
        draw_config(&source, run);
        rig = rig_of(config.model, truth);
        lever = lever_init(&memory, &config);
        const double period = (double)config.settings.sample_period;
        lever_command_t dither = rig_command();
        dither.dither_rms = 0.5f;
        for (uint32_t k = 1u; k <= 1000u; k++) {
            simulation_advance(&rig.simulation, period);
            lever_sample_t sample = rig_sample_after(&rig, 0u);
            sample.time_us = (uint32_t)(1.0e6 * period * (double)k);
            (void)(((k % 50u) == 0u) && lever_command(lever, &dither)); /* it keeps it alive, too */
            (void)lever_update(lever, &sample);
            assert_finite();
        }
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

static void test_innovations_at_a_microradian_are_as_large_as_predicted(void)
{
    double sum = 0.0;
    start(1.0e-6, 1.0e-5, 5.0e-4);
    (void)rig_run(&rig, lever, 20000u);
    for (uint32_t k = 0u; k < 20000u; k++) {
        (void)rig_run(&rig, lever, 1u);
        sum += (double)rig_estimate(lever).nis;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.3, 2.0, sum / 20000.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_microradian_converges_within_two_per_cent_and_stays);
    RUN_TEST(test_a_microradian_with_every_model_estimator_and_adaptation);
    RUN_TEST(test_a_microradian_with_preload_fixed_stays_within_four_sigma);
    RUN_TEST(test_a_microradian_with_annealing);
    RUN_TEST(test_a_microradian_with_a_fixed_walk);
    RUN_TEST(test_the_least_noise_that_the_settings_allow_never_loses_the_factor);
    RUN_TEST(test_the_least_of_all_noise_settings_never_loses_the_factor);
    RUN_TEST(test_the_greatest_of_all_noise_settings_never_loses_the_factor);
    RUN_TEST(test_any_accepted_configuration_stays_finite_without_a_restart);
    RUN_TEST(test_innovations_at_a_microradian_are_as_large_as_predicted);
    return UNITY_END();
}
