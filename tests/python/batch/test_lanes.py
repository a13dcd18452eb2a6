"""Levers side by side: what is drawn for each, what acts on it, and the force in the hand, against closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.config import Config
from lever_sil.batch import closed_loop, motions, plant
from lever_sil.batch.motions import Motion
from lever_sil.batch.plant import Hardware, Lanes
from lever_sil.batch.sensors import SENSORS
from lever_sil.plants import sensors
from lever_sil.plants.trajectories import Steps

SETTINGS = Config().settings


def test_the_lever_is_the_one_that_the_firmware_is_told_of() -> None:
    hardware = Hardware()
    told = {
        name: SETTINGS[f"lever_{name}"]
        for name in ("length", "mass", "mass_position", "inertia", "damping", "stiffness")
    }
    assert vars(hardware) == pytest.approx(told)
    assert closed_loop.MOTOR_LAG == 2e-3
    assert (motions.PERIOD, motions.STRIDE) == (1e-3, 10)
    m_p = np.array([2.5])
    assert hardware.moving_inertia(m_p) == pytest.approx(0.45**2 * (0.25 * 1.2 + 2.5) + 0.02)
    assert hardware.forcing_mass(m_p) == pytest.approx(0.5 * 1.2 + 2.5)


def test_arms_are_drawn_about_the_firmwares_first_guess() -> None:
    """Log-normal, by the standard deviations of the settings, but at most 1.8 of them away; trims from 10 to 28°."""
    m_p, c_p, k_p, trim = (values[0] for values in motions.arms(range(2000)))
    for values, name in ((m_p, "m_p"), (c_p, "c_p"), (k_p, "k_p")):
        off = np.log(values / SETTINGS[name])
        sigma = {"m_p": 0.25, "c_p": 0.3, "k_p": 0.3}[name]
        assert np.median(off) == pytest.approx(0.0, abs=0.025)
        assert np.abs(off).max() == pytest.approx(1.8 * sigma, rel=1e-9)
        assert np.std(off) == pytest.approx(0.93 * sigma, rel=0.05)  # of a normal number that is clipped
    degrees = np.degrees(trim)
    assert 10.0 <= degrees.min() < 10.1
    assert 27.9 < degrees.max() <= 28.0
    assert abs(np.corrcoef([m_p, c_p, k_p, trim]) - np.eye(4)).max() < 0.1


def test_sensors_are_those_of_scenarios_and_one_of_the_grip_force() -> None:
    usual = sensors.Sensors()
    assert {
        **{name: getattr(usual, name) for name in ("theta", "theta_dot", "tau_m", "z_ddot")},
        "grip_force": sensors.Sensor(noise=0.3, bias=2.0),
    } == SENSORS
    assert {name: SENSORS[name].noise for name in ("theta", "theta_dot", "tau_m", "z_ddot")} == {
        "theta": 1e-3, "theta_dot": 1e-2, "tau_m": 2e-3, "z_ddot": 0.01
    }  # fmt: skip


def still(runs: int = 3, **asked: float | Steps) -> Lanes:
    quiet = Motion(duration=1.0, base=(), torque=(), process_noise=0.0, **asked)  # type: ignore[arg-type]
    return motions.lanes(quiet, range(runs))


def test_a_lever_that_nothing_moves_rests_at_its_trim() -> None:
    given = still()
    theta, theta_dot = plant.run(given)
    np.testing.assert_allclose(theta - given.trim[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(theta_dot, 0.0, atol=1e-12)
    np.testing.assert_allclose(plant.grip_force(given, theta, theta_dot), 0.0, atol=1e-9)


def test_torque_moves_the_lever_to_where_the_springs_hold_it() -> None:
    """And the hand feels what the lever's own spring does not take."""
    given = still()
    nothing: dict[str, Any] = dict.fromkeys(("z_ddot", "disturbance", "kick"), np.zeros((4001, 3)))
    given = replace(given, tau_m=np.full((4001, 3), 0.4), **nothing)
    theta, theta_dot = plant.run(given)
    end, trim, h = theta[-1], given.trim[0], given.hardware
    arm = h.length * np.cos(end) * given.k_p[0] * h.length * (np.sin(end) - np.sin(trim))
    np.testing.assert_allclose(arm + h.stiffness * (end - trim), 0.4, rtol=1e-4)
    force = plant.grip_force(given, theta, theta_dot)[-1]
    np.testing.assert_allclose(-force * h.length, arm, rtol=1e-3)


def test_the_hand_feels_mass_and_damper_of_the_arm() -> None:
    """The lever's own equation of motion: what is left of its torque is the arm's."""
    given = motions.lanes(Motion(duration=3.0, process_noise=0.0), range(3))
    theta, theta_dot = plant.run(given)
    h, length = given.hardware, given.hardware.length
    own_inertia = length**2 * h.mass_position**2 * h.mass + h.inertia
    middle = 0.5 * (theta[1:] + theta[:-1])
    acceleration = np.diff(theta_dot, axis=0) / given.period
    rate, base, torque = (0.5 * (each[1:] + each[:-1]) for each in (theta_dot, given.z_ddot, given.tau_m))
    own = own_inertia * acceleration + h.damping * rate + h.stiffness * (middle - given.trim[0]) - torque
    own += length * h.mass_position * h.mass * base * np.cos(middle)
    force = plant.grip_force(given, theta, theta_dot)[1:]
    np.testing.assert_allclose(length * force, own, atol=0.02 * np.abs(own).max())


def test_frequency_and_damping_are_those_about_the_trim() -> None:
    given = still(2, trim=0.0)
    h, trim = given.hardware, given.trim[0]
    inertia, rise = h.moving_inertia(given.m_p[0]), h.length * np.cos(trim)
    omega = np.sqrt((rise**2 * given.k_p[0] + h.stiffness) / inertia)
    truth = motions.truth(given)
    np.testing.assert_allclose(truth["f_n"], np.broadcast_to(omega / (2.0 * math.pi), (101, 2)))
    zeta = (rise**2 * given.c_p[0] + h.damping) / (2.0 * omega * inertia)
    np.testing.assert_allclose(truth["zeta"][0], zeta)


def test_lanes_lie_side_by_side_and_each_is_itself() -> None:
    one, two = still(2), still(1, c_p=Steps(1.0, (0.5,), (2.0,)))
    both = plant.beside([one, two])
    assert both.z_ddot.shape == (1001, 3)
    assert both.c_p.shape == (1001, 3)
    np.testing.assert_array_equal(both.c_p[:, 2], two.c_p[:, 0])
    np.testing.assert_array_equal(both.only(1).k_p, one.k_p[:, [1]])
    assert both.only(2).hardware == one.hardware
    at = np.array([0, 1000])
    assert both.at(at, "m_p").shape == (2, 3)
    np.testing.assert_array_equal(both.at(at, "c_p")[:, 2], two.c_p[at, 0])


def test_signs_of_life_come_each_ten_thousand_samples() -> None:
    calls: list[int] = []
    nothing: dict[str, Any] = dict.fromkeys(("tau_m", "disturbance", "kick"), np.zeros((1, 1)))
    given = replace(still(1), z_ddot=np.zeros((25_001, 1)), **nothing)
    plant.run(given, lambda: calls.append(1))
    assert len(calls) == 3
