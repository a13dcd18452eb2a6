/* Runs the tests of a program: all, or the one of its argument. --list says which there are. */
#include "test.h"

#include <stdio.h>
#include <string.h>

uint32_t test_round;

static test_t *first;
static test_t **end = &first;

void test_add(test_t *test)
{
    *end = test;
    end = &test->next;
}

__attribute__((weak)) void setUp(void)
{
}

__attribute__((weak)) void tearDown(void)
{
}

static void run(const test_t *test, const char *argument)
{
    char name[200];
    (void)snprintf(name, sizeof name, (test->rounds > 0u) ? "%s [%u]" : "%s", test->name, test_round);
    if ((argument != NULL) && (strcmp(argument, "--list") == 0)) {
        (void)puts(name);
    } else if ((argument == NULL) || (strcmp(argument, name) == 0)) {
        UnityDefaultTestRun(test->run, name, test->line);
    } else {
        /* not this one */
    }
}

int main(int count, char **arguments)
{
    UnityBegin(first->file);
    for (const test_t *test = first; test != NULL; test = test->next) {
        test_round = 0u;
        do {
            run(test, (count > 1) ? arguments[1] : NULL);
            test_round++;
        } while (test_round < test->rounds);
    }
    return ((count > 1) && (strcmp(arguments[1], "--list") == 0)) ? 0 : UNITY_END();
}
