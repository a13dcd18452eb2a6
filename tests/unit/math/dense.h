/* Dense matrices and random numbers in double precision: the independent side of the tests. Plain textbook algebra on
 * full covariances, no square roots, so that it has nothing in common with what it checks. */
#ifndef UNIT_MATH_DENSE_H
#define UNIT_MATH_DENSE_H

#include <float.h>
#include <math.h>
#include <stdint.h>

enum { DENSE_MOST = 12 };

typedef struct matrix {
    uint32_t rows;
    uint32_t columns;
    double at[DENSE_MOST][DENSE_MOST];
} matrix_t;

/* --- random numbers, the same in every run ------------------------------------------------------------------------ */

typedef struct random_source {
    uint64_t state; /* any but 0 */
} random_source_t;

/* Uniform in (0, 1): xorshift64* (Vigna 2016). */
static inline double random_unit(random_source_t *source)
{
    source->state ^= source->state >> 12;
    source->state ^= source->state << 25;
    source->state ^= source->state >> 27;
    const uint64_t bits = (source->state * 2685821657736338717ULL) >> 11;
    return ((double)bits + 0.5) / 9007199254740992.0;
}

static inline double random_between(random_source_t *source, double least, double greatest)
{
    return least + ((greatest - least) * random_unit(source));
}

/* Normal with mean 0 and variance 1 (Box & Muller 1958). */
static inline double random_normal(random_source_t *source)
{
    const double radius = sqrt(-2.0 * log(random_unit(source)));
    return radius * cos(6.283185307179586 * random_unit(source));
}

static inline void random_floats(random_source_t *source, float *values, uint32_t count, double scale)
{
    for (uint32_t i = 0u; i < count; i++) {
        values[i] = (float)(scale * random_between(source, -1.0, 1.0));
    }
}

/* A factor [n x n] with diagonal in [1/2, 1], and rows below it. */
static inline void random_factor(random_source_t *source, float *s, uint32_t rows, uint32_t n)
{
    random_floats(source, s, rows * n, 1.0);
    for (uint32_t i = 0u; i < n; i++) {
        s[(i * n) + i] = (float)random_between(source, 0.5, 1.0);
        for (uint32_t j = i + 1u; j < n; j++) {
            s[(i * n) + j] = 0.0f;
        }
    }
}

/* --- matrices ----------------------------------------------------------------------------------------------------- */

static inline matrix_t matrix_zero(uint32_t rows, uint32_t columns)
{
    matrix_t result = {.rows = rows, .columns = columns};
    return result;
}

static inline matrix_t matrix_identity(uint32_t n)
{
    matrix_t result = matrix_zero(n, n);
    for (uint32_t i = 0u; i < n; i++) {
        result.at[i][i] = 1.0;
    }
    return result;
}

/* From a flat row-major array. */
static inline matrix_t matrix_of(const float *values, uint32_t rows, uint32_t columns)
{
    matrix_t result = matrix_zero(rows, columns);
    for (uint32_t i = 0u; i < rows; i++) {
        for (uint32_t j = 0u; j < columns; j++) {
            result.at[i][j] = (double)values[(i * columns) + j];
        }
    }
    return result;
}

static inline matrix_t matrix_transposed(matrix_t a)
{
    matrix_t result = matrix_zero(a.columns, a.rows);
    for (uint32_t i = 0u; i < a.rows; i++) {
        for (uint32_t j = 0u; j < a.columns; j++) {
            result.at[j][i] = a.at[i][j];
        }
    }
    return result;
}

static inline matrix_t matrix_product(matrix_t a, matrix_t b)
{
    matrix_t result = matrix_zero(a.rows, b.columns);
    for (uint32_t i = 0u; i < a.rows; i++) {
        for (uint32_t j = 0u; j < b.columns; j++) {
            for (uint32_t k = 0u; k < a.columns; k++) {
                result.at[i][j] += a.at[i][k] * b.at[k][j];
            }
        }
    }
    return result;
}

/* a + factor b */
static inline matrix_t matrix_sum(matrix_t a, double factor, matrix_t b)
{
    for (uint32_t i = 0u; i < a.rows; i++) {
        for (uint32_t j = 0u; j < a.columns; j++) {
            a.at[i][j] += factor * b.at[i][j];
        }
    }
    return a;
}

/* a b a^T */
static inline matrix_t matrix_congruence(matrix_t a, matrix_t b)
{
    return matrix_product(matrix_product(a, b), matrix_transposed(a));
}

/* a a^T */
static inline matrix_t matrix_gram(matrix_t a)
{
    return matrix_product(a, matrix_transposed(a));
}

/* Rows and columns first .. first + count - 1 of both sides. */
static inline matrix_t matrix_block(
    const matrix_t *a, uint32_t first_row, uint32_t rows, uint32_t first_column, uint32_t columns)
{
    matrix_t result = matrix_zero(rows, columns);
    for (uint32_t i = 0u; i < rows; i++) {
        for (uint32_t j = 0u; j < columns; j++) {
            result.at[i][j] = a->at[first_row + i][first_column + j];
        }
    }
    return result;
}

/* The matrix in the upper left corner of zeros, n x n. */
static inline matrix_t matrix_padded(matrix_t a, uint32_t n)
{
    matrix_t result = matrix_zero(n, n);
    for (uint32_t i = 0u; i < a.rows; i++) {
        for (uint32_t j = 0u; j < a.columns; j++) {
            result.at[i][j] = a.at[i][j];
        }
    }
    return result;
}

/* Inverse of a regular matrix by Gauss and Jordan, with row pivots. */
static inline matrix_t matrix_inverse(matrix_t a)
{
    matrix_t result = matrix_identity(a.rows);
    for (uint32_t k = 0u; k < a.rows; k++) {
        uint32_t pivot = k;
        for (uint32_t i = k + 1u; i < a.rows; i++) {
            pivot = (fabs(a.at[i][k]) > fabs(a.at[pivot][k])) ? i : pivot;
        }
        const double scale = 1.0 / a.at[pivot][k];
        for (uint32_t j = 0u; j < a.rows; j++) {
            const double left = a.at[pivot][j] * scale;
            const double right = result.at[pivot][j] * scale;
            a.at[pivot][j] = a.at[k][j];
            result.at[pivot][j] = result.at[k][j];
            a.at[k][j] = left;
            result.at[k][j] = right;
        }
        for (uint32_t i = 0u; i < a.rows; i++) {
            const double share = (i == k) ? 0.0 : a.at[i][k];
            for (uint32_t j = 0u; j < a.rows; j++) {
                a.at[i][j] -= share * a.at[k][j];
                result.at[i][j] -= share * result.at[k][j];
            }
        }
    }
    return result;
}

/* Greatest difference of two covariances, entry ij in units of sigma_i sigma_j of `scale` (0 / 0 counts as 0). */
static inline double covariance_difference(const matrix_t *a, const matrix_t *b, const matrix_t *scale)
{
    double greatest = 0.0;
    for (uint32_t i = 0u; i < a->rows; i++) {
        for (uint32_t j = 0u; j < a->rows; j++) {
            const double difference = fabs(a->at[i][j] - b->at[i][j]);
            const double unit = sqrt(scale->at[i][i]) * sqrt(scale->at[j][j]);
            const double relative = (difference == 0.0) ? 0.0 : (difference / unit);
            greatest = (isnan(greatest) || (relative <= greatest)) ? greatest : relative; /* NaN counts as greatest */
        }
    }
    return greatest;
}

#endif
