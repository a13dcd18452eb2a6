/* Square-root covariance factors: small dense kernels.
 *
 * A factor is a lower-triangular n x n matrix S with non-negative diagonal that stands for the covariance P = S S^T; its
 * upper triangle is zero. Every matrix is a flat row-major array. Dimensions are arguments: pass literals, so that the
 * compiler specialises and unrolls. Nothing here compares with an absolute threshold, so factors of any scale from
 * 1e-17 to 1e17 work alike (their squares must stay inside the range of float).
 */
#ifndef MATH_FACTOR_H
#define MATH_FACTOR_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

enum { FACTOR_MOST = 8 }; /* greatest n of factor_add_noise */

/* tria(A): factor[n x n] with factor factor^T = A A^T, for a[n x m]; `a` is used up.
 * Modified Gram-Schmidt on the rows of A, whose triangular factor is as accurate as Householder's (Bjorck 1967). A row that
 * depends on the earlier ones gives a zero on the diagonal. About n^2 m multiply-adds, n square roots, n divisions. */
static inline void factor_tria(float *a, uint32_t n, uint32_t m, float *factor)
{
    for (uint32_t i = 0u; i < n; i++) {
        const float *row = &a[i * m];
        float square = 0.0f;
        for (uint32_t k = 0u; k < m; k++) {
            square += row[k] * row[k];
        }
        const float norm = sqrtf(square);
        const float inverse = (norm > 0.0f) ? (1.0f / norm) : 0.0f;
        factor[(i * n) + i] = norm;
        for (uint32_t j = i + 1u; j < n; j++) {
            float *other = &a[j * m];
            float product = 0.0f;
            for (uint32_t k = 0u; k < m; k++) {
                product += other[k] * row[k];
            }
            const float projection = product * inverse;
            const float share = projection * inverse;
            for (uint32_t k = 0u; k < m; k++) {
                other[k] -= share * row[k];
            }
            factor[(j * n) + i] = projection;
            factor[(i * n) + j] = 0.0f;
        }
    }
}

/* b[n x columns] <- L^-1 b by forward substitution, for a factor l[n x n] with positive diagonal. */
static inline void factor_solve(const float *l, uint32_t n, float *b, uint32_t columns)
{
    for (uint32_t i = 0u; i < n; i++) {
        const float inverse = 1.0f / l[(i * n) + i];
        for (uint32_t c = 0u; c < columns; c++) {
            float sum = b[(i * columns) + c];
            for (uint32_t k = 0u; k < i; k++) {
                sum -= l[(i * n) + k] * b[(k * columns) + c];
            }
            b[(i * columns) + c] = sum * inverse;
        }
    }
}

/* Adds independent noise of standard deviation `noise` to element i: P <- P + noise^2 e_i e_i^T, by Givens rotations of the noise
 * column into the columns of the factor. `map` [n x n] are further rows with the same columns; they keep their covariance with the factor's. rest[n] takes what is left of the noise column in the rows of the map:
 * deviations that are no longer correlated with the factor's. n - i square roots and divisions. */
static inline void factor_add_noise(float *s, float *map, uint32_t n, uint32_t i, float noise, float *rest)
{
    float column[FACTOR_MOST];
    for (uint32_t r = 0u; r < n; r++) {
        column[r] = (r == i) ? noise : 0.0f;
        rest[r] = 0.0f;
    }
    for (uint32_t j = i; j < n; j++) {
        const float diagonal = s[(j * n) + j];
        const float norm = sqrtf((diagonal * diagonal) + (column[j] * column[j]));
        const float inverse = (norm > 0.0f) ? (1.0f / norm) : 0.0f;
        const float cosine = (norm == diagonal) ? 1.0f : (diagonal * inverse); /* exactly 1 where noise is lost */
        const float sine = column[j] * inverse;
        s[(j * n) + j] = norm;
        for (uint32_t r = j + 1u; r < n; r++) {
            const float old = s[(r * n) + j];
            s[(r * n) + j] = (cosine * old) + (sine * column[r]);
            column[r] = (cosine * column[r]) - (sine * old);
        }
        for (uint32_t r = 0u; r < n; r++) {
            const float old = map[(r * n) + j];
            map[(r * n) + j] = (cosine * old) + (sine * rest[r]);
            rest[r] = (cosine * rest[r]) - (sine * old);
        }
    }
}

#define FACTOR_ROUNDING 1.0e-6f /* of a difference of sums of a few products, relative to the sums */

/* Reverse Cholesky factor: U U^T = I + information, U upper triangular, in place of the upper triangle of `information`; the
 * diagonal holds the inverse of U's. Every pivot is at least 1; it is kept from falling below that, or below the rounding of
 * the information, so it cannot fail. */
static inline void factor_reverse(float *information, uint32_t n)
{
    float *u = information;
    for (uint32_t left = n; left > 0u; left--) {
        const uint32_t j = left - 1u;
        const float rounding = FACTOR_ROUNDING * u[(j * n) + j];
        const float least = (rounding > 1.0f) ? rounding : 1.0f;
        float pivot = 1.0f + u[(j * n) + j];
        for (uint32_t k = left; k < n; k++) {
            pivot -= u[(j * n) + k] * u[(j * n) + k];
        }
        const float inverse = 1.0f / sqrtf((pivot < least) ? least : pivot);
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

/* row <- U^-1 row, for such a U, of a row whose entries from `length` on are 0 and stay so. */
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

/* Conditions a factor on information gathered elsewhere: P <- S (I + information)^-1 S^T, by S <- S U^-T. Directions that have
 * less than a millionth of the greatest information drown in its rounding.
 *   s[n x n]              before and after
 *   map[n x n]            result: U^-T, lower triangular
 *   u[n x n]              factor_reverse() of the information: sum of C^T C over outputs C = H S with noise covariance I
 *   score[n]              sum of C^T innovation; result: U^-1 score, so S score (after) is the correction
 * The cost does not depend on the number of outputs. */
static inline void factor_condition(float *s, float *map, uint32_t n, const float *u, float *score)
{
    factor_reverse_solve(u, n, score, n);
    for (uint32_t r = 0u; r < n; r++) {
        for (uint32_t j = 0u; j < n; j++) {
            map[(r * n) + j] = (j == r) ? 1.0f : 0.0f;
        }
        factor_reverse_solve(u, n, &s[r * n], r + 1u);
        factor_reverse_solve(u, n, &map[r * n], r + 1u);
    }
}

/* Variance of element i, and its standard deviation: the norm of row i. */
static inline float factor_variance(const float *factor, uint32_t n, uint32_t i)
{
    float square = 0.0f;
    for (uint32_t k = 0u; k <= i; k++) {
        square += factor[(i * n) + k] * factor[(i * n) + k];
    }
    return square;
}

static inline float factor_sigma(const float *factor, uint32_t n, uint32_t i)
{
    return sqrtf(factor_variance(factor, n, i));
}

/* The invariant of a factor: every entry finite, diagonal positive, upper triangle zero. */
static inline bool factor_is_valid(const float *factor, uint32_t n)
{
    bool positive = true;
    float size = 0.0f;
    float above = 0.0f;
    for (uint32_t i = 0u; i < n; i++) {
        positive = positive && (factor[(i * n) + i] > 0.0f);
        for (uint32_t j = 0u; j < n; j++) {
            const float entry = fabsf(factor[(i * n) + j]);
            size += (j <= i) ? entry : 0.0f;
            above += (j <= i) ? 0.0f : entry;
        }
    }
    return positive && (size < 1.0e17f) && (above == 0.0f);
}

#endif
