#include "app/verdict.h"
#include "lever_cdkf.h"

#define ON(evidence) ((uint32_t)1u << (uint32_t)(evidence))
#define NOTHING ACTION_NOTHING
#define RESTORE ACTION_RESTORE
#define OPEN ACTION_OPEN
#define INFLATE ACTION_INFLATE
#define LEVELS ACTION_LEVELS
#define NEVER VERDICT_NEVER
#define ALWAYS 0u /* no fault forbids it */
#define UNDAMPED VERDICT_DAMPING
/* The clock advances, and the filter was not just restarted. */
#define RUNNING ((uint32_t)LEVER_FAULT_CLOCK | (uint32_t)LEVER_FAULT_RECOVERED)
/* That, and theta and the base are measured, and no parameter rests on a bound. */
#define SOUND (RUNNING | (uint32_t)LEVER_FAULT_THETA | (uint32_t)LEVER_FAULT_BASE | (uint32_t)LEVER_FAULT_BOUND)

const verdict_row_t verdict_rows[VERDICT_COUNT] = {
#define VERDICT(name, evidence, learn, adapt, torque, correction, margin, entry, exit, meaning)                        \
    {(evidence), (torque), (correction), (margin), (learn) != 0, (adapt) != 0, (uint8_t)(entry), (uint8_t)(exit)},
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
