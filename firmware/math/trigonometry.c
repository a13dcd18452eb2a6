#include "math/trigonometry.h"

#include "math/rounding.h"

#include <math.h>
#include <stdint.h>

sine_cosine_t sine_cosine(float angle)
{
    const float inside = (fabsf(angle) <= 30.0f) ? angle : 0.0f;
    const float turns = inside * 0.636619772f; /* in units of pi/2 */
    const float multiple = nearest_integer(turns);
    const int32_t quadrant = (int32_t)multiple;
    const float r = (inside - (multiple * 1.5703125f)) - (multiple * 4.83826794e-4f); /* pi/2 in two parts */

    const float z = r * r;
    const float s = r + ((r * z) * (-0.166666552f + (z * (0.00833215471f + (z * -0.000195140848f)))));
    const float c = (1.0f - (0.5f * z)) + ((z * z) * (0.0416666456f + (z * (-0.00138873374f + (z * 2.44348466e-5f)))));

    const uint32_t q = (uint32_t)quadrant & 3u;
    const float sine = ((q & 1u) != 0u) ? c : s;
    const float cosine = ((q & 1u) != 0u) ? s : c;
    sine_cosine_t result;
    result.sine = ((q & 2u) != 0u) ? -sine : sine;
    result.cosine = (((q + 1u) & 2u) != 0u) ? -cosine : cosine;
    return result;
}
