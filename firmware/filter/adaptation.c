#include "filter/adaptation.h"

#include "lever_cdkf.h"

void adaptation_start(const adaptation_t *adaptation, float walk[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        walk[i] =
            (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ANNEALING) ? adaptation->ceiling[i] : adaptation->floor[i];
    }
}

static float adapted(const adaptation_t *adaptation, float period, float correction, float walk, float floor)
{
    float next = floor;
    if (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ANNEALING) {
        next = walk * (1.0f - (period / adaptation->annealing_time));
    } else if (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO) {
        const float nu = period / adaptation->averaging_time;
        next = walk + (nu * (((correction * correction) / period) - walk));
    } else {
        next = floor;
    }
    return next;
}

void adaptation_step(const adaptation_t *adaptation, float period, const float correction[MODEL_PARAMETERS],
    bool excited, float walk[MODEL_PARAMETERS])
{
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        const float floor = adaptation->floor[i];
        const float ceiling = excited ? adaptation->ceiling[i] : floor;
        float next = adapted(adaptation, period, correction[i], walk[i], floor);
        next = (next > floor) ? next : floor;
        walk[i] = (next < ceiling) ? next : ceiling;
    }
}
