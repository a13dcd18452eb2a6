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

/* tria(A): factor[n x n] with factor factor^T = A A^T, for a[n x m]; `a` is used up.
 * Modified Gram-Schmidt on the rows of A, whose triangular factor is as accurate as Householder's (Bjorck 1967). A row that
 * depends on the earlier ones gives a zero on the diagonal. About n^2 m multiply-adds, n square roots, n divisions. */
static inline void factor_tria(float *a, uint32_t n, uint32_t m, float *factor)
{
    for (uint32_t i = 0u; i < n; i++) {
        float *row = &a[i * m];
        float square = 0.0f;
        for (uint32_t k = 0u; k < m; k++) {
            square += row[k] * row[k];
        }
        const float norm = sqrtf(square);
        const float inverse = (norm > 0.0f) ? (1.0f / norm) : 0.0f;
        for (uint32_t k = 0u; k < m; k++) {
            row[k] *= inverse;
        }
        factor[(i * n) + i] = norm;
        for (uint32_t j = i + 1u; j < n; j++) {
            float *other = &a[j * m];
            float projection = 0.0f;
            for (uint32_t k = 0u; k < m; k++) {
                projection += other[k] * row[k];
            }
            for (uint32_t k = 0u; k < m; k++) {
                other[k] -= projection * row[k];
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

/* Measurement update with `p` whitened outputs (noise covariance I), one after the other, by Carlson's triangular form
 * (Carlson 1973, here for lower-triangular factors): no inverse and no downdate, the diagonal is only ever multiplied by
 * factors in (0, 1], so it cannot fail. Costs n square roots and n divisions per output.
 *   s[rows x n]           factor in its first n rows; rows below it are carried along: they belong to other quantities
 *                         with those columns as part of their factor. Before and after.
 *   c[p x n]              outputs in factor coordinates, C = H S; used up
 *   innovation[p x m]     whitened innovations, one set a column; used up
 *   correction[rows x m]  result: gain times innovation, for each set
 *   work[rows + p]        scratch
 * Returns the normalised innovation squared of the first set, chi-square with p degrees of freedom. */
static inline float factor_update(float *s, uint32_t rows, uint32_t n, float *c, uint32_t p, float *innovation,
    uint32_t m, float *correction, float *work)
{
    float nis = 0.0f;
    for (uint32_t r = 0u; r < (rows * m); r++) {
        correction[r] = 0.0f;
    }
    for (uint32_t i = 0u; i < p; i++) {
        float *covariance = work;   /* of each row with this output, built column by column */
        float *ahead = &work[rows]; /* of the later outputs with this output */
        float variance = 1.0f;      /* of this output, likewise: Carlson's alpha */
        float root = 1.0f;          /* its square root and the inverse of that */
        float inverse = 1.0f;
        for (uint32_t r = 0u; r < (rows + p); r++) {
            work[r] = 0.0f;
        }
        for (uint32_t left = n; left > 0u; left--) {
            const uint32_t j = left - 1u;
            const float f = c[(i * n) + j];
            variance += f * f;
            const float next_root = sqrtf(variance);
            const float next_inverse = 1.0f / next_root;
            const float keep = root * next_inverse;
            const float spread = f * inverse * next_inverse;
            root = next_root;
            inverse = next_inverse;
            for (uint32_t r = j; r < rows; r++) {
                const float old = s[(r * n) + j];
                s[(r * n) + j] = (old * keep) - (covariance[r] * spread);
                covariance[r] += old * f;
            }
            for (uint32_t q = i + 1u; q < p; q++) {
                const float old = c[(q * n) + j];
                c[(q * n) + j] = (old * keep) - (ahead[q] * spread);
                ahead[q] += old * f;
            }
        }
        for (uint32_t set = 0u; set < m; set++) {
            const float weight = innovation[(i * m) + set] * inverse * inverse;
            nis += (set == 0u) ? (innovation[i * m] * weight) : 0.0f;
            for (uint32_t r = 0u; r < rows; r++) {
                correction[(r * m) + set] += covariance[r] * weight;
            }
            for (uint32_t q = i + 1u; q < p; q++) {
                innovation[(q * m) + set] -= ahead[q] * weight;
            }
        }
    }
    return nis;
}

/* Adds independent noise to a factor: P <- P + diag(noise^2), noise[n] standard deviations, by Givens rotations of each
 * noise column into the columns of the factor. s[rows x n] as in factor_update: rows below the first n keep their
 * covariance with the first n elements. rest[n x rows] takes what is left of each noise column: zeros for the first n rows,
 * and for the others deviations that are no longer correlated with the first n elements. */
static inline void factor_add_noise(float *s, uint32_t rows, uint32_t n, const float *noise, float *rest)
{
    for (uint32_t i = 0u; i < n; i++) {
        float *column = &rest[i * rows];
        for (uint32_t r = 0u; r < rows; r++) {
            column[r] = (r == i) ? noise[i] : 0.0f;
        }
        for (uint32_t j = i; j < n; j++) {
            const float diagonal = s[(j * n) + j];
            const float norm = sqrtf((diagonal * diagonal) + (column[j] * column[j]));
            const float cosine = (norm > 0.0f) ? (diagonal / norm) : 1.0f; /* exactly 1 where there is no noise */
            const float sine = (norm > 0.0f) ? (column[j] / norm) : 0.0f;
            s[(j * n) + j] = norm;
            column[j] = 0.0f;
            for (uint32_t r = j + 1u; r < rows; r++) {
                const float old = s[(r * n) + j];
                s[(r * n) + j] = (cosine * old) + (sine * column[r]);
                column[r] = (cosine * column[r]) - (sine * old);
            }
        }
    }
}

#define FACTOR_ROUNDING 1.0e-6f /* of a difference of sums of a few products, relative to the sums */

/* Conditions a factor on information gathered elsewhere: P <- S (I + information)^-1 S^T, by the reverse Cholesky factor
 * U U^T = I + information (U upper triangular), S <- S U^-T. Every pivot of U is at least 1; it is kept from falling below
 * that, or below the rounding of the information, so it cannot fail. Directions that have less than a millionth of the
 * greatest information drown in that rounding.
 *   s[rows x n]           as in factor_update; before and after
 *   information[n x n]    sum of C^T C over outputs C = H S with noise covariance I; used up
 *   score[n]              sum of C^T innovation; used up
 *   correction[rows]      result: S (I + information)^-1 score
 * Costs n square roots and n divisions, whatever the number of outputs. */
static inline void factor_condition(
    float *s, uint32_t rows, uint32_t n, float *information, float *score, float *correction)
{
    float *u = information; /* its upper triangle; the diagonal holds the inverse of U's */
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
    for (uint32_t r = 0u; r <= rows; r++) { /* the rows of S, and last the score: U z = row */
        float *row = (r < rows) ? &s[r * n] : score;
        for (uint32_t left = n; left > 0u; left--) {
            const uint32_t j = left - 1u;
            float sum = row[j];
            for (uint32_t k = left; k < n; k++) {
                sum -= u[(j * n) + k] * row[k];
            }
            row[j] = sum * u[(j * n) + j];
        }
    }
    for (uint32_t r = 0u; r < rows; r++) {
        float sum = 0.0f;
        for (uint32_t j = 0u; j < n; j++) {
            sum += s[(r * n) + j] * score[j];
        }
        correction[r] = sum;
    }
}

/* Standard deviation of element i: the norm of row i. */
static inline float factor_sigma(const float *factor, uint32_t n, uint32_t i)
{
    float square = 0.0f;
    for (uint32_t k = 0u; k <= i; k++) {
        square += factor[(i * n) + k] * factor[(i * n) + k];
    }
    return sqrtf(square);
}

/* The invariant of a factor: every entry finite, diagonal positive, upper triangle zero. */
static inline bool factor_is_valid(const float *factor, uint32_t n)
{
    bool valid = true;
    for (uint32_t i = 0u; i < n; i++) {
        for (uint32_t j = 0u; j < n; j++) {
            const float entry = factor[(i * n) + j];
            valid = valid && (fabsf(entry) < 1.0e17f) && ((j <= i) || (entry == 0.0f)) && ((j != i) || (entry > 0.0f));
        }
    }
    return valid;
}

#endif
