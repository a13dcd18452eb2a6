/* The façade: an instance is an estimator and its CAN side, in memory of the caller. */
#include "app/estimator.h"
#include "app/link.h"
#include "lever_cdkf.h"

#include <math.h>
#include <stddef.h>

struct lever {
    estimator_t estimator;
    link_t link;
};

/* cppcheck-suppress misra-c2012-2.3 ; D5 */
typedef char lever_fits_its_memory[(sizeof(struct lever) <= sizeof(lever_memory_t)) ? 1 : -1];

lever_t *lever_init(lever_memory_t *memory, const lever_config_t *config)
{
    lever_t *lever = NULL;
    if ((memory != NULL) && (config != NULL) && (lever_config_check(config) == NULL)) {
        /* cppcheck-suppress misra-c2012-11.5 ; D4 */
        lever = (lever_t *)(void *)memory; /* storage of the caller, as large and aligned as an instance */
        estimator_init(&lever->estimator, config);
        link_init(&lever->link);
    }
    return lever;
}

enum lever_mode lever_update(lever_t *lever, const lever_sample_t *sample)
{
    return estimator_update(&lever->estimator, sample);
}

bool lever_command(lever_t *lever, const lever_command_t *command)
{
    return estimator_command(&lever->estimator, command);
}

void lever_estimate(const lever_t *lever, lever_estimate_t *estimate)
{
    estimator_estimate(&lever->estimator, estimate);
}

void lever_health(const lever_t *lever, lever_health_t *health)
{
    estimator_health(&lever->estimator, health);
}

void lever_platform(lever_t *lever, const lever_platform_t *platform)
{
    estimator_platform(&lever->estimator, platform);
}

enum lever_frame_result lever_on_frame(lever_t *lever, const lever_frame_t *frame)
{
    return link_on_frame(&lever->link, &lever->estimator, frame);
}

enum lever_mode lever_step(lever_t *lever)
{
    return link_step(&lever->link, &lever->estimator);
}

bool lever_next_frame(lever_t *lever, lever_frame_t *frame)
{
    return link_next_frame(&lever->link, &lever->estimator, frame);
}

/* Stands for the torque gate: 50 ms in ten steps. */
void lever_idle(lever_t *lever, uint32_t elapsed_us)
{
    dither_t *dither = &lever->estimator.dither;
    if (dither->torque != 0.0f) {
        dither_set(dither, 0.0f);
        dither->level = 0.0f;
        dither->torque = (elapsed_us < 50000u) ? (0.5f * dither->torque) : 0.0f;
        dither->torque = (fabsf(dither->torque) < 0.001f) ? 0.0f : dither->torque;
        lever->link.due |= 1u;
    }
}
