/* The torque gate by itself: no request, setting or course of events lets out more than its limits. */
#include "app/torque_gate.h"

#include "watch.h"

#ifdef LEVER_MUTATED
enum { RUNS = 60 };
#else
enum { RUNS = 300 };
#endif

static lever_config_t config;
static uint32_t seed;

void setUp(void)
{
    lever_config_default(&config);
    config.settings.dither_fade = 0.1f;
    seed = 1u;
}

static float uniform(void)
{
    seed = (seed * 1664525u) + 1013904223u;
    return (float)(seed >> 8u) / 16777216.0f;
}

static float random_request(uint32_t kind, uint32_t k)
{
    const float values[] = {(((k / 100u) % 2u) == 0u) ? 100.0f : -100.0f, 1.0e30f,
        ((k % 7u) == 0u) ? NAN : (20.0f * (uniform() - 0.5f)), ((k % 5u) == 0u) ? -INFINITY : 3.0f,
        0.5f * sinf(0.02f * (float)k), (uniform() < 0.01f) ? -1.0e38f : 1.0f};
    return values[kind % 6u];
}

static lever_settings_t random_settings(void)
{
    lever_settings_t settings = config.settings;
    settings.sample_period = 1.0e-4f * powf(200.0f, uniform());
    settings.torque_limit = 10.0f * uniform();
    settings.torque_slew = powf(1.0e5f, uniform());
    settings.torque_rms = (uniform() < 0.1f) ? 0.0f : (5.0f * uniform());
    settings.dither_fade = 0.2f * uniform();
    return settings;
}

/* R36 S4 */
TEST(no_request_passes_a_limit_at_any_settings)
{
    uint32_t open = 0u;
    for (uint32_t run = 0u; run < RUNS; run++) {
        const lever_settings_t settings = random_settings();
        torque_gate_t gate;
        torque_gate_init(&gate, &settings);
        watch_start(&settings);
        for (uint32_t k = 0u; k < (3000000u / gate.period_us); k++) {
            const torque_sample_t sample = {gate.period_us, true, true, (uniform() > 0.002f), false};
            if ((k % 20u) == 0u) {
                torque_gate_keep_alive(&gate);
            }
            torque_gate_step(&gate, random_request(run, k), &sample);
            watch_torque(gate.torque, gate.period_us, gate.gain > 0.0f);
            open += gate.open ? 1u : 0u;
        }
    }
    TEST_ASSERT_GREATER_THAN_UINT32(300u * RUNS, open);
}

/* Gaps, silence that the port tells of, outputs that are missing, clocks that stand, commands that end: at random. */
/* R36 S4 */
TEST(no_course_of_events_passes_a_limit)
{
    for (uint32_t run = 0u; run < RUNS; run++) {
        torque_gate_t gate;
        lever_settings_t settings = random_settings();
        settings.sample_period = 1.0e-3f;
        torque_gate_init(&gate, &settings);
        watch_start(&settings);
        for (uint32_t k = 0u; k < 5000u; k++) {
            const float event = uniform();
            uint32_t elapsed_us = 1000u;
            if (event < 0.02f) {
                const uint32_t idle_us = (uint32_t)(20000.0f * uniform());
                torque_gate_idle(&gate, idle_us);
                watch_torque(gate.torque, idle_us, gate.gain > 0.0f);
                elapsed_us += idle_us;
            } else if (event < 0.03f) {
                elapsed_us = (uint32_t)(40000.0f * uniform());
            } else if (event < 0.04f) {
                torque_gate_keep_alive(&gate);
            } else if (event < 0.045f) {
                torque_gate_ask(&gate, event < 0.043f);
            } else {
                /* a good sample */
            }
            const torque_sample_t sample = {
                elapsed_us, (event < 0.999f), (event < 0.9f), true, (event > 0.899f) && (event < 0.9f)};
            const uint32_t real_us = sample.advances ? elapsed_us : 5000u; /* as long as a port waits for one */
            const uint32_t left_us = (real_us > gate.counted) ? (real_us - gate.counted) : 0u;
            torque_gate_step(&gate, random_request(run, k), &sample);
            watch_torque(gate.torque, left_us, gate.gain > 0.0f);
        }
    }
}

TEST(what_is_within_the_limits_passes_as_it_is)
{
    torque_gate_t gate;
    torque_gate_init(&gate, &config.settings);
    torque_gate_keep_alive(&gate);
    for (uint32_t k = 0u; k < 900u; k++) {
        const torque_sample_t sample = {1000u, true, true, true, false};
        const float asked = 0.6f * sinf(0.04f * (float)k);
        torque_gate_step(&gate, asked, &sample);
        TEST_ASSERT_TRUE((k < 101u) || (gate.torque == asked));
    }
}

/* The amplitude falls with the mean square as steeply as is allowed by its slew, by the silence that is to be outlasted,
 * or by a fifth of the mean square; figures by hand. */
TEST(settings_become_times_and_slopes)
{
    static const struct {
        float sample_period;
        float limit;
        float slew;
        float rms;
        float fade;
        uint32_t period_us;
        uint32_t silence_us;
        float open_step;
        float slope;
    } row[] = {{1.0e-3f, 2.0f, 10.0f, 0.5f, 0.1f, 1000u, 20000u, 0.01f, 0.625f},        /* slew / (4 limit^2) */
        {2.0e-2f, 1.0f, 1.0e5f, 0.55901699f, 0.025f, 20000u, 60000u, 0.8f, 2.1111111f}, /* .76 / (.24 (limit + .5)) */
        {6.6670e-3f, 3.0f, 1.0e5f, 1.11803399f, 0.0f, 6667u, 20001u, 1.0f, 2.8748438f},
        {1.00030e-3f, 9.5f, 1.0e5f, 0.55901699f, 1.0e-3f, 1000u, 20000u, 1.0f, 1.15f},
        {1.0e-3f, 1.0f, 1.0e5f, 1.0f, 1.0f, 1000u, 20000u, 1.0e-3f, 0.6598300f},
        {1.0e-3f, 0.0f, 200.0f, 0.0f, 1.0f, 1000u, 20000u, 1.0e-3f, 0.0f}};
    for (uint32_t i = 0u; i < (sizeof row / sizeof row[0]); i++) {
        torque_gate_t gate;
        config.settings.sample_period = row[i].sample_period;
        config.settings.torque_limit = row[i].limit;
        config.settings.torque_slew = row[i].slew;
        config.settings.torque_rms = row[i].rms;
        config.settings.dither_fade = row[i].fade;
        torque_gate_init(&gate, &config.settings);
        TEST_ASSERT_EQUAL_UINT32(row[i].period_us, gate.period_us);
        TEST_ASSERT_EQUAL_UINT32(row[i].silence_us, gate.silence_us);
        TEST_ASSERT_FLOAT_WITHIN(1.0e-6f, row[i].open_step, gate.open_step);
        TEST_ASSERT_FLOAT_WITHIN(1.0e-4f * row[i].slope, row[i].slope, gate.amplitude_slope);
    }
}

/* However small it is: 40 ms, less the time of torque below a micronewton metre. */
TEST(a_gate_that_closes_ends_small_torque_in_40_ms_and_none_later)
{
    static const float torque[] = {1.2e-6f, 1.0e-40f};
    for (uint32_t i = 0u; i < 2u; i++) {
        torque_gate_t gate;
        torque_gate_init(&gate, &config.settings);
        gate.open = true;
        gate.torque = torque[i];
        torque_gate_close(&gate);
        torque_gate_idle(&gate, 36000u);
        TEST_ASSERT_TRUE((gate.torque > 0.0f) == (i == 0u));
        torque_gate_idle(&gate, 5000u);
        TEST_ASSERT_TRUE(gate.torque == 0.0f);
    }
}

/* A second after the last COMMAND, and not a microsecond sooner. */
TEST(without_commands_torque_is_abandoned_after_a_second)
{
    torque_gate_t gate;
    torque_gate_init(&gate, &config.settings);
    TEST_ASSERT_TRUE(torque_gate_is_abandoned(&gate)); /* there was none yet */
    torque_gate_keep_alive(&gate);
    torque_gate_idle(&gate, 1000000u);
    TEST_ASSERT_FALSE(torque_gate_is_abandoned(&gate));
    torque_gate_idle(&gate, 1u);
    TEST_ASSERT_TRUE(torque_gate_is_abandoned(&gate));
}

/* Once is enough; a keep-alive does not end it, and asking does not either while it is there. */
/* R37 */
TEST(what_does_harm_bars_the_gate_until_torque_is_asked_for)
{
    torque_gate_t gate;
    torque_sample_t sample = {1000u, true, true, true, true};
    torque_gate_init(&gate, &config.settings);
    for (uint32_t k = 0u; k < 100u; k++) {
        torque_gate_keep_alive(&gate);
        torque_gate_ask(&gate, false);
        torque_gate_ask(&gate, true);
        torque_gate_step(&gate, 1.0f, &sample);
        TEST_ASSERT_FALSE(gate.open);
    }
    sample.harmful = false;
    for (uint32_t k = 0u; k < 100u; k++) {
        torque_gate_keep_alive(&gate);
        torque_gate_ask(&gate, true); /* what has been asked for all the time is not asked for anew */
        torque_gate_step(&gate, 1.0f, &sample);
        TEST_ASSERT_FALSE(gate.open);
    }
    torque_gate_ask(&gate, false);
    torque_gate_ask(&gate, true);
    TEST_ASSERT_FALSE(gate.open);
    torque_gate_step(&gate, 1.0f, &sample);
    TEST_ASSERT_TRUE(gate.open);
}
