#include "app/verdict.h"

#define ON(evidence) ((uint32_t)1u << (uint32_t)(evidence))
#define NOTHING ACTION_NOTHING
#define RESTORE ACTION_RESTORE
#define OPEN ACTION_OPEN
#define INFLATE ACTION_INFLATE
#define LEVELS ACTION_LEVELS

const verdict_row_t verdict_rows[VERDICT_COUNT] = {
#define VERDICT(name, evidence, learn, adapt, torque, correction, margin, entry, exit, meaning)                        \
    {(evidence), (learn) != 0, (adapt) != 0, (torque) != 0, (correction) != 0, (margin) != 0, (uint8_t)(entry),        \
        (uint8_t)(exit)},
#include "app/verdict.def"
};

/* All evidence that decides. */
static const uint32_t decisive = 0u
#define VERDICT(name, evidence, learn, adapt, torque, correction, margin, entry, exit, meaning) | (evidence)
#include "app/verdict.def"
    ;

uint8_t verdict_of(uint32_t present)
{
    uint8_t verdict = (uint8_t)VERDICT_LEARNING;
    if ((present & decisive) != 0u) { /* seldom */
        verdict = 0u;
        while ((verdict_rows[verdict].evidence & present) == 0u) {
            verdict++;
        }
    }
    return verdict;
}
