/* The textbook Kalman filter on full covariances in double precision, and a linear system of two states and three
 * parameters for it: the independent side of the filter tests. */
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

/* Rows of the identity for those of the first two elements of a state of n that are measured. */
static inline matrix_t kalman_outputs(const bool valid[2], uint32_t n)
{
    matrix_t h = matrix_zero(0u, n);
    for (uint32_t i = 0u; i < 2u; i++) {
        if (valid[i]) {
            h.at[h.rows][i] = 1.0;
            h.rows++;
        }
    }
    return h;
}

/* Of a column of two its valid rows; of a square matrix the rows and columns of those. */
static inline matrix_t kalman_pick(const bool valid[2], matrix_t all)
{
    if (!valid[0]) {
        all = matrix_block(&all, 1u, 1u, (all.columns == 1u) ? 0u : 1u, 1u);
    } else if (!valid[1]) {
        all = matrix_block(&all, 0u, 1u, 0u, 1u);
    } else {
        /* all of it */
    }
    return all;
}

/* q^2 [T^3/3, T^2/2; T^2/2, T] + diag(walk^2 T, 0): van Loan (1978) for a rate that walks and an angle that integrates. */
static inline matrix_t kalman_process_noise(double walk, double q, double period)
{
    matrix_t noise = matrix_zero(2u, 2u);
    noise.at[0][0] = (q * q * period * period * period / 3.0) + (walk * walk * period);
    noise.at[0][1] = q * q * period * period / 2.0;
    noise.at[1][0] = noise.at[0][1];
    noise.at[1][1] = q * q * period;
    return noise;
}

#endif
