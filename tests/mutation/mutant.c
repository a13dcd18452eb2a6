/* What takes the place of a program's main(), which is served_main() here, when its library has mutants. With arguments,
 * or a mutant in the environment variable MUTANT, it is that. Without, each line of the input is one run of it, in a
 * process of its own.
 *
 *     MUTANT <tab> MOST <tab> ARGUMENTS, with tabs between them     in: MOST expressions with mutants, then it hangs
 *     STATUS <tab> MICROSECONDS <tab> EXPRESSIONS                   out: exit status, or 128 and a signal; and without
 *                                                                   a mutant the places reached, with tabs between them
 *
 * A failed assertion ends a run. */
#define _GNU_SOURCE
#include "mutant.h"

#include <fcntl.h>
#include <inttypes.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

enum { FAILED = 1, HANGS = 124, ARGUMENTS_MOST = 4, LINE_MOST = 8192 };

typedef struct report {
    uint64_t expressions;
    uint8_t reached[MUTANTS_MOST];
} report_t;

uint32_t mutant;
uint8_t mutant_reached[MUTANTS_MOST];
uint64_t mutant_left = UINT64_MAX;

static report_t *report; /* of a run without a mutant; shared with its process */
static uint64_t most;

int served_main(int count, char **arguments);

void mutant_hangs(void)
{
    _Exit(HANGS);
}

/* Unity's way out of a failed test, through the linker's --wrap. */
_Noreturn void __wrap_longjmp(jmp_buf frame, int value)
{
    (void)frame;
    (void)value;
    (void)fflush(stdout);
    _Exit(FAILED);
}

static void write_report(void)
{
    report->expressions = most - mutant_left;
    (void)memcpy(report->reached, mutant_reached, sizeof report->reached);
}

static _Noreturn void run(char *line)
{
    char *arguments[ARGUMENTS_MOST + 2] = {"served"};
    int count = 1;
    mutant = (uint32_t)strtoul(strtok(line, "\t\n"), NULL, 10);
    most = strtoull(strtok(NULL, "\t\n"), NULL, 10);
    mutant_left = most;
    for (char *word = strtok(NULL, "\t\n"); (word != NULL) && (count <= ARGUMENTS_MOST); word = strtok(NULL, "\t\n")) {
        arguments[count] = word;
        count++;
    }
    const int nowhere = open("/dev/null", O_RDWR);
    (void)dup2(nowhere, STDIN_FILENO);
    (void)dup2(nowhere, STDOUT_FILENO);
    (void)dup2(nowhere, STDERR_FILENO);
    if (mutant == 0u) {
        (void)atexit(write_report);
    }
    exit(served_main(count, arguments));
}

static void answer(int status, const struct rusage *used, bool reports)
{
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : (128 + WTERMSIG(status));
    const long us =
        (1000000L * (used->ru_utime.tv_sec + used->ru_stime.tv_sec)) + used->ru_utime.tv_usec + used->ru_stime.tv_usec;
    printf("%d\t%ld\t%" PRIu64, code, us, report->expressions);
    for (unsigned number = 0u; reports && (number < MUTANTS_MOST); number++) {
        if (report->reached[number] != 0u) {
            printf("\t%u", number);
        }
    }
    (void)putchar('\n');
    (void)fflush(stdout);
}

int main(int count, char **arguments)
{
    static char line[LINE_MOST];
    const char *chosen = getenv("MUTANT");
    if ((count > 1) || (chosen != NULL)) {
        mutant = (chosen != NULL) ? (uint32_t)strtoul(chosen, NULL, 10) : 0u;
        return served_main(count, arguments);
    }
    report = mmap(NULL, sizeof *report, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    while ((report != MAP_FAILED) && (fgets(line, sizeof line, stdin) != NULL)) {
        struct rusage used;
        int status = 0;
        const pid_t child = fork();
        if (child == 0) {
            run(line);
        }
        if ((child < 0) || (wait4(child, &status, 0, &used) != child)) {
            return EXIT_FAILURE;
        }
        answer(status, &used, strtoul(line, NULL, 10) == 0u);
    }
    return EXIT_SUCCESS;
}
