"""Why a signal is proposed: its score, word by word and unit by unit, and the values that speak for it."""

from __future__ import annotations

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.signals import plots
from lever_cdkf.signals.proposal import Candidate, propose, words_of
from lever_cdkf.signals.recorded import Signal

TIME = 0.01 * np.arange(3000.0)
RANDOM = np.random.default_rng(4)
NOISE = RANDOM.standard_normal((6, len(TIME)))


def signal(name: str, unit: str = "", level: float = 0.0, size: float = 1.0, row: int = 0, words: str = "") -> Signal:
    """Return noise, another for each row, about a level."""
    return Signal(name, TIME, level + size * NOISE[row], unit, words)


ANGLE = signal("angle", "deg", 20.0)
BASE = signal("acceleration", "m/s^2", 0.0, row=1)


def found(*signals: Signal) -> dict[str, Candidate]:
    return {each.key: each for each in propose(signals, "a test")[1]}


def score(key: str, one: Signal) -> float:
    """Return the score of a signal beside others that are the base and the angle."""
    others = [
        each
        for each in (ANGLE, BASE)
        if key not in ("theta", "z_ddot") or each is not {"theta": ANGLE, "z_ddot": BASE}[key]
    ]
    return found(one, *others)[key].score


@pytest.mark.parametrize(
    ("key", "name", "unit", "expected"),
    [
        ("theta", "angle", "deg", 4.0 + 2.0),
        ("theta", "LeverAngle", "deg", 4.0 + 2.0 + 2.0),
        ("theta", "CollectiveLeverAngle", "rad", 4.0 + 3.0 + 2.0 + 2.0),
        ("theta", "LeverAngle", "", 2.0 + 2.0 + 2.0),  # no unit
        ("theta", "Hebelwinkel", "deg", 4.0 + 2.0 + 2.0),  # a compound
        ("theta", "LvrAngle", "deg", 4.0 + 2.0 + 2.0),  # shortened
        ("theta", "AngleMeasured", "deg", 4.0 + 2.0 + 2.0),
        ("theta", "Angle.LeverPosition", "deg", 4.0 + 1.5 + 2.0 + 0.5 * 2.0),  # half in the message's name
        ("theta", "LeverPosCmd", "deg", 4.0 + 1.5 + 2.0 - 2.0),
        ("z_ddot", "acceleration", "m/s^2", 4.0 + 3.0),
        ("z_ddot", "VertAccel", "g", 4.0 + 3.0 + 2.5),
        ("z_ddot", "AccZ", "m/s^2", 4.0 + 3.0 + 2.5),
    ],
)
def test_words_and_units_add_up(key: str, name: str, unit: str, expected: float) -> None:
    size = 0.3 if unit == "rad" else 1.0
    assert score(key, signal(name, unit, 0.0, size, 2)) == pytest.approx(expected)


def test_words_of_the_database_count_half() -> None:
    plain, told = (
        signal("Sig1 angle", "deg", 0.0, 1.0, 2, words) for words in ("", "position of the collective lever")
    )
    assert score("theta", told) - score("theta", plain) == pytest.approx(0.5 * (1.5 + 3.0 + 2.0))


@pytest.mark.parametrize(("unit", "level"), [("g", 1.0), ("g", -1.0), ("m/s^2", 9.81), ("", 9.81)])
def test_gravity_speaks_for_an_acceleration(unit: str, level: float) -> None:
    size = 0.1 * abs(level)
    without, with_it = (signal("acceleration", unit, each, size, 2) for each in (0.0, level))
    gain = found(with_it, ANGLE)["z_ddot"]
    if unit:
        assert gain.score - found(without, ANGLE)["z_ddot"].score == pytest.approx(3.0)
    assert f"rests at {np.median(with_it.values):.3g}, which is gravity" in gain.why


def test_a_rate_that_is_the_slope_speaks_for_both() -> None:
    angle = signal("angle", "rad", 0.0, 0.0)
    angle = Signal("angle", TIME, 0.2 * np.sin(3.0 * TIME), "rad")
    rate = Signal("rate", TIME, 0.6 * np.cos(3.0 * TIME), "rad/s")
    both, alone = found(angle, rate, BASE), found(angle, BASE)
    assert both["theta"].score - alone["theta"].score == pytest.approx(4.0, abs=0.01)
    assert "its slope is rate" in both["theta"].why
    assert "the slope of angle" in both["theta_dot"].why
    turned = Signal("rate", TIME, -0.6 * np.cos(3.0 * TIME), "rad/s")
    mapping, _, _ = propose([angle, turned, BASE], "a test")
    assert mapping.sources["theta_dot"].sign == -1
    other = Signal("rate", TIME, 0.6 * NOISE[3], "rad/s")  # the rate of something else
    assert "theta_dot" not in found(angle, other, BASE)


def test_what_comes_with_the_angle_is_likelier_the_lever_s() -> None:
    angle = Signal("Lever.angle", TIME, 0.2 * np.sin(3.0 * TIME), "rad")
    values = 0.6 * np.cos(3.0 * TIME)
    beside, elsewhere = (found(angle, Signal(name, TIME, values, "rad/s"), BASE) for name in ("Lever.rate", "Box.rate"))
    assert "in the message of Lever.angle" in beside["theta_dot"].why
    lever = 0.5 * 2.0  # half the weight of lever in the message's name
    assert beside["theta_dot"].score - elsewhere["theta_dot"].score == pytest.approx(2.0 + lever, abs=0.01)


def test_a_torque_is_proposed_by_its_unit_if_a_hand_can_hold_it() -> None:
    torque = signal("Sig7", "N m", 0.0, 2.0, 2)
    assert found(torque, ANGLE, BASE)["tau_m"].score == pytest.approx(7.0)
    assert "in N m" in found(torque, ANGLE, BASE)["tau_m"].why
    assert "tau_m" not in found(signal("Sig7", "N m", 0.0, 60.0, 2), ANGLE, BASE)  # up to 200 N m
    twins = [signal(f"Sig{k}", "N m", 0.0, 2.0, k) for k in (2, 3)]
    assert "tau_m" not in found(*twins, ANGLE, BASE), "either may be meant"
    _, _, nearly = propose([*twins, ANGLE, BASE], "a test")
    assert [each.key for each in nearly] == ["tau_m"]


@pytest.mark.parametrize(
    ("name", "proposed", "named"),
    [("MotorTorque", [7.0], []), ("torque", [], [5.0]), ("moment", [], [4.0]), ("shaft", [], [])],
)
def test_a_torque_without_a_unit_needs_more_words(name: str, proposed: list[float], named: list[float]) -> None:
    """Of 7 it is proposed, and down to 4 it is named for a person to decide."""
    _, taken, nearly = propose([signal(name, "", 0.0, 2.0, 2), ANGLE, BASE], "a test")
    assert [each.score for each in taken if each.key == "tau_m"] == proposed
    assert [each.score for each in nearly if each.key == "tau_m"] == named


@pytest.mark.parametrize(
    "odd",
    [
        Signal("angle", TIME, np.full(len(TIME), 5.0), "deg"),  # stands still
        Signal("angle", TIME, np.arange(len(TIME), dtype=np.float64), "deg"),  # counts
        Signal("angle", 0.6 * np.arange(100.0), NOISE[0][:100], "deg"),  # too seldom
        Signal("angle", TIME[:19], NOISE[0][:19], "deg"),  # too few
        Signal("angle", TIME, np.full(len(TIME), np.nan), "deg"),
    ],
)
def test_what_does_not_move_is_no_input(odd: Signal) -> None:
    with pytest.raises(LeverError) as error:
        propose([odd, BASE], "a log")
    assert str(error.value) == (
        "a log: no signal looks like the angle of a lever: map it by hand, with `lever replay --map KEY=SIGNAL`"
    )
    with pytest.raises(LeverError, match="no signal looks like an acceleration of the base"):
        propose([ANGLE], "a log")


def test_words_of_names() -> None:
    assert words_of("LeverAngle_deg") == {"lever", "angle", "deg"}
    assert words_of("LVRPosition2") == {"lvr", "position"}
    assert words_of("Débattement levier") == {"debattement", "levier"}
    assert words_of("ABCMotor x1y") == {"abc", "motor", "x", "y"}


# --- small plots -----------------------------------------------------------------------------------------------------


def test_a_sparkline_is_of_means_over_equal_times() -> None:
    time = np.arange(80.0)
    assert plots.sparkline(Signal("x", time, time), 8) == "▁▂▃▄▅▆▇█"
    assert plots.sparkline(Signal("x", time, -time), 8) == "█▇▆▅▄▃▂▁"
    assert plots.sparkline(Signal("x", time, 0.0 * time), 4) == "▁▁▁▁"
    hole = np.where((time >= 20) & (time < 40), np.nan, time)
    assert plots.sparkline(Signal("x", time, hole), 4) == "▁ ▆█"
    assert plots.sparkline(Signal("x", time, np.full(80, np.nan)), 3) == "   "
    assert plots.sparkline(Signal("x", time[:0], time[:0]), 3) == "   "
    assert plots.sparkline(Signal("x", time[:1], time[:1]), 3).strip() == "▁"
