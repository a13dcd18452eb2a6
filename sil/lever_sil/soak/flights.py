"""A flight of a soak, drawn at random: who flies, what shakes the cabin, what fails."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..scenarios import random_streams
from ..scenarios.scenario import Scenario
from ..toml_tables import Place, read

DURATION = 300.0
"""[s]"""
AT_REST = 5.0
"""Between two flights there are no samples for so long [s]: more than any gap_limit."""
SETTLED = 15.0
"""So long after the start of a flight, and after a grip, errors count [s]."""

_EVENTS_APART = 30.0  # [s]
_GRIPS, _GRIPS_MOST, _FAULTS_EACH = 2, 4, 3  # in a flight: grips on average, faults exactly
_HANDS_OFF = 0.25  # share of the flights
_WITHOUT_DITHER = 0.25

Values = dict[str, Any]


def draw(seed: int, number: int) -> tuple[Scenario, list[str]]:
    """Flight `number` of a soak, and the names of its faults."""
    rng = random_streams.stream(seed, "soak", number)
    slots = rng.permutation(np.arange(_EVENTS_APART, DURATION - _EVENTS_APART, _EVENTS_APART))
    starts = slots + rng.uniform(0.0, 5.0, len(slots))
    grips = np.sort(starts[: min(int(rng.poisson(_GRIPS)), _GRIPS_MOST)])
    faults = [str(name) for name in rng.choice(list(FAULTS), _FAULTS_EACH)]
    sensors = _sensors(rng)
    for fault, start in zip(faults, starts[_GRIPS_MOST:], strict=False):
        FAULTS[fault](sensors, rng, float(start))
    values = {
        "title": f"Flight {number}",
        "duration": f"{DURATION} s",
        "converged_after": f"{SETTLED} s",
        "seed": int(rng.integers(1, 1 << 31)),
        "pilot": _pilot(rng, grips, float(starts[-1])),
        "base": [{"kind": "noise", "rms": f"{rng.uniform(0.05, 0.15)} g", "low": "1 Hz", "high": "10 Hz"}],
        "torque": [] if rng.random() < _WITHOUT_DITHER else [{"kind": "firmware", "rms": "0.3 N m"}],
        "sensors": sensors,
    }
    return read(Scenario, _without_empty(values), Place("soak")), faults


def _without_empty(values: Values) -> Values:
    """Return a list that a table may leave out, but that is not empty where it is there."""
    return {
        name: _without_empty(value) if isinstance(value, dict) else value
        for name, value in values.items()
        if value != []
    }


def _pilot(rng: np.random.Generator, grips: np.ndarray[Any, Any], off: float) -> Values:
    """Return a pilot who drifts all the time, and takes another grip at some times."""

    def drifting(unit: str, least: float, greatest: float, rate: float) -> Values:
        parts = []
        for _ in range(len(grips) + 1):
            first = float(np.exp(rng.uniform(np.log(1.2 * least), np.log(greatest / 1.2))))
            limits = {"least": f"{least} {unit}", "greatest": f"{greatest} {unit}"}
            parts.append({"kind": "random_walk", "first": f"{first} {unit}", "rate": f"{rate} 1/sqrt(s)", **limits})
        if not len(grips):
            return parts[0]
        return {"kind": "sequence", "at": [f"{at} s" for at in grips], "parts": parts}

    mass = float(np.exp(rng.uniform(np.log(1.5), np.log(4.5))))
    pilot: Values = {
        "m_p": f"{mass} kg",
        "c_p": drifting("N s/m", 25.0, 90.0, rng.uniform(0.005, 0.03)),
        "k_p": drifting("N/m", 800.0, 3200.0, rng.uniform(0.005, 0.03)),
        "trim": {
            "kind": "noise",
            "mean": "20 deg",
            "rms": f"{rng.uniform(0.2, 2.5)} deg",
            "low": "0.05 Hz",
            "high": "0.5 Hz",
        },
        "process_noise": "0.05 rad/s/sqrt(s)",
    }
    if rng.random() < _HANDS_OFF:
        pilot["hands_off"] = [{"start": f"{off} s", "end": f"{off + rng.uniform(1.0, 8.0)} s"}]
    return pilot


def _sensors(rng: np.random.Generator) -> Values:
    """As good as the settings say that they are: their tolerances are standard deviations."""
    gain_error = {"tau_m": float(np.clip(rng.normal(0.0, 7.0), -20.0, 20.0))}
    gain_error["z_ddot"] = float(np.clip(rng.normal(0.0, 2.0), -6.0, 6.0))
    return {
        "theta": {"noise": "1 mrad", "fault": []},
        "theta_dot": {"noise": "10 mrad/s", "fault": []},
        "tau_m": {"gain_error": f"{gain_error['tau_m']} %"},
        "z_ddot": {"noise": "0.01 m/s^2", "gain_error": f"{gain_error['z_ddot']} %", "fault": []},
        "dropout": [],
    }


Fault = Callable[[Values, np.random.Generator, float], None]
"""Adds one that starts at a time [s] to the sensors of a flight."""


def _wrong(sensor: str, kind: Values, least: float, most: float) -> Fault:
    """Return a reading that counts as valid, for so long [s]."""

    def add(sensors: Values, rng: np.random.Generator, start: float) -> None:
        end = start + rng.uniform(least, most)
        sensors[sensor]["fault"].append({**kind, "start": f"{start} s", "end": f"{end} s"})

    return add


def _missing(what: str, share: float, burst: float, least: float, most: float) -> Fault:
    def add(sensors: Values, rng: np.random.Generator, start: float) -> None:
        end = start + rng.uniform(least, most)
        lost = {"what": what, "share": f"{share} %", "burst": f"{burst} s", "start": f"{start} s", "end": f"{end} s"}
        sensors["dropout"].append(lost)

    return add


FAULTS: dict[str, Fault] = {
    "theta stuck": _wrong("theta", {"kind": "stuck"}, 0.5, 4.0),
    "theta_dot stuck": _wrong("theta_dot", {"kind": "stuck"}, 0.5, 4.0),
    "z_ddot stuck": _wrong("z_ddot", {"kind": "stuck"}, 0.5, 4.0),
    "z_ddot zero": _wrong("z_ddot", {"kind": "scale", "factor": "0 %"}, 0.5, 4.0),
    "z_ddot reversed": _wrong("z_ddot", {"kind": "scale", "factor": "-100 %"}, 0.5, 4.0),
    "theta spikes": _wrong("theta", {"kind": "spikes", "share": "1 %", "size": "0.3 rad"}, 2.0, 10.0),
    "theta_dot spikes": _wrong("theta_dot", {"kind": "spikes", "share": "1 %", "size": "3 rad/s"}, 2.0, 10.0),
    "theta invalid": _missing("theta", 100.0, 1e-3, 0.5, 4.0),
    "theta_dot invalid": _missing("theta_dot", 100.0, 1e-3, 0.5, 4.0),
    "z_ddot invalid": _missing("z_ddot", 100.0, 1e-3, 0.1, 2.0),
    "lever frames lost": _missing("lever_frame", 5.0, 5e-3, 2.0, 20.0),
    "base frames lost": _missing("base_frame", 2.0, 3e-3, 2.0, 20.0),
    "all frames lost": _missing("base_frame", 100.0, 1e-3, 0.03, 1.5),
}
