#include "lanes.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

static double at(const lane_column_t *column, uint32_t sample, uint32_t lane)
{
    return column->value[(column->step * sample) + lane];
}

/* What stays in a sample period of a lane. */
typedef struct arm {
    double rest;
    double spring;
    double damper;
    double inverse;
} arm_t;

static double acceleration(const lanes_t *lanes, const arm_t *arm, double drive, double torque, double x, double v)
{
    const double cosine = cos(x);
    const double of_arm = drive - arm->rest + (arm->spring * sin(x)) + (arm->damper * cosine * v);
    const double other = torque - (lanes->damping * v) - (lanes->stiffness * x);
    return (other - (lanes->length * cosine * of_arm)) * arm->inverse;
}

/* Coulomb friction takes up to `most` [rad/s] from the rate after a step, spread over the step; a lever that it holds
 * stays where it is. */
static void rub(const lanes_t *lanes, size_t here, double most)
{
    const size_t next = here + lanes->width;
    const double rate = lanes->theta_dot[next];
    const double left = (fabs(rate) > most) ? (rate - copysign(most, rate)) : 0.0;
    const bool held = (lanes->theta_dot[here] == 0.0) && (left == 0.0);
    lanes->theta[next] = held ? lanes->theta[here] : (lanes->theta[next] + (0.5 * lanes->period * (left - rate)));
    lanes->theta_dot[next] = left;
}

/* A lane from sample i to sample i + 1 (Runge-Kutta), with further torque [N m] at its begin and end. */
static void advance(const lanes_t *lanes, uint32_t i, uint32_t lane, double begin, double end)
{
    const arm_t arm = {at(&lanes->rest, i, lane), at(&lanes->spring, i, lane), at(&lanes->damper, i, lane),
        at(&lanes->inverse, i, lane)};
    const double drive0 = at(&lanes->drive, i, lane);
    const double drive1 = at(&lanes->drive, i + 1u, lane);
    const double torque0 = at(&lanes->torque, i, lane) + begin;
    const double torque1 = at(&lanes->torque, i + 1u, lane) + end;
    const double drive = 0.5 * (drive0 + drive1);
    const double torque = 0.5 * (torque0 + torque1);
    const double period = lanes->period;
    const double half = 0.5 * period;
    const size_t here = ((size_t)i * lanes->width) + lane;
    const double x = lanes->theta[here];
    const double v = lanes->theta_dot[here];
    const double a1 = acceleration(lanes, &arm, drive0, torque0, x, v);
    const double v2 = v + (half * a1);
    const double a2 = acceleration(lanes, &arm, drive, torque, x + (half * v), v2);
    const double v3 = v + (half * a2);
    const double a3 = acceleration(lanes, &arm, drive, torque, x + (half * v2), v3);
    const double v4 = v + (period * a3);
    const double a4 = acceleration(lanes, &arm, drive1, torque1, x + (period * v3), v4);
    const size_t next = here + lanes->width;
    lanes->theta[next] = x + (period / 6.0 * (v + (2.0 * (v2 + v3)) + v4));
    lanes->theta_dot[next] = v + (period / 6.0 * (a1 + (2.0 * (a2 + a3)) + a4)) + at(&lanes->kick, i, lane);
    if (at(&lanes->friction, i, lane) > 0.0) {
        rub(lanes, here, period * at(&lanes->friction, i, lane) * arm.inverse);
    }
}

void lanes_move(const lanes_t *lanes, uint32_t first, uint32_t last)
{
    for (uint32_t i = first; i < last; i++) {
        for (uint32_t lane = 0u; lane < lanes->width; lane++) {
            advance(lanes, i, lane, 0.0, 0.0);
        }
    }
}

void lanes_advance(const lanes_t *lanes, uint32_t i, double begin, double end)
{
    advance(lanes, i, 0u, begin, end);
}
