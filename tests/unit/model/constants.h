/* What the firmware's model takes of a plant. */
#ifndef UNIT_MODEL_CONSTANTS_H
#define UNIT_MODEL_CONSTANTS_H

#include "model/model.h"
#include "plant.h"

static inline model_constants_t constants_of(const plant_t *plant)
{
    const double centre = plant->mass_position * plant->length;
    const model_constants_t constants = {.length = (float)plant->length,
        .length_squared = (float)(plant->length * plant->length),
        .inertia = (float)((centre * centre * plant->mass) + plant->inertia),
        .mass_moment = (float)(plant->mass_position * plant->mass),
        .damping = (float)plant->damping,
        .stiffness = (float)plant->stiffness,
        .arm_preload_sine = (float)sin(plant->arm_preload_angle),
        .lever_preload_angle = (float)plant->lever_preload_angle,
        .hand_inertia =
            (float)((centre * centre * plant->mass) + plant->inertia + (plant->length * plant->length * 2.5)),
        .trim = plant->follows_trim};
    return constants;
}

#endif
