/* What the filter makes of a force: refused beyond eight standard deviations of what is expected.
 * tests/python/oracle compares what it makes of one that is taken with float64. */
#include "filter/grip.h"

#include <math.h>

#include "test.h"

#define PERIOD 1.0e-3f

static const model_response_t response = {.slope = {-460.0f, -6.3f}, .torque = 1.7f};
static const step_noise_t noise = {
    .variance = 2.5e-6f, .angle = 2.0833334e-13f, .second = 0.01666667f}; /* of the walk and these second differences */
static cdkf_t cdkf;

TEST(a_force_is_taken_up_to_eight_standard_deviations)
{
    static const float sigmas[] = {7.9f, -7.9f, 8.1f, -8.1f};
    for (uint32_t i = 0u; i < 4u; i++) {
        cdkf = (cdkf_t){.s_xx = {1.0e-3f, 0.0f, 2.0e-3f, 1.0e-2f}};
        grip_seen_t seen = {.row = {0.3f, -0.2f, 0.1f}, .column = {0.2f, 0.1f}, .walk = 0.5f, .noise = 0.15f};
        const cdkf_t before = cdkf;
        (void)grip_predict_state_columns(&cdkf, &response, &noise, PERIOD, &seen);
        const float own = 1.0f / (seen.gain.inverse * seen.gain.inverse);
        TEST_ASSERT_TRUE((own > 0.0725f) && (own < 0.1f)); /* noise, columns, and what the step adds */
        cdkf = before;
        seen.innovation = sigmas[i] * sqrtf(own + 0.14f); /* and the rows */
        TEST_ASSERT_EQUAL(i < 2u, grip_predict_state_columns(&cdkf, &response, &noise, PERIOD, &seen));
        TEST_ASSERT_TRUE(cdkf_state_is_valid(&cdkf));
        TEST_ASSERT_TRUE(cdkf.s_xx[0] < 1.1e-3f); /* theta is no less certain after a step */
    }
}

/* An output that sees 1 of the first error and 3 of the second, in halves of its standard deviation; the third does not
 * act. Whether the base is wrong must not depend on the force. */
TEST(a_force_says_of_the_errors_what_it_sees_of_them)
{
    static const float row[MODEL_PARAMETERS] = {1.0f, 10.0f, 100.0f};
    static const float of_seen[] = {2.0f, 6.0f, 0.0f};
    const gain_t gain = {.k = {0.5f, 0.25f}, .inverse = 2.0f};
    const float seen[CDKF_CONSIDERED] = {1.0f, 3.0f, 5.0f};
    considered_t considered[CDKF_CONSIDERED] = {{.vector = 0.0f}};
    considered_correct_by(considered, 2u, &gain, seen, row, -3.0f, true);
    for (uint32_t c = 0u; c < 3u; c++) {
        const bool counts = (c != (uint32_t)CDKF_BASE_GAIN);
        TEST_ASSERT_EQUAL_FLOAT(-0.25f * of_seen[c], considered[c].x[0]);
        TEST_ASSERT_EQUAL_FLOAT(-0.125f * of_seen[c], considered[c].x[1]);
        TEST_ASSERT_EQUAL_FLOAT(counts ? (-3.0f * of_seen[c]) : 0.0f, considered[c].vector);
        TEST_ASSERT_EQUAL_FLOAT(counts ? (of_seen[c] * of_seen[c]) : 0.0f, considered[c].information);
        for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETERS; i++) {
            TEST_ASSERT_EQUAL_FLOAT(row[i] * of_seen[c], considered[c].cross[i]);
        }
    }
}
