"""Spellings of units; units that nobody says: what values look like, and what no lever and no aircraft has."""

from __future__ import annotations

import math

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.signals.inputs import understood
from lever_cdkf.signals.mapping import Source
from lever_cdkf.signals.recorded import Signal
from lever_cdkf.signals.units import check_plausible, factor, gravity_in, guess


@pytest.mark.parametrize(
    ("key", "value", "unit"),
    [
        ("theta", -3.14, "rad"),
        ("theta", 3.15, "deg"),
        ("theta_dot", -20.0, "rad/s"),
        ("theta_dot", 20.1, "deg/s"),
        ("z_ddot", 0.86, "g"),
        ("z_ddot", -1.14, "g"),
        ("z_ddot", 8.4, "m/s^2"),
        ("z_ddot", -11.2, "m/s^2"),
        ("tau_m", 1e4, "N m"),
    ],
)
def test_the_unit_is_that_of_the_size(key: str, value: float, unit: str) -> None:
    """Of all but a hundredth, without what is missing."""
    values = np.full(1000, value)
    values[:5], values[5:100] = 1e6, np.nan
    assert guess(key, values)[0] == unit


DEGREE = math.pi / 180.0
SPELLINGS: dict[str, dict[float, tuple[str, ...]]] = {
    "theta": {
        1.0: ("rad", "Radians", "[rad]"),
        1e-3: ("mrad", "milliradian"),
        DEGREE: ("deg", "°", "º", "Degrees", "degrés", "grad"),
        2.0 * math.pi: ("rev", "revolution", "turns"),
    },
    "theta_dot": {
        1.0: ("rad/s", "rad s-1", "rad·s⁻¹", "rad*s^-1", "rad/sec", "radians per second", "rads/second"),
        DEGREE: ("deg/s", "dps", "°/s", "deg s-1", "degs_per_sec", "degps"),
        math.pi / 30.0: ("rpm", "1/min", "U/min", "rev/min"),
    },
    "z_ddot": {
        1.0: (
            "m/s2",
            "m/s^2",
            "[m/s²]",
            "m/s/s",
            "m/sec/sec",
            "m s-2",
            "m·s⁻²",
            "meters/second^2",
            "metre per s2",
            "mps2",
        ),
        0.3048: ("ft/s²", "ft/s/s"),
        9.80665: ("g", "G"),
        9.80665e-6: ("ug", "µg", "micro-g"),
    },
    "tau_m": {
        1.0: ("N m", "Nm", "N·m", "N.m", "N*m", "N-m", "N⋅m", "newton metres", "Newtonmeter"),
        4.4482216152605 * 0.3048: ("lbf ft", "ft-lb", "lb.ft", "lb ft", "lbs-ft", "ft lbs"),
    },
    "grip_force": {1.0: ("N", "newton", "Newtons"), 4.4482216152605: ("lb", "lbs", "lbf")},
}


@pytest.mark.parametrize("key", SPELLINGS)
def test_a_unit_has_many_spellings(key: str) -> None:
    spelt = {unit: si for si, units in SPELLINGS[key].items() for unit in units}
    assert {unit: factor(key, unit) for unit in spelt} == pytest.approx(spelt)


@pytest.mark.parametrize("level", [0.0, 0.84, 1.16, 8.3, 11.3])
def test_an_acceleration_without_gravity_is_not_guessed(level: float) -> None:
    with pytest.raises(LeverError, match="say unit=g or unit="):
        guess("z_ddot", np.full(100, level))


def test_gravity_has_a_sign() -> None:
    assert [gravity_in(np.full(9, level)) for level in (8.4, -11.2, 8.3, 11.3, 0.0, np.nan)] == [1, -1, 0, 0, 0, 0]


@pytest.mark.parametrize(
    ("key", "greatest"),
    [("theta", 3.15), ("theta_dot", 20.1), ("z_ddot", 80.1), ("tau_m", 1001), ("grip_force", 10_001)],
)
def test_more_than_a_hundredth_beyond_what_there_is_means_another_unit(key: str, greatest: float) -> None:
    values = np.zeros(1000)
    values[:10] = -greatest
    check_plausible(key, "it", values)
    values[10] = greatest
    with pytest.raises(LeverError, match=f"{key} = it: 1 % of it is beyond"):
        check_plausible(key, "it", values)
    check_plausible(key, "it", np.full(1000, 0.99 * greatest))
    check_plausible(key, "it", np.full(3, np.nan))


@pytest.mark.parametrize(
    ("key", "unit", "size"),
    [
        ("theta", "rad", 0.5),
        ("theta", "deg", math.degrees(0.5)),
        ("theta_dot", "rad/s", 1.0),
        ("theta_dot", "deg/s", math.degrees(1.0)),
        ("z_ddot", "m/s^2", 9.81),
        ("z_ddot", "g", 9.81 / 9.80665),
        ("tau_m", "N m", 2.0),
    ],
)
def test_a_signal_whose_unit_nobody_says_is_read_in_the_one_that_is_told(key: str, unit: str, size: float) -> None:
    """The same values as with that unit, and a sentence that says so."""
    time = 0.01 * np.arange(500.0)
    values = size * (1.0 + 0.2 * np.sin(time))
    taken, said = (understood(key, Source("x", unit=each), Signal("x", time, values)) for each in ("", unit))
    assert taken.signal.unit == said.signal.unit
    np.testing.assert_array_equal(taken.signal.values, said.signal.values)
    (told,) = set(taken.notes) - set(said.notes)
    assert told.startswith(f"{key} = x: no unit is said; taken as {unit}, since ")
