/* Invariants hold whatever the input. With LEVER_ASSERTIONS (debug builds, fuzzers, mutants) one that is broken traps;
 * elsewhere they compile to nothing. NaN breaks none: app/estimator.c refuses it. */
#ifndef MATH_INVARIANT_H
#define MATH_INVARIANT_H

#ifdef LEVER_ASSERTIONS
#define INVARIANT(condition) ((condition) ? (void)0 : __builtin_trap())
#else
#define INVARIANT(condition)
#endif

#endif
