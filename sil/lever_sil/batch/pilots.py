"""Pilots whose arm is no mass on a spring and a damper: truths of plants/, with the trim that others of that seed have.

mayo_* are as Mayo measured them, mayo_random about both; two_dof has an arm that differs from that of its scenario by
10 % (standard deviation). To the arm that others of that seed have, hysteretic gives a loss factor, and reflex a
stretch reflex.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from lever_cdkf.firmware.config import Config
from lever_cdkf.numeric.arrays import FloatArray

from ..fast import plants as fast_plants
from ..plants import hysteretic_plant, lever_plant, mayo_plant, reflex_plant, two_dof_plant
from ..plants.truth import Conditions, Truth
from .motions import FREQUENCIES, PERIOD, Motion, Recording, arms, excitation, stream

LOSS_FACTOR, REFLEX_GAIN = 0.6, 0.25
MOTOR_LAG = 2e-3  # [s]


def record(motion: Motion, seeds: Sequence[int], tick: Callable[[], None] = lambda: None) -> Recording:
    """Return the recording of such a pilot; `tick` is called now and then."""
    z_ddot, command, _ = excitation(motion, seeds)
    theta, theta_dot, tau_m = np.empty((3, *z_ddot.shape))
    responses = []
    for run, seed in enumerate(seeds):
        tick()
        pilot = _pilot(motion.pilot, seed, np.ones(len(z_ddot)))
        given = Conditions(z_ddot[:, run], PERIOD, motion.process_noise, MOTOR_LAG, stream("process", seed))
        theta[:, run], theta_dot[:, run], tau_m[:, run] = fast_plants.move(pilot, given, command[:, run])
        responses.append(pilot.transfer(np.zeros(1, np.intp)).response(FREQUENCIES)[0])
    return Recording(motion.time, theta, theta_dot, tau_m, z_ddot, {}, np.stack(responses))


def _pilot(name: str, seed: int, ones: FloatArray) -> Truth:
    """Return the pilot of that name; `ones` has a value for each sample."""
    lever = lever_plant.Lever.from_settings(Config().settings)
    m_p, c_p, k_p, trim = (values[0, 0] * ones for values in arms([seed]))
    rng = stream("pilot", seed)
    if name == "hysteretic":
        return hysteretic_plant.Hysteretic(lever, LOSS_FACTOR, m_p, k_p, trim)
    if name == "reflex":
        return reflex_plant.Reflex(lever, reflex_plant.DELAY, m_p, c_p, k_p, REFLEX_GAIN * k_p, 0.0 * ones, trim)
    if name == "mayo_random":
        normal = np.clip(rng.standard_normal(3), -1.8, 1.8)
        w, a, outside = np.array((500.0, 13.5, 9.0)) * np.exp(np.array((0.3, 0.35, 0.45)) * normal)
        return mayo_plant.Mayo(mayo_plant.Hand(a, a - outside, w), lever.lever_length, trim)
    if name.startswith("mayo_"):
        return mayo_plant.Mayo(mayo_plant.HANDS[name.removeprefix("mayo_")], lever.lever_length, trim)
    m_p, c_p, k_p = (value * np.exp(0.1 * rng.standard_normal()) * ones for value in (3.2, 60.0, 2100.0))
    trunk = (two_dof_plant.TRUNK_MASS, two_dof_plant.TRUNK_DAMPING, two_dof_plant.TRUNK_STIFFNESS)
    m_t, c_t, k_t = (value * ones for value in trunk)
    return two_dof_plant.TwoDof(lever, m_p, c_p, k_p, m_t, c_t, k_t, trim)
