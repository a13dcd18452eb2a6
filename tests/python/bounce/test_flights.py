"""The flights of `lever bounce` against margins() and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from lever_cdkf.errors import LeverError
from lever_cdkf.firmware.library import lib
from lever_cdkf.numeric.arrays import FloatArray
from lever_sil.aircraft import aircraft, stability
from lever_sil.aircraft.aircraft import Coupled
from lever_sil.bounce import conditions, flights, measure, pilots
from lever_sil.bounce.flights import AIRCRAFT, Plan
from lever_sil.scenarios import inputs
from python.aircraft.loops import loop_of, margins


@pytest.mark.parametrize("craft", AIRCRAFT)
def test_the_critical_gearing_is_that_of_the_margins(craft: str) -> None:
    plan = Plan(craft, 3, pilots.relaxing(3), 1.0, duration=60.0)
    transfer = flights.truth_of(plan).transfer(np.array([0, 1500, 2999]))
    found = stability.critical_gearing(aircraft.load(craft), transfer)
    loops = (loop_of(Coupled(aircraft.load(craft), 1.0), transfer, row) for row in range(3))
    assert found == pytest.approx([margins(loop).gain for loop in loops], rel=2e-3)  # 0.02 dB


@pytest.mark.parametrize(("until", "expected"), [(1.5, 1.0), (2.5, 4.0), (5.0, 4.0), (6.0, math.inf)])
def test_an_alarm_that_has_ended_does_not_count(until: float, expected: float) -> None:
    alarmed = np.array((False, True, False, False, True, True, False))
    assert measure.standing(alarmed, np.arange(7.0), until) == expected


def test_a_gearing_goes_up_after_a_while() -> None:
    plan = measure.raised(Plan("puma_like", 1, pilots.table(pilots.arm(1)), 1.0, duration=30.0), 3.0)
    least = plan.gearing / 3.0
    assert plan.gearings(np.array([0.0, 20.0, 22.5, 25.0])) == pytest.approx(least * np.array([0.5, 0.5, 1.75, 3.0]))
    margins = flights.fly(plan).margins(50)
    assert margins[0] == pytest.approx(20.0 * math.log10(2.0), abs=1e-3)
    assert margins[-1] == pytest.approx(-20.0 * math.log10(3.0), abs=1e-3)


def test_the_gusts_of_a_flight_are_as_strong_as_said() -> None:
    """In a loop that is open: the base moves as the gusts do, by 0.05 g rms from 1 to 10 Hz."""
    flown = flights.fly(Plan("uh60_like", 1, pilots.table(pilots.arm(1)), 1e-9, duration=20.0))
    assert np.std(flown.z_ddot) == pytest.approx(0.05 * 9.81, rel=0.05)
    power = np.abs(np.fft.rfft(flown.z_ddot)) ** 2
    frequency = np.fft.rfftfreq(len(flown.time), flown.time[1])
    assert power[(frequency >= 0.9) & (frequency <= 10.1)].sum() > 0.99 * power[1:].sum()


def test_a_flight_is_quiet_or_a_limit_cycle() -> None:
    """Without mitigation, on both sides of the critical gearing."""
    plan = Plan("uh60_like", 2, pilots.table(pilots.arm(2, pilots.SLACK)), 1.0)
    quiet, loud = (flights.fly(measure.raised(plan, ratio)) for ratio in (0.5, 1.5))
    assert np.abs(quiet.z_ddot[40_000:]).max() < 3.0
    assert np.abs(loud.z_ddot[40_000:]).max() > 5.0
    assert not quiet.correction.any()


def test_a_stopped_clock_is_one() -> None:
    plan = Plan("uh60_like", 1, pilots.table(pilots.arm(1)), 0.2, duration=3.0, clock_stops=2.0)
    flown = flights.fly(plan)
    faults: FloatArray = flown.health["faults"]
    assert not (faults[flown.notes < 2.0] & lib.LEVER_FAULT_CLOCK).any()
    assert (faults[flown.notes > 2.1] & lib.LEVER_FAULT_CLOCK).all()


@pytest.mark.parametrize("corner", [0.0, 1.0])
def test_what_is_used_is_the_corrected_angle_a_sample_late_through_the_low_pass(corner: float) -> None:
    """Whose step response is 1 - exp(-2 pi f t)."""
    plan = Plan("uh60_like", 1, pilots.table(pilots.arm(1)), 0.2, duration=1.0, low_pass=corner)
    flown = flights.fly(plan)
    steps, time = np.where(flown.time < 0.5, 0.0, 1.0), flown.time
    made = replace(flown, theta=np.zeros_like(time), correction=steps)
    at = time[501:] - 0.5
    expected = 1.0 - np.exp(-2.0 * math.pi * corner * at) if corner else np.ones_like(at)
    np.testing.assert_allclose(made.corrected[501:], expected, atol=1e-9)
    assert not made.corrected[:501].any()


def test_the_table_of_an_aircraft_is_off_by_what_is_stated() -> None:
    """By 5 % and 0.05 rad on average, and the way to the seat by up to 10 % and 0.1 rad; times a factor of the plan."""
    plan = Plan("uh60_like", 1, pilots.table(pilots.arm(1)), 0.2, airframe=conditions.AT_6)
    responses, seats = [], []
    for seed in range(60):
        table = flights.uncertain_response(replace(plan, seed=seed)).pointer
        responses.append(complex(table.real[8], table.imaginary[8]))
        seats.append(abs(table.seat_direct))
    low = flights.uncertain_response(replace(plan, seed=3, table_gain=0.8, table_sigma=0.3)).pointer
    assert complex(low.real[8], low.imaginary[8]) == pytest.approx(0.8 * responses[3], rel=1e-5)
    assert low.gain_sigma == pytest.approx(0.3)
    response = np.array(responses) / np.mean(responses)
    assert np.std(np.abs(response)) == pytest.approx(0.05, rel=0.35)
    assert np.std(np.angle(response)) == pytest.approx(0.05, rel=0.35)
    assert 0.1 < np.std(seats) / np.mean(seats) < 0.3, "of a fit, which an error of the phase moves more"


def test_a_refused_command_ends_the_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(inputs, "commands", lambda *_: {0: {"request": "reset", "dither_rms": -1.0}})
    with pytest.raises(LeverError, match="refuses COMMAND"):
        flights.fly(Plan("uh60_like", 1, pilots.table(pilots.arm(1)), 0.2, duration=1.0))


@pytest.mark.parametrize(("sigma", "covered"), [(0.6, 100.0), (0.4, 0.0)])
def test_the_error_of_a_stated_margin_is_from_the_true_one(sigma: float, covered: float) -> None:
    plan = measure.geared(Plan("uh60_like", 1, pilots.table(pilots.arm(1)), 1.0, duration=10.0), 0.7)
    flown = flights.fly(plan)
    stated = flown.stability.copy()
    stated["state"] = lib.LEVER_BOUNCE_CLEAR
    stated["gain_margin"] = np.repeat(flown.margins(25), 25)[: len(stated)] - 1.0
    stated["gain_margin_sigma"] = sigma
    figures = measure._margins(replace(flown, stability=stated))
    assert figures == pytest.approx({"margin covered": covered, "margin rms": 1.0, "margin stated": 100.0})
    unknown = flown.notes <= 7.5  # half of what is judged
    stated["state"][unknown], stated["gain_margin"][unknown] = lib.LEVER_BOUNCE_UNKNOWN, 40.0
    figures = measure._margins(replace(flown, stability=stated))
    assert figures == pytest.approx({"margin covered": covered, "margin rms": 1.0, "margin stated": 50.0}, rel=0.2)


def test_a_correction_is_harmful_while_the_corrected_angle_swings_more(monkeypatch: pytest.MonkeyPatch) -> None:
    """For a second and a quarter after the fault it adds half of the motion; at all other times it takes half away."""
    time = 1e-3 * np.arange(round(1e3 * (measure.FAULT + 5.0)))
    theta = 0.01 * np.sin(2.0 * np.pi * 3.0 * time)
    adds = (time > measure.FAULT + 1.0) & (time < measure.FAULT + 2.25)
    corrected = np.where(adds, 1.5, 0.5) * theta
    flown = SimpleNamespace(
        theta=0.3 + theta,
        corrected=0.3 + corrected,
        correction=corrected - theta,
        truth=SimpleNamespace(rest=np.full(len(time), 0.3)),
        during=lambda start, end: slice(*np.searchsorted(time, (start, end))),
    )
    monkeypatch.setattr(measure, "raised", lambda plan, _ratio: plan)
    monkeypatch.setattr(measure, "fly", lambda _plan: flown)
    monkeypatch.setattr(measure, "excerpt", lambda _flown: None)
    measured = measure.harmful("puma_like", 1, mitigation="cancellation", spoil=lambda plan: plan)
    assert measured.figures["adds for"] == pytest.approx(1.25, abs=0.1)
    jump = np.abs(np.diff(corrected - theta)[round(1e3 * measure.FAULT) :]).max()
    assert measured.figures["jump"] == pytest.approx(math.degrees(jump))


def test_what_a_mitigation_makes_of_the_own_flying_is_over_that_without(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gain of 0.8 and a lag of 0.1 rad, whatever the pilot's stroke."""

    def flown(plan: Plan) -> SimpleNamespace:
        gain, lag = (1.0, 0.0) if plan.mitigation == "none" else (0.8, 0.1)
        time = 1e-3 * np.arange(60_000)
        corrected = 0.3 + 0.035 * gain * np.sin(2.0 * np.pi * measure.VOLUNTARY * time - lag)
        return SimpleNamespace(
            time=time, corrected=corrected, during=lambda start, end: slice(*np.searchsorted(time, (start, end)))
        )

    monkeypatch.setattr(measure, "fly", flown)
    figures = measure.voluntary("uh60_like", 1, mitigation="cancellation").figures
    assert figures == pytest.approx({"gain changed": 20.0, "phase changed": math.degrees(0.1)})
