"""The truths of plants/ as c/plants.h takes them. One that is not here, the C does not have."""

from __future__ import annotations

from typing import Any

import numpy as np
from lever_cdkf.numeric.arrays import FloatArray

from ..plants import hysteretic_plant, lever_plant, linear_plant, mayo_plant, reflex_plant, two_dof_plant
from ..plants.truth import Conditions, Truth
from .library import Struct, lib

_Columns = tuple[FloatArray, ...]

_KINDS: dict[type[Any], str] = {
    lever_plant.LeverTruth: "LEVER",
    linear_plant.LinearTruth: "LINEAR",
    two_dof_plant.TwoDof: "TWO_DOF",
    hysteretic_plant.Hysteretic: "HYSTERETIC",
    reflex_plant.Reflex: "REFLEX",
}


def has(truth: Truth) -> bool:
    """Return whether the C has it."""
    return isinstance(truth, tuple(_KINDS))


def move(truth: Truth, conditions: Conditions, command: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return theta [rad], theta_dot [rad/s] and tau_m [N m] at every sample, from rest.

    `command` are the torques [N m].
    """
    struct, signals = Struct("plant_t"), np.empty((3, len(command)))
    fill(struct, struct.pointer, truth, conditions)
    pointers = [struct.doubles(signal) for signal in signals]
    lib.plant_move(struct.pointer, struct.doubles(command), len(command), *pointers)
    return signals[0], signals[1], signals[2]


def outside(truth: Truth) -> float:
    """Return by how much a pilot feels the cabin's speed besides its acceleration [1/s]."""
    return truth.hand.outside if isinstance(truth, mayo_plant.Mayo) else 0.0


def fill(struct: Struct, plant: Any, truth: Truth, conditions: Conditions) -> None:
    """Put a truth at rest, and what acts on it, into a plant_t in a struct.

    Where z_ddot comes to be known on the way, it is what is felt().
    """
    if isinstance(truth, linear_plant.LinearTruth) and conditions.ahead > 1:
        conditions = truth.felt(conditions)
    last = len(conditions.z_ddot) - 1
    plant.kind = getattr(lib, "PLANT_" + next(name for kind, name in _KINDS.items() if isinstance(truth, kind)))
    plant.substeps, plant.step = conditions.count, conditions.step
    plant.lag_middle, plant.lag, plant.kick = conditions.decay(0.5), conditions.decay(1.0), conditions.kick
    plant.z_ddot = struct.doubles(conditions.z_ddot)
    plant.disturbance = struct.doubles(np.broadcast_to(conditions.disturbance, conditions.z_ddot.shape))
    plant.normal = struct.doubles(conditions.rng.standard_normal(last * conditions.count))
    plant.theta = float(truth.rest[0])
    for index, column in enumerate(_columns(struct, plant, truth, conditions)):
        plant.column[index] = struct.doubles(column)


def _columns(struct: Struct, plant: Any, truth: Truth, conditions: Conditions) -> _Columns:
    """Return the coefficients; put what else there is of a kind into the plant."""
    if isinstance(truth, linear_plant.LinearTruth):
        return tuple(vars(truth.system).values())
    if isinstance(truth, lever_plant.LeverTruth):
        _fill_lever(plant.lever, truth.lever, truth.preload)
        return lever_plant.coefficients(truth.lever, truth.pilot, truth.preload)
    if isinstance(truth, reflex_plant.Reflex):
        arm, count = truth.arm, len(truth.trim)
        _fill_lever(plant.lever, truth.lever, arm.preload)
        plant.reflex.middle = 0.5 * conditions.period
        plant.reflex.late = reflex_plant.late(truth, conditions.period)
        plant.reflex_force = struct.doubles(np.zeros(count))
        arm_columns = lever_plant.coefficients(truth.lever, arm.pilot, arm.preload)
        return (*arm_columns, *reflex_plant.coefficients(truth))
    if isinstance(truth, two_dof_plant.TwoDof):
        _fill_lever(plant.lever, truth.lever, "trim")
        return two_dof_plant.coefficients(truth)
    assert isinstance(truth, hysteretic_plant.Hysteretic)
    _fill_lever(plant.lever, truth.lever, "trim")
    _fill_elements(plant.elements, truth, conditions)
    columns = hysteretic_plant.coefficients(truth)
    plant.rest_sine = float(np.sin(truth.trim[0]))
    return columns


def _fill_lever(given: Any, lever: lever_plant.Lever, preload: lever_plant.Preload) -> None:
    given.length, given.damping = lever.lever_length, lever.lever_damping
    given.stiffness, given.friction = lever.lever_stiffness, lever.lever_friction
    given.stop_rate, given.weight = lever_plant.STOP_RATE, lever_plant.weight(preload)
    given.own_inertia, given.own_moment = lever.own_inertia, lever.own_moment


def _fill_elements(given: Any, truth: hysteretic_plant.Hysteretic, conditions: Conditions) -> None:
    power = hysteretic_plant.Power.of(truth.loss_factor)
    elements = hysteretic_plant.Elements.of(power, conditions.step)
    given.spring, given.damper, given.springs = power.spring, elements.damper, power.springs.tolist()
    given.until_middle, given.decay = elements.until_middle.tolist(), elements.decay.tolist()
    given.stretched = elements.stretched.tolist()
