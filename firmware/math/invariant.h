/* What holds whatever comes in: checked in debug builds and by the fuzzers (LEVER_ASSERTIONS), nothing elsewhere. A value
 * that is not a number breaks no invariant: app/estimator.c refuses it. */
#ifndef MATH_INVARIANT_H
#define MATH_INVARIANT_H

#ifdef LEVER_ASSERTIONS
#define INVARIANT(condition) ((condition) ? (void)0 : __builtin_trap())
#else
#define INVARIANT(condition)
#endif

#endif
