/* Power-on self test of the estimator: the same bits from this processor, compiler and memory as from the host's
 * build. */
#ifndef LEVER_PORT_EMBEDDED_SELF_TEST_H
#define LEVER_PORT_EMBEDDED_SELF_TEST_H

#include <stdbool.h>

#include "lever_cdkf.h"

/* Feeds the frames of golden.h to an instance in `memory` with each kind of estimator, and compares all it sends and
 * its last estimate. True when every bit is the host's. Call it before `memory` gets its instance; about 2 million
 * instructions. */
bool self_test(lever_memory_t *memory);

#endif
