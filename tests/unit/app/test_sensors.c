/* Sensors and a lever that are not what they should be: what the settings know of them is made up for, what they do not
 * know is flagged, not learnt, and forgotten when it is over. */
#include "app/instance.h"

#include "rig.h"

enum {
    UNTRUSTED = (int)((uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_THETA_DOT | (uint32_t)LEVER_FAULT_BASE),
    DELAY = 3 /* samples */
};

static lever_config_t config;
static lever_config_t exact; /* of the other */
static lever_memory_t memory;
static lever_memory_t other_memory;
static lever_t *lever;
static lever_t *other; /* for comparison */
static rig_t rig;
static double truth[LEVER_PARAMETERS];

static void start(void)
{
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
}

void setUp(void)
{
    lever_config_default(&config);
    rig = rig_of((uint8_t)LEVER_MODEL_LEVER, truth);
    exact = config;
    other = lever_init(&other_memory, &exact);
    start();
}

static bool has_fault(uint32_t fault)
{
    return (rig_health(lever).faults & fault) != 0u;
}

/* Of lever and other, in standard deviations of the other. */
static double largest_difference(void)
{
    const lever_estimate_t a = rig_estimate(lever);
    const lever_estimate_t b = rig_estimate(other);
    double largest = 0.0;
    for (uint32_t i = 0u; i < (uint32_t)LEVER_PARAMETERS; i++) {
        largest = fmax(largest, fabs((double)(a.parameter[i] - b.parameter[i]) / (double)b.parameter_sigma[i]));
    }
    return largest;
}

/* --- what is missing ---------------------------------------------------------------------------------------------- */

/* What was asked of the motor until the sample is what a perfect torque sensor would have said. */
TEST(without_measured_torque_the_torque_asked_for_counts)
{
    lever_command_t command = rig_command();
    command.dither_rms = 0.3f;
    double largest = 0.0;
    for (uint32_t k = 0u; k < 5000u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        if ((k >= 400u) && ((k % 500u) == 400u)) {
            TEST_ASSERT_TRUE(lever_command(lever, &command) && lever_command(other, &command));
        }
        sample.tau_m = rig_health(other).torque;
        largest = fmax(largest, fabs((double)sample.tau_m));
        (void)lever_update(other, &sample);
        sample.tau_m = NAN;
        sample.tau_m_valid = false;
        (void)lever_update(lever, &sample);
        rig_assert_same_estimates(other, lever);
        TEST_ASSERT_TRUE(has_fault((uint32_t)LEVER_FAULT_TORQUE));
    }
    TEST_ASSERT_TRUE(largest > 0.3);
}

/* The trim is taken to be where the lever's spring rests. */
TEST(it_aligns_and_learns_by_the_rate_alone)
{
    for (uint32_t k = 0u; k < 40000u; k++) {
        lever_sample_t sample = rig_sample(&rig);
        sample.theta = NAN;
        sample.theta_valid = false;
        const enum lever_mode mode = lever_update(lever, &sample);
        TEST_ASSERT_EQUAL((k < 300u) ? LEVER_MODE_ALIGN : LEVER_MODE_RUN, mode);
        TEST_ASSERT_TRUE((k > 300u) || (rig_estimate(lever).trim == config.settings.lever_preload_angle));
    }
    TEST_ASSERT_TRUE(has_fault((uint32_t)LEVER_FAULT_THETA));
    rig_assert_within(4.0, truth, rig_estimate(lever));
    TEST_ASSERT_DOUBLE_WITHIN(0.15 * truth[2], truth[2], (double)rig_estimate(lever).parameter[2]);
}

/* --- what nobody knows -------------------------------------------------------------------------------------------- */

typedef struct defect {
    uint32_t signal; /* 0 theta, 1 theta_dot, 2 z_ddot */
    float keep;      /* of the true value, besides, */
    float hold;      /* of that at the beginning */
    uint32_t fault;
    uint32_t found_ms;
    uint32_t over_ms;
} defect_t;

/* Fifteen seconds; flagged in time, nothing learnt that is wrong, and over in time. */
TEST(a_signal_that_is_wrong_but_valid_is_flagged_and_not_learnt)
{
    static const defect_t defects[] = {{0u, 0.0f, 1.0f, (uint32_t)LEVER_FAULT_THETA, 500u, 100u},
        {1u, 0.0f, 1.0f, (uint32_t)LEVER_FAULT_THETA_DOT, 500u, 100u},
        {2u, 0.0f, 1.0f, (uint32_t)LEVER_FAULT_BASE, 500u, 100u},
        {2u, 0.0f, 0.0f, (uint32_t)LEVER_FAULT_BASE, 500u, 100u},
        {2u, -1.0f, 0.0f, (uint32_t)LEVER_FAULT_BASE, 2000u, 1050u}};
    for (uint32_t k = 0u; k < (uint32_t)(sizeof defects / sizeof defects[0]); k++) {
        const defect_t *defect = &defects[k];
        float held = 0.0f;
        uint32_t found_ms = 0u;
        uint32_t last_ms = 0u;
        setUp();
        (void)rig_run(&rig, lever, 20000u);
        for (uint32_t ms = 1u; ms <= 25000u; ms++) {
            lever_sample_t sample = rig_sample(&rig);
            float *const values[] = {&sample.theta, &sample.theta_dot, &sample.z_ddot};
            float *value = values[defect->signal];
            held = (ms == 1u) ? *value : held;
            *value = (ms <= 15000u) ? ((defect->keep * *value) + (defect->hold * held)) : *value;
            (void)lever_update(lever, &sample);
            found_ms = ((found_ms == 0u) && has_fault(defect->fault)) ? ms : found_ms;
            last_ms = has_fault((uint32_t)UNTRUSTED) ? ms : last_ms;
            if ((ms > defect->found_ms) && ((ms % 100u) == 0u)) {
                rig_assert_within(4.0, truth, rig_estimate(lever));
            }
        }
        TEST_ASSERT_UINT32_WITHIN(defect->found_ms / 2u, defect->found_ms / 2u, found_ms);
        TEST_ASSERT_UINT32_WITHIN(defect->over_ms / 2u, 15000u + (defect->over_ms / 2u), last_ms);
    }
}

/* One sample in a hundred, of either output. */
TEST(spikes_are_refused_and_cost_nothing)
{
    random_source_t source = {9u};
    for (uint32_t i = 0u; i < 2u; i++) {
        uint32_t spikes = 0u;
        setUp();
        for (uint32_t k = 0u; k < 30000u; k++) {
            lever_sample_t sample = rig_sample(&rig);
            (void)lever_update(other, &sample);
            if ((k > 5000u) && (random_unit(&source) < 0.01)) {
                float *value = (i == 0u) ? &sample.theta : &sample.theta_dot;
                *value += (random_unit(&source) < 0.5) ? -0.3f : 0.3f;
                spikes++;
                (void)lever_update(lever, &sample);
                TEST_ASSERT_TRUE(has_fault((i == 0u) ? LEVER_FAULT_THETA : LEVER_FAULT_THETA_DOT));
            } else {
                (void)lever_update(lever, &sample);
            }
        }
        TEST_ASSERT_EQUAL_UINT32(spikes, rig_health(lever).corrupt);
        TEST_ASSERT_TRUE(largest_difference() < 1.0);
        for (uint32_t p = 0u; p < (uint32_t)LEVER_PARAMETERS; p++) {
            const float sigma = rig_estimate(other).parameter_sigma[p];
            TEST_ASSERT_FLOAT_WITHIN(0.2f * sigma, sigma, rig_estimate(lever).parameter_sigma[p]);
        }
    }
}

/* Torque of 1 N m rms that nobody measures, with a correlation time of 0.3 s: no arm of this order does that. It is
 * said for a good part of the time, more than a third. */
TEST(unknown_torque_is_a_mismatch_and_ordinary_flight_is_none)
{
    const uint32_t either = (uint32_t)LEVER_FAULT_MISMATCH | (uint32_t)LEVER_FAULT_CALIBRATION;
    random_source_t source = {41u};
    for (uint32_t k = 0u; k < 2u; k++) {
        uint32_t mismatch = 0u;
        uint32_t flagged = 0u;
        double unknown = 0.0;
        setUp();
        for (uint32_t ms = 0u; ms < 60000u; ms++) {
            lever_sample_t sample = rig_sample(&rig);
            unknown += (-unknown * 1.0e-3 / 0.3) + (sqrt(2.0e-3 / 0.3) * random_normal(&source));
            sample.tau_m -= (k == 1u) ? (float)unknown : 0.0f;
            (void)lever_update(lever, &sample);
            mismatch += ((ms >= 20000u) && has_fault((uint32_t)LEVER_FAULT_MISMATCH)) ? 1u : 0u;
            flagged += ((ms >= 20000u) && has_fault(either)) ? 1u : 0u;
        }
        TEST_ASSERT_TRUE((k == 0u) ? (flagged == 0u) : ((flagged > 15000u) && (mismatch > 12000u)));
    }
}

/* Seen within a second, both ways; and what the lever does alone is not learnt of the arm. */
TEST(hands_off_is_flagged_and_not_learnt)
{
    const plant_t held = rig.simulation.plant;
    uint32_t off = 0u;
    (void)rig_run(&rig, lever, 20000u);
    rig.simulation.plant.m_p = 0.0;
    rig.simulation.plant.c_p = 0.0;
    rig.simulation.plant.k_p = 1.0e-9;
    for (uint32_t ms = 1u; ms <= 5000u; ms++) {
        (void)rig_run(&rig, lever, 1u);
        off += has_fault((uint32_t)LEVER_FAULT_HANDS_OFF) ? 1u : 0u;
    }
    TEST_ASSERT_TRUE(off > 3600u);
    rig.simulation.plant = held;
    (void)rig_run(&rig, lever, 1000u);
    TEST_ASSERT_FALSE(has_fault((uint32_t)LEVER_FAULT_HANDS_OFF));
    for (uint32_t k = 0u; k < 20u; k++) {
        (void)rig_run(&rig, lever, 500u);
        rig_assert_within(4.0, truth, rig_estimate(lever));
    }
}
