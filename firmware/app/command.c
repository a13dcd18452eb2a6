/* Commands: choices and requests. */
#include "app/estimator.h"

static bool is_choice(uint8_t value, uint8_t count)
{
    return (value < count) || (value == (uint8_t)LEVER_KEEP);
}

/* Makes a choice, unless it is to be kept. Returns true when that changes it. */
static bool choose(uint8_t *choice, uint8_t asked)
{
    const bool changes = (asked != (uint8_t)LEVER_KEEP) && (asked != *choice);
    *choice = changes ? asked : *choice;
    return changes;
}

static void carry_out(estimator_t *estimator, const lever_command_t *command)
{
    setup_t *setup = &estimator->setup;
    bool restart = (command->request == (uint8_t)LEVER_REQUEST_RESET);
    restart = choose(&setup->model, command->model) || restart;
    restart = choose(&setup->preload, command->preload) || restart;
    restart = choose(&setup->estimator, command->estimator) || restart;
    if (choose(&setup->adaptation, command->adaptation)) {
        const adaptation_t adaptation = setup_adaptation(setup);
        adaptation_start(&adaptation, &estimator->cdkf);
    }
    if (restart) {
        estimator_start_over(estimator);
    }
    if (estimator->frozen && (command->request == (uint8_t)LEVER_REQUEST_RUN)) {
        learning_resume(&estimator->learning, &estimator->cdkf);
    }
    if ((command->request == (uint8_t)LEVER_REQUEST_RUN) || (command->request == (uint8_t)LEVER_REQUEST_FREEZE)) {
        estimator->frozen = (command->request == (uint8_t)LEVER_REQUEST_FREEZE);
    }
}

bool estimator_command(estimator_t *estimator, const lever_command_t *command)
{
    const bool known = (command->request <= (uint8_t)LEVER_REQUEST_RESET) &&
                       is_choice(command->model, (uint8_t)LEVER_MODEL_COUNT) &&
                       is_choice(command->preload, (uint8_t)LEVER_PRELOAD_COUNT) &&
                       is_choice(command->estimator, (uint8_t)LEVER_ESTIMATOR_COUNT) &&
                       is_choice(command->adaptation, (uint8_t)LEVER_ADAPTATION_COUNT);
    if (known) {
        carry_out(estimator, command);
    }
    return known;
}
