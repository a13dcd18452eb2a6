"""The firmware on measured samples: in bulk, or in a closed loop with the lever that its own torque moves."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.firmware.estimator import Estimator, feed
from lever_cdkf.firmware.library import ffi, struct_dtype
from lever_cdkf.firmware.library import lib as firmware_lib
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from .closed_loop import LaneLoop
from .motions import FREQUENCIES, PERIOD, STRIDE, Motion, Recording, lanes, truth
from .plant import TICK
from .sensors import lost, offsets

PARAMETERS = ("m_p", "c_p", "k_p")
RESPONSE_STRIDE = 50
"""Rows of a track between two responses."""
_KEEP_ALIVE = 250  # samples between two commands


@dataclass(frozen=True)
class ClosedLoop:
    """The firmware makes the dither itself, and a share of its samples is lost."""

    dither: float = 0.3
    """rms [N m]"""
    lost: float = 0.5
    lost_for: float = PERIOD
    """At a time [s]."""
    whole: bool = False
    """The whole sample, not LEVER_SAMPLE alone."""


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
    """Feed each run to an estimator of its own, a sample each sample_period; `response`: with the feedthrough."""
    count, width = signals["theta"].shape
    every = round(config.settings["sample_period"] / PERIOD)
    rate = signals.get("clock_rate", np.ones((1, width)))
    measured = {what: column for what, column in signals.items() if what != "clock_rate"}
    samples = np.zeros(len(range(0, count, every)), struct_dtype("lever_sample_t"))
    notes = _Notes(count, width, response)
    for run in range(width):
        time = PERIOD * np.cumsum(np.broadcast_to(rate[:, run], count))[::every]
        samples["time_us"] = np.rint((time - time[0]) * 1e6)
        for what, values in measured.items():
            column = values[::every, run]
            samples[what], samples[f"{what}_valid"] = column, ~np.isnan(column)
        notes.feed(run, Estimator(config), samples, STRIDE // every)
    return _track(notes)


def _track(notes: _Notes) -> Track:
    def single(name: str) -> FloatArray:
        column: FloatArray = notes.estimates[name].swapaxes(0, 1).astype(np.float64)
        return column

    value = {"f_n": single("natural_frequency"), "zeta": single("damping_ratio")}
    sigma = {"f_n": single("natural_frequency_sigma"), "zeta": single("damping_ratio_sigma")}
    for i, name in enumerate(PARAMETERS):
        value[name], sigma[name] = single("parameter")[..., i], single("parameter_sigma")[..., i]
    feedthrough = None
    if notes.responses.size:
        of = {name: notes.responses[name].swapaxes(0, 1) for name in ("real", "imaginary", "gain_sigma", "phase_sigma")}
        feedthrough = Feedthrough(of["real"] + 1j * of["imaginary"], of["gain_sigma"], of["phase_sigma"])
    return Track(
        time=np.arange(len(value["f_n"]), dtype=np.float64) * STRIDE * PERIOD,
        value=value,
        sigma=sigma,
        faults=notes.healths["faults"].T,
        mode=notes.healths["mode"].T,
        feedthrough=feedthrough,
    )


def closed_loop(
    config: Config, motion: Motion, seeds: Sequence[int], loop: ClosedLoop, tick: Callable[[], None]
) -> tuple[Recording, Track]:
    """Run the firmware, which dithers the lever itself, and lose samples at random; `tick` is called now and then.

    A lost sample lacks what LEVER_SAMPLE carries, theta, theta_dot and tau_m, or never comes at all. The motor holds
    the last torque that it was asked for.
    """
    given = lanes(motion, seeds)
    count, width = given.z_ddot.shape
    gone, notes, runs = lost(seeds, count, loop.lost, loop.lost_for), _Notes(count, width), []
    commanded = np.arange(0, count, _KEEP_ALIVE)
    for run, seed in enumerate(seeds):
        closed = LaneLoop(given.only(run), offsets(seed, count), config, STRIDE)
        closed.lose(gone[:, run], gone[:, run] & loop.whole)
        closed.command(commanded, [{"dither_rms": loop.dither}] * len(commanded))
        for last in range(TICK, count + TICK, TICK):
            closed.advance(min(last, count))
            tick()
        notes.estimates[run], notes.healths[run] = closed.estimate, closed.health
        runs.append(closed.signals)
    theta, theta_dot, tau_m = (
        np.stack([each[what] for each in runs], axis=1) for what in ("theta", "theta_dot", "tau_m")
    )
    return Recording(motion.time, theta, theta_dot, tau_m, given.z_ddot, truth(given)), _track(notes)


class _Notes:
    """The outputs of the estimators of `width` runs at every STRIDE-th of `count` samples; run first.

    With `response` it is also their feedthrough at every RESPONSE_STRIDE-th of these.
    """

    def __init__(self, count: int, width: int, response: bool = False) -> None:
        rows = (count - 1) // STRIDE + 1
        self.estimates = np.zeros((width, rows), struct_dtype("lever_estimate_t"))
        self.healths = np.zeros((width, rows), struct_dtype("lever_health_t"))
        shape = (width, (rows - 1) // RESPONSE_STRIDE + 1 if response else 0, len(FREQUENCIES))
        self.responses = np.zeros(shape, struct_dtype("lever_feedthrough_t"))

    def feed(self, run: int, estimator: Estimator, samples: NDArray[Any], stride: int) -> None:
        """All samples of a run, noted at every `stride`-th, in bulk: as many at a time as are between two responses."""
        at, fed = np.arange(0, len(samples), stride), 0
        stops = [*range(1, len(at), RESPONSE_STRIDE), len(at)] if self.responses.size else [len(at)]
        for index, (first, last) in enumerate(pairwise([0, *stops])):
            notes = feed(estimator, samples[fed:], at[first:last] - fed)
            self.estimates[run, first:last], self.healths[run, first:last] = notes
            fed = int(at[last - 1]) + 1
            if index < self.responses.shape[1]:
                self._note_response(run, index, estimator)

    def _note_response(self, run: int, index: int, estimator: Estimator) -> None:
        kept = ffi.from_buffer("lever_feedthrough_t[]", self.responses[run, index])
        for i, frequency in enumerate(FREQUENCIES.tolist()):
            firmware_lib.lever_feedthrough(estimator.pointer, frequency, kept + i)
