/* Included before each source of a harness: "not available" is infinite, because Eva 25 does not decide comparisons with
 * NaN. */
#ifndef PROOF_NO_NAN_H
#define PROOF_NO_NAN_H

#include <math.h>

#undef NAN
#define NAN INFINITY

#endif
