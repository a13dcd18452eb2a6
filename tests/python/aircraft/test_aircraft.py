"""The helicopter around the lever: against blade elements, scipy's integrator, and its own linearised loop."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.aircraft import aircraft
from lever_sil.aircraft.aircraft import Aircraft, Coupled, Helicopter
from lever_sil.aircraft.flight import Flight
from lever_sil.aircraft.stability import Response
from lever_sil.plants import hysteretic_plant, lever_plant, linear_plant, mayo_plant, two_dof_plant
from lever_sil.plants.truth import Conditions, Truth
from lever_sil.toml_tables import ScenarioError
from python.aircraft.loops import decibels, loop_of, margins, mode
from python.plants.motion import LEVER, PERIOD, TRIM
from scipy import integrate

AIRCRAFT = ("bo105_like", "ch53_like", "ec135_like", "puma_like", "uh60_like")


def accelerations(craft: Helicopter, pitch: float, z_dot: float, beta: float, beta_dot: float) -> FloatArray:
    """beta_ddot and z_ddot of a rotor whose lift is summed over 2000 blade elements, by d'Alembert."""
    radius, speed = craft.radius, craft.rotor_speed
    at = (np.arange(2000) + 0.5) / 2000 * radius
    mass = 3.0 * craft.blade_inertia / radius**3  # of a length of the uniform blade
    slope = craft.lock_number * craft.blade_inertia / radius**4  # rho a c
    lift = craft.lift_deficiency * 0.5 * slope * ((speed * at) ** 2 * pitch - speed * at * (z_dot + at * beta_dot))
    element = radius / 2000
    inertia, moment = (mass * float(np.sum(at**power)) * element for power in (2, 1))
    # inertia beta_ddot + moment z_ddot = flap moment - spring; blades moment beta_ddot + M z_ddot = thrust
    left = np.array(((inertia, moment), (craft.blades * moment, craft.mass)))
    spring = inertia * (craft.flap_frequency * speed) ** 2 * beta
    right = (float(np.sum(lift * at)) * element - spring, craft.blades * float(np.sum(lift)) * element)
    return np.linalg.solve(left, right)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_the_airframe_is_that_of_blade_elements(name: str) -> None:
    craft, random = aircraft.load(name), np.random.default_rng(1)
    assert isinstance(craft, Helicopter)
    a, b, c, d = vars(craft.airframe()).values()
    for _ in range(5):
        pitch, z_dot, beta, beta_dot = random.normal(0.0, (0.05, 2.0, 0.05, 1.0))
        state, given = (z_dot, beta, beta_dot), (pitch, 0.0)
        beta_ddot, z_ddot = accelerations(craft, pitch, z_dot, beta, beta_dot)
        assert a @ state + b @ given == pytest.approx((z_ddot, beta_dot, beta_ddot), rel=1e-5, abs=1e-9)
        assert c @ state + d @ given == pytest.approx((z_ddot, z_ddot), rel=1e-5)


def test_a_gust_is_an_acceleration_of_the_whole_mass_when_blades_are_light() -> None:
    craft = aircraft.load("uh60_like", blade_inertia="1e-6 kg m^2")
    assert craft.airframe().d[0, 1] == pytest.approx(1.0, rel=1e-6)


@pytest.mark.parametrize(("low_pass", "error"), [(0.0, 1e-3), (1.0, 1e-2)])
def test_a_flight_is_that_of_solve_ivp(low_pass: float, error: float) -> None:
    """A lever that swings and a gust, within the actuator's limits; a low-pass is one of samples, half of one early."""
    craft, gearing = aircraft.load("puma_like", lever_low_pass=f"{low_pass} Hz"), 0.4
    time = np.arange(1501) * PERIOD
    a, b, c, d = vars(craft.airframe()).values()
    omega = 2.0 * math.pi * craft.actuator_bandwidth

    def lever(now: float) -> float:
        return 0.02 * math.sin(20.0 * now) if now > 0.0 else 0.0

    def derivative(now: float, x: FloatArray) -> FloatArray:
        moved = lever(now - craft.delay)
        rate = omega * (gearing * (x[4] if low_pass else moved) - x[3])
        passed = 2.0 * math.pi * low_pass * (moved - x[4])
        return np.append(a @ x[:3] + b @ (x[3], math.sin(9.0 * now)), (rate, passed))

    exact = integrate.solve_ivp(derivative, (0.0, time[-1]), np.zeros(5), t_eval=time, rtol=1e-9, atol=1e-12).y
    expected = c @ exact[:3] + d @ np.stack((exact[3], np.sin(9.0 * time)))
    flight = Flight(Coupled(craft, gearing), PERIOD, np.sin(9.0 * time))
    found = [flight.z_ddot, *(flight.advance(lever(now)) for now in time[:-1])]
    assert found == pytest.approx(expected[0], abs=error * np.abs(expected).max())


def coupled_motion(coupled: Coupled, truth: Truth, count: int) -> tuple[FloatArray, FloatArray]:
    """theta [rad] and z_ddot [m/s^2] after a gust of 50 ms."""
    gust = np.where(np.arange(count) < 50, 1e-3, 0.0)
    flight, z_ddot = Flight(coupled, PERIOD, gust), np.zeros(count)
    z_ddot[0] = flight.z_ddot
    body = truth.body(Conditions(z_ddot, PERIOD, 0.0, 0.0, np.random.default_rng(1), ahead=1))
    theta = [body.theta]
    for sample in range(count - 1):
        z_ddot[sample + 1] = flight.advance(theta[-1] - theta[0])
        body.advance(0.0)
        theta.append(body.theta)
    return np.array(theta) - theta[0], z_ddot


def pilots() -> dict[str, Callable[[int], Truth]]:
    def columns(count: int, *values: float) -> list[FloatArray]:
        return [np.full(count, value) for value in values]

    def arm(c_p: float) -> Callable[[int], Truth]:
        return lambda n: lever_plant.LeverTruth(LEVER, lever_plant.Truth(*columns(n, 2.5, c_p, 1500.0, TRIM)), "trim")

    trunk = (two_dof_plant.TRUNK_MASS, two_dof_plant.TRUNK_DAMPING, two_dof_plant.TRUNK_STIFFNESS)
    return {
        "arm": arm(42.0),
        "slack arm": arm(18.0),
        "trunk": lambda n: two_dof_plant.TwoDof(LEVER, *columns(n, 3.2, 30.0, 2100.0, *trunk, TRIM)),
        "hysteretic": lambda n: hysteretic_plant.Hysteretic(LEVER, 0.4, *columns(n, 2.5, 1500.0, TRIM)),
        "Mayo": lambda n: mayo_plant.Mayo(mayo_plant.HANDS["ectomorphic"], 0.45, *columns(n, TRIM)),
        "black box": lambda n: linear_plant.BlackBox(*columns(n, -530.0, -8.0, -2.2, TRIM)),
    }


def loop_with(craft: Aircraft, truth: Truth, gearing: float) -> Response:
    return loop_of(Coupled(craft, gearing), truth.transfer(np.array([0])), 0)


@pytest.mark.parametrize("pilot", pilots())
@pytest.mark.parametrize("name", AIRCRAFT)
def test_growth_is_that_of_the_linearised_loop(name: str, pilot: str) -> None:
    """40 % beyond the gain margin; growth rate and frequency by linear prediction of the last second of two."""
    craft, truth = aircraft.load(name), pilots()[pilot]
    limit = margins(loop_with(craft, truth(2), 1.0))
    beyond = 1.4 * limit.gain
    root = mode(loop_with(craft, truth(2), beyond), 2j * math.pi * limit.frequency)
    theta, _ = coupled_motion(Coupled(craft, beyond), truth(2000), 2000)
    late = theta[1000::20]
    behind, ahead = np.stack((late[1:-1], late[:-2]), axis=1), late[2:]
    (one, two), *_ = np.linalg.lstsq(behind, ahead, rcond=None)
    growth = np.log(np.roots((1.0, -one, -two)).astype(complex)[0]) / (20 * PERIOD)
    assert np.abs(theta).max() < math.radians(1.0)
    assert growth.real == pytest.approx(root.real, rel=0.01)
    assert abs(growth.imag) == pytest.approx(root.imag, rel=0.001)


@pytest.mark.parametrize("name", AIRCRAFT)
def test_the_gain_margin_is_where_the_loop_becomes_unstable(name: str) -> None:
    craft, truth = aircraft.load(name), pilots()["slack arm"](2)
    limit = margins(loop_with(craft, truth, 1.0))
    guess = 2j * math.pi * limit.frequency
    assert mode(loop_with(craft, truth, 0.99 * limit.gain), guess).real < 0.0
    assert mode(loop_with(craft, truth, 1.01 * limit.gain), guess).real > 0.0
    half = margins(loop_with(craft, truth, 0.5 * limit.gain))
    assert half.gain == pytest.approx(2.0, rel=1e-6)
    assert decibels(half.gain) == pytest.approx(6.02, abs=0.01)
    assert 0.0 < half.modulus < 0.501  # at the crossing 1 - L is 1/2


def test_instability_ends_in_a_limit_cycle() -> None:
    craft, truth = aircraft.load("uh60_like"), pilots()["slack arm"](14_000)
    theta, z_ddot = coupled_motion(Coupled(craft, 0.8), truth, 14_000)
    earlier, later = np.abs(theta[9_000:11_000]).max(), np.abs(theta[12_000:]).max()
    assert later == pytest.approx(earlier, rel=0.01)
    assert math.radians(5.0) < later < math.radians(30.0)
    assert np.abs(z_ddot[12_000:]).max() > 5.0


@pytest.mark.parametrize(
    ("name", "changes", "error"),
    [
        ("ka50", {}, "no aircraft 'ka50'; there are bo105_like, ch53_like, ec135_like, puma_like, uh60_like"),
        ("none.toml", {}, "none.toml: no such file"),
        ("uh60_like", {"mass": "7400"}, "uh60_like: mass: '7400' has no unit"),
        ("uh60_like", {"wings": 2}, "uh60_like: unknown key 'wings'"),
    ],
)
def test_errors_name_the_key(name: str, changes: dict[str, object], error: str) -> None:
    with pytest.raises(ScenarioError, match=error):
        aircraft.load(name, **changes)
