/* Runs the tests of a program. */
#include "test.h"

#include <stdio.h>

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

int main(void)
{
    UnityBegin(first->file);
    for (const test_t *test = first; test != NULL; test = test->next) {
        char name[200];
        test_round = 0u;
        do {
            (void)snprintf(name, sizeof name, (test->rounds > 0u) ? "%s [%u]" : "%s", test->name, test_round);
            UnityDefaultTestRun(test->run, name, test->line);
            test_round++;
        } while (test_round < test->rounds);
    }
    return UNITY_END();
}
