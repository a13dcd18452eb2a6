/* The numeric kernels: exponential and trigonometry of any float but NaN (Eva 25 does not decide comparisons with it),
 * logarithm and rounding over their ranges, and the factors of any finite elements in the dimensions of the filter.
 *
 * No alarm says that no conversion is out of range and no element outside of its matrix. How exact they are is for
 * tests/unit/math. */
#include "any.h"

#include "filter/cdkf.h"
#include "math/bounds.h"
#include "math/crc32.h"
#include "math/exponential.h"
#include "math/factor.h"
#include "math/rounding.h"
#include "math/share.h"
#include "math/trigonometry.h"

#include <math.h>

enum { N = MODEL_PARAMETERS, ROWS = CDKF_ROWS, COLUMNS = 11 };

static void fill(float *values, uint32_t count)
{
    for (uint32_t i = 0u; i < count; i++) {
        values[i] = any_finite();
    }
}

static void prove_functions(float x)
{
    (void)exponential(x);
    (void)logarithm(Frama_C_float_interval(1.0e-4f, 1.0e4f));
    (void)sine_cosine(x);
    (void)sine_cosine_small(x);
    (void)clamped(x, Frama_C_float_interval(0.0f, 3.4028235e38f));
    (void)is_finite(x);
    (void)share_of(Frama_C_float_interval(1.0e-6f, 1.0e4f), Frama_C_float_interval(1.0e-6f, 1.0e4f));
    (void)(int32_t)nearest_integer(Frama_C_float_interval(-4194303.0f, 4194303.0f));
    (void)crc32_shift(any_word(), Frama_C_unsigned_int_interval(0u, 32u));
}

static void prove_factors(void)
{
    float s[ROWS * N];
    float rest[ROWS - N];
    float information[N * N];
    float row[N];
    float a[COLUMNS];
    float b[COLUMNS];
    float two[4];
    for (uint32_t i = 0u; i < (uint32_t)N; i++) {
        fill(s, (uint32_t)(ROWS * N));
        factor_add_noise(s, (uint32_t)ROWS, (uint32_t)N, i, any_finite(), rest);
        (void)factor_variance(s, (uint32_t)N, i);
    }
    fill(information, (uint32_t)(N * N));
    factor_reverse(information, (uint32_t)N);
    for (uint32_t length = 1u; length <= (uint32_t)N; length++) {
        fill(row, (uint32_t)N);
        factor_reverse_solve(information, (uint32_t)N, row, length);
    }
    fill(a, (uint32_t)COLUMNS);
    fill(b, (uint32_t)COLUMNS);
    factor_tria_two(a, b, (uint32_t)COLUMNS, two);
    (void)factor_dot_three(a, b);
}

void main(void)
{
    prove_functions(Frama_C_float_interval(-80.0f, 80.0f)); /* in parts: Eva does not infer x from fabsf(x) */
    prove_functions(Frama_C_float_interval(80.0f, 3.4028235e38f));
    prove_functions(Frama_C_float_interval(-3.4028235e38f, -80.0f));
    prove_functions(INFINITY);
    prove_functions(-INFINITY);
    prove_factors();
}
