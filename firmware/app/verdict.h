/* The verdict: the first row of verdict.def whose evidence is present, and what it permits and does. */
#ifndef APP_VERDICT_H
#define APP_VERDICT_H

#include <stdbool.h>
#include <stdint.h>

enum evidence_id {
#define EVIDENCE(name, threshold, off, fault, meaning) name,
#include "app/evidence.def"
    EVIDENCE_COUNT
};

enum verdict {
#define VERDICT(name, evidence, learn, adapt, torque, correction, margin, entry, exit, meaning) name,
#include "app/verdict.def"
    VERDICT_COUNT
};

/* What is done once, on entering or leaving a verdict. */
enum verdict_action {
    ACTION_NOTHING = 0,
    ACTION_RESTORE = 1, /* the belief of one to two seconds ago: what came since was not what it seemed */
    ACTION_OPEN = 2,    /* the prior's uncertainty: it may be another pilot */
    ACTION_INFLATE = 4, /* change_walk seconds of the walk at once */
    ACTION_LEVELS = 8   /* levels and state begin anew, with a step of the acceleration, where the lever was moved */
};

typedef struct verdict_row {
    uint32_t evidence;   /* a bit each, of enum evidence_id */
    uint32_t torque;     /* faults that forbid it, of enum lever_fault and VERDICT_NEVER */
    uint32_t correction; /* likewise */
    uint32_t margin;     /* likewise */
    bool learn;
    bool adapt;
    uint8_t entry; /* enum verdict_action */
    uint8_t exit;
} verdict_row_t;

extern const verdict_row_t verdict_rows[VERDICT_COUNT];

#define VERDICT_NEVER 0x80000000u   /* forbids it with any faults */
#define VERDICT_DAMPING 0x40000000u /* among the faults: damping is chosen, and depends on the sign of torque */

/* Whether an action of a row is permitted with these faults. */
static inline bool verdict_permits(uint32_t forbidding, uint32_t faults)
{
    return ((faults | VERDICT_NEVER) & forbidding) == 0u;
}

/* The verdict on evidence that is present, a bit each. */
uint8_t verdict_of(uint32_t present);

#endif
