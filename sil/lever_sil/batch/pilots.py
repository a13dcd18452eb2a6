"""Pilots whose arm is no mass on a spring and a damper: a trunk on a seat, measured hands, hysteresis, a reflex.

two_dof and mayo_* are the truths of sil/. The others are linear and exact in the frequency domain: with the arm's
dynamic stiffness D [N/m] the lever answers

    (-M w^2 + i w c_l + k_l + l^2 cos^2(trim) D(w)) theta = -l mu cos(trim) z_ddot + tau_m + disturbance

    hysteretic   D = k_p (1 + i eta), its loss the same at every frequency      eta = 0.6
    reflex       D = k_p (1 + 0.25 exp(-i w 35 ms)) + i w c_p, the stretch reflex after its delay
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from lever_cdkf.firmware.config import settings_table
from lever_cdkf.numeric.arrays import ComplexArray, FloatArray

from ..fast import plants as fast_plants
from ..plants import lever_plant, mayo_plant, two_dof_plant
from ..plants.truth import Conditions, Truth
from .motions import FREQUENCIES, PERIOD, Motion, Recording, arms, excitation, stream
from .plant import Hardware

LOSS = 0.6
REFLEX_GAIN, REFLEX_DELAY = 0.25, 35e-3
MOTOR_LAG = 2e-3  # [s]

DynamicStiffness = Callable[[FloatArray, FloatArray, FloatArray], ComplexArray]
"""D of c_p, k_p and the frequency [Hz], which broadcast."""


def _hysteretic(c_p: FloatArray, k_p: FloatArray, frequency: FloatArray) -> ComplexArray:
    stiffness: ComplexArray = k_p * (1.0 + 1j * LOSS * np.sign(frequency))
    return stiffness


def _reflex(c_p: FloatArray, k_p: FloatArray, frequency: FloatArray) -> ComplexArray:
    s = 2j * np.pi * frequency
    stiffness: ComplexArray = k_p * (1.0 + REFLEX_GAIN * np.exp(-REFLEX_DELAY * s)) + s * c_p
    return stiffness


LINEAR: dict[str, DynamicStiffness] = {"hysteretic": _hysteretic, "reflex": _reflex}


def record(motion: Motion, seeds: Sequence[int], tick: Callable[[], None] = lambda: None) -> Recording:
    """Return the recording of such a pilot, with the trim and the linear arm that others of that seed have.

    `tick` is called now and then.
    """
    return _linear(motion, seeds) if motion.pilot in LINEAR else _of_sil(motion, seeds, tick)


def _linear(motion: Motion, seeds: Sequence[int]) -> Recording:
    hardware, stiffness = Hardware(), LINEAR[motion.pilot]
    z_ddot, tau_m, kick = excitation(motion, seeds)
    m_p, c_p, k_p, trim = arms(seeds)
    inertia, rise = hardware.moving_inertia(m_p), hardware.length * np.cos(trim)
    forcing = -rise * hardware.forcing_mass(m_p)

    def divisor(frequency: FloatArray) -> ComplexArray:
        s = 2j * np.pi * frequency
        own = inertia * s**2 + hardware.damping * s + hardware.stiffness
        resistance: ComplexArray = own + rise**2 * stiffness(c_p, k_p, frequency)
        return resistance

    count = len(z_ddot)
    frequency = np.fft.rfftfreq(count, PERIOD)[:, None].astype(np.float64)
    torque = forcing * z_ddot + tau_m + inertia * kick / PERIOD
    answer = np.fft.rfft(torque, axis=0) / divisor(frequency)
    theta = trim + np.fft.irfft(answer, count, axis=0)
    theta_dot = np.fft.irfft(2j * np.pi * frequency * answer, count, axis=0)
    response = (forcing / divisor(FREQUENCIES[:, None])).T
    return Recording(motion.time, theta, theta_dot, tau_m, z_ddot, {}, response)


def _of_sil(motion: Motion, seeds: Sequence[int], tick: Callable[[], None]) -> Recording:
    z_ddot, command, _ = excitation(motion, seeds)
    trim = arms(seeds)[3][0]
    theta, theta_dot, tau_m = np.empty_like(z_ddot), np.empty_like(z_ddot), np.empty_like(z_ddot)
    responses = []
    for run, seed in enumerate(seeds):
        tick()
        pilot = _pilot_of_sil(motion.pilot, np.full(len(z_ddot), trim[run]), stream("pilot", seed))
        rng = stream("process", seed)
        given = Conditions(z_ddot[:, run], PERIOD, motion.process_noise, MOTOR_LAG, rng)
        theta[:, run], theta_dot[:, run], tau_m[:, run] = fast_plants.move(pilot, given, command[:, run])
        responses.append(pilot.transfer(np.zeros(1, np.intp)).response(FREQUENCIES)[0])
    return Recording(motion.time, theta, theta_dot, tau_m, z_ddot, {}, np.stack(responses))


def _pilot_of_sil(name: str, trim: FloatArray, rng: np.random.Generator) -> Truth:
    """Return the pilot of `lever sim` of that name.

    mayo_* are as measured, mayo_random about both; two_dof has an arm that differs from that of its scenario by 10 %
    (standard deviation).
    """
    lever = lever_plant.Lever.from_settings({row.name: row.default for row in settings_table()})
    if name == "mayo_random":
        normal = np.clip(rng.standard_normal(3), -1.8, 1.8)
        w, a, outside = np.array((500.0, 13.5, 9.0)) * np.exp(np.array((0.3, 0.35, 0.45)) * normal)
        return mayo_plant.Mayo(mayo_plant.Hand(a, a - outside, w), lever.lever_length, trim)
    if name.startswith("mayo_"):
        return mayo_plant.Mayo(mayo_plant.HANDS[name.removeprefix("mayo_")], lever.lever_length, trim)
    ones = np.ones_like(trim)
    m_p, c_p, k_p = (value * np.exp(0.1 * rng.standard_normal()) * ones for value in (3.2, 60.0, 2100.0))
    trunk = (two_dof_plant.TRUNK_MASS, two_dof_plant.TRUNK_DAMPING, two_dof_plant.TRUNK_STIFFNESS)
    m_t, c_t, k_t = (value * ones for value in trunk)
    return two_dof_plant.TwoDof(lever, m_p, c_p, k_p, m_t, c_t, k_t, trim)
