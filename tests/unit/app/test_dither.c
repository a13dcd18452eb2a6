/* The identification torque: off by default, of the rms that is asked, inside its band, faded in and out. */
#include "app/dither.h"

#include "lever_cdkf.h"
#include "test.h"

#include <math.h>
#include <string.h>

#define PERIOD 1.0e-3f

static dither_t dither;
static float torque; /* of the last step */

static void start(double low, double high, double period, double rms_most, double fade)
{
    dither_init(&dither, (float)low, (float)high, (float)period, (float)rms_most, (float)fade);
}

void setUp(void)
{
    start(1.0, 10.0, (double)PERIOD, 1.5, 1.0);
}

static void ask(float rms)
{
    dither_set(&dither, rms, false);
}

static void step(uint32_t count)
{
    for (uint32_t k = 0u; k < count; k++) {
        torque = dither_step(&dither);
    }
}

/* Rms of the torque over the next samples. */
static double rms_over(uint32_t count)
{
    double square = 0.0;
    for (uint32_t k = 0u; k < count; k++) {
        step(1u);
        square += (double)torque * (double)torque;
    }
    return sqrt(square / (double)count);
}

/* --- off and on --------------------------------------------------------------------------------------------------- */

/* A keep-alive may repeat the command: once a sample, the fade still takes its time. */
TEST(a_repeated_command_does_not_stretch_the_fade)
{
    const float steps = dither.fade;
    dither_set(&dither, 0.3f, false);
    for (float k = 0.0f; k < (steps + 1.0f); k += 1.0f) {
        dither_set(&dither, 0.3f, false);
        step(1u);
    }
    TEST_ASSERT_TRUE(dither.level == dither.target);
    for (float k = 0.0f; k < (steps + 1.0f); k += 1.0f) {
        dither_set(&dither, 0.0f, false);
        step(1u);
    }
    TEST_ASSERT_FALSE(dither_is_on(&dither));
}

static float limit_of(const char *name, bool greatest)
{
    const lever_setting_t *row = lever_setting(0u);
    for (uint32_t i = 0u; strcmp(row->name, name) != 0; i++) {
        row = lever_setting(i);
        TEST_ASSERT_NOT_NULL_MESSAGE(row, name);
    }
    return greatest ? row->greatest : row->least;
}

/* Every corner of what the settings allow, within 20 %: a band of 1 Hz needs more than a hundred seconds for less. */
/* R41 */
TEST_EACH(8, has_the_rms_that_is_asked_in_every_band_that_the_settings_allow)
{
    const float low = limit_of("dither_low", (test_round & 1u) != 0u);
    const float high = limit_of("dither_high", (test_round & 2u) != 0u);
    const float period = limit_of("sample_period", (test_round & 4u) != 0u);
    start((double)low, (double)high, (double)period, 20.0, 0.0);
    ask(0.3f);
    (void)rms_over(10000u);
    TEST_ASSERT_DOUBLE_WITHIN(0.2 * 0.3, 0.3, rms_over((period < 1.0e-3f) ? 500000u : 50000u));
}

TEST(no_command_exceeds_the_greatest_rms)
{
    ask(100.0f);
    step(2000u);
    TEST_ASSERT_TRUE(dither.level == 1.5f);
    start(1.0, 10.0, (double)PERIOD, 0.0, 1.0);
    ask(0.3f);
    TEST_ASSERT_TRUE(rms_over(5000u) == 0.0);
    TEST_ASSERT_FALSE(dither_is_on(&dither));
}

/* --- fades -------------------------------------------------------------------------------------------------------- */

/* R41 */
TEST(fades_in_linearly_over_its_time)
{
    ask(0.4f);
    step(250u);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 0.1, (double)dither.level);
    step(500u);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 0.3, (double)dither.level);
    step(251u);
    TEST_ASSERT_TRUE(dither.level == 0.4f);
}

/* R41 */
TEST(a_change_of_hardly_any_torque_fades_as_one_of_a_millionth)
{
    ask(4.0e-7f);
    step(300u);
    TEST_ASSERT_FLOAT_WITHIN(1.0e-9f, 3.0e-7f, dither.level);
    step(101u);
    TEST_ASSERT_TRUE(dither.level == 4.0e-7f);
}

TEST(without_a_fade_time_or_need_it_is_there_at_once)
{
    start(1.0, 10.0, (double)PERIOD, 1.5, 0.0);
    ask(0.4f);
    step(1u);
    TEST_ASSERT_TRUE(dither.level == 0.4f);
    setUp();
    dither_set(&dither, 0.4f, true);
    step(1u);
    TEST_ASSERT_TRUE(dither.level == 0.4f);
}

/* --- spectrum ----------------------------------------------------------------------------------------------------- */

enum { SEGMENT = 10000, SEGMENTS = 60, FREQUENCIES = 8 };

/* Mean power of the torque at each frequency [Hz], by a Fourier sum with Hann's window over segments of 10 s. */
static void spectrum(const double frequency[FREQUENCIES], double power[FREQUENCIES])
{
    for (uint32_t s = 0u; s < SEGMENTS; s++) {
        double real[FREQUENCIES] = {0.0};
        double imaginary[FREQUENCIES] = {0.0};
        for (uint32_t k = 0u; k < SEGMENT; k++) {
            const double turn = 6.283185307179586 * (double)k / (double)SEGMENT;
            step(1u);
            const double value = (1.0 - cos(turn)) * (double)torque;
            for (uint32_t f = 0u; f < FREQUENCIES; f++) {
                real[f] += value * cos(turn * 10.0 * frequency[f]);
                imaginary[f] += value * sin(turn * 10.0 * frequency[f]);
            }
        }
        for (uint32_t f = 0u; f < FREQUENCIES; f++) {
            power[f] += ((real[f] * real[f]) + (imaginary[f] * imaginary[f])) / (double)SEGMENTS;
        }
    }
}

TEST(spectrum_is_flat_in_the_band_half_at_its_corners_and_gone_beyond)
{
    const double frequency[FREQUENCIES] = {3.2, 2.5, 5.0, 1.0, 10.0, 0.1, 100.0, 300.0};
    double power[FREQUENCIES] = {0.0};
    start(1.0, 10.0, (double)PERIOD, 20.0, 0.0);
    ask(0.3f);
    step(5000u);
    spectrum(frequency, power);
    TEST_ASSERT_DOUBLE_WITHIN(0.25, 1.0, power[1] / power[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.25, 1.0, power[2] / power[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.15, 0.5, power[3] / power[0]);
    TEST_ASSERT_DOUBLE_WITHIN(0.15, 0.5, power[4] / power[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-3, 0.0, power[5] / power[0]); /* 40 dB a decade: 1e-4 expected */
    TEST_ASSERT_DOUBLE_WITHIN(2.0e-4, 0.0, power[6] / power[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1.0e-5, 0.0, power[7] / power[0]);
}

/* A tenth of the samples a second: what is asked beyond is that. */
TEST(the_band_ends_at_a_tenth_of_the_sampling_rate)
{
    dither_t beyond;
    dither_t at;
    dither_init(&beyond, 2.0f, 12.0f, 0.01f, 1.0f, 0.5f);
    dither_init(&at, 2.0f, 10.0f, 0.01f, 1.0f, 0.5f);
    TEST_ASSERT_EQUAL_FLOAT(at.high, beyond.high);
    TEST_ASSERT_EQUAL_FLOAT(at.scale, beyond.scale);
}
