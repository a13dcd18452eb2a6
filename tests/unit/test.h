/* How a test is written: TEST(what_it_shows) { … }. A program runs its tests in their order, after setUp() each, if
 * there is one. */
#ifndef UNIT_TEST_H
#define UNIT_TEST_H

#include <stdint.h>

#include "unity.h"

typedef struct test {
    const char *file;
    const char *name;
    void (*run)(void);
    int line;
    uint32_t rounds;
    struct test *next;
} test_t;

extern uint32_t test_round; /* of TEST_EACH */

void test_add(test_t *test);

/* Runs so many times, with test_round from 0 on. */
#define TEST_EACH(how_many, title)                                                                                     \
    static void title(void);                                                                                           \
    __attribute__((constructor)) static void add_##title(void)                                                         \
    {                                                                                                                  \
        static test_t test = {                                                                                         \
            .file = __FILE__, .name = #title, .run = title, .line = __LINE__, .rounds = (uint32_t)(how_many)};         \
        test_add(&test);                                                                                               \
    }                                                                                                                  \
    static void title(void)

#define TEST(title) TEST_EACH(0, title)

#endif
