"""What theta and theta_dot alone tell of the arm, when nobody measures what shakes the base: for PAPER.md.

About its trim the lever is theta'' + 2 zeta w theta' + w^2 theta = a, with a in proportion to the base acceleration and
the unmodelled torque. Of the spectrum |H|^2 S_a of theta only the product can be seen, so S_a has to be assumed. Here
natural frequency, damping ratio and what is not assumed of S_a are those of greatest likelihood in the frequency domain
(P. Whittle, "The analysis of multiple stationary time series", JRSS B 15, 1953), for parameters that stay: no filter
with the same assumption, a joint EKF with a shaping filter for one, knows more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from lever_cdkf.cli.tables import Cell, Row
from lever_cdkf.firmware.config import setting
from lever_cdkf.firmware.native import Config, lib, run_samples
from lever_cdkf.models.lever import Lever
from lever_cdkf.numeric.arrays import Array
from lever_cdkf.text.units import GRAVITY

from .. import measures
from ..plants.excitation import Noise, Rotor
from .draws import streams
from .steps import follow, substeps_of

SEEDS, DURATION = 20, 60.0
"""Runs, and their length [s]."""
_RMS, _PROCESS_NOISE, _TRIM = 0.1 * GRAVITY, 0.05, math.radians(20.0)
_BAND = (0.8, 12.0)
"""Frequencies that are looked at [Hz]: above the pilot's own motion."""
_START = (3.0, 4.5)
"""First guesses of f_n [Hz]."""
_TAPERED = 35.0 / 18.0
"""Variance with Hann's taper over that without one: neighbouring frequencies tell the same in part (Welch 1967)."""

BASES: Mapping[str, Noise | Rotor] = {
    "flat, 1-10 Hz": Noise(rms=_RMS, low=1.0, high=10.0),
    "flat, 2-6 Hz": Noise(rms=_RMS, low=2.0, high=6.0),
    "rotor, 4.3 Hz and harmonics": Rotor(rms=_RMS, rotor_frequency=4.3, harmonics=(1, 2)),
}
"""What shakes the base."""


@dataclass(frozen=True)
class Found:
    """Of N runs; (N, 2) arrays of natural frequency and damping ratio."""

    error: Array
    """Relative."""
    sigma: Array
    """Its stated standard deviation."""


Spectrum = Callable[[Array, Array], Array]
"""S_a up to a factor, of frequencies [Hz] and free parameters."""


def _white(frequency: Array, _: Array) -> Array:
    return np.ones_like(frequency)


def shaped(frequency: Array, free: Array) -> Array:
    """Return a band-pass of second order: logarithms of its centre [Hz] and of its damping ratio."""
    ratio, damping = frequency / np.exp(free[0]), np.exp(free[1])
    band: Array = (2.0 * damping * ratio) ** 2 / ((1.0 - ratio**2) ** 2 + (2.0 * damping * ratio) ** 2)
    return band


def _band(low: float, high: float) -> Spectrum:
    return lambda frequency, _: ((frequency >= low) & (frequency <= high)).astype(float)


def assumptions(base: str) -> dict[str, tuple[Spectrum, tuple[float, ...]]]:
    """Return what may be assumed of the spectrum of a base, each with the start of its free parameters."""
    shape = BASES[base]
    known = {"its spectrum but for the level": (_band(shape.low, shape.high), ())} if isinstance(shape, Noise) else {}
    shaping = (math.log(4.0), math.log(0.7))
    return {"white": (_white, ()), "second-order shaping filter": (shaped, shaping), **known}


def runs(base: str, count: int, duration: float) -> tuple[Array, Array, Array]:
    """Return measured theta, theta_dot (N, K, 2), base acceleration (N, K), and the true f_n [Hz] and zeta (N, 2)."""
    settings = Config().settings
    lever, period = Lever.from_settings(settings, "trim"), settings["sample_period"]
    drawn, time = streams(1, count), np.arange(round(duration / period), dtype=np.float64) * period
    z_ddot = np.stack([BASES[base].samples(time, own["base"]) for own in drawn])
    guess = np.array([settings[name] for name in ("m_p", "c_p", "k_p")])
    p = np.stack([guess * own["pilot"].uniform(0.75, 1.25, 3) for own in drawn])
    substeps = substeps_of(period)
    shape = (len(time) - 1, substeps)
    kicks = (
        _PROCESS_NOISE
        * math.sqrt(period / substeps)
        * np.stack([own["process"].standard_normal(shape) for own in drawn])
    )
    u = np.stack((z_ddot, np.zeros_like(z_ddot)), axis=-1)
    x = follow(lever, np.repeat(p[:, None], len(time), axis=1), u, _TRIM, kicks, period)
    noise = np.array((settings["theta_noise"], settings["theta_dot_noise"]))
    y = x + noise * np.stack([own["output"].standard_normal((len(time), 2)) for own in drawn])
    return y, z_ddot, lever.dynamics(p.T, _TRIM).T


def likeliest(y: Array, truth: Array, spectrum: Spectrum, start: tuple[float, ...]) -> Found:
    """Return what the runs y (N, K, 2) tell under an assumption, against the truth (N, 2)."""
    settings = Config().settings
    noise = np.array((settings["theta_noise"], settings["theta_dot_noise"]))
    centred, period = y - y.mean(axis=1, keepdims=True), settings["sample_period"]
    found = [_fit(*_periodogram(run, noise, period), spectrum, start) for run in centred]
    best, sigma = (np.stack(part)[:, :2] for part in zip(*found, strict=True))
    return Found(np.exp(best) / truth - 1.0, sigma)


def _periodogram(y: Array, noise: Array, period: float) -> tuple[Array, Array, Array]:
    """Return frequencies [Hz]; the periodogram of theta from both outputs; its noise (one-sided).

    The outputs are weighted by their noise.
    """
    frequency = np.fft.rfftfreq(len(y), period)
    inside = (frequency >= _BAND[0]) & (frequency <= _BAND[1])
    taper = np.hanning(len(y))  # what is loud at one frequency does not leak into others
    transform, frequency = np.fft.rfft(taper[:, np.newaxis] * y, axis=0)[inside], frequency[inside]
    omega = 2.0 * math.pi * frequency
    weight = 1.0 / noise[0] ** 2 + (omega / noise[1]) ** 2
    theta = (transform[:, 0] / noise[0] ** 2 - 1j * omega * transform[:, 1] / noise[1] ** 2) / weight
    return frequency, np.abs(theta) ** 2 * period / np.sum(taper**2), period / weight


def density(frequency: Array, free: Array, spectrum: Spectrum) -> Array:
    """Return the spectral density of theta of the logarithms of f_n [Hz], zeta, level, and those that are free."""
    omega, natural, zeta = 2.0 * math.pi * frequency, 2.0 * math.pi * np.exp(free[0]), np.exp(free[1])
    response = 1.0 / ((natural**2 - omega**2) ** 2 + (2.0 * zeta * natural * omega) ** 2)
    values: Array = (np.exp(2.0 * free[2]) * spectrum(frequency, free[3:]) + _PROCESS_NOISE**2) * response
    return values


def _fit(
    frequency: Array, power: Array, noise: Array, spectrum: Spectrum, start: tuple[float, ...]
) -> tuple[Array, Array]:
    """Logarithms of f_n [Hz], zeta, level and free parameters of greatest likelihood, and their standard deviations."""
    from scipy.optimize import minimize

    def logarithm(free: Array) -> Array:
        values: Array = np.log(density(frequency, free, spectrum) + noise)
        return values

    def cost(free: Array) -> float:
        with np.errstate(over="ignore"):
            expected = logarithm(free)
            value = float(np.sum(expected + power * np.exp(-expected)))
        return value if math.isfinite(value) else 1e300

    bounds = [(math.log(0.5), math.log(15.0)), (math.log(0.01), math.log(5.0)), (-6.0, 4.0)]
    bounds += [(math.log(0.5), math.log(15.0)), (math.log(0.05), math.log(5.0))][: len(start)]
    tries = [
        minimize(cost, np.array((math.log(at), math.log(0.4), 0.0, *start)), method="L-BFGS-B", bounds=bounds)
        for at in _START
    ]
    best = min(tries, key=lambda one: float(one.fun)).x
    steps = 1e-4 * np.eye(len(best))
    slopes = np.stack([(logarithm(best + step) - logarithm(best - step)) / 2e-4 for step in steps])
    return best, np.sqrt(_TAPERED * np.abs(np.diag(np.linalg.pinv(slopes @ slopes.T))))


BASE_FAULT: int = lib.LEVER_FAULT_BASE
"""Base acceleration missing or stuck."""


def firmware(y: Array, truth: Array) -> tuple[Found, Array]:
    """Return what the firmware says at the end without z_ddot, and the share (N,) of samples with the fault BASE."""
    errors, sigmas, flagged = [], [], []
    period = setting("sample_period").default
    for run, (f_n, zeta) in zip(y, truth, strict=True):
        time_us = np.arange(len(run), dtype=np.int64) * round(period * 1e6)
        columns = {"time_us": time_us, "theta": run[:, 0], "theta_dot": run[:, 1], "tau_m": np.zeros(len(run))}
        said = run_samples(Config("lever", "trim"), columns)
        last = {name: float(said[name][-1]) for name in ("natural_frequency", "damping_ratio")}
        spread = [float(said[f"{name}_sigma"][-1]) / value for name, value in last.items()]
        errors.append((last["natural_frequency"] / f_n - 1.0, last["damping_ratio"] / zeta - 1.0))
        sigmas.append(spread)
        flagged.append(float(np.mean(measures.is_flagged(said["faults"], BASE_FAULT))))
    return Found(np.array(errors), np.array(sigmas)), np.array(flagged)


def rows(count: int = SEEDS, duration: float = DURATION) -> list[Row]:
    """Return the table of PAPER.md.

    Parameters
    ----------
    count
        Pilots.
    duration
        Of each run [s].

    Returns
    -------
    list of dict
        A row for each base and assumption, and one for the firmware of each base.
    """
    table: list[Row] = []
    for base in BASES:
        y, _, truth = runs(base, count, duration)
        for name, (spectrum, start) in assumptions(base).items():
            table.append(_row(base, f"{name}, likeliest", likeliest(y, truth, spectrum, start)))
        table.append(_row(base, "nothing: the firmware", firmware(y, truth)[0]))
    return table


def _row(base: str, assumed: str, found: Found) -> Row:
    error = 100.0 * np.abs(found.error)
    covered = 100.0 * measures.covered(found.error, found.sigma, axis=0)
    cells: dict[str, Cell] = {"base": base, "assumed of it": assumed}
    for index, name in enumerate(("f_n", "ζ")):
        cells[f"{name}: error [%]"] = f"{np.median(error[:, index]):.1f} / {np.max(error[:, index]):.1f}"
        cells[f"{name}: bias [%]"] = f"{100.0 * np.mean(found.error[:, index]):+.1f}"
        cells[f"{name}: ±2σ covers [%]"] = f"{covered[index]:.0f}"
    return cells
