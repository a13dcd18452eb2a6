"""How base, motor and pilot move the lever, for many seeds at once, and the truth that an estimate is judged by."""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from lever_cdkf.models.transfer import BAND as BOUNCE_BAND
from lever_cdkf.numeric.arrays import FloatArray
from numpy.typing import NDArray

from ..plants.excitation import autoregressive
from .plant import Hardware, Lanes, natural_frequency_and_damping

PERIOD = 1e-3
"""Between two samples [s]."""
STRIDE = 10
"""Estimates are judged at every so many-th sample."""
BAND = (1.0, 10.0)
"""Of base motion and dither [Hz]."""
FREQUENCIES = np.linspace(*BOUNCE_BAND, 25)
"""At which theta/z_ddot is compared [Hz]."""
EVENT = 30.0
"""When what happens once begins [s]."""


@dataclass(frozen=True)
class Motion:
    """What acts on the lever. Equal motions are simulated once, whatever the sensors make of them."""

    duration: float = 60.0
    """[s]"""
    base: float = 1.0
    """rms of z_ddot [m/s^2], white in BAND."""
    dither: float = 0.3
    """rms of the motor torque [N m], likewise."""
    process_noise: float = 0.05
    """Random walk of theta_dot [rad/s/sqrt(s)]."""
    rough: tuple[float, float] | None = None
    """Rough air that comes and goes: this process noise [rad/s/sqrt(s)] for so long [s], after as long without."""
    base_sine: tuple[float, float] | None = None
    """Besides, the base moves as a sine of this amplitude [m/s^2] and frequency [Hz]."""
    pilot: str = "arm"
    """"arm": the lever of plant.py; otherwise one of pilots.py."""
    sway: tuple[float, float] | None = None
    """The pilot moves the lever as a sine of this amplitude [deg] and frequency [Hz]."""
    wander: float = 0.0
    """The pilot moves the lever at random: rms [deg], 0.05 to 0.5 Hz."""
    retrim: float = 0.0
    """From EVENT on the trim goes up by so much [deg] in 4 s."""
    retrims: tuple[float, float, float] | None = None
    """The trim moves by up to so much [deg], up or down at random, every so often [s], within a time [s]."""
    jump: tuple[float, float] = (1.0, 1.0)
    """At EVENT c_p and k_p change by these factors at once; the lever rests where it did."""
    grip: float = 1.0
    """At EVENT c_p and k_p go up by this factor, or down in every second run, and the rest angle with them."""
    grip_moves: tuple[float, float] = (1.0, 0.05)
    """By how much the rest angle then goes up [deg], and in what time all of it happens [s]."""
    slow_torque: float = 0.0
    """rms of an unknown torque [N m] with a correlation time of 0.3 s."""
    tremor: float = 0.0
    """rms of an unknown torque [N m], 3 to 5 Hz."""
    damping: tuple[float, float, float, float] | None = None
    """c_p goes from the first to the second [N s/m] between these times [s]."""
    pause: tuple[float, float] | None = None
    """Nothing moves between these times [s]."""
    released: tuple[float, float] | None = None
    """The hands are off the lever between these times [s]."""
    next_pilot: float = 1.0
    """Who holds it then: c_p and k_p are so many times as large, or as small in every second run."""
    friction: float = 0.0
    """Coulomb friction [N m]."""
    tightened: float = 0.0
    """Before then there is no friction [s]."""
    freed: float | None = None
    """From then on there is no friction [s]."""
    friction_sigma: float = 0.0
    """Friction is the size of a normal number of this standard deviation [N m]."""

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


def band_limited(white: FloatArray, band: tuple[float, float], rms: float) -> FloatArray:
    """Return noise that fills a band [Hz] and has this rms, exactly, in every column."""
    spectrum = np.fft.rfft(white, axis=0)
    frequency = np.fft.rfftfreq(len(white), PERIOD)
    spectrum[(frequency < band[0]) | (frequency > band[1])] = 0.0
    wave = np.fft.irfft(spectrum, len(white), axis=0)
    scaled: FloatArray = wave * (rms / np.sqrt(np.mean(wave**2, axis=0)))
    return scaled


def excitation(motion: Motion, seeds: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """z_ddot [m/s^2], tau_m [N m] and the kick of process noise [rad/s], each (samples, runs)."""
    time = motion.time
    active = np.ones((len(time), 1))
    if motion.pause is not None:
        active[(time >= motion.pause[0]) & (time < motion.pause[1])] = 0.0
    z_ddot, tau_m = (
        band_limited(columns(what, seeds, len(time)), BAND, rms) * active
        for what, rms in (("base", motion.base), ("dither", motion.dither))
    )
    if motion.base_sine is not None:
        z_ddot = z_ddot + _sine(time, motion.base_sine, "base phase", seeds) * active
    process_noise = np.full_like(time, motion.process_noise)
    if motion.rough is not None:
        noise, seconds = motion.rough
        process_noise[(time % (2.0 * seconds)) >= seconds] = noise
    kick = process_noise[:, None] * math.sqrt(PERIOD) * columns("process", seeds, len(time)) * active
    return z_ddot, tau_m, kick


def _sine(time: FloatArray, wave: tuple[float, float], what: str, seeds: Sequence[int]) -> FloatArray:
    """Return the sine of this amplitude and frequency [Hz], with a random phase in each run: (samples, runs)."""
    amplitude, frequency = wave
    phase = np.array([stream(what, seed).uniform(0.0, 2.0 * math.pi) for seed in seeds])
    sine: FloatArray = amplitude * np.sin(2.0 * math.pi * frequency * time[:, None] + phase)
    return sine


def arms(seeds: Sequence[int]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """m_p [kg], c_p [N s/m], k_p [N/m] and trim [rad] of random pilots about the firmware's first guess."""
    normal = np.stack([np.clip(stream("pilot", seed).standard_normal(3), -1.8, 1.8) for seed in seeds], axis=1)
    guess, spread = np.array((2.5, 42.0, 1500.0)), np.array((0.25, 0.3, 0.3))
    m_p, c_p, k_p = (guess[:, None] * np.exp(spread[:, None] * normal))[:, None, :]
    trim = np.radians([stream("trim", seed).uniform(10.0, 28.0) for seed in seeds])
    return m_p, c_p, k_p, trim[None, :]


def _ramp(time: FloatArray, start: float, length: float) -> FloatArray:
    """From 0 to 1, (samples, 1)."""
    return np.clip((time - start) / length, 0.0, 1.0)[:, None]


def _moved(motion: Motion, seeds: Sequence[int], trim: FloatArray) -> FloatArray:
    """Return the trim as the pilot moves it [rad]."""
    time = motion.time
    if motion.sway is not None:
        amplitude, frequency = motion.sway
        trim = trim + _sine(time, (math.radians(amplitude), frequency), "phase", seeds)
    if motion.wander:
        wander = band_limited(columns("wander", seeds, len(time)), (0.05, 0.5), math.radians(motion.wander))
        trim = trim + np.clip(wander, -0.3, 0.3)
    if motion.retrim:
        trim = trim + math.radians(motion.retrim) * _ramp(time, EVENT, 4.0)
    if motion.retrims is not None:
        trim = trim + _retrims(time, motion.retrims, seeds)
    if motion.grip != 1.0:
        angle, seconds = motion.grip_moves
        trim = trim + math.radians(angle) * _ramp(time, EVENT, seconds)
    return trim


def _retrims(time: FloatArray, retrims: tuple[float, float, float], seeds: Sequence[int]) -> FloatArray:
    """Return angle from the first trim [rad], which it never leaves by more than the greatest move."""
    most, every, seconds = math.radians(retrims[0]), *retrims[1:]
    moments = every * np.arange(1.0, time[-1] // every + 1.0)
    knots = np.concatenate(((0.0,), np.stack((moments, moments + seconds), axis=1).ravel()))
    angle = np.empty((len(time), len(seeds)))
    for run, seed in enumerate(seeds):
        places = [0.0]
        for move in stream("retrims", seed).uniform(-most, most, len(moments)).tolist():
            places.append(places[-1] + (move if abs(places[-1] + move) <= most else -move))
        angle[:, run] = np.interp(time, knots, np.repeat(places, 2)[:-1])
    return angle


def _disturbance(motion: Motion, seeds: Sequence[int]) -> FloatArray:
    """Unmeasured torque [N m]."""
    count = len(motion.time)
    torque = np.zeros((1, len(seeds)))
    if motion.slow_torque:
        pole = math.exp(-PERIOD / 0.3)
        white = motion.slow_torque * math.sqrt(1.0 - pole**2) * columns("slow torque", seeds, count)
        torque = torque + autoregressive(white, pole)
    if motion.tremor:
        torque = torque + band_limited(columns("tremor", seeds, count), (3.0, 5.0), motion.tremor)
    return torque


def _up_or_down(factor: float, seeds: Sequence[int]) -> FloatArray:
    return np.array([factor if seed % 2 else 1.0 / factor for seed in seeds])


def lanes(motion: Motion, seeds: Sequence[int]) -> Lanes:
    """Return what plant.py needs."""
    time = motion.time
    z_ddot, tau_m, kick = excitation(motion, seeds)
    m_p, c_p, k_p, trim = arms(seeds)
    if motion.grip != 1.0:
        change = 1.0 + (_up_or_down(motion.grip, seeds) - 1.0) * _ramp(time, EVENT, motion.grip_moves[1])
        c_p, k_p = c_p * change, k_p * change
    if motion.jump != (1.0, 1.0):
        jumped = (time >= EVENT)[:, None]
        c_p, k_p = (
            np.where(jumped, factor * value, value) for factor, value in zip(motion.jump, (c_p, k_p), strict=True)
        )
    if motion.damping is not None:
        first, last, start, end = motion.damping
        c_p = first + (last - first) * _ramp(time, start, end - start) + np.zeros_like(c_p)
    if motion.released is not None:
        held = ((time < motion.released[0]) | (time >= motion.released[1]))[:, None]
        pilot = np.where((time >= motion.released[1])[:, None], _up_or_down(motion.next_pilot, seeds), 1.0)
        m_p, c_p, k_p = m_p * held, c_p * held * pilot, k_p * held * pilot
    friction = np.full((1, len(seeds)), motion.friction)
    if motion.tightened or motion.freed is not None:
        rubs = (time >= motion.tightened) & (time < (math.inf if motion.freed is None else motion.freed))
        friction = friction * rubs[:, None]
    if motion.friction_sigma:
        friction = motion.friction_sigma * np.abs(columns("friction", seeds, 1))
    return Lanes(
        z_ddot=z_ddot,
        tau_m=tau_m,
        m_p=m_p,
        c_p=c_p,
        k_p=k_p,
        trim=_moved(motion, seeds, trim),
        disturbance=_disturbance(motion, seeds),
        kick=kick,
        friction=friction,
        period=PERIOD,
        hardware=Hardware(),
    )


def truth(given: Lanes) -> dict[str, FloatArray]:
    """At every STRIDE-th sample, (times, runs)."""
    count, width = given.z_ddot.shape
    at = np.arange(0, count, STRIDE)
    m_p, c_p, k_p, trim = (
        np.broadcast_to(given.at(at, name), (len(at), width)) for name in ("m_p", "c_p", "k_p", "trim")
    )
    f_n, zeta = natural_frequency_and_damping(given.hardware, m_p, c_p, k_p, trim, given.trim[:1])
    return {"f_n": f_n, "zeta": zeta, "m_p": m_p, "c_p": c_p, "k_p": k_p}
