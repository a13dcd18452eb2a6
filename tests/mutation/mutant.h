/* The mutant that is switched on; 0: none. Included first by every mutated file. */
#ifndef MUTATION_MUTANT_H
#define MUTATION_MUTANT_H

#include <stdbool.h>
#include <stdint.h>

enum { MUTANTS_MOST = 20000 };

extern uint32_t mutant;
extern uint8_t mutant_reached[MUTANTS_MOST]; /* [number of the first mutant of an expression or statement] */
extern uint64_t mutant_left; /* expressions with mutants still to be computed before the program counts as hanging */

void mutant_hangs(void);

/* Is one of these the chosen one? Asked each time that their expression or statement is reached. */
static inline bool mutant_in(uint32_t first, uint32_t last)
{
    mutant_reached[first] = 1u;
    mutant_left--;
    if (mutant_left == 0u) {
        mutant_hangs();
    }
    return (mutant - first) <= (last - first);
}

#endif
