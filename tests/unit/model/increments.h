/* What a model says of each of its sigma points: made up from its response to all of them, and asked for alone. */
#ifndef UNIT_MODEL_INCREMENTS_H
#define UNIT_MODEL_INCREMENTS_H

#include "model/model.h"

#include <math.h>

enum { POINTS = 1 + (2 * MODEL_PAIRS) }; /* the mean; then + and - of each pair */

/* NaN counts as greatest. */
static inline double greater_of(double a, double b)
{
    return (isnan(a) || (b <= a)) ? a : b;
}

static inline double point_sign(uint32_t i)
{
    const double signs[2] = {-1.0, 1.0};
    return (i == 0u) ? 0.0 : signs[i % 2u];
}

static inline uint32_t point_pair(uint32_t i)
{
    return (i == 0u) ? 0u : ((i - 1u) / 2u);
}

static inline const model_arm_t *point_arm(const model_points_t *points, uint32_t i)
{
    return &points->arm[(i < (uint32_t)MODEL_PARAMETER_POINTS) ? i : 0u];
}

/* Increments of the state: theta_dot by the response, theta by the midpoint rule. */
static inline void increments_of(const model_t *model, const model_constants_t *constants, const model_step_t *step,
    const model_points_t *points, double increment[POINTS][MODEL_STATES])
{
    model_response_t response;
    model->respond(constants, step, points, &response);
    for (uint32_t i = 0u; i < (uint32_t)POINTS; i++) {
        const uint32_t pair = point_pair(i);
        const double sign = point_sign(i);
        const double bend = (i == 0u) ? 0.0 : (double)response.bend[pair];
        const double rate = (double)points->x[1] + (sign * (double)points->offset[pair][1]);
        const double change = (double)response.mean + (0.5 * (bend + (sign * (double)response.difference[pair])));
        increment[i][0] = (double)step->period * (rate + (0.5 * change));
        increment[i][1] = change;
    }
}

/* A mean with an arm, without spread. `arms` has to stay as long as the points. */
static inline model_points_t points_alike(
    const float x[MODEL_STATES], const model_arm_t *arm, model_arm_t arms[MODEL_PARAMETER_POINTS])
{
    model_points_t points = {.x = {x[0], x[1]}, .arm = arms};
    for (uint32_t i = 0u; i < (uint32_t)MODEL_PARAMETER_POINTS; i++) {
        arms[i] = *arm;
    }
    return points;
}

/* How theta_dot changes at a point, asked for by itself. */
static inline float change_alone(const model_t *model, const model_constants_t *constants, const model_step_t *step,
    const model_points_t *points, uint32_t i)
{
    const float sign = (float)point_sign(i);
    const float *offset = points->offset[point_pair(i)];
    const float x[MODEL_STATES] = {points->x[0] + (sign * offset[0]), points->x[1] + (sign * offset[1])};
    model_arm_t arms[MODEL_PARAMETER_POINTS];
    const model_points_t alone = points_alike(x, point_arm(points, i), arms);
    model_response_t response;
    model->respond(constants, step, &alone, &response);
    return response.mean;
}

/* Greatest error [rad/s] of differences and bends against points that are asked for by themselves. */
static inline double pair_error(
    const model_t *model, const model_constants_t *constants, const model_step_t *step, const model_points_t *points)
{
    model_response_t response;
    model->respond(constants, step, points, &response);
    const float mean = change_alone(model, constants, step, points, 0u);
    double greatest = fabs((double)(response.mean - mean));
    for (uint32_t j = 0u; j < (uint32_t)MODEL_PAIRS; j++) {
        const float plus = change_alone(model, constants, step, points, 1u + (2u * j));
        const float minus = change_alone(model, constants, step, points, 2u + (2u * j));
        const float bend = (plus - mean) + (minus - mean);
        greatest = greater_of(greatest, fabs((double)(response.difference[j] - (plus - minus))));
        greatest = greater_of(greatest, fabs((double)(response.bend[j] - bend)));
    }
    return greatest;
}

#endif
