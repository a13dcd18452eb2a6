/* Sine and cosine against libm in double: the error bounds that trigonometry.h states, over the domains it states. */
#include "dense.h"
#include "math/trigonometry.h"
#include "unity.h"

enum { GRID = 1000000 };

#define QUARTER_TURN 1.5707963267948966

void setUp(void)
{
}

void tearDown(void)
{
}

static double error_against(sine_cosine_t found, double angle)
{
    const double sine = fabs((double)found.sine - sin(angle));
    const double cosine = fabs((double)found.cosine - cos(angle));
    return (sine > cosine) ? sine : cosine;
}

static double error_at(float angle)
{
    return error_against(sine_cosine(angle), (double)angle);
}

static void test_error_is_at_most_1_2e_minus_7_within_30_rad(void)
{
    for (int32_t k = -GRID; k <= GRID; k++) {
        const float angle = (float)(30.0 * (double)k / (double)GRID);
        TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, 0.0, error_at(angle));
    }
}

static void test_error_is_at_most_1_2e_minus_7_at_the_seams_between_quadrants(void)
{
    for (int32_t eighth = -38; eighth <= 38; eighth++) {
        float angle = (float)(0.5 * QUARTER_TURN * (double)eighth);
        for (int32_t k = 0; k < 50; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, 0.0, error_at(angle));
            TEST_ASSERT_DOUBLE_WITHIN(1.2e-7, 0.0, error_at(-angle));
            angle = nextafterf(angle, 100.0f);
        }
    }
}

static void test_small_angles_are_their_own_sine(void)
{
    const float angles[] = {0.0f, 1.0e-38f, -1.0e-20f, 1.0e-6f, -1.0e-4f};
    for (uint32_t k = 0u; k < 5u; k++) {
        const sine_cosine_t found = sine_cosine(angles[k]);
        TEST_ASSERT_EQUAL_FLOAT(angles[k], found.sine);
        TEST_ASSERT_EQUAL_FLOAT(1.0f, found.cosine);
    }
}

static void test_beyond_30_rad_and_not_a_number_give_the_result_of_zero(void)
{
    const float refused[] = {nextafterf(30.0f, 31.0f), -nextafterf(30.0f, 31.0f), 1.0e30f, INFINITY, -INFINITY, NAN};
    for (uint32_t k = 0u; k < 6u; k++) {
        const sine_cosine_t found = sine_cosine(refused[k]);
        TEST_ASSERT_TRUE((found.sine == 0.0f) && (found.cosine == 1.0f));
    }
}

/* Greatest error of the near variant, the known angle and `delta` both being exact. */
static double near_error(double greatest_delta)
{
    double greatest = 0.0;
    for (int32_t a = -64; a <= 64; a++) {
        const double angle = 0.05 * (double)a;
        const sine_cosine_t known = {(float)sin(angle), (float)cos(angle)};
        for (int32_t k = -500; k <= 500; k++) {
            const float delta = (float)(greatest_delta * (double)k / 500.0);
            const double error = error_against(sine_cosine_near(&known, delta), angle + (double)delta);
            greatest = (error > greatest) ? error : greatest;
        }
    }
    return greatest;
}

static void test_near_variant_is_at_most_5e_minus_7_off_within_a_quarter_rad(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(5.0e-7, 0.0, near_error(0.25));
}

static void test_near_variant_is_at_most_3e_minus_5_off_within_half_a_rad(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(3.0e-5, 0.0, near_error(0.5));
}

static void test_near_variant_with_no_distance_is_exact(void)
{
    const sine_cosine_t known = {0.6f, 0.8f};
    const sine_cosine_t found = sine_cosine_near(&known, 0.0f);
    TEST_ASSERT_TRUE((found.sine == 0.6f) && (found.cosine == 0.8f));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_error_is_at_most_1_2e_minus_7_within_30_rad);
    RUN_TEST(test_error_is_at_most_1_2e_minus_7_at_the_seams_between_quadrants);
    RUN_TEST(test_small_angles_are_their_own_sine);
    RUN_TEST(test_beyond_30_rad_and_not_a_number_give_the_result_of_zero);
    RUN_TEST(test_near_variant_is_at_most_5e_minus_7_off_within_a_quarter_rad);
    RUN_TEST(test_near_variant_is_at_most_3e_minus_5_off_within_half_a_rad);
    RUN_TEST(test_near_variant_with_no_distance_is_exact);
    return UNITY_END();
}
