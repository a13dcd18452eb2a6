"""The firmware on measured samples: in bulk, or in a closed loop with the lever that its own torque moves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from lever_cdkf.host_tools.config import Config
from lever_cdkf.host_tools.estimator import Estimator, run_samples
from lever_cdkf.host_tools.library import ffi, lib, struct_dtype
from numpy.typing import NDArray

from .motions import PERIOD, STRIDE, Motion, Recording, columns, lanes, stream, truth
from .plant import FloatArray, Plant
from .sensors import NOISE

PARAMETERS = ("m_p", "c_p", "k_p")
MOTOR_LAG = 2e-3
"""Time constant with which the motor's torque follows the firmware's [s]."""
_KEEP_ALIVE = 250  # samples between two commands


@dataclass(frozen=True)
class Track:
    """What the firmware says at every STRIDE-th sample, (times, runs)."""

    time: FloatArray
    value: Mapping[str, FloatArray]
    """f_n [Hz], zeta [1], m_p [kg], c_p [N s/m], k_p [N/m]."""
    sigma: Mapping[str, FloatArray]
    correlation: FloatArray
    """Of the parameters' errors (times, runs, 3)."""
    trim: FloatArray
    """[rad]"""
    faults: NDArray[np.uint32]
    mode: NDArray[np.uint32]

    def parameters(self, which: str) -> FloatArray:
        """`value` or `sigma` of the three parameters, (times, runs, 3)."""
        found: Mapping[str, FloatArray] = getattr(self, which)
        return np.stack([found[name] for name in PARAMETERS], axis=-1)


def estimates(config: Config, signals: Mapping[str, FloatArray]) -> Track:
    """Feeds each run to an estimator of its own."""
    count, width = signals["theta"].shape
    at = np.arange(0, count, STRIDE)
    time_us = np.arange(count) * round(PERIOD * 1e6)
    runs = [
        run_samples(config, {"time_us": time_us} | {what: column[:, run] for what, column in signals.items()}, at)
        for run in range(width)
    ]
    return _track(runs, at)


def _track(runs: Sequence[Mapping[str, NDArray[Any]]], at: NDArray[np.intp]) -> Track:
    def beside(name: str) -> NDArray[Any]:
        return np.stack([run[name] for run in runs], axis=1)

    value = {"f_n": beside("natural_frequency"), "zeta": beside("damping_ratio")}
    sigma = {"f_n": beside("natural_frequency_sigma"), "zeta": beside("damping_ratio_sigma")}
    for i, name in enumerate(PARAMETERS):
        value[name], sigma[name] = beside("parameter")[..., i], beside("parameter_sigma")[..., i]
    return Track(
        time=(at * PERIOD).astype(np.float64),
        value={name: column.astype(np.float64) for name, column in value.items()},
        sigma={name: column.astype(np.float64) for name, column in sigma.items()},
        correlation=beside("parameter_correlation").astype(np.float64),
        trim=beside("trim").astype(np.float64),
        faults=beside("faults"),
        mode=beside("mode"),
    )


def closed_loop(
    config: Config, motion: Motion, seeds: Sequence[int], dither: float, lost: float, whole: bool
) -> tuple[Recording, Track]:
    """The firmware dithers [N m rms] the lever itself, and a share of its samples is lost at random.

    A lost sample lacks what LEVER_SAMPLE carries, theta, theta_dot and tau_m; `whole`: it never comes at all. The motor
    holds the last torque that it was asked for.
    """
    given = lanes(motion, seeds)
    plant, (count, width) = Plant(given), given.z_ddot.shape
    noise = {what: sigma * columns(f"noise of {what}", seeds, count) for what, sigma in NOISE.items()}
    gone = np.stack([stream("lost", seed).random(count) < lost for seed in seeds], axis=1)
    theta, theta_dot, tau_m = (np.empty((count, width)) for _ in range(3))
    decay, torque = math.exp(-PERIOD / MOTOR_LAG), np.zeros(width)
    runs = [_Live(config, count) for _ in seeds]
    for i in range(count):
        theta[i], theta_dot[i], tau_m[i] = plant.theta, plant.theta_dot, torque
        values = np.stack((theta[i], theta_dot[i], torque, given.z_ddot[i]))
        values += np.stack([noise[what][i] for what in ("theta", "theta_dot", "tau_m", "z_ddot")])
        if i % _KEEP_ALIVE == 0:
            for run in runs:
                run.estimator.command(dither_rms=dither)
        for run, column, missing in zip(runs, values.T.tolist(), gone[i].tolist(), strict=True):
            if not (missing and whole):
                run.take(i, column, missing)
            if i % STRIDE == 0:
                run.note(i // STRIDE)
        if i + 1 < count:
            asked = np.array([run.torque for run in runs])
            after = asked + (torque - asked) * decay
            plant.advance(i, torque, after)
            torque = after
    recording = Recording(motion.time, theta, theta_dot, tau_m, given.z_ddot, truth(given))
    return recording, _track([run.columns for run in runs], np.arange(0, count, STRIDE))


class _Live:
    """One estimator in the loop, and what it said."""

    def __init__(self, config: Config, count: int) -> None:
        self.estimator = Estimator(config)
        self.torque = 0.0
        size = (count - 1) // STRIDE + 1
        self._estimates = np.zeros(size, struct_dtype("lever_estimate_t"))
        self._healths = np.zeros(size, struct_dtype("lever_health_t"))
        self._estimate = ffi.from_buffer("lever_estimate_t[]", self._estimates)
        self._health = ffi.from_buffer("lever_health_t[]", self._healths)
        self._now = ffi.new("lever_health_t *")

    def take(self, i: int, values: Sequence[float], missing: bool) -> None:
        """Takes theta, theta_dot, tau_m and z_ddot of sample i; `missing`: z_ddot alone."""
        lever = () if missing else values[:3]
        self.estimator.update(
            i * round(PERIOD * 1e6),
            **dict(zip(("theta", "theta_dot", "tau_m"), lever, strict=False)),
            z_ddot=values[3],
        )
        lib.lever_health(self.estimator.pointer, self._now)
        self.torque = self._now.torque

    def note(self, row: int) -> None:
        """Keeps what the estimator says now."""
        lib.lever_estimate(self.estimator.pointer, self._estimate + row)
        lib.lever_health(self.estimator.pointer, self._health + row)

    @property
    def columns(self) -> dict[str, NDArray[Any]]:
        """All that was kept, by field."""
        kept = {name: self._estimates[name] for name in self._estimates.dtype.names or ()}
        return kept | {name: self._healths[name] for name in ("mode", "faults")}
