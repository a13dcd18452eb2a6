/* Where single precision hurts most: measurement noise near its resolution, R set to match, little process noise. And
 * any configuration that is accepted, with any samples. Through the C API. */
#include "rig.h"

#ifdef __SANITIZE_ADDRESS__
enum { CONFIGURATIONS = 900 };
#else
enum { CONFIGURATIONS = 9000 };
#endif

enum { CHOICES = RIG_COMBINATIONS * LEVER_ADAPTATION_COUNT };

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

/* Every parameter within 2 % from 20 to 60 s, never a restart. */
TEST(a_microradian_with_every_model_estimator_and_adaptation_converges_within_two_per_cent)
{
    for (uint32_t choice = 0u; choice < (uint32_t)CHOICES; choice++) {
        config = rig_config(choice % (uint32_t)RIG_COMBINATIONS);
        config.adaptation = (uint8_t)(choice / (uint32_t)RIG_COMBINATIONS);
        rig = rig_of(config.model, truth);
        start(1.0e-6, 1.0e-5, 5.0e-4);
        (void)rig_run(&rig, lever, 20000u);
        for (uint32_t tenth = 0u; tenth < 400u; tenth++) {
            TEST_ASSERT_EQUAL(LEVER_MODE_RUN, rig_run(&rig, lever, 100u));
            const lever_estimate_t estimate = rig_estimate(lever);
            for (uint32_t i = 0u; i < 3u; i++) {
                TEST_ASSERT_DOUBLE_WITHIN(0.02 * fabs(truth[i]), truth[i], (double)estimate.parameter[i]);
            }
        }
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

/* Each model and estimator for a minute. `share` of the greatest walk; `wide`: more noise than there is, so that the
 * filter believes in next to nothing. */
typedef struct extreme {
    double theta_noise;
    double theta_dot_noise;
    double process_noise;
    float share; /* negative: walks as they are */
    bool wide;
} extreme_t;

static void set_extreme(lever_settings_t *s, const extreme_t *extreme)
{
    float *const walks[] = {&s->m_p_walk, &s->c_p_walk, &s->k_p_walk, &s->m_walk, &s->c_walk, &s->k_walk, &s->a21_walk,
        &s->a22_walk, &s->b21_walk};
    const float greatest[] = {1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 1.0f, 3200.0f, 320.0f, 32.0f};
    for (uint32_t i = 0u; (i < 9u) && (extreme->share >= 0.0f); i++) {
        *walks[i] = extreme->share * greatest[i];
    }
    if (extreme->wide) {
        s->walk_ceiling = 100.0f;
        s->theta_noise = 0.2f;
        s->theta_dot_noise = 2.0f;
        s->theta_process_noise = 1.0f;
        s->theta_dot_process_noise = 10.0f;
    }
}

TEST(the_least_and_greatest_noise_that_may_be_set_never_lose_the_factor)
{
    const extreme_t extremes[] = {
        {1.0e-7, 1.0e-6, 5.0e-4, -1.0f, false}, {1.0e-7, 1.0e-6, 0.0, 0.0f, false}, {1.0e-3, 1.0e-2, 0.05, 1.0f, true}};
    for (uint32_t k = 0u; k < (uint32_t)(3 * RIG_COMBINATIONS); k++) {
        const extreme_t *extreme = &extremes[k / (uint32_t)RIG_COMBINATIONS];
        config = rig_config(k % (uint32_t)RIG_COMBINATIONS);
        rig = rig_of(config.model, truth);
        start(extreme->theta_noise, extreme->theta_dot_noise, extreme->process_noise);
        set_extreme(&config.settings, extreme);
        lever = lever_init(&memory, &config);
        (void)rig_run(&rig, lever, 60000u);
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

/* --- anything ----------------------------------------------------------------------------------------------------- */

/* Anywhere in the range: by decades where it is positive, and from 0 or six decades on where it begins at 0. */
static float draw_setting(random_source_t *source, const lever_setting_t *setting)
{
    const double greatest = (double)setting->greatest;
    const bool from_zero = (setting->least == 0.0f);
    const double least = from_zero ? (1.0e-6 * greatest) : (double)setting->least;
    const double share = random_unit(source);
    double value = (least > 0.0) ? (least * pow(greatest / least, share)) : (least + (share * (greatest - least)));
    value = (from_zero && (random_unit(source) < 0.1)) ? 0.0 : value;
    return fminf(fmaxf((float)value, setting->least), setting->greatest);
}

/* Every choice in turn; all settings anywhere, until settings go together. */
static void draw_config(random_source_t *source, uint32_t run)
{
    float *value = (float *)(void *)&config.settings; /* an array in the order of the table */
    const uint32_t choice = run / (uint32_t)LEVER_PRELOAD_COUNT;
    config = rig_config(choice % (uint32_t)RIG_COMBINATIONS);
    config.preload = (uint8_t)(run % (uint32_t)LEVER_PRELOAD_COUNT);
    config.adaptation = (uint8_t)((choice / (uint32_t)RIG_COMBINATIONS) % (uint32_t)LEVER_ADAPTATION_COUNT);
    uint32_t draws = 0u;
    do {
        for (uint32_t i = 0u; i < lever_setting_count(); i++) {
            value[i] = draw_setting(source, lever_setting(i));
        }
        draws++;
        TEST_ASSERT_LESS_THAN_UINT32(1000u, draws);
    } while (lever_config_check(&config) != NULL);
}

/* What a sample and the time to it can be: as it should; parts missing; nonsense; after a gap; late. */
static lever_sample_t draw_sample(random_source_t *source, uint32_t *time_us)
{
    const double period = (double)config.settings.sample_period;
    const bool gap = (random_unit(source) < 0.03);
    const double elapsed = gap ? (2.0 * random_unit(source) * (double)config.settings.gap_limit) : period;
    simulation_advance(&rig.simulation, fmin(elapsed, 0.02));
    *time_us += (uint32_t)(1.0e6 * elapsed);
    lever_sample_t sample = rig_sample_after(&rig, 0u);
    float *const values[4] = {&sample.theta, &sample.theta_dot, &sample.tau_m, &sample.z_ddot};
    bool *const valid[4] = {&sample.theta_valid, &sample.theta_dot_valid, &sample.tau_m_valid, &sample.z_ddot_valid};
    sample.time_us = *time_us - ((random_unit(source) < 0.01) ? 5000u : 0u);
    for (uint32_t i = 0u; i < 4u; i++) {
        *valid[i] = (random_unit(source) > 0.1);
        if (random_unit(source) < 0.02) {
            *values[i] = (float)(pow(10.0, random_between(source, -38.0, 38.0)) * random_between(source, -1.0, 1.0));
        }
    }
    return sample;
}

TEST(any_accepted_configuration_with_any_samples_stays_finite)
{
    random_source_t source = {99u};
    for (uint32_t run = 0u; run < (uint32_t)CONFIGURATIONS; run++) {
        uint32_t time_us = 0u;
        draw_config(&source, run);
        rig = rig_of(config.model, truth);
        lever = lever_init(&memory, &config);
        lever_command_t command = rig_command();
        command.dither_rms = (float)random_between(&source, 0.0, 2.0);
        TEST_ASSERT_TRUE(lever_command(lever, &command));
        for (uint32_t k = 0u; k < 250u; k++) {
            const lever_sample_t sample = draw_sample(&source, &time_us);
            (void)lever_update(lever, &sample);
            rig_assert_finite(rig_estimate(lever));
            TEST_ASSERT_TRUE(isfinite(rig_health(lever).excitation));
        }
    }
}

/* Half of the settings as they are, samples as they should be: then nothing is ever refused either. */
TEST(any_accepted_configuration_with_good_samples_needs_no_restart)
{
    random_source_t source = {7u};
    for (uint32_t run = 0u; run < ((uint32_t)CONFIGURATIONS / 10u); run++) {
        lever_config_t usual = rig_config(0u);
        float *value = (float *)(void *)&config.settings;
        const float *usual_value = (const float *)(const void *)&usual.settings;
        do {
            draw_config(&source, run);
            for (uint32_t i = 0u; i < lever_setting_count(); i++) {
                value[i] = (random_unit(&source) < 0.5) ? value[i] : usual_value[i];
            }
        } while (lever_config_check(&config) != NULL);
        rig = rig_of(config.model, truth);
        lever = lever_init(&memory, &config);
        for (uint32_t k = 1u; k <= 1000u; k++) {
            simulation_advance(&rig.simulation, (double)config.settings.sample_period);
            lever_sample_t sample = rig_sample_after(&rig, 0u);
            sample.time_us = (uint32_t)(1.0e6 * (double)config.settings.sample_period * (double)k);
            (void)lever_update(lever, &sample);
        }
        rig_assert_finite(rig_estimate(lever));
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}
