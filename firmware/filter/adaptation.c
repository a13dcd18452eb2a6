#include "filter/adaptation.h"

#include "lever_cdkf.h"
#include "math/bounds.h"
#include "math/share.h"

void adaptation_start(const adaptation_t *adaptation, cdkf_t *cdkf)
{
    const bool anneals = (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ANNEALING);
    const bool forgets = (adaptation->kind == (uint8_t)LEVER_ADAPTATION_FORGETTING);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        cdkf->walk[i] = adaptation->floor[i] * (anneals ? adaptation->ceiling : 1.0f);
        cdkf->drift[i] = 0.0f;
    }
    cdkf->growth = forgets ? (1.0f / adaptation->forgetting_time) : 0.0f;
}

void adaptation_step(
    const adaptation_t *adaptation, float period, const float correction[MODEL_PARAMETERS], bool excited, cdkf_t *cdkf)
{
    const bool forgets = excited && (adaptation->kind == (uint8_t)LEVER_ADAPTATION_FORGETTING);
    const float nu = share_of(period, adaptation->averaging_time);
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
        const float floor = adaptation->floor[i];
        const float ceiling = floor * (excited ? adaptation->ceiling : 1.0f);
        float next = floor;
        if (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ANNEALING) {
            next = cdkf->walk[i] * (1.0f - share_of(period, adaptation->annealing_time));
        } else if (adaptation->kind == (uint8_t)LEVER_ADAPTATION_ROBBINS_MONRO) {
            cdkf->drift[i] += correction[i] - (share_of(period, adaptation->memory) * cdkf->drift[i]);
            const float seen = (2.0f * (cdkf->drift[i] * cdkf->drift[i])) / adaptation->memory;
            next = cdkf->walk[i] + (nu * (seen - cdkf->walk[i]));
        } else {
            /* the floor */
        }
        cdkf->walk[i] = lesser(greater(next, floor), ceiling);
    }
    cdkf->growth = forgets ? (1.0f / adaptation->forgetting_time) : 0.0f;
}
