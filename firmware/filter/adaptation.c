#include "filter/adaptation.h"

#include "lever_cdkf.h"

static float growth(const adaptation_t *adaptation, bool excited)
{
    const bool forgets = excited && (adaptation->kind == (uint8_t)LEVER_ADAPTATION_FORGETTING);
    return forgets ? (1.0f / adaptation->forgetting_time) : 0.0f;
}

void adaptation_start(const adaptation_t *adaptation, parameter_filter_t *filter)
{
    const bool anneals = (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ANNEALING);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        filter->walk[i] = adaptation->floor[i] * (anneals ? adaptation->ceiling : 1.0f);
    }
    filter->growth = growth(adaptation, true);
}

static float share_of(float period, float time)
{
    return (period < time) ? (period / time) : 1.0f;
}

static float adapted(const adaptation_t *adaptation, float period, float correction, float walk, float floor)
{
    float next = floor;
    if (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ANNEALING) {
        next = walk * (1.0f - share_of(period, adaptation->annealing_time));
    } else if (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO) {
        const float nu = share_of(period, adaptation->averaging_time);
        next = walk + (nu * (((correction * correction) / period) - walk));
    } else {
        next = floor;
    }
    return next;
}

void adaptation_step(const adaptation_t *adaptation, float period, const float correction[MODEL_PARAMETERS],
    bool excited, parameter_filter_t *filter)
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        const float floor = adaptation->floor[i];
        const float ceiling = floor * (excited ? adaptation->ceiling : 1.0f);
        float next = adapted(adaptation, period, correction[i], filter->walk[i], floor);
        next = (next > floor) ? next : floor;
        filter->walk[i] = (next < ceiling) ? next : ceiling;
    }
    filter->growth = growth(adaptation, excited);
}
