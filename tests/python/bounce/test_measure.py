"""The measures of `lever bounce` are tested on flights that are made up."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from lever_cdkf.firmware.library import lib
from lever_cdkf.numeric.arrays import BoolArray, FloatArray
from lever_sil.bounce import detectors, measure
from lever_sil.bounce.flights import Plan
from lever_sil.bounce.measure import FIGURES
from lever_sil.fast import plants
from numpy.typing import NDArray

SECONDS = ("s", "least", False)
RISES = ("1", "sum", True)
KNOWN: dict[str, tuple[str, str, bool]] = {
    **dict.fromkeys(("alarm lead", "ROVER lead", "spectrum lead", "ahead of ROVER", "ahead of spectrum"), SECONDS),
    "margin at the alarm": ("dB", "mean", True),
    "margin covered": ("%", "mean", False),
    "margin rms": ("dB", "rms", True),
    "margin stated": ("%", "mean", False),
    "false alarms": RISES,
    "flight time": ("h", "sum", True),
    "ROVER level": ("m/s²", "largest", True),
    "spectrum level": ("m/s²", "largest", True),
    "ROVER false alarms": RISES,
    "spectrum false alarms": RISES,
    "gearing ÷ critical": ("1", "least", False),
    "involuntary cancelled": ("%", "mean", False),
    "back after a grip": ("s", "largest", True),
    "gain changed": ("%", "largest", True),
    "phase changed": ("°", "largest", True),
    "vibration ÷ passive": ("1", "largest", True),
    "angle ÷ passive": ("1", "largest", True),
    "destabilised": RISES,
    "missed": RISES,
    "adds for": ("s", "largest", True),
    "to zero": ("s", "largest", True),
    "jump": ("°", "largest", True),
}
"""Unit, what is made of all flights, and whether more is worse."""
OF_3_1_2 = {"least": 1.0, "largest": 3.0, "mean": 2.0, "sum": 6.0, "rms": math.sqrt(14.0 / 3.0)}


def test_figures_have_their_unit_and_are_pooled_as_they_are_meant() -> None:
    values = np.array([3.0, 1.0, 2.0])
    assert FIGURES.keys() == KNOWN.keys()
    for name, (unit, pooled, more_is_worse) in KNOWN.items():
        figure = FIGURES[name]
        assert (figure.unit, figure.more_is_worse) == (unit, more_is_worse), name
        assert figure.pool(values) == pytest.approx(OF_3_1_2[pooled]), name
        assert figure.worst(values) == (3.0 if more_is_worse else 1.0)
    assert FIGURES["margin rms"].pool(np.array([3.0, math.nan, 4.0])) == pytest.approx(math.sqrt(12.5))


def test_a_search_ends_where_the_largest_gearing_is_said_to_be_at_least() -> None:
    """Seven steps of a half up from half the critical gearing, as the README has it: 8.54."""
    assert FIGURES["gearing ÷ critical"].sought_to == pytest.approx(0.5 * 1.5**7, abs=0.005)
    assert {name for name, figure in FIGURES.items() if math.isfinite(figure.sought_to)} == {"gearing ÷ critical"}


# --- flights ---------------------------------------------------------------------------------------------------------


@dataclass
class Made:
    """A flight of which every column is made up; a sample is a millisecond, a note every 20th."""

    plan: Plan
    z_ddot: FloatArray
    theta: FloatArray
    correction: FloatArray
    tau_m: FloatArray
    state: NDArray[np.int_]
    margin: float = 3.0

    @property
    def time(self) -> FloatArray:
        return 1e-3 * np.arange(float(len(self.theta)))

    @property
    def notes(self) -> FloatArray:
        return self.time[::20]

    @property
    def corrected(self) -> FloatArray:
        return self.theta + self.correction

    @property
    def truth(self) -> SimpleNamespace:
        return SimpleNamespace(rest=np.zeros(len(self.theta)))

    @property
    def stability(self) -> NDArray[np.void]:
        noted = np.zeros(len(self.notes), [("state", int), ("gain_margin", float), ("gain_margin_sigma", float)])
        noted["state"], noted["gain_margin"], noted["gain_margin_sigma"] = self.state, self.margin, 1.0
        return noted

    def during(self, start: float, end: float) -> slice:
        return slice(*np.searchsorted(self.time, (start, end)))

    def margins(self, every: int) -> FloatArray:
        """Return a true margin that falls by 0.1 dB a second from 6 dB."""
        return 6.0 - 0.1 * self.notes[::every]


Change = Callable[[Made], None]


@pytest.fixture
def flights(monkeypatch: pytest.MonkeyPatch) -> Callable[[Change], list[Plan]]:
    """Return a function that makes up all flights from now on, and the list of those that are flown."""
    monkeypatch.setattr(measure, "critical_gearing", lambda *_: np.array([2.0, 1.0]))
    motionless = SimpleNamespace(rest=np.zeros(10), transfer=lambda _at: None)
    monkeypatch.setattr(measure, "truth_of", lambda _plan: motionless)

    def made_up(change: Change) -> list[Plan]:
        plans: list[Plan] = []

        def fly(plan: Plan) -> Made:
            count = round(1e3 * plan.duration)
            states = np.full(len(range(0, count, 20)), lib.LEVER_BOUNCE_CLEAR)
            z_ddot, theta, correction, tau_m = np.zeros((4, count))
            made = Made(plan, z_ddot, theta, correction, tau_m, states)
            change(made)
            plans.append(plan)
            return made

        monkeypatch.setattr(measure, "fly", fly)
        return plans

    return made_up


def detected(monkeypatch: pytest.MonkeyPatch, **levels: tuple[float, float]) -> None:
    """Let a detector show a level from a time [s] on, in times its threshold with the UH-60."""
    limits = dict(zip(("rover", "spectrum"), detectors.THRESHOLDS["uh60_like"], strict=True))
    for name, (level, since) in levels.items():

        def shown(watched: detectors.Watched, *_: Any, name: str = name, by: float = level, at: float = since) -> Any:
            time = (np.arange(len(watched.theta)) + 1.0) / detectors.RATE
            return np.where(time >= at, by * limits[name], 0.0)

        monkeypatch.setattr(detectors, name, shown)


def relaxing(flown: Made) -> None:
    """Double the vibration from 40 s on, and for a second at 20 s; the alarm stands from 30 s, and did from 12 to 15 s.

    The rms of a second that is doubled, and four times the power, for 3/8 of its length is twice as large as before.
    """
    time = flown.time
    loud = (time >= 40.0) | (time >= 20.0) & (time < 21.0)
    flown.z_ddot[:] = np.where(loud, 3.0, 1.0)
    alarm = (flown.notes >= 30.0) | (flown.notes >= 12.0) & (flown.notes < 15.0)
    flown.state[alarm] = lib.LEVER_BOUNCE_ALARM


def test_an_alarm_leads_a_vibration_that_has_doubled_for_good(
    flights: Callable[[Change], list[Plan]], monkeypatch: pytest.MonkeyPatch
) -> None:
    flights(relaxing)
    detected(monkeypatch, rover=(1.001, 33.0), spectrum=(1.001, 41.0))
    measured = measure.relaxing("uh60_like", 1)
    expected = {
        "alarm lead": 10.38,
        "missed": 0.0,
        "ROVER lead": 7.38,
        "spectrum lead": -0.62,
        "ahead of ROVER": 3.0,
        "ahead of spectrum": 11.0,
        "margin at the alarm": 3.0,
        "margin covered": 100.0 * 40.0 / 70.0,  # it is judged from 5 to 75 s, and off by 2 dB at 10 and at 50 s
        "margin rms": math.sqrt((4.5**3 + 2.5**3) / (3.0 * 7.0)),  # off by -2.5 to 4.5 dB, 0.1 dB a second
        "margin stated": 100.0,
    }
    assert measured.figures.keys() == expected.keys()
    for name, value in expected.items():
        slack = 0.021 if FIGURES[name].unit == "s" else 0.02 * abs(value)
        assert measured.figures[name] == pytest.approx(value, abs=slack), name
    assert measured.excerpt is not None
    assert measured.excerpt.moments == pytest.approx({"alarm": 30.0, "vibration doubled": 40.38}, abs=0.021)


def test_what_never_comes_is_missed(flights: Callable[[Change], list[Plan]], monkeypatch: pytest.MonkeyPatch) -> None:
    """A vibration that does not double counts as doubled at the end of the flight, an alarm as raised there."""
    flights(lambda flown: flown.z_ddot.fill(1.0))
    detected(monkeypatch, rover=(0.999, 33.0), spectrum=(1.001, 41.0))
    measured = measure.relaxing("uh60_like", 1)
    figures = measured.figures
    assert (figures["missed"], figures["alarm lead"], figures["ROVER lead"]) == (1.0, 0.0, -math.inf)
    assert (figures["ahead of ROVER"], math.isnan(figures["margin at the alarm"])) == (-math.inf, True)
    assert figures["spectrum lead"] == pytest.approx(75.0 - 41.0, abs=0.021)
    assert measured.excerpt is not None
    assert measured.excerpt.moments == {}


@pytest.mark.parametrize(("level", "false"), [(0.999, 0.0), (1.001, 1.0)])
def test_false_alarms_are_counted_as_often_as_they_begin(
    level: float, false: float, flights: Callable[[Change], list[Plan]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def alarms(flown: Made) -> None:
        flown.state[0:5] = flown.state[100:200] = flown.state[300] = lib.LEVER_BOUNCE_ALARM
        flown.state[400:410] = lib.LEVER_BOUNCE_WARNING

    flights(alarms)
    detected(monkeypatch, rover=(level, 3.0), spectrum=(1.001, 3.0))
    figures = measure.stable("uh60_like", 1, duration=36.0).figures
    rover, spectrum = detectors.THRESHOLDS["uh60_like"]
    assert figures["false alarms"] == 3.0
    assert figures["flight time"] == pytest.approx(0.01)
    assert (figures["ROVER false alarms"], figures["spectrum false alarms"]) == (false, 1.0)
    assert figures["ROVER level"] == pytest.approx(level * rover)
    assert figures["spectrum level"] == pytest.approx(1.001 * spectrum)


@pytest.mark.parametrize(
    ("loud_from", "expected"),
    [(0.6, 0.5 * 1.5**0.25), (0.7, 0.5 * 1.5**0.75), (3.0, 2.8), (5.0, 4.66), (99.0, 8.54), (0.1, 0.5)],
)
def test_the_largest_gearing_is_the_last_step_before_the_vibration_has_doubled(
    loud_from: float, expected: float, flights: Callable[[Change], list[Plan]]
) -> None:
    """Steps of a half, then of its root and that one's: 1.225 and 1.107."""

    def rises(flown: Made) -> None:
        plan = flown.plan
        judged = (flown.time >= 40.0) & (flown.time < 60.0)
        flown.z_ddot[:] = np.where(judged, 2.01 if plan.gearing >= loud_from else 1.99, 99.0)
        if plan.gearing < 1e-6:
            assert (plan.mitigation, plan.dither, plan.raised_from) == ("none", 0.0, None)
            flown.z_ddot[judged] = 1.0

    plans = flights(rises)
    figures = measure.largest_gearing("uh60_like", 1, mitigation="notch").figures
    grid = 0.5 * 1.5 ** (0.25 * np.arange(29))
    largest = grid[grid < loud_from][-1] if loud_from > 0.5 else 0.5
    assert figures == pytest.approx({"gearing ÷ critical": largest})
    assert largest == pytest.approx(expected, rel=0.1)
    assert {plan.mitigation for plan in plans[1:]} == {"notch"}
    assert max(plan.gearing for plan in plans) < 9.0


def test_a_wrong_model_does_harm_where_the_worst_mitigation_doubles_the_vibration(
    flights: Callable[[Change], list[Plan]],
) -> None:
    def swings(flown: Made) -> None:
        size = {"none": 1.0, "damping": 1.5, "notch": 2.5}[flown.plan.mitigation]
        flown.z_ddot[:] = size
        flown.theta[:] = 0.2 / size * np.sin(2.0 * math.pi * 4.0 * flown.time) + np.sin(2.0 * math.pi * flown.time)

    plans = flights(swings)

    def figures(*mitigations: str) -> dict[str, float]:
        return measure.wrong("uh60_like", 1, mitigations=mitigations, spoil=lambda plan: plan).figures

    assert figures("damping", "notch") == pytest.approx(
        {"vibration ÷ passive": 2.5, "angle ÷ passive": 1.0 / 1.5, "destabilised": 1.0}, rel=1e-3
    )
    assert figures("damping")["destabilised"] == 0.0
    assert {plan.gearing for plan in plans} == {0.7}


@pytest.mark.parametrize("column", ["correction", "tau_m"])
@pytest.mark.parametrize(("least", "expected"), [(0.9, 0.0), (1.1, 0.3)])
def test_after_a_fault_it_is_told_when_all_is_zero(
    least: float, expected: float, column: str, flights: Callable[[Change], list[Plan]]
) -> None:
    """Up to 0.005° and 2 mN m are nothing."""
    nothing = {"correction": math.radians(0.005), "tau_m": 2e-3}[column]

    def acts(flown: Made) -> None:
        getattr(flown, column)[: 40_000 + 300] = least * nothing

    flights(acts)
    figures = measure.faulty("uh60_like", 1, mitigation="notch", spoil=lambda plan: plan).figures
    assert figures["to zero"] == pytest.approx(expected)
    assert figures["jump"] == pytest.approx(0.005 * least if column == "correction" else 0.0)
    flights(lambda flown: getattr(flown, column).fill(-1.0))
    figures = measure.faulty("uh60_like", 1, mitigation="notch", spoil=lambda plan: plan).figures
    assert figures == {"to zero": math.inf, "jump": 0.0}


def test_what_cabin_and_motor_make_of_the_angle_is_cancelled_by_its_power(
    flights: Callable[[Change], list[Plan]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """All but a tenth of the amplitude; from the grip at 45 s on nothing, for 3 s."""

    def involuntary(time: FloatArray) -> FloatArray:
        return 0.01 * np.sin(2.0 * math.pi * 4.0 * time) + 0.05 * np.sin(2.0 * math.pi * 1.0 * time)

    def cancels(flown: Made) -> None:
        gripped: BoolArray = (flown.time >= 45.0) & (flown.time < 48.0)
        gripped &= isinstance(flown.plan.pilot["c_p"], dict)
        flown.correction[:] = np.where(gripped, 0.0, -0.9 * involuntary(flown.time))

    flights(cancels)
    monkeypatch.setattr(plants, "move", lambda truth, *_: (involuntary(1e-3 * np.arange(60_000.0)), None, None))
    figures = measure.cancelled("uh60_like", 1, mitigation="cancellation").figures
    assert figures["involuntary cancelled"] == pytest.approx(99.0, abs=0.1)
    left_of_two_seconds = (0.2 - 0.01) / (1.0 - 0.01)  # the share without cancellation when 80 % is cancelled
    assert figures["back after a grip"] == pytest.approx(3.0 - 2.0 * left_of_two_seconds, abs=0.1)
