/* The textbook Kalman filter on full covariances in double precision: the independent side of the filter tests. */
#ifndef UNIT_FILTER_KALMAN_H
#define UNIT_FILTER_KALMAN_H

#include "../math/dense.h"

#include <stdbool.h>

typedef struct kalman {
    matrix_t x; /* column */
    matrix_t p;
} kalman_t;

/* x <- a x, P <- a P a^T + q */
static inline void kalman_predict(kalman_t *kalman, matrix_t a, matrix_t q)
{
    kalman->x = matrix_product(a, kalman->x);
    kalman->p = matrix_sum(matrix_congruence(a, kalman->p), 1.0, q);
}

/* Gain for the outputs h x with noise covariance r. */
static inline matrix_t kalman_gain(const kalman_t *kalman, matrix_t h, matrix_t r)
{
    const matrix_t innovation = matrix_sum(matrix_congruence(h, kalman->p), 1.0, r);
    return matrix_product(matrix_product(kalman->p, matrix_transposed(h)), matrix_inverse(innovation));
}

/* Measurement update in Joseph's form. Returns the normalised innovation squared. */
static inline double kalman_update(kalman_t *kalman, matrix_t h, matrix_t r, matrix_t y)
{
    const matrix_t innovation = matrix_sum(y, -1.0, matrix_product(h, kalman->x));
    const matrix_t covariance = matrix_sum(matrix_congruence(h, kalman->p), 1.0, r);
    const matrix_t gain = kalman_gain(kalman, h, r);
    const matrix_t rest = matrix_sum(matrix_identity(kalman->p.rows), -1.0, matrix_product(gain, h));
    kalman->x = matrix_sum(kalman->x, 1.0, matrix_product(gain, innovation));
    kalman->p = matrix_sum(matrix_congruence(rest, kalman->p), 1.0, matrix_congruence(gain, r));
    return matrix_congruence(matrix_transposed(innovation), matrix_inverse(covariance)).at[0][0];
}

#endif
