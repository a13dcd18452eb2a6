/* What runs around a unit test whose library has mutants. A failed assertion ends it. */
#include "mutant.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>

enum { MUTANTS_MOST = 20000, FAILED = 1, HANGS = 124 };

uint32_t mutant;
uint8_t mutant_reached[MUTANTS_MOST];
uint64_t mutant_left = UINT64_MAX;

void mutant_hangs(void)
{
    _Exit(HANGS);
}

/* Unity's way out of a failed test, through the linker's --wrap. */
_Noreturn void __wrap_longjmp(jmp_buf frame, int value)
{
    _Exit(FAILED);
}

/* Without a mutant: what was computed, and what was reached, for the file MUTANT_REPORT. */
static void report(void)
{
    const char *path = getenv("MUTANT_REPORT");
    FILE *file = (path != NULL) ? fopen(path, "w") : NULL;
    if (file != NULL) {
        fprintf(file, "%llu\n", (unsigned long long)(UINT64_MAX - mutant_left));
        for (unsigned number = 0u; number < MUTANTS_MOST; number++) {
            if (mutant_reached[number] != 0u) {
                fprintf(file, "%u\n", number);
            }
        }
        fclose(file);
    }
}

__attribute__((constructor)) static void choose(void)
{
    const char *chosen = getenv("MUTANT");
    const char *most = getenv("MUTANT_MOST");
    mutant = (chosen != NULL) ? (uint32_t)strtoul(chosen, NULL, 10) : 0u;
    mutant_left = (most != NULL) ? strtoull(most, NULL, 10) : UINT64_MAX;
    atexit(report);
}
