/* Model, estimator and adaptation chosen while running, by COMMAND frames: that each choice is the one used, what it starts
 * with, and that the answers say which model their values belong to. */
#include "frames.h"

enum { PARAMETERS = LEVER_PARAMETERS, CHOICES = RIG_COMBINATIONS * LEVER_ADAPTATION_COUNT };

static lever_config_t config;
static lever_memory_t memory;
static lever_memory_t other_memory;
static lever_t *lever;
static sender_t sender;
static lever_frame_t frames[FRAMES_MOST];

/* Every sample is answered with all messages. */
static void configure(uint32_t combination)
{
    config = rig_config(combination);
    config.settings.publish_period = 1.0e-4f;
}

void setUp(void)
{
    configure(0u);
    lever = lever_init(&memory, &config);
    TEST_ASSERT_NOT_NULL(lever);
    sender = sender_typical();
}

void tearDown(void)
{
}

static void command(const lever_command_t *choice)
{
    const lever_frame_t frame = sender_command(&sender, choice);
    TEST_ASSERT_EQUAL(LEVER_FRAME_TAKEN, lever_on_frame(lever, &frame));
}

static void choose_model(uint8_t model)
{
    lever_command_t choice = rig_command();
    choice.model = model;
    config.model = model;
    command(&choice);
}

/* The answers to the next sample that is answered with all of them: parameters, sigma, dynamics, and more. */
static void fetch_full_answers(void)
{
    uint32_t count = 0u;
    while (count < 5u) {
        (void)sender_deliver(&sender, lever);
        count = fetch_all(lever, frames);
    }
}

/* --- every choice ---------------------------------------------------------------------------------------------------- */

/* Commanded, or configured from the start: the same samples give the same estimates to the bit. */
static void assert_commanded_as_configured(uint32_t choice)
{
    double truth[PARAMETERS];
    setUp();
    configure(choice % (uint32_t)RIG_COMBINATIONS);
    config.adaptation = (uint8_t)(choice / (uint32_t)RIG_COMBINATIONS);
    lever_command_t all = rig_command();
    all.request = (uint8_t)LEVER_REQUEST_RESET;
    all.model = config.model;
    all.estimator = config.estimator;
    all.adaptation = config.adaptation;
    command(&all);
    lever_t *other = lever_init(&other_memory, &config);
    sender.rig = rig_of(config.model, truth);
    sender_t same = sender;
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_run(&sender, lever, 3000u));
    TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_run(&same, other, 3000u));
    rig_assert_same_estimates(lever, other);
    fetch_full_answers();
    for (uint32_t k = 0u; k < 3u; k++) {
        TEST_ASSERT_EQUAL_UINT8(config.model, (frames[k].data[1] >> 4u) & 7u); /* the model: bits 12 to 14 */
    }
}

static void test_every_model_estimator_and_adaptation_can_be_commanded(void)
{
    for (uint32_t choice = 0u; choice < (uint32_t)CHOICES; choice++) {
        assert_commanded_as_configured(choice);
    }
}

static void test_every_choice_makes_a_difference(void)
{
    lever_estimate_t estimates[CHOICES];
    for (uint32_t choice = 0u; choice < (uint32_t)CHOICES; choice++) {
        configure(choice % (uint32_t)RIG_COMBINATIONS);
        config.adaptation = (uint8_t)(choice / (uint32_t)RIG_COMBINATIONS);
        lever = lever_init(&memory, &config);
        sender = sender_typical();
        (void)sender_run(&sender, lever, 3000u);
        estimates[choice] = rig_estimate(lever);
        for (uint32_t k = 0u; k < choice; k++) {
            const bool same = (memcmp(&estimates[k], &estimates[choice], sizeof estimates[k]) == 0);
            TEST_ASSERT_FALSE(same);
        }
    }
}

/* --- a change of model ----------------------------------------------------------------------------------------------- */

static void assert_at_first_guess(void)
{
    const lever_estimate_t estimate = rig_estimate(lever);
    for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
        TEST_ASSERT_EQUAL_FLOAT(*rig_parameter_setting(&config, i, ""), estimate.parameter[i]);
        TEST_ASSERT_EQUAL_FLOAT(rig_first_sigma(&config, i), estimate.parameter_sigma[i]);
        TEST_ASSERT_TRUE(estimate.parameter_correlation[i] == 0.0f);
    }
}

static void test_a_change_of_model_starts_over_with_its_own_first_guess(void)
{
    const uint8_t models[] = {(uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX, (uint8_t)LEVER_MODEL_LEVER,
        (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL, (uint8_t)LEVER_MODEL_LINEAR_BLACK_BOX,
        (uint8_t)LEVER_MODEL_LINEAR_PHYSICAL, (uint8_t)LEVER_MODEL_LEVER};
    for (uint32_t k = 0u; k < 6u; k++) {
        (void)sender_run(&sender, lever, 2000u);
        choose_model(models[k]);
        TEST_ASSERT_EQUAL(LEVER_MODE_INIT, rig_health(lever).mode);
        assert_at_first_guess();
        TEST_ASSERT_EQUAL(LEVER_MODE_ALIGN, sender_deliver(&sender, lever));
        TEST_ASSERT_EQUAL(LEVER_MODE_RUN, sender_run(&sender, lever, 310u));
        TEST_ASSERT_EQUAL_UINT32(0u, rig_health(lever).recoveries);
    }
}

/* The first guesses of one model are in the settings all the time, whatever the others are set to. */
static void test_each_model_has_first_guesses_of_its_own(void)
{
    for (uint8_t model = 0u; model < (uint8_t)LEVER_MODEL_COUNT; model++) {
        config.model = model;
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
            *rig_parameter_setting(&config, i, "") *= 1.0f + (0.1f * (float)(1u + i + model));
            *rig_parameter_setting(&config, i, "_sigma") *= 1.0f - (0.1f * (float)(1u + i + model));
        }
    }
    for (uint8_t model = 0u; model < (uint8_t)LEVER_MODEL_COUNT; model++) {
        config.model = model;
        lever = lever_init(&memory, &config);
        TEST_ASSERT_NOT_NULL(lever);
        assert_at_first_guess();
    }
}

static void test_a_change_of_estimator_starts_over(void)
{
    (void)sender_run(&sender, lever, 2000u);
    lever_command_t choice = rig_command();
    choice.estimator = (uint8_t)LEVER_ESTIMATOR_JOINT;
    command(&choice);
    TEST_ASSERT_EQUAL(LEVER_MODE_INIT, rig_health(lever).mode);
    assert_at_first_guess();
}

/* --- what the answers say -------------------------------------------------------------------------------------------- */

/* Half a count of each value of PILOT_PARAMETERS and PILOT_SIGMA, by model: lever.dbc. */
static const double half_parameter[LEVER_MODEL_COUNT][PARAMETERS] = {
    {5.0e-4, 5.0e-3, 5.0e-2}, {5.0e-4, 5.0e-3, 5.0e-2}, {5.0e-2, 5.0e-3, 5.0e-4}};
static const double half_sigma[LEVER_MODEL_COUNT][PARAMETERS] = {
    {5.0e-5, 1.0e-3, 2.5e-2}, {5.0e-5, 1.0e-3, 2.5e-2}, {1.0e-2, 1.0e-3, 1.0e-4}};

static void test_parameters_and_sigma_are_those_of_the_model_and_say_so(void)
{
    for (uint8_t model = 0u; model < (uint8_t)LEVER_MODEL_COUNT; model++) {
        message_pilot_parameters_t parameters;
        message_pilot_sigma_t sigma;
        choose_model(model);
        (void)sender_run(&sender, lever, 2000u);
        fetch_full_answers();
        const lever_estimate_t estimate = rig_estimate(lever);
        TEST_ASSERT_TRUE(message_pilot_parameters_decode(&parameters, &frames[0]));
        TEST_ASSERT_TRUE(message_pilot_sigma_decode(&sigma, &frames[1]));
        TEST_ASSERT_EQUAL_UINT8(model, parameters.model);
        TEST_ASSERT_EQUAL_UINT8(model, sigma.model);
        for (uint32_t i = 0u; i < (uint32_t)PARAMETERS; i++) {
            const double value = (double)estimate.parameter[i];
            const double deviation = (double)estimate.parameter_sigma[i];
            TEST_ASSERT_DOUBLE_WITHIN(1.01 * half_parameter[model][i], value, (double)parameters.parameter[i]);
            TEST_ASSERT_DOUBLE_WITHIN(1.01 * half_sigma[model][i], deviation, (double)sigma.sigma[i]);
            TEST_ASSERT_TRUE(fabs(value) > 100.0 * half_parameter[model][i]); /* it is more than rounding */
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_model_estimator_and_adaptation_can_be_commanded);
    RUN_TEST(test_every_choice_makes_a_difference);
    RUN_TEST(test_a_change_of_model_starts_over_with_its_own_first_guess);
    RUN_TEST(test_each_model_has_first_guesses_of_its_own);
    RUN_TEST(test_a_change_of_estimator_starts_over);
    RUN_TEST(test_parameters_and_sigma_are_those_of_the_model_and_say_so);
    return UNITY_END();
}
