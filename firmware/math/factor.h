/* Square-root covariance factors: small dense kernels.
 *
 * A factor is a lower-triangular n x n matrix S with non-negative diagonal that stands for the covariance P = S S^T;
 * its upper triangle is zero. Every matrix is a flat row-major array. Dimensions are arguments: pass literals, so
 * that the compiler specialises and unrolls. Nothing here compares with an absolute threshold, so factors of any
 * scale from 1e-17 to 1e17 work alike (their squares must stay inside the range of float).
 */
#ifndef MATH_FACTOR_H
#define MATH_FACTOR_H

#include "math/bounds.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

enum { FACTOR_ROWS_MOST = 8 }; /* of factor_add_noise */

/* Whether it is lower-triangular, and no element of its diagonal negative: invariants. NaN breaks none. */
static inline bool factor_is_whole(const float *s, uint32_t n)
{
    bool whole = true;
    for (uint32_t i = 0u; i < n; i++) {
        whole = whole && !(s[(i * n) + i] < 0.0f);
        for (uint32_t j = i + 1u; j < n; j++) {
            whole = whole && !(fabsf(s[(i * n) + j]) > 0.0f);
        }
    }
    return whole;
}

static inline float factor_dot_three(const float *a, const float *b)
{
    return (a[0] * b[0]) + (a[1] * b[1]) + (a[2] * b[2]);
}

/* tria(A) of two rows a and b of length m: s[2 x 2] with s s^T = A A^T; `a` is used up. The second diagonal element
 * is the norm of what b has beside a, from the 2 x 2 minors of A (Lagrange's identity): a sum of squares, where b
 * b^T - (a b^T)^2 / (a a^T) would cancel. */
static inline void factor_tria_two(float *a, const float *b, uint32_t m, float s[4])
{
    float square = 0.0f;
    for (uint32_t i = 0u; i < m; i++) {
        square += a[i] * a[i];
    }
    const float norm = sqrtf(square);
    const float inverse = (norm > 0.0f) ? (1.0f / norm) : 0.0f;
    float product = 0.0f;
    for (uint32_t i = 0u; i < m; i++) {
        a[i] *= inverse;
        product += a[i] * b[i];
    }
    float minors = 0.0f;
    for (uint32_t i = 0u; i < m; i++) {
        for (uint32_t j = i + 1u; j < m; j++) {
            const float minor = (a[i] * b[j]) - (a[j] * b[i]);
            minors += minor * minor;
        }
    }
    s[0] = norm;
    s[1] = 0.0f;
    s[2] = product;
    s[3] = sqrtf(minors);
}

/* Adds independent noise of standard deviation `noise` to row i of s[rows x n], whose first n rows are a factor: P
 * <- P + noise^2 e_i e_i^T, by Givens rotations of the noise column into the columns of s. The other rows keep their
 * covariance with the factor's. rest[rows - n] receives what is left of the noise column in them: deviations that
 * the factor does not explain any more. n - i square roots and divisions. */
static inline void factor_add_noise(float *s, uint32_t rows, uint32_t n, uint32_t i, float noise, float *rest)
{
    float column[FACTOR_ROWS_MOST];
    for (uint32_t r = i; r < rows; r++) {
        column[r] = (r == i) ? noise : 0.0f;
    }
    for (uint32_t j = i; j < n; j++) {
        const float diagonal = s[(j * n) + j];
        const float norm = sqrtf((diagonal * diagonal) + (column[j] * column[j]));
        const float inverse = (norm > 0.0f) ? (1.0f / norm) : 0.0f;
        const float cosine = (norm == diagonal) ? 1.0f : (diagonal * inverse); /* exactly 1 where noise is lost */
        const float sine = column[j] * inverse;
        s[(j * n) + j] = norm;
        for (uint32_t r = j + 1u; r < rows; r++) {
            const float old = s[(r * n) + j];
            s[(r * n) + j] = (cosine * old) + (sine * column[r]);
            column[r] = (cosine * column[r]) - (sine * old);
        }
    }
    for (uint32_t r = n; r < rows; r++) {
        rest[r - n] = column[r];
    }
}

#define FACTOR_ROUNDING 1.0e-6f /* of a difference of sums of a few products, relative to the sums */

/* Reverse Cholesky factor: U U^T = I + information, U upper triangular, in place of the upper triangle of
 * `information`; the diagonal holds the inverse of U's. Every pivot is at least 1. It is kept from falling below
 * that, or below the rounding of the information, so it cannot fail. */
static inline void factor_reverse(float *information, uint32_t n)
{
    float *u = information;
    for (uint32_t left = n; left > 0u; left--) {
        const uint32_t j = left - 1u;
        const float rounding = FACTOR_ROUNDING * u[(j * n) + j];
        const float least = greater(rounding, 1.0f);
        float pivot = 1.0f + u[(j * n) + j];
        for (uint32_t k = left; k < n; k++) {
            pivot -= u[(j * n) + k] * u[(j * n) + k];
        }
        const float inverse = 1.0f / sqrtf(greater(least, pivot));
        u[(j * n) + j] = inverse;
        for (uint32_t i = 0u; i < j; i++) {
            float sum = u[(i * n) + j];
            for (uint32_t k = left; k < n; k++) {
                sum -= u[(i * n) + k] * u[(j * n) + k];
            }
            u[(i * n) + j] = sum * inverse;
        }
    }
}

/* row <- U^-1 row, for such a U, of a row whose entries from `length` on are 0 and stay so. Applied to each row of a
 * factor S it conditions it on the information: P <- S (I + information)^-1 S^T. Directions with less than a
 * millionth of the greatest information are lost in its rounding. */
static inline void factor_reverse_solve(const float *u, uint32_t n, float *row, uint32_t length)
{
    for (uint32_t left = length; left > 0u; left--) {
        const uint32_t j = left - 1u;
        float sum = row[j];
        for (uint32_t k = left; k < length; k++) {
            sum -= u[(j * n) + k] * row[k];
        }
        row[j] = sum * u[(j * n) + j];
    }
}

/* Variance of element i: the square of the norm of row i. */
static inline float factor_variance(const float *factor, uint32_t n, uint32_t i)
{
    float square = 0.0f;
    for (uint32_t k = 0u; k <= i; k++) {
        square += factor[(i * n) + k] * factor[(i * n) + k];
    }
    return square;
}

#endif
