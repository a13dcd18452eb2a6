"""A flight: a pilot on his lever in a helicopter in gusts, with the firmware in the loop, by fast/."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import accumulate
from typing import Any

import numpy as np
from lever_cdkf.firmware.aircraft import AircraftResponse
from lever_cdkf.numeric.arrays import FloatArray
from lever_cdkf.text.units import GRAVITY
from numpy.typing import NDArray

from ..aircraft.aircraft import Aircraft
from ..aircraft.response_table import UNSURE, known_response
from ..aircraft.stability import critical_gearing
from ..batch.motions import stream
from ..fast.closed_loop import Loop
from ..plants.truth import Truth
from ..scenarios import inputs as scenario_inputs
from ..scenarios.scenario import Scenario
from ..toml_tables import Place, read

AIRCRAFT = ("uh60_like", "puma_like", "bo105_like")
FIVE = (*AIRCRAFT, "ec135_like", "ch53_like")
STRIDE = 20
"""Samples between two notes of what the firmware says."""
SEAT_ERROR = 0.1
"""Largest error of what is told of the way from the accelerometer to the seat: of the gain [1], of the phase [rad]."""
RAISED = (20.0, 25.0)
"""When a gearing goes up that does so [s]: the firmware knows the pilot by then."""


@dataclass(frozen=True)
class Plan:
    """What is flown."""

    craft: str
    seed: int
    pilot: Mapping[str, Any]
    """Table [pilot] of a scenario."""
    gearing: float
    """[1]"""
    raised_from: float | None = None
    """The gearing until RAISED; None: it is the same all the time."""
    duration: float = 60.0
    """[s]"""
    gust: float = 0.05
    """rms [g], 1 to 10 Hz."""
    dither: float = 0.3
    """rms [N m]"""
    mitigation: str = "none"
    """Of enum lever_mitigation."""
    correction_delay: float = 0.0
    """Beyond a sample period [s]."""
    told_delay: float = 1e-3
    """What the firmware is told of that, with the sample period [s]."""
    low_pass: float = 0.0
    """Corner of a low-pass of the lever's angle, to compare with mitigation [Hz]; 0: none."""
    airframe: Mapping[str, Any] = field(default_factory=dict)
    """Further keys of [aircraft]."""
    table_gain: float = 1.0
    """Of the firmware's table over that of the aircraft, besides an error of UNSURE."""
    table_sigma: float = UNSURE
    """gain_sigma that the firmware is told."""
    more: Mapping[str, Any] = field(default_factory=dict)
    """Further tables of the scenario."""
    clock_stops: float | None = None
    """From then on all samples have the same time [s]."""

    @cached_property
    def scenario(self) -> Scenario:
        """Raises ScenarioError."""
        values: dict[str, Any] = {
            "title": "flight",
            "duration": f"{self.duration} s",
            "seed": self.seed,
            "pilot": dict(self.pilot),
            "aircraft": {
                "model": self.craft,
                "gearing": f"{self.gearing} 1",
                "correction_delay": f"{self.correction_delay} s",
                "lever_low_pass": f"{self.low_pass} Hz",
                **self.airframe,
            },
            "base": [{"kind": "noise", "rms": f"{self.gust * GRAVITY} m/s^2", "low": "1 Hz", "high": "10 Hz"}],
        }
        if self.dither:
            values["torque"] = [{"kind": "firmware", "rms": f"{self.dither} N m"}]
        merged = {
            "estimator": {"mitigation": self.mitigation, **self.more.get("estimator", {})},
            "settings": {"correction_delay": self.told_delay, **self.more.get("settings", {})},
        }
        scenario: Scenario = read(Scenario, {**values, **self.more, **merged}, Place("flight"))
        return scenario

    @property
    def aircraft(self) -> Aircraft:
        """That flies."""
        coupled = self.scenario.aircraft
        assert coupled is not None
        return coupled.aircraft

    def gearings(self, time: FloatArray) -> FloatArray:
        """At these times [s]."""
        if self.raised_from is None:
            return np.full_like(time, self.gearing)
        return np.interp(time, RAISED, (self.raised_from, self.gearing))


@dataclass(frozen=True)
class Flown:
    """What happened: arrays with a value a sample, and what the firmware said at every STRIDE-th."""

    plan: Plan
    truth: Truth
    time: FloatArray
    """[s]"""
    theta: FloatArray
    """[rad]"""
    tau_m: FloatArray
    """[N m]"""
    z_ddot: FloatArray
    """At the pilot's seat [m/s^2]."""
    correction: FloatArray
    """As put out [rad]."""
    notes: FloatArray
    """Times of the notes [s]."""
    stability: NDArray[Any]
    """lever_stability_t"""
    health: NDArray[Any]
    """lever_health_t"""

    @property
    def corrected(self) -> FloatArray:
        """What the correction, and a low-pass, make of the lever's angle, as it is used: a sample late [rad]."""
        corrected: FloatArray = self.theta + np.append(0.0, self.correction[:-1])
        return _low_passed(corrected, self.plan) if self.plan.low_pass else corrected

    def during(self, start: float, end: float) -> slice:
        """Return the samples between two times [s]."""
        first, last = np.searchsorted(self.time, (start, end))
        return slice(int(first), int(last))

    def margins(self, every: int) -> FloatArray:
        """Return the true gain margin at every so many-th note [dB]."""
        at = np.arange(0, len(self.time), STRIDE * every)
        limit = critical_gearing(self.plan.aircraft, self.truth.transfer(at))
        margin: FloatArray = 20.0 * np.log10(limit / np.maximum(self.plan.gearings(self.time[at]), 1e-9))
        return margin


def fly(plan: Plan) -> Flown:
    """Fly one flight. Raise LeverError."""
    scenario = plan.scenario
    inputs = scenario_inputs.prepare(scenario)
    loop = Loop(scenario, inputs, by_frames=False, every=STRIDE)
    loop.gear(plan.gearings(inputs.time))
    stability = loop.watch(uncertain_response(plan))
    if plan.clock_stops is not None:
        time = np.minimum(inputs.time, plan.clock_stops)
        loop.give_time(np.round(1e6 * time).astype(np.uint32))
    loop.advance(len(inputs.time))
    loop.check()
    return Flown(
        plan=plan,
        truth=inputs.truth,
        time=inputs.time,
        theta=loop.signals["theta"],
        tau_m=loop.signals["tau_m"],
        z_ddot=inputs.z_ddot,
        correction=loop.correction,
        notes=inputs.time[::STRIDE],
        stability=stability,
        health=loop.outputs[1],
    )


def uncertain_response(plan: Plan) -> AircraftResponse:
    """Return what the firmware is given of an aircraft: its response, off by what is stated.

    The way from the accelerometer to the seat is off by up to SEAT_ERROR.
    """
    coupled = plan.scenario.aircraft
    assert coupled is not None
    random = stream(f"known {coupled.aircraft.title}", plan.seed)
    gain, phase = UNSURE * random.standard_normal(2)
    off, seat_off = plan.table_gain * (1.0 + gain) * np.exp(1j * phase), random.uniform(-SEAT_ERROR, SEAT_ERROR, 2)
    seat = (1.0 + seat_off[0]) * np.exp(1j * seat_off[1])
    return known_response(
        coupled, lambda s: np.full_like(s, off), seat_off=lambda s: np.full_like(s, seat), gain_sigma=plan.table_sigma
    )


def _low_passed(angle: FloatArray, plan: Plan) -> FloatArray:
    """As aircraft/flight.py does it."""
    share = 1.0 - math.exp(-2.0 * math.pi * plan.low_pass * plan.scenario.period)
    return np.array(list(accumulate(angle.tolist(), lambda last, now: last + share * (now - last))))


def truth_of(plan: Plan) -> Truth:
    """Return the pilot of a flight, at every STRIDE-th sample."""
    scenario = plan.scenario
    return scenario.truth(scenario.time()).at(slice(None, None, STRIDE))
