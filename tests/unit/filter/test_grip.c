/* What the filter makes of a force: refused beyond eight standard deviations of what is expected.
 * tests/python/oracle compares what it makes of one that is taken with float64. */
#include "filter/grip.h"

#include <math.h>

#include "test.h"

#define PERIOD 1.0e-3f

static const model_response_t response = {
    .slope = {-460.0f, -6.3f}, .torque = 1.7f, .second_difference = {0.5f, 0.2f, 0.1f}};
static cdkf_t cdkf;

TEST(a_force_is_taken_up_to_eight_standard_deviations)
{
    static const float sigmas[] = {7.9f, -7.9f, 8.1f, -8.1f};
    for (uint32_t i = 0u; i < 4u; i++) {
        cdkf = (cdkf_t){.process_noise = {0.0f, 0.05f}, .s_xx = {1.0e-3f, 0.0f, 2.0e-3f, 1.0e-2f}};
        grip_seen_t seen = {.row = {0.3f, -0.2f, 0.1f}, .column = {0.2f, 0.1f}, .walk = 0.5f, .noise = 0.15f};
        const cdkf_t before = cdkf;
        (void)grip_predict_state_columns(&cdkf, &response, PERIOD, &seen);
        const float own = 1.0f / (seen.gain.inverse * seen.gain.inverse);
        TEST_ASSERT_TRUE((own > 0.0725f) && (own < 0.1f)); /* noise, columns, and what the step adds */
        cdkf = before;
        seen.innovation = sigmas[i] * sqrtf(own + 0.14f); /* and the rows */
        TEST_ASSERT_EQUAL(i < 2u, grip_predict_state_columns(&cdkf, &response, PERIOD, &seen));
        TEST_ASSERT_TRUE(cdkf_state_is_valid(&cdkf));
    }
}
