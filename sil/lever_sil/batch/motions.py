"""How base, motor and pilot move the lever, for many seeds at once, and the truth that an estimate is judged by."""

from __future__ import annotations

import math
import zlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.transfer import BAND
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..plants.excitation import Excitation, Noise, total
from ..plants.pilots import HandsOff, is_held
from ..plants.trajectories import Trajectory
from . import plant

PERIOD = 1e-3
"""Between two samples [s]."""
STRIDE = 10
"""Estimates are judged at every so many-th sample."""
FREQUENCIES = np.linspace(*BAND, 25)
"""At which theta/z_ddot is compared [Hz]."""
EVENT = 30.0
"""When what happens once begins [s]."""

Excitations = tuple[Excitation, ...]
"""These add up."""


def noise(rms: float, low: float = 1.0, high: float = 10.0) -> Excitations:
    """Return Gaussian noise, white from `low` to `high` [Hz], and nothing else."""
    return (Noise(rms=rms, low=low, high=high),)


BASE, DITHER = noise(1.0), noise(0.3)
"""The base acceleration [m/s^2] and the motor torque [N m] of steady flight."""


@dataclass(frozen=True)
class Motion:
    """A lever is moved by these, and held by a random pilot.

    Equal motions are simulated once, whatever the sensors make of them.
    """

    duration: float = 60.0
    """[s]"""
    base: Excitations = BASE
    """The base acceleration z_ddot [m/s^2]."""
    torque: Excitations = DITHER
    """The torque of the motor [N m]."""
    disturbance: Excitations = ()
    """Unmeasured torque [N m]."""
    process_noise: float = 0.05
    """Random walk of theta_dot [rad/s/sqrt(s)]."""
    gusts: float | Trajectory = 1.0
    """Factor of the process noise."""
    pilot: str = "arm"
    """"arm": the lever of plant.py; otherwise one of pilots.py."""
    trim: float | Trajectory = 0.0
    """How the pilot moves the lever, from the trim that is drawn [rad]."""
    c_p: float | Trajectory = 1.0
    """Factor of what is drawn; the lever rests where it did."""
    k_p: float | Trajectory = 1.0
    either_way: bool = False
    """In every second run these two are divided by their factors."""
    hands_off: tuple[HandsOff, ...] = ()
    friction: float | Trajectory = 0.0
    """Coulomb friction [N m]."""
    friction_sigma: float = 0.0
    """Besides, the size of a normal number of this standard deviation that each run draws [N m]."""

    @property
    def time(self) -> FloatArray:
        """Of the samples [s]."""
        return np.arange(round(self.duration / PERIOD) + 1, dtype=np.float64) * PERIOD


@dataclass(frozen=True)
class Recording:
    """What happened, exactly: signals of shape (samples, runs), and the truth at every STRIDE-th sample."""

    time: FloatArray
    theta: FloatArray
    theta_dot: FloatArray
    tau_m: FloatArray
    z_ddot: FloatArray
    truth: Mapping[str, FloatArray]
    """f_n [Hz], zeta [1], m_p [kg], c_p [N s/m], k_p [N/m]; nothing for pilots that have no such parameters."""
    response: NDArray[np.complex128] | None = None
    """theta/z_ddot at FREQUENCIES, (runs, frequencies), where it stays the same."""
    grip_force: FloatArray | None = None
    """Of the hand on the lever, mean since the last sample [N]; None where it is not known."""


def stream(what: str, seed: int) -> np.random.Generator:
    """Return the random numbers of one purpose in one run."""
    return np.random.default_rng([zlib.crc32(what.encode()), seed])


def columns(what: str, seeds: Sequence[int], count: int) -> FloatArray:
    """White noise of unit variance, (count, runs)."""
    return np.stack([stream(what, seed).standard_normal(count) for seed in seeds], axis=1)


def _sum(excitations: Excitations, what: str, motion: Motion, seeds: Sequence[int]) -> FloatArray:
    """Return the sum of excitations, (samples, runs); in each run they draw from one stream in turn."""
    streams = ([stream(what, seed)] * len(excitations) for seed in seeds)
    return np.stack([total(excitations, motion.time, own) for own in streams], axis=1)


def _path(trajectory: float | Trajectory, what: str, motion: Motion, seeds: Sequence[int]) -> FloatArray:
    """Return the values of a trajectory, (samples, runs), or (1, runs) where they do not change."""
    if isinstance(trajectory, float):
        return np.full((1, len(seeds)), trajectory)
    return np.stack([trajectory.values(motion.time, stream(what, seed)) for seed in seeds], axis=1)


def excitation(motion: Motion, seeds: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """z_ddot [m/s^2], tau_m [N m] and the kick of process noise [rad/s], each (samples, runs)."""
    deviation = motion.process_noise * math.sqrt(PERIOD) * _path(motion.gusts, "gusts", motion, seeds)
    kick = deviation * columns("process", seeds, len(motion.time))
    return _sum(motion.base, "base", motion, seeds), _sum(motion.torque, "dither", motion, seeds), kick


def arms(seeds: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """m_p [kg], c_p [N s/m], k_p [N/m] and trim [rad] of random pilots about the firmware's first guess."""
    normal = np.stack([np.clip(stream("pilot", seed).standard_normal(3), -1.8, 1.8) for seed in seeds], axis=1)
    guess, spread = np.array((2.5, 42.0, 1500.0)), np.array((0.25, 0.3, 0.3))
    m_p, c_p, k_p = (guess[:, None] * np.exp(spread[:, None] * normal))[:, None, :]
    trim = np.radians([stream("trim", seed).uniform(10.0, 28.0) for seed in seeds])
    return m_p, c_p, k_p, trim[None, :]


def lanes(motion: Motion, seeds: Sequence[int]) -> plant.Lanes:
    """Return what plant.py needs."""
    z_ddot, tau_m, kick = excitation(motion, seeds)
    m_p, c_p, k_p, trim = arms(seeds)
    power = np.array([-1.0 if motion.either_way and seed % 2 == 0 else 1.0 for seed in seeds])
    held = is_held(motion.hands_off, motion.time)[:, None] if motion.hands_off else 1.0
    return plant.Lanes(
        z_ddot=z_ddot,
        tau_m=tau_m,
        m_p=held * m_p,
        c_p=held * c_p * _path(motion.c_p, "c_p", motion, seeds) ** power,
        k_p=held * k_p * _path(motion.k_p, "k_p", motion, seeds) ** power,
        trim=trim + _path(motion.trim, "moves", motion, seeds),
        disturbance=_sum(motion.disturbance, "disturbance", motion, seeds),
        kick=kick,
        friction=_path(motion.friction, "rubbing", motion, seeds)
        + motion.friction_sigma * np.abs(columns("friction", seeds, 1)),
        period=PERIOD,
        hardware=plant.Hardware(),
    )


def truth(given: plant.Lanes) -> dict[str, FloatArray]:
    """At every STRIDE-th sample, (times, runs)."""
    count, width = given.z_ddot.shape
    at = np.arange(0, count, STRIDE)
    m_p, c_p, k_p, trim = (
        np.broadcast_to(given.at(at, name), (len(at), width)) for name in ("m_p", "c_p", "k_p", "trim")
    )
    f_n, zeta = plant.natural_frequency_and_damping(given.hardware, m_p, c_p, k_p, trim, given.trim[:1])
    return {"f_n": f_n, "zeta": zeta, "m_p": m_p, "c_p": c_p, "k_p": k_p}


def simulated(
    given: Iterable[tuple[Motion, Sequence[int]]], tick: Callable[[], None] = lambda: None
) -> list[Recording]:
    """Return what happens in motions of one duration, each with its seeds; `tick` is called now and then."""
    parts = [(motion.time, lanes(motion, seeds)) for motion, seeds in given]
    moved = plant.run(plant.beside([part for _, part in parts]), tick) if parts else ()
    recordings, first = [], 0
    for time, part in parts:
        last = first + part.z_ddot.shape[1]
        theta, theta_dot = (column[:, first:last] for column in moved)
        first = last
        force = plant.grip_force(part, theta, theta_dot)
        signals = (theta, theta_dot, part.tau_m, part.z_ddot)
        recordings.append(Recording(time, *signals, truth(part), grip_force=force))
    return recordings
