"""The firmware on measured samples: in bulk, or in a closed loop with the lever that its own torque moves."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from lever_cdkf.host_tools.arrays import FloatArray
from lever_cdkf.host_tools.firmware.config import Config
from lever_cdkf.host_tools.firmware.estimator import Estimator
from lever_cdkf.host_tools.firmware.library import ffi, lib, struct_dtype
from numpy.typing import NDArray

from .condition import ClosedLoop
from .motions import FREQUENCIES, PERIOD, STRIDE, Motion, Recording, columns, lanes, stream, truth
from .plant import Plant
from .sensors import NOISE

PARAMETERS = ("m_p", "c_p", "k_p")
MOTOR_LAG = 2e-3
"""Time constant with which the motor's torque follows the firmware's [s]."""
RESPONSE_STRIDE = 50
"""Rows of a track between two responses."""
_KEEP_ALIVE = 250  # samples between two commands


@dataclass(frozen=True)
class Feedthrough:
    """theta/z_ddot as the firmware has it at every RESPONSE_STRIDE-th row of a track, (times, runs, FREQUENCIES)."""

    response: NDArray[np.complex128]
    """[rad/(m/s^2)]"""
    gain_sigma: FloatArray
    """Of the gain, relative [1]."""
    phase_sigma: FloatArray
    """[rad]"""


@dataclass(frozen=True)
class Track:
    """What the firmware says at every STRIDE-th sample, (times, runs)."""

    time: FloatArray
    value: Mapping[str, FloatArray]
    """f_n [Hz], zeta [1], m_p [kg], c_p [N s/m], k_p [N/m]."""
    sigma: Mapping[str, FloatArray]
    faults: NDArray[np.uint32]
    mode: NDArray[np.uint32]
    feedthrough: Feedthrough | None = None

    def parameters(self, which: str) -> FloatArray:
        """`value` or `sigma` of the three parameters, (times, runs, 3)."""
        by_name: Mapping[str, FloatArray] = getattr(self, which)
        return np.stack([by_name[name] for name in PARAMETERS], axis=-1)


def estimates(config: Config, signals: Mapping[str, FloatArray], response: bool = False) -> Track:
    """Feeds each run to an estimator of its own; `response`: with the feedthrough."""
    count, width = signals["theta"].shape
    samples = np.zeros(count, struct_dtype("lever_sample_t"))
    samples["time_us"] = np.arange(count) * round(PERIOD * 1e6)
    runs = []
    for run in range(width):
        for what, column in signals.items():
            samples[what], samples[f"{what}_valid"] = column[:, run], ~np.isnan(column[:, run])
        runs.append(_Live(config, count, response))
        runs[-1].feed(samples)
    return _track(runs)


def _track(runs: Sequence[_Live]) -> Track:
    def beside(array: str, name: str) -> NDArray[Any]:
        return np.stack([getattr(run, array)[name] for run in runs], axis=1)

    def single(name: str) -> FloatArray:
        return beside("estimates", name).astype(np.float64)

    value = {"f_n": single("natural_frequency"), "zeta": single("damping_ratio")}
    sigma = {"f_n": single("natural_frequency_sigma"), "zeta": single("damping_ratio_sigma")}
    for i, name in enumerate(PARAMETERS):
        value[name], sigma[name] = single("parameter")[..., i], single("parameter_sigma")[..., i]
    feedthrough = None
    if runs[0].responses.size:
        of = {name: beside("responses", name) for name in ("real", "imaginary", "gain_sigma", "phase_sigma")}
        feedthrough = Feedthrough(of["real"] + 1j * of["imaginary"], of["gain_sigma"], of["phase_sigma"])
    return Track(
        time=np.arange(len(value["f_n"]), dtype=np.float64) * STRIDE * PERIOD,
        value=value,
        sigma=sigma,
        faults=beside("healths", "faults"),
        mode=beside("healths", "mode"),
        feedthrough=feedthrough,
    )


def closed_loop(
    config: Config, motion: Motion, seeds: Sequence[int], loop: ClosedLoop, tick: Callable[[], None]
) -> tuple[Recording, Track]:
    """The firmware dithers the lever itself, and samples are lost at random; `tick` is called now and then.

    A lost sample lacks what LEVER_SAMPLE carries, theta, theta_dot and tau_m, or never comes at all. The motor holds
    the last torque that it was asked for.
    """
    given = lanes(motion, seeds)
    plant, (count, width) = Plant(given), given.z_ddot.shape
    noise = {what: sigma * columns(f"noise of {what}", seeds, count) for what, sigma in NOISE.items()}
    gone = np.stack([stream("lost", seed).random(count) < loop.lost for seed in seeds], axis=1)
    theta, theta_dot, tau_m = (np.empty((count, width)) for _ in range(3))
    decay, torque = math.exp(-PERIOD / MOTOR_LAG), np.zeros(width)
    runs = [_Live(config, count) for _ in seeds]
    for i in range(count):
        theta[i], theta_dot[i], tau_m[i] = plant.theta, plant.theta_dot, torque
        values = np.stack((theta[i], theta_dot[i], torque, given.z_ddot[i]))
        values += np.stack([noise[what][i] for what in ("theta", "theta_dot", "tau_m", "z_ddot")])
        if i % _KEEP_ALIVE == 0:
            tick()
            for run in runs:
                run.estimator.command(dither_rms=loop.dither)
        for run, column, missing in zip(runs, values.T.tolist(), gone[i].tolist(), strict=True):
            if not (missing and loop.whole):
                run.take(i, column, missing)
            if i % STRIDE == 0:
                run.note(i // STRIDE)
        if i + 1 < count:
            asked = np.array([run.torque for run in runs])
            after = asked + (torque - asked) * decay
            plant.advance(i, torque, after)
            torque = after
    recording = Recording(motion.time, theta, theta_dot, tau_m, given.z_ddot, truth(given))
    return recording, _track(runs)


class _Live:
    """One estimator, and what it says at every STRIDE-th of `count` samples."""

    def __init__(self, config: Config, count: int, response: bool = False) -> None:
        self.estimator = Estimator(config)
        self.torque = 0.0
        rows = (count - 1) // STRIDE + 1
        self.estimates = np.zeros(rows, struct_dtype("lever_estimate_t"))
        self.healths = np.zeros(rows, struct_dtype("lever_health_t"))
        size = ((rows - 1) // RESPONSE_STRIDE + 1 if response else 0, len(FREQUENCIES))
        self.responses = np.zeros(size, struct_dtype("lever_feedthrough_t"))
        self._estimate = ffi.from_buffer("lever_estimate_t[]", self.estimates)
        self._health = ffi.from_buffer("lever_health_t[]", self.healths)
        self._response = ffi.from_buffer("lever_feedthrough_t[]", self.responses)
        self._now = ffi.new("lever_health_t *")

    def feed(self, samples: NDArray[Any]) -> None:
        """All samples, in bulk."""
        lever, sample = self.estimator.pointer, ffi.from_buffer("lever_sample_t[]", samples)
        for i in range(len(samples)):
            lib.lever_update(lever, sample + i)
            if i % STRIDE == 0:
                self.note(i // STRIDE)

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
        lever = self.estimator.pointer
        lib.lever_estimate(lever, self._estimate + row)
        lib.lever_health(lever, self._health + row)
        if self.responses.size and row % RESPONSE_STRIDE == 0:
            first = row // RESPONSE_STRIDE * len(FREQUENCIES)
            for i, frequency in enumerate(FREQUENCIES.tolist()):
                lib.lever_feedthrough(lever, frequency, self._response + (first + i))
