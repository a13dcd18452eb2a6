/* Any configuration that is accepted, with any samples. */
#include "rig.h"

#ifdef LEVER_MUTATED
enum { CONFIGURATIONS = 64 };
#else
enum { CONFIGURATIONS = 900 };
#endif

static random_source_t source;
static lever_memory_t other_memory;

/* Anywhere in the range: by decades where it is positive, and from 0 or six decades on where it begins at 0. */
static float draw_setting(const lever_setting_t *setting)
{
    const double greatest = (double)setting->greatest;
    const bool from_zero = (setting->least == 0.0f);
    const double least = from_zero ? (1.0e-6 * greatest) : (double)setting->least;
    const double share = random_unit(&source);
    double value = (least > 0.0) ? (least * pow(greatest / least, share)) : (least + (share * (greatest - least)));
    value = (from_zero && (random_unit(&source) < 0.1)) ? 0.0 : value;
    return fminf(fmaxf((float)value, setting->least), setting->greatest);
}

/* Every choice in turn; each setting anywhere, or with a probability as it is, until settings go together. */
static void draw_config(uint32_t combination, double usual)
{
    float *value = (float *)(void *)&config.settings; /* an array in the order of the table */
    const uint32_t choice = combination / (uint32_t)COMBINATIONS;
    do {
        config = config_of(combination % (uint32_t)COMBINATIONS);
        config.preload = (uint8_t)(choice % (uint32_t)LEVER_PRELOAD_COUNT);
        config.adaptation = (uint8_t)((choice / (uint32_t)LEVER_PRELOAD_COUNT) % (uint32_t)LEVER_ADAPTATION_COUNT);
        config.mitigation = (uint8_t)(choice % (uint32_t)LEVER_MITIGATION_COUNT);
        for (uint32_t i = 0u; i < lever_setting_count(); i++) {
            value[i] = (random_unit(&source) < usual) ? value[i] : draw_setting(lever_setting(i));
        }
    } while (lever_config_check(&config) != NULL);
    start();
}

/* What a sample and the time to it can be: as it should; parts missing; nonsense; after a gap; late. */
static lever_sample_t draw_sample(void)
{
    const bool gap = (random_unit(&source) < 0.03);
    const double factor = gap ? (2.0 * random_unit(&source) * (double)config.settings.gap_limit) : 0.0;
    const double elapsed = gap ? factor : (double)config.settings.sample_period;
    simulation_advance(&simulation, fmin(elapsed, 0.02));
    time_us += (uint32_t)(1.0e6 * elapsed);
    lever_sample_t sample = sample_after(0u);
    float *const values[4] = {&sample.theta, &sample.theta_dot, &sample.tau_m, &sample.z_ddot};
    bool *const valid[4] = {&sample.theta_valid, &sample.theta_dot_valid, &sample.tau_m_valid, &sample.z_ddot_valid};
    sample.time_us = time_us - ((random_unit(&source) < 0.01) ? 5000u : 0u);
    for (uint32_t i = 0u; i < 4u; i++) {
        *valid[i] = (random_unit(&source) > 0.1);
        if (random_unit(&source) < 0.02) {
            *values[i] = (float)(pow(10.0, random_between(&source, -38.0, 38.0)) * random_between(&source, -1.0, 1.0));
        }
    }
    return sample;
}

/* R12 */
TEST(with_any_samples_it_stays_finite)
{
    source.state = 99u;
    for (uint32_t k = 0u; k < (uint32_t)CONFIGURATIONS; k++) {
        draw_config(k, 0.0);
        dither((float)random_between(&source, 0.0, 2.0));
        for (uint32_t n = 0u; n < 250u; n++) {
            const lever_sample_t sample = draw_sample();
            (void)lever_update(lever, &sample);
            lever_correction_t correction;
            lever_correction(lever, &correction);
            assert_finite(estimate());
            TEST_ASSERT_TRUE(isfinite(health().excitation));
            TEST_ASSERT_TRUE(fabsf(correction.angle) <= config.settings.correction_limit);
        }
    }
}

static void assert_its_state_can_be_restored(void)
{
    uint8_t state[LEVER_STATE_BYTES];
    lever_state_save(lever, state);
    TEST_ASSERT_TRUE(lever_state_restore(lever_init(&other_memory, &config), state));
}

/* Half of the settings as they are, samples as they should be: then nothing is ever refused either. */
/* R53 */
TEST(with_good_samples_it_needs_no_restart)
{
    source.state = 7u;
    for (uint32_t k = 0u; k < ((uint32_t)CONFIGURATIONS / 8u); k++) {
        draw_config(k, 0.5);
        for (uint32_t n = 1u; n <= 1000u; n++) {
            simulation_advance(&simulation, (double)config.settings.sample_period);
            lever_sample_t sample = sample_after(0u);
            sample.time_us = (uint32_t)(1.0e6 * (double)config.settings.sample_period * (double)n);
            (void)lever_update(lever, &sample);
        }
        assert_finite(estimate());
        assert_its_state_can_be_restored();
        TEST_ASSERT_EQUAL_UINT32(0u, health().recoveries);
    }
}
